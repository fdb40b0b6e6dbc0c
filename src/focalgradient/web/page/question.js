// The question after a trial: a choice, rating steps, a typed number or a slider.

import Buttons from "@jspsych/plugin-html-button-response";
import { sliderQuestion } from "./slider.js";
import { stepsQuestion } from "./steps.js";
import { typedQuestion } from "./typed.js";

// Choice between two alternatives, by the arrow keys or by buttons.
function choiceQuestion(control, { escaped, head, keep }) {
  const { question, ways } = control;
  let listen;
  return {
    type: Buttons,
    stimulus: head(control),
    choices: [`&larr; ${escaped(ways[0])}`, `${escaped(ways[1])} &rarr;`],
    button_html: (choice) => `<button class="way">${choice}</button>`,
    on_load: () => {
      const group = document.getElementById("jspsych-html-button-response-btngroup");
      group.setAttribute("role", "group");
      group.setAttribute("aria-label", question);
      const buttons = group.querySelectorAll("button");
      listen = (event) => {
        const way = ["ArrowLeft", "ArrowRight"].indexOf(event.key);
        if (way >= 0 && !event.repeat) buttons[way].click();
      };
      addEventListener("keydown", listen);
    },
    on_finish: ({ response, rt }) => {
      removeEventListener("keydown", listen);
      keep({ chosen: response + 1, response_time: rt / 1000 });
    },
  };
}

export function question(scale, how) {
  if (scale.kind === "choice") return choiceQuestion(scale, how);
  if (scale.kind === "typed") return typedQuestion(scale, how);
  if (scale.kind === "steps") return stepsQuestion(scale, how);
  return sliderQuestion(scale, how);
}
