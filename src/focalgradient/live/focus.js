"use strict";
import { program, rectangle, sample, webgl } from "./gl.js";

/* A focus series in WebGL 2, drawn by the same shader as in the windows of the experiments.
 *
 *   const view = new FocusView(canvas, SHADERS), series = await view.load(packed);
 *   view.draw(series, 1.25);                                 // focus in dioptres
 *   view.draw(series, { values, width, height });            // map of focus, Float32Array, over the whole picture
 *   view.draw(series, { values, width, height, x, y });      // map centred on a position in the picture, in pixels
 *
 * `packed` is the result of `focalgradient.live.packed`; SHADERS are those of `focalgradient.live.page_shaders`. */
export class FocusView {
  constructor(canvas, shaders, gamma = null) {
    this.canvas = canvas;
    const gl = this.gl = webgl(canvas), kind = gamma ? "gamma" : "srgb";
    this.gamma = gamma;
    this.even = program(gl, shaders[kind]);
    this.varying = program(gl, shaders[`${kind}_varies`]);
    this.places = gl.createTexture();
    rectangle(gl);
  }

  /* Unpack the planes and send them to the graphics card. */
  async load({ width, height, vergences, bits, gain, data }) {
    const gl = this.gl, count = vergences.length, size = width * height;
    if (count > gl.getParameter(gl.MAX_ARRAY_TEXTURE_LAYERS)) throw new Error(`it holds fewer planes than ${count}`);
    const stream = new Blob([Uint8Array.from(atob(data), c => c.charCodeAt(0))]).stream();
    const bytes = await new Response(stream.pipeThrough(new DecompressionStream("deflate"))).arrayBuffer();
    const Numbers = bits === 8 ? Uint8Array : Uint16Array, steps = new Numbers(bytes);
    const texture = gl.createTexture(), plane = new Numbers(4 * size).fill(bits === 8 ? 255 : 0x3c00);  // alpha is 1
    gl.bindTexture(gl.TEXTURE_2D_ARRAY, texture);
    gl.texStorage3D(gl.TEXTURE_2D_ARRAY, 1, bits === 8 ? gl.SRGB8_ALPHA8 : gl.RGBA16F, width, height, count);
    for (let n = 0, from = 0; n < count; n++) {
      for (let c = 0; c < 3; c++) for (let p = 0; p < size; p++, from++) {
        if (n) plane[4 * p + c] += steps[from];  // stored as differences from the previous plane
        else plane[4 * p + c] = steps[from];
      }
      gl.texSubImage3D(gl.TEXTURE_2D_ARRAY, 0, 0, 0, n, width, height, 1, gl.RGBA,
        bits === 8 ? gl.UNSIGNED_BYTE : gl.HALF_FLOAT, plane);
    }
    sample(gl, gl.TEXTURE_2D_ARRAY);
    return { width, height, vergences, gain, texture };
  }

  /* Fractional plane index of a focus in dioptres: 1.25 is a quarter of the way from plane 1 to plane 2. */
  static place({ vergences }, focus) {
    const last = vergences.length - 1;
    if (!(focus > vergences[0])) return 0;
    if (focus >= vergences[last]) return last;
    let n = 0;
    while (vergences[n + 1] <= focus) n++;
    return n + (focus - vergences[n]) / (vergences[n + 1] - vergences[n]);
  }

  /* Draw once. `lamp`: disc of light to add: x, y and radius in pixels, radiance as a fraction of white. */
  draw(series, focus, lamp = null) {
    const gl = this.gl, map = typeof focus === "number" ? null : focus, made = map ? this.varying : this.even;
    const at = name => gl.getUniformLocation(made, name);
    const { width, height } = series;
    if (this.canvas.width !== width || this.canvas.height !== height) Object.assign(this.canvas, { width, height });
    gl.viewport(0, 0, width, height);
    gl.useProgram(made);
    gl.activeTexture(gl.TEXTURE0);
    gl.bindTexture(gl.TEXTURE_2D_ARRAY, series.texture);
    gl.uniform1i(at("planes"), 0);
    gl.uniform1f(at("last"), series.vergences.length - 1);
    gl.uniform1f(at("gain"), series.gain);
    if (this.gamma) gl.uniform3f(at("gamma"), ...this.gamma);
    gl.uniform2f(at("size"), width, height);
    gl.uniform4f(at("lamp"), ...(lamp ? [lamp.x, lamp.y, lamp.radius, lamp.light] : [0, 0, 0, 0]));
    if (map) this.send(map, series, at);
    else gl.uniform1f(at("place"), FocusView.place(series, focus));
    gl.drawArrays(gl.TRIANGLE_STRIP, 0, 4);
  }

  send({ values, width, height, x, y }, series, at) {
    const gl = this.gl, placed = x !== undefined, places = values.map(focus => FocusView.place(series, focus));
    gl.activeTexture(gl.TEXTURE1);
    gl.bindTexture(gl.TEXTURE_2D, this.places);
    gl.texImage2D(gl.TEXTURE_2D, 0, gl.R32F, width, height, 0, gl.RED, gl.FLOAT, places);
    const coarse = !placed && (width !== series.width || height !== series.height);
    sample(gl, gl.TEXTURE_2D, coarse && gl.getExtension("OES_texture_float_linear") ? gl.LINEAR : gl.NEAREST);
    gl.uniform1i(at("places"), 1);
    const left = placed ? Math.round(x - width / 2) / series.width : 0;
    const top = placed ? Math.round(y - height / 2) / series.height : 0;
    gl.uniform4f(at("frame"), left, top, placed ? width / series.width : 1, placed ? height / series.height : 1);
  }
}
