// Knob: slider, mouse wheel and arrow keys move a value within a range, until Enter or the button confirms it.

import { shareOf, valueAt } from "./numbers.js";

const COARSE = 6; // steps per press of an up or down arrow key of a coarse knob

export class Knob {
  // `steps`: number of steps across the range; `coarse`: up and down keys make larger steps; `turn_first`: must be
  // turned
  // before it can be confirmed.
  constructor(place, { least, most, ratios = false, start, steps, coarse = false, turn_first = false, label, button_label }) {
    this.range = { least, most, ratios };
    Object.assign(this, { steps, coarse, share: shareOf(this.range, start), turned: !turn_first, done: null });
    const [min, max] = ratios ? [0, 1] : [least, most]; // with ratios, the slider's value is the fraction of the range
    this.slider = Object.assign(document.createElement("input"), { type: "range", min, max, step: "any", ariaLabel: label });
    this.slider.style.width = "20rem";
    this.button = Object.assign(document.createElement("button"), { type: "button", className: "jspsych-btn" });
    this.button.textContent = button_label;
    place.append(this.slider, " ", this.button);
    this.move(0);
    this.turned = !turn_first;
    if (turn_first) this.slider.setAttribute("aria-valuetext", "\u2013");
    this.button.disabled = turn_first;
    this.listeners = [
      [this.slider, "input", () => this.move(this.slid(Number(this.slider.value)) - this.share)],
      [this.button, "click", (event) => this.confirm(event)],
      [window, "wheel", (event) => this.wheel(event), { passive: false }],
      [window, "keydown", (event) => this.press(event), true],
    ];
    for (const [target, event, listener, how] of this.listeners) target.addEventListener(event, listener, how);
    this.slider.focus();
  }

  get value() {
    return valueAt(this.range, this.share);
  }

  // Convert the slider's value to a fraction of the range.
  slid(value) {
    return this.range.ratios ? value : shareOf(this.range, value);
  }

  move(by) {
    this.share = Math.min(Math.max(this.share + by, 0), 1);
    this.slider.value = this.range.ratios ? this.share : this.value;
    this.slider.setAttribute("aria-valuetext", `${Math.round(100 * this.share)} %`); // not the quantity
    this.turned = true;
    this.button.disabled = false;
  }

  wheel(event) {
    event.preventDefault();
    this.move(-Math.sign(event.deltaY) / this.steps);
  }

  press(event) {
    if (event.key === "Enter") {
      event.preventDefault();
      if (!event.repeat) this.confirm(event);
    }
    const by = { ArrowRight: 1, ArrowUp: this.coarse ? COARSE : 1, ArrowLeft: -1, ArrowDown: this.coarse ? -COARSE : -1 }[event.key];
    if (!by) return;
    event.preventDefault();
    this.move(by / (event.shiftKey ? 10 : 1) / this.steps);
  }

  confirm(event) {
    if (this.turned) this.done ??= event.timeStamp;
  }

  end() {
    for (const [target, event, listener, how] of this.listeners) target.removeEventListener(event, listener, how);
  }
}
