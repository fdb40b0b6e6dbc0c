// What jsPsych's simulation mode needs of a plugin: data without a display, or the display with somebody who answers.

const MEAN_MS = 500; // of response times, as jsPsych's own plugins simulate them

export const NOTHING_LOST = { hidden: 0, left_full_screen: 0, zoomed: 0 };

export const responseTime = (jsPsych) => Math.round(jsPsych.randomization.sampleExGaussian(MEAN_MS, 50, 1 / 150, true));

export const between = (low, high) => low + Math.random() * (high - low);

// `data`: what somebody would give; `act(data, element)` lets it happen where the trial is shown.
export async function simulated(plugin, trial, mode, options, loaded, { data, act }) {
  const { jsPsych } = plugin;
  const given = jsPsych.pluginAPI.mergeSimulationData(data, options);
  jsPsych.pluginAPI.ensureSimulationDataConsistency(trial, given);
  if (mode === "data-only") {
    loaded();
    return jsPsych.finishTrial(given);
  }
  const element = jsPsych.getDisplayElement();
  const shown = plugin.trial(element, trial);
  loaded();
  act(given, element);
  return shown;
}

// Wait for an element that a plugin makes.
export async function appears(element, selector) {
  for (;;) {
    const found = element.querySelector(selector);
    if (found) return found;
    await new Promise((resolve) => requestAnimationFrame(resolve));
  }
}
