import { initJsPsych } from "jspsych";
import { FocalBlur, FocalCube, focalDistance, FocalPicture } from "@focalgradient/jspsych";

const jsPsych = initJsPsych();
await jsPsych.run([
  focalDistance(jsPsych),
  { type: FocalPicture, stimulus: "picture.png", stimulus_duration: 500, choices: ["f", "j"] },
  { type: FocalBlur, stimulus: "series/focus.json", adjustable: true, prompt: "Make the near card sharp." },
  { type: FocalCube, gradient: "rigid", trial_duration: 2000, keys: { f: "rigid", j: "nonrigid" } },
]);
