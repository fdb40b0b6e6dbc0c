// The trials of the turning cube, in which keys are held.

import Call from "@jspsych/plugin-call-function";
import Keyboard from "@jspsych/plugin-html-keyboard-response";
import CubePlugin from "./cube.js";
import { escaped } from "./texts.js";

// Labels of the response keys, below the cube and before it.
const reminder = (page) => {
  const foot = Object.entries(page.session.keys).map(([name, key]) => [page.session.key_names[key], page.words(`necker.${name}`)]);
  return foot.map(([key, word]) => `<b>${escaped(key)}</b> ${escaped(word)}`).join(" &emsp; ");
};

export function ready(page, { event, text }) {
  const [title, ...lines] = text.split("\n");
  return {
    type: Keyboard,
    stimulus: `<div class="page"><h1>${escaped(title)}</h1>${lines.map((line) => `<p>${escaped(line)}</p>`).join("")}</div>`,
    prompt: `<p class="foot">${reminder(page)}</p>`,
    choices: [" "],
    on_load: () => page.shown.push([event, text]),
  };
}

// Timeline nodes of a cube's trial.
export function cubeNodes(page, trial) {
  const { cube, keys } = page.session;
  const kept = {};
  const shown = {
    type: CubePlugin,
    cube,
    trial: trial.cube,
    keys: Object.values(keys),
    foot: reminder(page),
    frame: page.frame,
    on_start: () => page.shown.push(["trial", `${trial.phase} ${trial.trial}`]),
    on_finish: (data) =>
      Object.assign(kept, {
        onset: (data.shown[0].stamps[0] - page.session.start_ms) / 1000,
        presses: data.presses,
        trial_duration: data.seconds,
        dropped_frames: data.dropped_frames,
        frames: { shown: data.shown, ...data.lost },
      }),
  };
  let held = {};
  const judged = (done) => page.practice.judged(trial, kept).then((verdict) => done((held = verdict)), (error) => page.lost(error));
  const after = trial.after.length ? [{ type: Call, async: true, func: judged }, ...page.steps(trial.after, trial, () => held)] : [];
  return [page.exposing(trial), shown, ...page.further(trial, kept), ...after, page.sent(trial, kept)];
}
