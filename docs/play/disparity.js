/* Fig. 5: the Laplacians of two views, their ratio (the focal disparity), and the depth that it gives. */
import { Panel, still } from "./panel.js";
import { decimal, stop, word } from "./words.js";

export class DisparityPanel extends Panel {
  constructor() {
    super("disparity");
    const stops = { min: 0, max: 10, step: 1, from: n => 4 * 2 ** (n / 2), format: stop };
    this.range("fSmall", { ...stops, value: 8 });
    this.range("fLarge", { ...stops, value: 5 });
    this.range("focusVergence", { min: 0, max: 1.75, step: 0.05, value: 1.75, format: v => `${decimal(v, 2)} D` });
    this.range("noise", { min: 0, max: 3, step: 0.1, value: 0, format: v => `${decimal(v, 1)} %` });
    this.range("bits", { min: 4, max: 12, step: 1, value: 12, format: v => String(v) });
    this.range("window", { min: 2, max: 16, step: 1, value: 6, format: v => `${v} px` });
    this.check("control", false);
    this.frame = 0;
  }

  moves() {
    return this.state.noise > 0;
  }

  given() {
    const { fSmall, fLarge, focusVergence, noise, bits, window, control } = this.state, F = PLAY.scene.focal_length;
    const apertures = [F / Math.max(fSmall, fLarge), F / Math.min(fSmall, fLarge)];
    const plane = focusVergence, reach = Math.max(plane, PLAY.scene.vergence - plane), side = plane > PLAY.scene.vergence / 2 ? 1 : -1;
    return {
      apertures: control ? [apertures[0], apertures[0]] : apertures,
      focus: [plane, plane], noise: noise / 100, bits, window, seed: still.matches ? 1 : ++this.frame,
      read: { apertures, plane, side, reach },  // with the control too: what the reader believes
    };
  }

  draw() {
    const given = this.given(), F = PLAY.scene.focal_length, pair = given.apertures.map(a => stop(F / a));
    const names = [...pair, ...pair.map(name => `|∇²|, ${name}`), word("focalDisparity"), word("depth")];
    this.show([0, 1, 2, 3, 4, 5], names, given);
    this.said.textContent = word(this.state.control ? "disparity.control" : given.apertures[0] === given.apertures[1] ? "disparity.equal" : "disparity.said");
  }
}
