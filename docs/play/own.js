/* A picture of one's own with its depth map, blurred; or two photographs of one's own, and their ratio. */
import { element, imageOf, Panel } from "./panel.js";
import { decimal, stop, word } from "./words.js";

const LARGEST = 640;
const LINEAR = Float64Array.from({ length: 256 }, (_, n) => n < 11 ? n / 255 / 12.92 : ((n / 255 + 0.055) / 1.055) ** 2.4);

/* Luminance of an image in so many pixels, encoded as sRGB. */
function luminance(image, width, height) {
  const copy = element("canvas", { width, height }).getContext("2d");
  copy.drawImage(image, 0, 0, width, height);
  const { data } = copy.getImageData(0, 0, width, height), made = new Uint8Array(width * height);
  for (let n = 0; n < made.length; n++) {
    const light = 0.2126 * LINEAR[data[4 * n]] + 0.7152 * LINEAR[data[4 * n + 1]] + 0.0722 * LINEAR[data[4 * n + 2]];
    made[n] = Math.round(255 * (light < 0.0031308 ? 12.92 * light : 1.055 * light ** (1 / 2.4) - 0.055));
  }
  return made;
}

export class OwnPanel extends Panel {
  constructor() {
    super("own");
    this.images = {};
    this.choice("mode", ["depth", "photographs"], "depth");
    this.parts = { depth: [], photographs: [] };
    for (const [mode, key] of [["depth", "picture"], ["depth", "depthMap"], ["photographs", "photograph1"], ["photographs", "photograph2"]]) this.file(mode, key);
    const metres = value => `${decimal(value, 2)} m`;
    this.parts.depth.push(
      this.choice("white", ["near", "far"], "near"), this.number("near", 0.4, 0.1), this.number("far", 10, 0.1), this.number("fieldDegrees", 20, 1),
      this.range("aperture", { min: 0, max: 20, step: 0.5, value: 9, format: v => `${decimal(v, 1)} mm` }),
      this.range("ownFocus", { min: -1, max: 2.3, step: 0.05, value: -0.5, from: Math.exp, format: metres }));
    this.parts.photographs.push(this.number("f1", 22, 0.5), this.number("f2", 5.6, 0.5), this.number("focus1", 1, 0.05), this.number("focus2", 1, 0.05));
  }

  file(mode, key) {
    const input = element("input", { type: "file", accept: "image/*", name: key });
    input.addEventListener("change", async () => {
      const [file] = input.files;
      if (!file) return;
      try {
        this.images[key] = await imageOf(URL.createObjectURL(file));
        this.take(mode);
      } catch (error) {
        this.said.textContent = word("unreadable").replace("{name}", file.name);
      }
    });
    const label = element("label", {}, element("span", { word: key }), input);
    this.controls.append(label);
    this.parts[mode].push({ label });
  }

  /* Send what was given to the graphics card, both pictures in the size of the first. */
  take(mode) {
    const [first, second] = mode === "depth" ? [this.images.picture, this.images.depthMap] : [this.images.photograph1, this.images.photograph2];
    if (!first || !second) return;
    const scale = Math.min(1, LARGEST / Math.max(first.naturalWidth, first.naturalHeight));
    const width = 4 * Math.floor(first.naturalWidth * scale / 4), height = 4 * Math.floor(first.naturalHeight * scale / 4);
    this.given = { mode, width, height, parts: [luminance(first, width, height), luminance(second, width, height)] };
    this.change();
  }

  draw() {
    const { mode, white, near, far, fieldDegrees, aperture, ownFocus, f1, f2, focus1, focus2 } = this.state;
    for (const name of ["depth", "photographs"]) for (const { label } of this.parts[name]) label.hidden = name !== mode;
    const own = this.given?.mode === mode ? this.given : null;
    // Photographs in order: the smaller aperture first, or else the nearer focus.
    const swap = mode === "photographs" && (f1 !== f2 ? f1 < f2 : focus1 > focus2);
    if (own) {
      const most = mode === "depth" ? 1 / near : 1, least = mode === "depth" ? Math.min(near / far, 1) : 0;
      const key = JSON.stringify([mode, swap, white, near, far]);
      if (this.loaded !== own || this.key !== key) {
        const bytes = new Uint8Array(4 * own.width * own.height), [a, b] = swap ? [own.parts[1], own.parts[0]] : own.parts;
        for (let n = 0; n < a.length; n++) {
          const grey = white === "near" ? b[n] / 255 : 1 - b[n] / 255;
          bytes[4 * n] = a[n];
          bytes[4 * n + 1] = mode === "depth" ? Math.round(255 * (least + (1 - least) * grey)) : b[n];
        }
        this.views.load(bytes, { width: own.width, height: own.height, vergence: most, pair: mode === "photographs" });
        Object.assign(this, { loaded: own, key });
      }
    } else if (this.loaded) {
      this.loaded = null;
      return this.load();
    }
    const names = mode === "depth" ? [word("blurred"), word("depth")] : [...[f1, f2].map((f, n) => `${stop(f)}, ${decimal([focus1, focus2][n], 2)} m`)];
    if (swap) names.reverse();
    if (mode === "depth") {
      const angle = own ? 2 * Math.tan(fieldDegrees * Math.PI / 360) / own.width : PLAY.scene.pixel_angle;
      this.show([1, 6], names, { apertures: [0, aperture / 1000], focus: [1 / ownFocus, 1 / ownFocus] }, angle);
    } else if (own) {
      this.show([0, 1, 7], [...names, word("ratio")], { window: 8 });
    } else {  // until photographs are given: the example, as they would show it
      const F = PLAY.scene.focal_length, focus = [1 / focus1, 1 / focus2], apertures = [F / f1, F / f2];
      this.show([0, 1, 7], [...names, word("ratio")], swap ? { apertures: apertures.reverse(), focus: focus.reverse(), window: 8 } : { apertures, focus, window: 8 });
    }
    this.said.textContent = mode === "depth" ? word(own ? "own.here" : "own.example")
      : word(f1 === f2 && focus1 === focus2 ? "own.equal" : f1 !== f2 ? "own.apertures" : "own.foci");
  }
}
