// A picture refocused at every frame, in WebGL: by a number, by a function of time, or by the participant.

import { ParameterType } from "jspsych";
import { inDevicePixels, late, nextFrame, rounded, Watch } from "../../../src/focalgradient/web/page/frames.js";
import { Knob } from "../../../src/focalgradient/web/page/knob.js";
import { FocusView } from "../../../src/focalgradient/live/focus.js";
import { SHADERS } from "../build/shared.js";
import { pressed } from "./keys.js";
import { FOOT } from "./prompt.js";
import { appears, between, NOTHING_LOST, responseTime, simulated } from "./simulation.js";

const WHEEL = 25; // steps of the wheel and of arrow keys from one end of the range to the other

async function fetched(stimulus) {
  if (typeof stimulus !== "string") return stimulus;
  const response = await fetch(stimulus);
  if (!response.ok) throw new Error(`${stimulus}: ${response.status}`);
  return response.json();
}

export default class FocalBlur {
  static info = {
    name: "focal-blur",
    version: "0.1.0",
    parameters: {
      stimulus: { type: ParameterType.COMPLEX, default: undefined },
      focus: { type: ParameterType.FLOAT, default: null },
      focus_at: { type: ParameterType.FUNCTION, default: null },
      adjustable: { type: ParameterType.BOOL, default: false },
      range: { type: ParameterType.COMPLEX, default: null },
      start: { type: ParameterType.FLOAT, default: null },
      gamma: { type: ParameterType.FLOAT, default: null },
      choices: { type: ParameterType.KEYS, default: "ALL_KEYS" },
      trial_duration: { type: ParameterType.INT, default: null },
      prompt: { type: ParameterType.HTML_STRING, default: null },
      label: { type: ParameterType.STRING, default: "Focus" },
      button_label: { type: ParameterType.STRING, default: "Continue" },
      frame: { type: ParameterType.FLOAT, default: null },
    },
    data: {
      focus: { type: ParameterType.FLOAT },
      start: { type: ParameterType.FLOAT },
      response: { type: ParameterType.STRING },
      rt: { type: ParameterType.FLOAT },
      changes: { type: ParameterType.COMPLEX },
      dropped_frames: { type: ParameterType.INT },
      lost: { type: ParameterType.COMPLEX },
    },
  };

  constructor(jsPsych) {
    this.jsPsych = jsPsych;
  }

  async trial(element, trial) {
    const packed = await fetched(trial.stimulus);
    const canvas = Object.assign(document.createElement("canvas"), { id: "focal-blur" });
    const view = new FocusView(canvas, SHADERS, trial.gamma ? Array(3).fill(trial.gamma) : null);
    const series = await view.load(packed);
    const [low, high] = trial.range ?? [series.vergences[0], series.vergences.at(-1)];
    const watch = new Watch();
    element.replaceChildren(canvas);
    inDevicePixels(canvas, series.width, series.height);
    const begin = trial.start ?? trial.focus ?? (trial.adjustable ? low + Math.random() * (high - low) : (low + high) / 2);
    const knob = this.controls(element, trial, begin, low, high);
    const keys = trial.adjustable ? null : pressed(this.jsPsych, trial.choices);
    const stamps = [];
    const changes = [];
    for (;;) {
      const now = await nextFrame();
      stamps.push(now);
      const elapsed = now - stamps[0];
      const over = trial.trial_duration !== null && elapsed >= trial.trial_duration - (trial.frame ?? 1000 / 60) / 2;
      if (knob?.done || over || keys?.since(stamps[0])) break;
      const focus = trial.focus_at ? trial.focus_at(elapsed / 1000) : knob ? knob.value : begin;
      if (focus !== changes.at(-1)?.[1]) {
        view.draw(series, focus);
        changes.push([Math.round(10 * elapsed) / 10, focus]);
      }
    }
    const answer = keys?.since(stamps[0]) ?? null;
    const rt = answer ? answer.rt : (knob?.done || null) && knob.done - stamps[0];
    knob?.end();
    keys?.end();
    element.replaceChildren();
    view.gl.getExtension("WEBGL_lose_context")?.loseContext(); // browsers keep a few contexts only
    this.jsPsych.finishTrial({
      focus: changes.at(-1)[1],
      start: begin,
      response: answer?.key ?? null,
      rt,
      changes,
      dropped_frames: late(rounded(stamps), trial.frame),
      lost: watch.end(),
    });
  }

  // Below the picture: the prompt; and, where focus is the participant's, a slider that the wheel and the keys move, too.
  controls(element, trial, start, low, high) {
    const foot = Object.assign(document.createElement("div"), { id: "focal-blur-foot" });
    Object.assign(foot.style, FOOT);
    if (trial.prompt) foot.innerHTML = trial.prompt;
    element.append(foot);
    if (!trial.adjustable) return null;
    foot.append(document.createElement("br"));
    return new Knob(foot, {
      least: low, most: high, start, steps: WHEEL, label: trial.label, button_label: trial.button_label,
    });
  }

  async simulate(trial, mode, options, loaded) {
    const { pluginAPI } = this.jsPsych;
    const { vergences } = await fetched(trial.stimulus);
    const [low, high] = trial.range ?? [vergences[0], vergences.at(-1)];
    const none = trial.adjustable || trial.choices === "NO_KEYS";
    const rt = none && !trial.adjustable ? null : responseTime(this.jsPsych);
    const start = trial.start ?? trial.focus ?? (trial.adjustable ? between(low, high) : (low + high) / 2);
    const focus = trial.adjustable ? between(low, high) : (trial.focus_at?.((rt ?? trial.trial_duration ?? 0) / 1000) ?? start);
    const changes = focus === start ? [[0, start]] : [[0, start], [(rt ?? 0) / 2, focus]];
    const response = none ? null : pluginAPI.getValidKey(trial.choices);
    const data = { focus, start, response, rt, changes, dropped_frames: 0, lost: NOTHING_LOST };
    const act = async ({ focus, response, rt }, element) => {
      await appears(element, "#focal-blur-foot");
      if (!trial.adjustable) {
        if (rt !== null) pluginAPI.pressKey(response, rt);
        return;
      }
      const slider = await appears(element, "#focal-blur-foot input");
      slider.value = focus;
      slider.dispatchEvent(new Event("input"));
      pluginAPI.clickTarget(element.querySelector("#focal-blur-foot button"), rt);
    };
    return simulated(this, trial, mode, options, loaded, { data, act });
  }
}
