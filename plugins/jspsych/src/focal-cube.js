// The turning Necker cube, blurred by the depth of one of its two readings, while keys are held or released.

import { ParameterType } from "jspsych";
import Cube from "./cube.js";
import { CUBE } from "../build/shared.js";
import { measurements } from "./focal-distance.js";
import { atFoot } from "./prompt.js";
import { appears, between, NOTHING_LOST, simulated } from "./simulation.js";

const radians = (degrees) => (degrees * Math.PI) / 180;

// Sizes of a cube as it is drawn, of lengths in degrees and metres: those of `focalgradient.scenes.NeckerCube`.
export function cubeOf({ size_deg, perspective, distance_m, tilt_deg, line_deg, turns_per_s, strength_mm, pixels_per_degree, gamma }) {
  const [tilt, size, pixel_angle] = [radians(tilt_deg), radians(size_deg), Math.tan(radians(1)) / pixels_per_degree];
  const line_deg_used = line_deg ?? Math.max(0.05, 2 / pixels_per_degree);
  const reach = perspective * (Math.cos(tilt) / Math.SQRT2 + Math.abs(Math.sin(tilt)) / 2);
  if (reach > 0.95) throw new Error(`perspective is ${perspective}, with which the cube reaches the viewer: take less.`);
  const magnification = size / perspective;
  const [half, radius] = [perspective / 2, perspective / Math.SQRT2];
  const [sin, cos] = [Math.abs(Math.sin(tilt)), Math.cos(tilt)];
  const wide = radius / Math.sqrt((1 - half * sin) ** 2 - (radius * cos) ** 2);
  const heights = [-half, half].flatMap((y) => [-radius, radius].map((z) => Math.abs(y * cos - z * sin) / (1 + y * sin + z * cos)));
  const [nearest, farthest] = [distance_m * (1 - reach), distance_m * (1 + reach)];
  const blur = CUBE.blur_k * magnification * (strength_mm / 2000) * (1 / nearest - 1 / farthest);
  const rim = CUBE.reach * (blur + radians(line_deg_used));
  const side = (extent) => 2 * Math.ceil((magnification * extent + rim) / pixel_angle);
  return {
    edge: perspective * distance_m,
    distance: distance_m,
    tilt,
    magnification,
    nearest,
    turns_per_s,
    pixel_angle,
    line_px: radians(line_deg_used) / CUBE.width / pixel_angle,
    width: side(wide),
    height: side(Math.max(...heights)),
    gamma: gamma ?? 0,
    level: CUBE.level,
    blur_k: CUBE.blur_k,
    shrink: CUBE.shrink,
    twist: CUBE.twist,
  };
}

// Seconds for which each key was held.
function held(presses, seconds, keys) {
  const sums = Object.fromEntries(keys.map((key) => [key, 0]));
  const down = {};
  for (const [time, key, pressed] of presses) {
    if (pressed) down[key] ??= time;
    else if (key in down) {
      sums[key] += time - down[key];
      delete down[key];
    }
  }
  for (const [key, time] of Object.entries(down)) sums[key] += seconds - time;
  return sums;
}

export default class FocalCube {
  static info = {
    name: "focal-cube",
    version: "0.1.0",
    parameters: {
      gradient: { type: ParameterType.STRING, default: "rigid" },
      strength_mm: { type: ParameterType.FLOAT, default: 4 },
      direction: { type: ParameterType.STRING, default: "right" },
      trial_duration: { type: ParameterType.INT, default: 10000 },
      keys: { type: ParameterType.COMPLEX, default: {} },
      pixels_per_degree: { type: ParameterType.FLOAT, default: null },
      size_deg: { type: ParameterType.FLOAT, default: 8 },
      perspective: { type: ParameterType.FLOAT, default: 0.4 },
      distance_m: { type: ParameterType.FLOAT, default: 0.5 },
      tilt_deg: { type: ParameterType.FLOAT, default: 20 },
      line_deg: { type: ParameterType.FLOAT, default: null },
      turns_per_s: { type: ParameterType.FLOAT, default: 0.125 },
      gamma: { type: ParameterType.FLOAT, default: null },
      prompt: { type: ParameterType.HTML_STRING, default: "" },
      frame: { type: ParameterType.FLOAT, default: null },
    },
    data: {
      presses: { type: ParameterType.COMPLEX },
      held: { type: ParameterType.COMPLEX },
      seconds: { type: ParameterType.FLOAT },
      shown: { type: ParameterType.COMPLEX },
      dropped_frames: { type: ParameterType.INT },
      lost: { type: ParameterType.COMPLEX },
    },
  };

  constructor(jsPsych) {
    this.jsPsych = jsPsych;
  }

  trial(element, trial) {
    for (const [name, known] of [["gradient", ["none", "rigid", "nonrigid"]], ["direction", ["right", "left"]]]) {
      if (!known.includes(trial[name])) throw new Error(`${name} is ${trial[name]}, but must be ${known.join(" or ")}.`);
    }
    const pixels_per_degree = trial.pixels_per_degree ?? measurements.get(this.jsPsych)?.pixels_per_degree;
    if (!pixels_per_degree) throw new Error("pixels_per_degree is missing: give it, or measure it by focalDistance before.");
    const names = Object.entries(trial.keys).map(([key, name]) => [key.toLowerCase(), name]);
    const finishTrial = (data) => {
      const sums = held(data.presses, data.seconds, names.map(([key]) => key));
      this.jsPsych.finishTrial({ ...data, held: Object.fromEntries(names.map(([key, name]) => [name, sums[key]])) });
    };
    const cube = { shape: "ambiguous", gradient: trial.gradient, strength: trial.strength_mm, direction: trial.direction };
    return new Cube({ finishTrial }).trial(element, {
      cube: cubeOf({ ...trial, pixels_per_degree }),
      trial: { ...cube, seconds: trial.trial_duration / 1000 },
      keys: names.map(([key]) => key),
      foot: atFoot(trial.prompt),
      frame: trial.frame,
    });
  }

  // One key after the other is held for a while, as by somebody whose percept changes.
  simulate(trial, mode, options, loaded) {
    const seconds = trial.trial_duration / 1000;
    const keys = Object.keys(trial.keys).map((key) => key.toLowerCase());
    const presses = [];
    for (let time = between(0.3, 1), n = 0; keys.length && time < seconds; n++) {
      const end = time + between(1, 4);
      presses.push([time, keys[n % keys.length], true]);
      if (end < seconds) presses.push([end, keys[n % keys.length], false]);
      time = end;
    }
    const sums = held(presses, seconds, keys);
    const data = {
      presses,
      held: Object.fromEntries(Object.entries(trial.keys).map(([key, name]) => [name, sums[key.toLowerCase()]])),
      seconds,
      shown: [{ event: "cube", stamps: [0, trial.trial_duration] }],
      dropped_frames: 0,
      lost: NOTHING_LOST,
    };
    const act = async ({ presses }, element) => {
      await appears(element, "#cube");
      const { pluginAPI } = this.jsPsych;
      for (const [time, key, down] of presses) {
        pluginAPI.setTimeout(() => (down ? pluginAPI.keyDown(key) : pluginAPI.keyUp(key)), 1000 * time);
      }
    };
    return simulated(this, trial, mode, options, loaded, { data, act });
  }
}
