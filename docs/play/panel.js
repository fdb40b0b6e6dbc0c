/* What panels share: their frame, their controls, and when they are drawn. */
import { TwoViews } from "./two-views.js";
import { word } from "./words.js";

export const still = matchMedia("(prefers-reduced-motion: reduce)");
const narrow = matchMedia("(max-width: 600px)");

/* An element with properties and children; `word` is the key of its text. */
export function element(name, properties = {}, ...children) {
  const made = document.createElement(name), { word, ...rest } = properties;
  if (word) made.dataset.word = word;
  Object.assign(made, rest);
  made.append(...children);
  return made;
}

/* The image of a data address or a file, decoded. */
export async function imageOf(address) {
  const image = new Image();
  image.src = address;
  await image.decode();
  return image;
}

export class Panel {
  constructor(id, { scene = true } = {}) {
    this.id = id;
    this.state = {};
    this.outputs = [];
    this.box = element("section", { id }, element("h2", { word: `${id}.title` }), element("p", { className: "what", word: `${id}.what` }));
    this.box.tabIndex = -1;
    document.querySelector("main").append(this.box);
    document.querySelector("nav").append(element("a", { href: `#${id}`, word: `${id}.title` }));
    this.controls = element("div", { className: "controls" });
    this.said = element("p", { className: "said" });
    this.said.setAttribute("aria-live", "polite");
    if (scene) this.addViews();
    this.box.append(this.controls, this.said);
  }

  addViews() {
    this.canvas = element("canvas");
    this.canvas.setAttribute("role", "img");
    this.captions = element("ol");
    const tiles = element("div", { className: "tiles" }, this.canvas, this.captions);
    this.box.append(tiles);
    try {
      this.views = new TwoViews(this.canvas);
    } catch (error) {
      if (!error.message.includes("WebGL 2")) throw error;
      tiles.replaceChildren(element("p", { className: "lacking", word: "noWebgl" }));
    }
    this.visible = true;
    new IntersectionObserver(entries => { this.visible = entries[0].isIntersecting; this.change(); }).observe(this.canvas);
    narrow.addEventListener("change", () => this.change());
    this.start = performance.now();
  }

  async load() {
    if (!this.views) return;
    this.views.load(await imageOf(PLAY.scene.png), PLAY.scene);
    this.change();
  }

  /* Add a slider; `format` writes its value, and `from` turns the slider's place into it. */
  range(key, { min, max, step, value, format = String, from = x => x }) {
    const input = element("input", { type: "range" }), output = element("span", { className: "value" });
    Object.assign(input, { min, max, step, value });
    const set = () => {
      this.state[key] = from(Number(input.value));
      output.textContent = format(this.state[key]);
      input.setAttribute("aria-valuetext", output.textContent);
    };
    return this.add(key, input, set, output);
  }

  check(key, value) {
    const input = element("input", { type: "checkbox", checked: value });
    return this.add(key, input, () => { this.state[key] = input.checked; });
  }

  choice(key, values, value) {
    const input = element("select", {}, ...values.map(name => element("option", { value: name, word: `${key}.${name}` })));
    input.value = value;
    return this.add(key, input, () => { this.state[key] = input.value; });
  }

  number(key, value, step) {
    const input = element("input", { type: "number", min: step, step: "any", value });
    return this.add(key, input, () => { if (input.valueAsNumber > 0) this.state[key] = input.valueAsNumber; });
  }

  add(key, input, set, output = "") {
    input.name = key;
    input.addEventListener("input", () => { set(); this.change(); });
    const text = element("span", { word: key }), check = input.type === "checkbox";
    const label = element("label", { className: check ? "check" : "" }, ...(check ? [input, text] : [text, output, input]));
    this.controls.append(label);
    this.outputs.push(set);
    set();
    return { input, label, set: value => { input.value = value; set(); this.change(); } };
  }

  /* Write the numbers again, in the chosen language. */
  translate() {
    for (const set of this.outputs) set();
    this.change();
  }

  change() {
    if (this.waiting) return;
    this.waiting = requestAnimationFrame(() => {
      this.waiting = 0;
      this.drawn();
      if (this.visible && this.moves?.() && !still.matches) this.change();
    });
  }

  /* Seconds that drive what moves: a fixed moment, an extreme of the oscillation, where motion is unwanted. */
  seconds() {
    return still.matches ? 0.125 : (performance.now() - this.start) / 1000;
  }

  drawn() {
    if (this.views?.width) this.draw();
  }

  /* Draw tiles with their captions. */
  show(tiles, names, given, pixelAngle = PLAY.scene.pixel_angle) {
    const columns = Math.min(tiles.length, narrow.matches ? (tiles.length > 2 ? 2 : 1) : tiles.length === 4 ? 2 : 3);
    this.views.draw({ ...given, tiles, columns }, pixelAngle);
    const text = names.join("|") + columns;
    if (this.captioned !== text) {
      this.captioned = text;
      this.captions.style.gridTemplate = `repeat(${Math.ceil(tiles.length / columns)}, 1fr) / repeat(${columns}, 1fr)`;
      this.captions.replaceChildren(...names.map(name => element("li", {}, element("span", { textContent: name }))));
      this.canvas.setAttribute("aria-label", names.join(", "));
    }
  }
}
