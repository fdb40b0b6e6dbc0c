// The display's gamma without a photometer: a chequerboard of stripes, each a row of device pixels, and of even grey, whose
// contrast is made as small as it gets. The grey has then the light of so many white rows among black ones.

import Slider from "@jspsych/plugin-html-slider-response";
import { inDevicePixels } from "./frames.js";

const ONE_IN = [2, 4, 2, 4]; // rows that are white; two matches of each
const CELLS = 6; // of the board, in each direction
const CELL = 8; // of CSS, times four, so that each cell has whole groups of rows

// Rows of a board: grey `level` beside stripes of which one in `of` is white.
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

// Screens of all matches; `matches` gains the share of white rows and the level that was set, of each.
export function gammaMatches(matches, words, html) {
  const match = (of, index) => {
    const among = [1, 1 / 4].map((inverse) => 255 * of ** -inverse); // gammas of 1 and of 4
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
        if (!index) matches.length = 0; // where it is done again
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
