// The question after a trial: a choice, rating steps or a slider.

import Buttons from "@jspsych/plugin-html-button-response";
import Keyboard from "@jspsych/plugin-html-keyboard-response";
import { onlyTouch } from "./device.js";
import { sliderQuestion } from "./slider.js";
import { stepsQuestion } from "./steps.js";

// Choice between two alternatives by the arrow keys, or by buttons on touch devices. `interval`: alternative stored as
// 1.
function choiceQuestion({ question, ways }, interval, { escaped, keep }) {
  const stimulus = `<div class="ask"><h2>${escaped(question)}</h2></div>`;
  const chosen = (way, rt) => keep({ rating: way === interval ? 1 : 0, response_time: rt / 1000 });
  if (onlyTouch()) {
    return { type: Buttons, stimulus, choices: ways.map(escaped), on_finish: ({ response, rt }) => chosen(response + 1, rt) };
  }
  return {
    type: Keyboard,
    stimulus,
    prompt: `<p class="foot arrows">&larr; ${escaped(ways[0])} &emsp; ${escaped(ways[1])} &rarr;</p>`,
    choices: ["ArrowLeft", "ArrowRight"],
    on_finish: ({ response, rt }) => chosen(response.toLowerCase() === "arrowleft" ? 1 : 2, rt),
  };
}

export function question(scale, interval, how) {
  if (scale.kind === "choice") return choiceQuestion(scale, interval, how);
  if (scale.kind === "steps") return stepsQuestion(scale, how);
  return sliderQuestion(scale, how);
}
