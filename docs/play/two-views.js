/* Two views of a scene, or two photographs, with their Laplacians and ratio, in WebGL 2.
 *
 *   const views = new TwoViews(canvas);
 *   views.load(image, { width, height, vergence });   // red: light in sRGB; green: vergence from 0 to `vergence` dioptres
 *   views.draw({ apertures, focus, tiles: [0, 1, 4] }, pixelAngle); */
import { program, rectangle, sample, target, webgl } from "../../src/focalgradient/live/gl.js";
import { depthTable } from "./optics.js";
import { SHADERS } from "./shaders.js";

export class TwoViews {
  constructor(canvas, { packed = false } = {}) {
    const gl = webgl(canvas);
    Object.assign(this, { canvas, gl, packed: packed || !gl.getExtension("EXT_color_buffer_float"), programs: {}, targets: {} });
    for (const name of ["blur", "squares", "gather", "ratio", "depth", "show"]) this.programs[name] = this.step(SHADERS[name]);
    rectangle(gl);
    this.scene = gl.createTexture();
  }

  /* A step's program, with its uniforms by name. */
  step(pixel) {
    const gl = this.gl, made = program(gl, SHADERS.head(this.packed) + pixel), uniforms = {};
    for (let n = 0; n < gl.getProgramParameter(made, gl.ACTIVE_UNIFORMS); n++) {
      const { name, type } = gl.getActiveUniform(made, n);
      uniforms[name.replace("[0]", "")] = { place: gl.getUniformLocation(made, name), type, list: name.endsWith("[0]") };
    }
    return { made, uniforms };
  }

