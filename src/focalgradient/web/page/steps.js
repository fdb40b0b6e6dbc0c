// A scale of rating steps, answered as in the laboratory: arrow keys or a digit select a step, the first arrow key a
// random one, and ENTER confirms it; a click confirms immediately.

import Buttons from "@jspsych/plugin-html-button-response";

export function stepsQuestion(scale, { number, escaped, head, keep }) {
  const values = scale.steps.map(({ value }) => value);
  const bipolar = values[0] < 0;
  const signed = (value) => `${bipolar && value > 0 ? "+" : ""}${number(value)}`.replace("-", "\u2212");
  let start = null;
  let listen;
  return {
    type: Buttons,
    stimulus: head(scale),
    choices: scale.steps.map(({ value, label }) => `${signed(value)}${label ? `<br><small>${escaped(label)}</small>` : ""}`),
    button_html: (choice) => `<button class="step">${choice}</button>`,
    on_load: () => {
      const group = document.getElementById("jspsych-html-button-response-btngroup");
      group.setAttribute("role", "group");
      group.setAttribute("aria-label", scale.question);
      const buttons = [...group.querySelectorAll("button.step")];
      listen = ({ key }) => {
        const by = { ArrowLeft: -1, ArrowRight: 1 }[key];
        const at = buttons.indexOf(document.activeElement);
        let chosen = !scale.digits ? -1 : values.findIndex((value) => String(value) === key);
        if (by && at < 0) {
          chosen = Math.floor(Math.random() * values.length);
          start = values[chosen];
        } else if (by) {
          chosen = Math.min(Math.max(at + by, 0), values.length - 1);
        }
        buttons[chosen]?.focus();
      };
      addEventListener("keydown", listen);
    },
    on_finish: ({ response, rt }) => {
      removeEventListener("keydown", listen);
      keep({ rating: values[response], response_time: rt / 1000, start });
    },
  };
}
