// A slider in equal ratios or equal differences. It shows no marker until it is first moved, which places the marker at
// a random position, so that no response is suggested.

import Slider from "@jspsych/plugin-html-slider-response";
import { valueAt } from "./numbers.js";

const STEPS = 1200; // positions of the marker, by pointer
const KEY_STEP = STEPS / 60; // of one key press, as in the laboratory
const KEYS = { ArrowLeft: -KEY_STEP, ArrowDown: -KEY_STEP, ArrowRight: KEY_STEP, ArrowUp: KEY_STEP };

// `number` and `escaped` format numbers and texts, `head` the question, `done` is the button's label, `keep` receives the
// response.
export function sliderQuestion(scale, { number, escaped, head, done, keep }) {
  const value = (place) => valueAt(scale, place / STEPS);
  const start = Math.floor(Math.random() * (STEPS + 1));
  let moved = false;
  let keyed = false; // the first key shows the marker at its start
  const ends = scale.ends.map((end) => `<span>${escaped(end)}</span>`);
  return {
    type: Slider,
    stimulus: `${head(scale)}<p class="ends">${ends[0]}<output></output>${ends[1]}</p>`,
    labels: scale.ticks.map(number),
    min: 0,
    max: STEPS,
    step: 1,
    slider_start: start,
    require_movement: true,
    button_label: done,
    on_load: () => {
      const slider = document.querySelector("input[type=range]");
      const shown = document.querySelector("output");
      slider.classList.add("unset");
      slider.setAttribute("aria-label", scale.question);
      slider.setAttribute("aria-valuetext", "\u2013"); // a screen reader does not read the hidden start
      slider.focus();
      slider.addEventListener("input", () => {
        slider.classList.remove("unset");
        const now = number(value(Number(slider.value)));
        if (scale.numbered) shown.textContent = now;
        slider.setAttribute("aria-valuetext", now);
      });
      slider.addEventListener("keydown", (event) => {
        if (event.key === "Enter") document.querySelector("#jspsych-html-slider-response-next").click();
        const isFirst = !moved && /^(Arrow|Page|Home|End)/.test(event.key);
        if (!isFirst && !KEYS[event.key]) return;
        if (isFirst) moved = keyed = true;
        else slider.value = Number(slider.value) + KEYS[event.key]; // the browser keeps it within the range
        event.preventDefault();
        slider.dispatchEvent(new Event("input"));
        slider.dispatchEvent(new Event("change"));
      });
      slider.addEventListener("pointerdown", () => (moved = true));
    },
    on_finish: ({ response, rt }) => keep({ rating: value(response), response_time: rt / 1000, start: keyed ? value(start) : null }),
  };
}
