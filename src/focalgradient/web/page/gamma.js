// Estimation of the display's gamma without a photometer: the participant minimises the contrast of a chequerboard of
// uniform grey and of stripes, one device pixel high. The grey then has the mean light of the white and black rows.

import Slider from "@jspsych/plugin-html-slider-response";
import { inDevicePixels } from "./frames.js";

const ONE_IN = [2, 4, 2, 4]; // one row in this number is white; two matches each
const CELLS = 6; // cells of the board in each direction
const CELL = 8; // a quarter of a cell's side in CSS pixels: a multiple of four gives whole groups of rows

// Draw a board: grey of `level` beside stripes of which one in `of` is white.
export function drawBoard(canvas, of, level) {
  const cell = 4 * Math.round(CELL * devicePixelRatio);
  inDevicePixels(canvas, CELLS * cell, CELLS * cell);
  const context = canvas.getContext("2d", { colorSpace: "srgb" });
  const fill = (value, ...place) => {
    context.fillStyle = `rgb(${value} ${value} ${value})`;
    context.fillRect(...place);
  };
  fill(level, 0, 0, canvas.width, canvas.height);
  for (let row = 0; row < CELLS; row++) {
    for (let column = row % 2; column < CELLS; column += 2) {
      for (let line = 0; line < cell; line++) fill(line % of ? 0 : 255, column * cell, row * cell + line, cell, 1);
    }
  }
}

// Screens of all matches; adds the fraction of white rows and the chosen level of each to `matches`.
export function gammaMatches(matches, words, html) {
  const match = (of, index) => {
    const among = [1, 1 / 4].map((inverse) => 255 * of ** -inverse); // levels for gammas of 1 and 4
    return {
      type: Slider,
      stimulus: `<div class="page match">${html(words("web.gamma", { number: index + 1, of: ONE_IN.length }))}</div><canvas id="board"></canvas>`,
      labels: [],
      min: 1,
      max: 254,
      step: 1,
      slider_start: Math.round(among[0] + Math.random() * (among[1] - among[0])),
      slider_width: 480,
      require_movement: true,
      button_label: words("web.done"),
      on_load: () => {
        if (!index) matches.length = 0; // if the matches are repeated
        const slider = document.querySelector("input[type=range]");
        slider.setAttribute("aria-label", words("web.gamma_slider"));
        const draw = () => drawBoard(document.getElementById("board"), of, slider.value);
        draw();
        slider.addEventListener("input", draw);
        slider.addEventListener("keydown", ({ key }) => {
          if (key === "Enter") document.querySelector("#jspsych-html-slider-response-next").click();
        });
        slider.focus();
        document.getElementById("stage").classList.add("matching");
      },
      on_finish: ({ response }) => {
        document.getElementById("stage").classList.remove("matching");
        matches.push([1 / of, response]);
      },
    };
  };
  return { timeline: ONE_IN.map(match) };
}