  /* Take the scene: an image of the browser, or RGBA bytes. `pair`: red and green are two photographs. */
  load(image, { width, height, vergence = 1, pair = false }) {
    const gl = this.gl;
    gl.bindTexture(gl.TEXTURE_2D, this.scene);
    sample(gl, gl.TEXTURE_2D);
    gl.pixelStorei(gl.UNPACK_COLORSPACE_CONVERSION_WEBGL, gl.NONE);
    if (image instanceof Uint8Array) gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA8, width, height, 0, gl.RGBA, gl.UNSIGNED_BYTE, image);
    else gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA8, gl.RGBA, gl.UNSIGNED_BYTE, image);
    Object.assign(this, { width, height, vergence, pair });
    for (const { texture, frame } of Object.values(this.targets)) { gl.deleteTexture(texture); gl.deleteFramebuffer(frame); }
    const grid = [width >> 2, height >> 2], format = this.packed ? gl.RGBA8 : gl.RGBA32F;
    this.targets = {};
    for (const name of ["half", "views"]) this.targets[name] = target(gl, format, width, height);
    for (const name of ["detail", "light", "across", "ratio", "depth"]) this.targets[name] = target(gl, format, ...grid);
  }

  /* Run a program over a target, or a rectangle of the canvas. Textures are given by the name of their target. */
  run(name, onto, values) {
    const gl = this.gl, { made, uniforms } = this.programs[name], drawn = this.targets[onto];
    const [x, y, width, height] = drawn ? [0, 0, drawn.width, drawn.height] : onto;
    gl.bindFramebuffer(gl.FRAMEBUFFER, drawn ? drawn.frame : null);
    gl.viewport(x, y, width, height);
    gl.useProgram(made);
    let unit = 0;
    for (const [key, { place, type, list }] of Object.entries(uniforms)) {
      const value = key === "size" ? [width, height] : values[key];
      if (type === gl.SAMPLER_2D) {
        const texture = key === "scene" ? this.scene : this.targets[value ?? key].texture;
        gl.activeTexture(gl.TEXTURE0 + unit);
        gl.bindTexture(gl.TEXTURE_2D, texture);
        gl.uniform1i(place, unit++);
      } else if (list) gl.uniform1fv(place, value);
      else if (type === gl.FLOAT) gl.uniform1f(place, value);
      else if (type === gl.FLOAT_VEC2) gl.uniform2f(place, ...value);
      else if (type === gl.INT_VEC2) gl.uniform2i(place, ...value);
      else if (type === gl.UNSIGNED_INT) gl.uniform1ui(place, value);
      else gl.uniform1i(place, Number(value));
    }
    gl.drawArrays(gl.TRIANGLE_STRIP, 0, 4);
  }

  /* Draw once.
   *   apertures    diameters in metres of both views
   *   focus        vergences in dioptres: [first, second], or of both meridians [[across, across], [upright, upright]]
   *   tiles        what to show, left to right and down, `columns` in a row
   *   noise, bits  of a pixel: standard deviation, 1 being white; steps of 2^-bits (0: none)
   *   read         { apertures, plane, side }: by which optics the ratio becomes depth */
  draw({ apertures = [0, 0], focus = [0, 0], tiles, columns = tiles.length, noise = 0, bits = 0, seed = 0, window = 0, read = null }, pixelAngle) {
    const { width, height, vergence: most, pair } = this, grid = [width >> 2, height >> 2];
    const gain = apertures.map(aperture => PLAY.k * aperture / 2 / pixelAngle);
    const both = Array.isArray(focus[0]) ? focus : [focus, focus];
    const widest = Math.max(...both.flatMap(pair => pair.map((f, n) => gain[n] * Math.max(Math.abs(f), Math.abs(f - most)))));
    const shared = { gain, most, pair, reach: pair ? 0 : Math.min(24, Math.ceil(3 * widest)) };
    this.run("blur", "half", { ...shared, first: true, along: [1, 0], focus: both[0], from: "views", noise: 0, levels: 0, seed });
    this.run("blur", "views", { ...shared, first: false, pair: false, along: [0, 1], focus: both[1], from: "half", noise, levels: bits && 2 ** bits - 1, seed });
    if (tiles.some(what => what > 1 && what !== 6)) this.compare({ noise, bits, window, read, grid });
    const rows = Math.ceil(tiles.length / columns), { canvas } = this;
    if (canvas.width !== columns * width || canvas.height !== rows * height) Object.assign(canvas, { width: columns * width, height: rows * height });
    tiles.forEach((what, n) => {
      const origin = [n % columns * width, (rows - 1 - Math.floor(n / columns)) * height];
      this.run("show", [...origin, width, height], { what, origin, frame: [width, height], most, exposure: 1 });
    });
  }

  compare({ noise, bits, window, read, grid }) {
    const frame = [this.width, this.height], steps = sd => Math.sqrt(sd * sd - 16 / 12) / 4;
    const floors = 20 * (2 / Math.PI) * (noise * noise + (bits && (2 ** bits - 1) ** -2 / 12));
    for (const [name, laplacian] of [["detail", true], ["light", false]]) {
      this.run("squares", name, { from: "views", frame, laplacian });
      const sd = laplacian ? window : PLAY.brightness;
      if (!sd) continue;
      this.run("gather", "across", { from: name, along: [1, 0], sd: steps(sd), squared: laplacian });
      this.run("gather", name, { from: "across", along: [0, 1], sd: steps(sd), squared: laplacian });
    }
    this.run("ratio", "ratio", { floors, least: PLAY.least, clear: PLAY.clear });
    if (read) this.run("depth", "depth", { from: "ratio", ...depthTable(read, PLAY.scene.pixel_angle), plane: read.plane, side: read.side });
  }

  /* The numbers of a step, two a pixel, as 32-bit floats in base64: "views", "detail", "light", "ratio" or "depth". */
  read(name) {
    const gl = this.gl, { frame, width, height } = this.targets[name], values = new Float32Array(2 * width * height);
    gl.bindFramebuffer(gl.FRAMEBUFFER, frame);
    const raw = this.packed ? new Uint8Array(4 * width * height) : new Float32Array(4 * width * height);
    gl.readPixels(0, 0, width, height, gl.RGBA, this.packed ? gl.UNSIGNED_BYTE : gl.FLOAT, raw);
    for (let n = 0; n < width * height; n++) for (let c = 0; c < 2; c++) {
      values[2 * n + c] = this.packed ? (256 * raw[4 * n + 2 * c] + raw[4 * n + 2 * c + 1]) / 32767.5 : raw[4 * n + c];
    }
    let text = "";
    for (const byte of new Uint8Array(values.buffer)) text += String.fromCharCode(byte);
    return btoa(text);
  }
}
