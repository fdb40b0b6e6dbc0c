// A typed number, confirmed by ENTER or the button; one off the scale is refused with its ends.

import Buttons from "@jspsych/plugin-html-button-response";

const LONGEST = 8; // characters, as in the laboratory

export function typedQuestion(scale, { number, escaped, head, done, wrong, keep }) {
  let typed;
  return {
    type: Buttons,
    stimulus: `<div class="ask">${head(scale)}<input id="typed" inputmode="decimal" maxlength="${LONGEST}" autocomplete="off"
      aria-label="${escaped(scale.question)}" aria-describedby="typed-wrong"><p class="wrong" id="typed-wrong" role="alert"></p></div>`,
    choices: [done],
    on_load: () => {
      const input = document.getElementById("typed");
      const group = document.getElementById("jspsych-html-button-response-btngroup");
      const check = (event) => {
        typed = input.value.trim() === "" ? NaN : Number(input.value.trim().replace(",", "."));
        if (typed >= scale.least && typed <= scale.most) return;
        event.stopPropagation();
        input.setAttribute("aria-invalid", "true");
        document.getElementById("typed-wrong").textContent = wrong({ least: number(scale.least), most: number(scale.most) });
        input.focus();
      };
      group.addEventListener("click", check, true);
      input.addEventListener("keydown", ({ key }) => key === "Enter" && group.querySelector("button").click());
      input.focus();
    },
    on_finish: ({ rt }) => keep({ rating: typed, response_time: rt / 1000 }),
  };
}
