/* Fig. 3: eight pictures to rate for depth, and the curve of these ratings beside that of simulated observers. */
import { valueAt } from "../../src/focalgradient/web/page/numbers.js";
import { element, Panel } from "./panel.js";
import { decimal, stop, word } from "./words.js";

const APERTURES = ["pinhole", "f/22", "f/11", "f/5.6"], FIXATIONS = ["nearest", "farthest"];

export class RatingPanel extends Panel {
  constructor() {
    super("rating", { scene: false });
    this.place = element("div");
    this.box.insertBefore(this.place, this.controls);
    const [least, most] = PLAY.rating.simulated.scale;
    this.slider = this.range("rating", { min: 0, max: 1, step: 0.0125, value: 0.5, from: share => valueAt({ least, most, ratios: true }, share), format: v => decimal(v, 2) });
    this.button = element("button", { type: "button", onclick: () => this.next() });
    this.controls.append(this.button);
    this.restart();
  }

  async load() {}
  drawn() {}

  restart() {
    this.answers = {};
    this.order = FIXATIONS.flatMap(fixation => APERTURES.map(aperture => ({ fixation, aperture })));
    for (let n = this.order.length - 1; n > 0; n--) {
      const other = Math.floor(Math.random() * (n + 1));
      [this.order[n], this.order[other]] = [this.order[other], this.order[n]];
    }
    this.done = 0;
    this.render();
  }

  next() {
    if (this.done === this.order.length) return this.restart();
    const { fixation, aperture } = this.order[this.done++];
    (this.answers[fixation] ??= {})[aperture] = this.state.rating;
    this.slider.set(0.5);
    this.render();
  }

  translate() {
    super.translate();
    this.render();
  }

  render() {
    const trial = this.order[this.done], { standard, pictures, marks, simulated } = PLAY.rating;
    this.slider.label.hidden = !trial;
    this.button.textContent = word(trial ? "next" : "again");
    this.said.textContent = trial
      ? word(`look.${trial.fixation}`).replace("{n}", this.done + 1).replace("{all}", this.order.length)
      : word("rating.said").replace("{n}", simulated.observers);
    if (!trial) return this.place.replaceChildren(this.curves());
    const stem = trial.aperture === "pinhole" ? "pinhole" : `${trial.aperture.replace("/", "")}-${trial.fixation}`;
    const ring = element("span", { className: "ring" }), [x, y] = marks[trial.fixation];
    Object.assign(ring.style, { left: `${100 * x}%`, top: `${100 * y}%` });
    const picture = (source, key, ...more) =>
      element("figure", {}, element("div", { style: "position:relative" }, element("img", { src: source, alt: word(key) }), ...more), element("figcaption", { textContent: word(key) }));
    this.place.replaceChildren(element("div", { className: "rate" }, picture(standard, "standard"), picture(pictures[stem], "picture", ring)));
  }

  /* Ratings relative to the pinhole picture, on a scale of their logarithm. */
  curves() {
    const x = n => 90 + 190 * n, y = value => 150 - 55 * Math.log2(Math.min(Math.max(value, 0.25), 4)), { means } = PLAY.rating.simulated;
    const line = (values, colour, width, dash) =>
      `<path d="M${values.map((value, n) => `${x(n)} ${y(value)}`).join("L")}" fill="none" stroke="${colour}" stroke-width="${width}" stroke-dasharray="${dash}"/>`;
    const parts = [0.25, 0.5, 1, 2, 4].map(v => `<path d="M80 ${y(v)}H700" stroke="var(--line)"/><text x="70" y="${y(v) + 5}" text-anchor="end">${decimal(v, v < 1 ? 2 : 0)}</text>`);
    APERTURES.forEach((name, n) => parts.push(`<text x="${x(n)}" y="292" text-anchor="middle">${name === "pinhole" ? word("pinhole") : stop(Number(name.slice(2)))}</text>`));
    FIXATIONS.forEach((fixation, n) => {
      const colour = n ? "var(--orange)" : "var(--blue)", simulated = APERTURES.map(name => means[fixation][name]), own = this.answers[fixation];
      parts.push(line(simulated.map(v => v[0]), colour, 2, "3 5"), ...simulated.map(([, low, high], k) => `<path d="M${x(k)} ${y(low)}V${y(high)}" stroke="${colour}"/>`));
      const values = APERTURES.map(name => own[name] / own.pinhole);
      parts.push(line(values, colour, 4, ""), ...values.map((v, k) => `<circle cx="${x(k)}" cy="${y(v)}" r="6" fill="${colour}"/>`));
      parts.push(`<text x="90" y="${28 * n - 14}" style="fill:${colour}">${word(`key.${fixation}`)}</text>`);
    });
    const svg = document.createElementNS("http://www.w3.org/2000/svg", "svg");
    svg.setAttribute("viewBox", "0 -36 720 336");
    svg.innerHTML = parts.join("");
    return svg;
  }
}
