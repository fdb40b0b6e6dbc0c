/* Fig. 1 and Eq. 1: a lens, the blur of a point, and the two distances that have this blur. */
import { blurRadius, distancesOfBlur } from "./optics.js";
import { element, imageOf, Panel } from "./panel.js";
import { decimal, stop, word } from "./words.js";

const NEAREST = 0.2, FARTHEST = 8;  // metres that the diagram shows

export class LensPanel extends Panel {
  constructor() {
    super("lens");
    const metres = value => `${decimal(value, 2)} m`;
    this.range("fNumber", { min: 0, max: 12, step: 1, value: 2, from: n => 4 * 2 ** (n / 2), format: stop });
    this.focus = this.range("focusDistance", { min: -1, max: 1.6, step: 0.02, value: -0.5, from: Math.exp, format: metres });
    this.distance = this.range("pointDistance", { min: -1, max: 1.6, step: 0.02, value: 0.3, from: Math.exp, format: metres });
    this.svg = document.createElementNS("http://www.w3.org/2000/svg", "svg");
    this.svg.setAttribute("viewBox", "0 0 800 250");
    this.svg.setAttribute("role", "img");
    this.box.insertBefore(this.svg, this.box.querySelector(".tiles"));
    this.canvas.addEventListener("pointerdown", event => this.pick(event));
  }

  async load() {
    await super.load();
    const { width, height, png } = PLAY.scene, copy = element("canvas", { width, height }).getContext("2d");
    copy.drawImage(await imageOf(png), 0, 0);
    this.green = copy.getImageData(0, 0, width, height).data;
  }

  /* Take the distance of the point that was pressed. */
  pick(event) {
    const { width, height, vergence } = PLAY.scene, box = this.canvas.getBoundingClientRect();
    const x = Math.floor((event.clientX - box.left) / box.width * this.canvas.width) % width;
    const y = Math.floor((event.clientY - box.top) / box.height * this.canvas.height) % height;
    const pressed = this.green[4 * (y * width + x) + 1] / 255 * vergence;
    this.distance.set(Math.log(1 / Math.max(pressed, 0.2)));
  }

  drawn() {
    const { fNumber, focusDistance, pointDistance } = this.state, F = PLAY.scene.focal_length;
    const sigma = blurRadius(F, fNumber, focusDistance, pointDistance);
    const { near, far } = distancesOfBlur(F, fNumber, focusDistance, sigma);
    const metres = value => Number.isFinite(value) ? `${decimal(value, 2)} m` : word("none");
    this.said.textContent = word("lens.said").replace("{sigma}", decimal(1e6 * sigma, 1)).replace("{near}", metres(near)).replace("{far}", metres(far));
    this.diagram(near, far);
    super.drawn();
  }

  draw() {
    const { fNumber, focusDistance } = this.state, F = PLAY.scene.focal_length;
    this.show([0, 1], [stop(22), stop(fNumber)], { apertures: [F / 22, F / fNumber], focus: [1 / focusDistance, 1 / focusDistance] });
  }

  /* Rays from the point and from the other distance of the same blur; distances on a scale of their logarithm. */
  diagram(near, far) {
    const { fNumber, focusDistance, pointDistance } = this.state, lens = 560, sensor = 700, middle = 115;
    const place = metres => lens - 40 - 480 * Math.log(metres / NEAREST) / Math.log(FARTHEST / NEAREST);
    const half = 20 + 70 * Math.min(1, 4 / fNumber);
    const image = metres => lens + 140 * (1 + 0.24 * (1 / metres - 1 / focusDistance));
    const rays = (metres, colour, dash) => [-1, 1].map(side => {
      const at = image(metres), end = 780, edge = middle + side * half, slope = (middle - edge) / (at - lens);
      return `<path d="M${place(metres)} ${middle}L${lens} ${edge}L${end} ${edge + slope * (end - lens)}" fill="none" stroke="${colour}" stroke-width="1.5" stroke-dasharray="${dash}"/>`;
    }).join("");
    const isFar = pointDistance > focusDistance, other = isFar ? near : far, at = image(pointDistance);
    const blur = half * Math.abs((sensor - at) / (at - lens));
    const dot = (metres, text, colour, up) => `<circle cx="${place(metres)}" cy="${middle}" r="5" fill="${colour}"/>
      <text x="${Math.max(place(metres), 60)}" y="${up ? 30 : 205}" text-anchor="middle" style="fill:${colour}">${text}</text>`;
    this.svg.innerHTML = `
      <path d="M0 ${middle}H800" stroke="var(--line)"/>
      <path d="M${place(focusDistance)} 45V185" stroke="var(--soft)" stroke-dasharray="3 4"/>
      <text x="${place(focusDistance)}" y="243" text-anchor="middle" style="fill:var(--soft)">${word("inFocus")}</text>
      ${other > NEAREST && other < FARTHEST ? rays(other, "var(--blue)", "5 4") + dot(other, `${decimal(other, 2)} m`, "var(--blue)", false) : ""}
      ${rays(pointDistance, "var(--orange)", "")}${dot(pointDistance, `${decimal(pointDistance, 2)} m`, "var(--orange)", true)}
      <path d="M${lens} 10V${middle - half}M${lens} ${middle + half}V220" stroke="var(--text)" stroke-width="5"/>
      <ellipse cx="${lens}" cy="${middle}" rx="8" ry="${half}" fill="#8cf4" stroke="var(--text)"/>
      <path d="M${sensor} 20V210" stroke="var(--text)" stroke-width="2"/>
      <path d="M${sensor} ${middle - blur}V${middle + blur}" stroke="var(--orange)" stroke-width="6"/>
      <text x="${sensor}" y="243" text-anchor="middle">${word("sensor")}</text>`;
    this.svg.setAttribute("aria-label", this.said.textContent);
  }
}
