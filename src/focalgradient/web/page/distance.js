// Measurement of screen size and viewing distance.

import Buttons from "@jspsych/plugin-html-button-response";
import Chinrest from "@jspsych/plugin-virtual-chinrest";
import { card, CARD_MM } from "./card.js";

const BLIND_SPOT_TIMES = 5;

// The drawn card, resized by the arrow keys as well as by the mouse.
function resizeByKeys(event) {
  const item = document.getElementById("item");
  const by = { ArrowRight: 1, ArrowUp: 1, ArrowLeft: -1, ArrowDown: -1 }[event.key];
  if (!item || !by) return;
  event.preventDefault();
  const width = Math.max(20, item.getBoundingClientRect().width + by * (event.shiftKey ? 10 : 1));
  Object.assign(item.style, { width: `${width}px`, height: `${(width * 53.98) / CARD_MM}px` });
}

// Screen size by a card, distance by the blind spot; both are repeated if the participant rejects the distance. `large`
// waits for a window that shows them.
export function measurement(about, words, html, large) {
  const pressed = (about.pressed = []);
  // The plugin returns only the mean, so each press is recorded here; the plugin itself counts them down.
  const press = ({ key }) => {
    const [ball, square] = ["circle", "square"].map((name) => document.getElementById(`virtual-chinrest-${name}`));
    if (key !== " " || !ball) return;
    const left = document.getElementById("click").textContent;
    const middle = ({ left, width }) => left + width / 2;
    const place = middle(square.getBoundingClientRect()) - middle(ball.getBoundingClientRect());
    setTimeout(() => document.getElementById("click")?.textContent.trim() === left.trim() || pressed.push(place));
  };
  const measure = {
    type: Chinrest,
    blindspot_reps: BLIND_SPOT_TIMES,
    resize_units: "none",
    item_path: card,
    item_init_size: () => Math.round(about.card_px ?? 250),
    adjustment_prompt: `<div class="page">${html(words("web.card"))}</div>`,
    adjustment_button_prompt: words("web.card_done"),
    blindspot_prompt: `<div class="page">${html(words("web.blind_spot"))}</div>`,
    blindspot_measurements_prompt: `<span class="left">${words("web.blind_spot_left")}</span>`,
    viewing_distance_report: "none",
    on_load: () => {
      pressed.length = 0; // if the measurement is repeated
      addEventListener("keydown", resizeByKeys);
      addEventListener("keydown", press, true);
      addEventListener("resize", large);
    },
    on_finish: (data) => {
      removeEventListener("keydown", resizeByKeys);
      removeEventListener("keydown", press, true);
      removeEventListener("resize", large);
      about.card_px = data.item_width_px;
      about.distance_mm = data.view_dist_mm;
      about.distance = `${Math.round(data.view_dist_mm / 10)} cm`;
    },
  };
  const right = {
    type: Buttons,
    stimulus: () => `<div class="page">${html(words("web.distance_right", { distance: about.distance }))}</div>`,
    choices: [words("web.yes"), words("web.no")],
    on_load: () => document.querySelector("#jspsych-html-button-response-btngroup button")?.focus(), // none if only data are simulated
    on_finish: ({ response }) => (about.right = response === 0),
  };
  return { timeline: [measure, right], loop_function: () => !about.right };
}
