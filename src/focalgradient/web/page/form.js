// jsPsych plugin for the form about the participant, with the design's questions. Every field may be left empty.

import { ParameterType } from "jspsych";
import { escaped } from "./texts.js";

const LONGEST = 20; // maximum number of characters, as in the laboratory
const CHARACTERS = /^[\p{L}\p{M}\p{N}_ ./-]*$/u;
const OLDEST = 130; // maximum age in years
const CHOICES = { sex: ["female", "male", "other"], handedness: ["left", "right", "ambidextrous"] };

export default class FormPlugin {
  static info = {
    name: "focalgradient-form",
    version: "1.0.0",
    parameters: {
      ask: { type: ParameterType.STRING, array: true, default: [] },
      words: { type: ParameterType.FUNCTION, default: (name) => name },
    },
    data: { about: { type: ParameterType.COMPLEX } },
  };

  constructor(jsPsych) {
    this.jsPsych = jsPsych;
  }

  trial(element, { ask, words }) {
    const option = (value) => `<option value="${value}">${value && escaped(words(`form.${value}`))}</option>`;
    const entry = (name) => {
      const how = `id="form-${name}" name="${name}" aria-describedby="hint-${name}"`;
      if (name in CHOICES) return `<select ${how}>${["", ...CHOICES[name]].map(option).join("")}</select>`;
      return `<input ${how} maxlength="${LONGEST}" autocomplete="off" autocapitalize="none" ${name === "age" ? 'inputmode="numeric"' : ""}>`;
    };
    const field = (name) => `<p class="field"><label for="form-${name}">${escaped(words(`form.${name}`))}</label>
      ${entry(name)}
      <small id="hint-${name}">${escaped(words(`form.${name}_hint`))}</small></p>`;
    element.innerHTML = `<form class="page" novalidate><h1>${escaped(words("web.about"))}</h1>${ask.map(field).join("")}
      <p class="wrong"></p><button type="submit">${escaped(words("web.go_on"))}</button></form>`;
    const form = element.querySelector("form");
    form.elements[0].focus();
    const wrong = (input, name) => {
      const said = form.querySelector(".wrong");
      said.setAttribute("role", "alert");
      said.textContent = words(name);
      input.setAttribute("aria-invalid", "true");
      input.focus();
    };
    form.addEventListener("submit", (event) => {
      event.preventDefault();
      const about = {};
      for (const name of ask) {
        const input = form.elements[name];
        const value = input.value.trim().toLowerCase();
        input.removeAttribute("aria-invalid");
        if (!CHARACTERS.test(value)) return wrong(input, "web.about_characters");
        if (name === "age" && !(value === "" || (Number(value) >= 0 && Number(value) <= OLDEST))) return wrong(input, "web.about_age");
        if (value) about[name] = value;
      }
      element.replaceChildren();
      this.jsPsych.finishTrial({ about });
    });
  }
}
