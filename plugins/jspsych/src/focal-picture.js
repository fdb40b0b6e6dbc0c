// A picture pixel for pixel, as its file has it, after a mark on what is to be fixated; every frame recorded.

import { ParameterType } from "jspsych";
import Picture from "../../../src/focalgradient/web/page/picture.js";
import { pressed } from "./keys.js";
import { atFoot } from "./prompt.js";
import { appears, NOTHING_LOST, responseTime, simulated } from "./simulation.js";

export default class FocalPicture {
  static info = {
    name: "focal-picture",
    version: "0.1.0",
    parameters: {
      stimulus: { type: ParameterType.IMAGE, default: undefined },
      stimulus_duration: { type: ParameterType.INT, default: null },
      trial_duration: { type: ParameterType.INT, default: null },
      choices: { type: ParameterType.KEYS, default: "ALL_KEYS" },
      response_ends_trial: { type: ParameterType.BOOL, default: true },
      mark: { type: ParameterType.COMPLEX, default: null },
      mark_duration: { type: ParameterType.INT, default: 500 },
      mark_radius: { type: ParameterType.FLOAT, default: 10 },
      prompt: { type: ParameterType.HTML_STRING, default: null },
      frame: { type: ParameterType.FLOAT, default: null },
    },
    data: {
      stimulus: { type: ParameterType.STRING },
      response: { type: ParameterType.STRING },
      rt: { type: ParameterType.FLOAT },
      stamps: { type: ParameterType.COMPLEX },
      dropped_frames: { type: ParameterType.INT },
      lost: { type: ParameterType.COMPLEX },
    },
  };

  constructor(jsPsych) {
    this.jsPsych = jsPsych;
  }

  async trial(element, trial) {
    const keys = pressed(this.jsPsych, trial.choices);
    const longest = Math.min(trial.stimulus_duration ?? Infinity, trial.trial_duration ?? Infinity);
    let first = null;
    const interval = {
      url: trial.stimulus,
      seconds: longest / 1000,
      event: "picture",
      mark: trial.mark,
      mark_seconds: trial.mark ? trial.mark_duration / 1000 : 0,
    };
    const shown = new Promise((resolve) => {
      const stopped = (onset) => {
        first ??= onset;
        return trial.response_ends_trial && keys.since(first) !== null;
      };
      new Picture({ finishTrial: resolve }).trial(element, {
        intervals: [interval],
        mark_radius: trial.mark_radius,
        blank_seconds: 0,
        pause_seconds: 0,
        frame: trial.frame,
        foot: atFoot(trial.prompt),
        stopped,
      });
    });
    const { shown: [{ stamps }], dropped_frames, lost } = await shown;
    if (trial.prompt) element.innerHTML = atFoot(trial.prompt);
    const rest = trial.trial_duration === null ? Infinity : trial.trial_duration - (stamps.at(-1) - stamps[0]);
    const open = trial.choices !== "NO_KEYS" && trial.response_ends_trial;
    const answer = await keys.wait(stamps[0], open ? rest : rest === Infinity ? 0 : rest, trial.response_ends_trial);
    keys.end();
    element.replaceChildren();
    const { stimulus } = trial;
    const [response, rt] = [answer?.key ?? null, answer?.rt ?? null];
    this.jsPsych.finishTrial({ stimulus, response, rt, stamps, dropped_frames, lost });
  }

  simulate(trial, mode, options, loaded) {
    const { jsPsych } = this;
    const none = trial.choices === "NO_KEYS";
    const rt = none ? null : responseTime(jsPsych);
    const longest = Math.min(trial.stimulus_duration ?? Infinity, trial.trial_duration ?? Infinity);
    const seen = trial.response_ends_trial && rt !== null ? Math.min(rt, longest) : longest;
    const data = {
      stimulus: trial.stimulus,
      response: none ? null : jsPsych.pluginAPI.getValidKey(trial.choices),
      rt,
      stamps: [0, Number.isFinite(seen) ? seen : 0],
      dropped_frames: 0,
      lost: NOTHING_LOST,
    };
    const mark_ms = trial.mark ? trial.mark_duration : 0;
    const act = async ({ response, rt }, element) => {
      await appears(element, "#picture[width]");
      if (rt !== null) jsPsych.pluginAPI.pressKey(response, mark_ms + rt);
    };
    return simulated(this, trial, mode, options, loaded, { data, act });
  }
}
