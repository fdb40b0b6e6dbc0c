// jsPsych plugin for adjustment: pictures whose focus follows a knob, in WebGL, until the value is confirmed.

import { ParameterType } from "jspsych";
import { inDevicePixels, late, nextFrame, rounded, Watch } from "./frames.js";
import { Knob } from "./knob.js";
import { valueAt } from "./numbers.js";
import { access } from "./picture.js";

const STEPS = 60; // across the knob's range, as in the laboratory
const SHARES = [0.1, 0.9]; // fractions of the knob's range between which it starts

const loaded = new Map();

// A file fetched in advance; the caller handles network failures.
export function loadSeries(url) {
  if (!loaded.has(url)) {
    const fetched = fetch(url, access).then((response) => {
      if (!response.ok) throw new TypeError(`${url}: ${response.status}`);
      return response.json();
    });
    loaded.set(url, fetched);
    fetched.catch(() => loaded.delete(url));
  }
  return loaded.get(url);
}

// The neighbouring script that windows and plugins also use.
const drawing = () => import(String(new URL("focus.js", import.meta.url)));

async function shown(element, { url, pos }, { FocusView, SHADERS }) {
  const canvas = document.createElement("canvas");
  canvas.className = "refocused";
  element.append(canvas);
  const view = new FocusView(canvas, SHADERS);
  const series = await view.load(await loadSeries(url));
  const { width, height } = series;
  inDevicePixels(canvas, width, height);
  const [x, y] = pos.map((side) => side / devicePixelRatio);
  canvas.style.left = `${Math.round((parseFloat(canvas.style.left) + x) * devicePixelRatio) / devicePixelRatio}px`;
  canvas.style.top = `${Math.round((parseFloat(canvas.style.top) - y) * devicePixelRatio) / devicePixelRatio}px`;
  return { view, series };
}

export default class AdjustedPlugin {
  static info = {
    name: "focalgradient-adjusted",
    version: "1.0.0",
    parameters: {
      knob: { type: ParameterType.COMPLEX, default: undefined }, // views, least, most, ratios, question
      question: { type: ParameterType.HTML_STRING, default: "" },
      button_label: { type: ParameterType.STRING, default: "Done" },
      frame: { type: ParameterType.FLOAT, default: null },
    },
    data: {
      value: { type: ParameterType.FLOAT },
      start: { type: ParameterType.FLOAT },
      rt: { type: ParameterType.FLOAT },
      shown: { type: ParameterType.COMPLEX },
      dropped_frames: { type: ParameterType.INT },
      lost: { type: ParameterType.COMPLEX },
    },
  };

  constructor(jsPsych) {
    this.jsPsych = jsPsych;
  }

  async trial(element, { knob: asked, question, button_label, frame }) {
    const watch = new Watch();
    element.innerHTML = `<div class="ask adjusted">${question}</div><div class="foot knob"></div>`;
    const script = await drawing();
    const views = await Promise.all(asked.views.map((one) => shown(element, one, script)));
    const start = valueAt(asked, SHARES[0] + Math.random() * (SHARES[1] - SHARES[0]));
    const knob = new Knob(element.querySelector(".knob"), {
      ...asked, start, button_label, label: asked.question, steps: STEPS, coarse: true, turn_first: true,
    });
    const stamps = [];
    let now = null;
    while (knob.done === null) {
      stamps.push(await nextFrame());
      if (knob.value === now) continue;
      now = knob.value;
      for (const { view, series } of views) view.draw(series, now); // a fixed view has one picture
    }
    stamps.push(await nextFrame());
    knob.end();
    for (const { view } of views) view.gl.getExtension("WEBGL_lose_context")?.loseContext(); // browsers keep only a few
    element.replaceChildren();
    const value = knob.value;
    const times = { rt: Math.max(0, knob.done - stamps[0]), shown: [{ event: "adjust", stamps: rounded(stamps) }] };
    this.jsPsych.finishTrial({ value, start, ...times, dropped_frames: late(rounded(stamps), frame), lost: watch.end() });
  }
}

// Timeline node of an adjustment; its response is passed to `keep`.
export function adjustedNode(knob, { escaped, practice, done, frame, keep }) {
  return {
    type: AdjustedPlugin,
    knob,
    question: `${practice}<h2>${escaped(knob.question)}</h2>`,
    button_label: done,
    frame,
    on_finish: ({ value, start, rt, shown, dropped_frames, lost }) =>
      keep({
        rating: value,
        start,
        response_time: rt / 1000,
        onset_ms: shown[0].stamps[0],
        frames: { shown, ...lost },
        dropped_frames,
      }),
  };
}
