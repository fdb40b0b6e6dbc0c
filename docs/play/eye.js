/* The eye's two views at once, of the L and M cones and of the S cones, and its two views in time. */
import { eyeFocus, oscillation } from "./optics.js";
import { Panel, still } from "./panel.js";
import { decimal, word } from "./words.js";

export class EyePanel extends Panel {
  constructor() {
    super("eye");
    const dioptres = value => `${value > 0 ? "+" : ""}${decimal(value, 2)} D`;
    this.range("pupil", { min: 2, max: 8, step: 0.5, value: 6, format: v => `${decimal(v, 1)} mm` });
    this.range("accommodation", { min: 0, max: 4, step: 0.05, value: 0.8, format: dioptres });
    this.range("sphere", { min: -4, max: 2, step: 0.25, value: 0, format: dioptres });
    this.range("cylinder", { min: -3, max: 0, step: 0.25, value: 0, format: dioptres });
    this.choice("axis", ["180", "90"], "180");
    this.choice("pair", ["bands", "moments"], "bands");
    this.range("amplitude", { min: 0, max: 0.5, step: 0.05, value: PLAY.oscillation.amplitude, format: v => `${decimal(v, 2)} D` });
    this.check("moving", !still.matches);
  }

  moves() {
    return this.state.moving && this.state.amplitude > 0;
  }

  /* Focus of both views, across and upright: two bands now, or the L and M cones at half a period apart. */
  focus() {
    const { sphere, cylinder, axis, accommodation, amplitude, pair } = this.state;
    const seconds = this.moves() ? this.seconds() : 0.125;  // at rest: an extreme
    const both = eyeFocus({ sphere, cylinder, axis: Number(axis), accommodation });
    const now = oscillation(amplitude, seconds), before = oscillation(amplitude, seconds - 0.5 / PLAY.oscillation.frequency);
    return both.map(([lm, s]) => pair === "bands" ? [lm + now, s + now] : [lm + now, lm + before]);
  }

  draw() {
    const focus = this.focus(), pupil = this.state.pupil / 1000, names = this.state.pair === "bands" ? ["L+M", "S"] : [word("now"), word("before")];
    this.show([0, 1, 7, 6], [...names, word("ratio"), word("trueDepth")], { apertures: [pupil, pupil], focus, window: 8 });
    const mean = n => (focus[0][n] + focus[1][n]) / 2;
    this.said.textContent = word("eye.said").replace("{first}", names[0]).replace("{second}", names[1])
      .replace("{a}", decimal(mean(0), 2)).replace("{b}", decimal(mean(1), 2));
  }
}
