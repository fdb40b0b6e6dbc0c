// Size of the screen by a bank card, distance by the blind spot, as the pages of `focalgradient serve` measure them.

import Chinrest from "@jspsych/plugin-virtual-chinrest";
import { CARD_MM } from "../../../src/focalgradient/web/page/card.js";
import { measurement } from "../../../src/focalgradient/web/page/distance.js";
import { filled, html } from "../../../src/focalgradient/web/page/texts.js";
import { TEXTS } from "../build/shared.js";

// The plugin has no simulation: somebody whose card is 324 pixels wide, about 50 cm away, is given instead of its pages.
class SimulatedChinrest extends Chinrest {
  simulate(trial, mode, options, loaded) {
    loaded();
    const data = { item_width_px: 324, view_dist_mm: 500 };
    this.jsPsych.finishTrial(this.jsPsych.pluginAPI.mergeSimulationData(data, options));
  }
}

// What was measured, by the instance of jsPsych: plugins that need degrees find it here.
export const measurements = new WeakMap();

// A node of a timeline. At its end every row of data has pixels_per_degree (of the display), viewing_distance_mm and
// pixels_per_mm (of the page); `on_measured` is called with them.
export function focalDistance(jsPsych, { language = "en", texts = {}, on_measured = () => {} } = {}) {
  const about = {};
  const known = { ...(TEXTS[language] ?? TEXTS.en), ...texts };
  const written = (text) => `<div style="max-width: 36rem; margin: 1rem auto; text-align: left; line-height: 1.4">${html(text)}</div>`;
  const node = measurement(about, (name, values) => filled(known[name] ?? name, values), written);
  const [measure, right] = node.timeline;
  return {
    ...node,
    timeline: [{ ...measure, type: SimulatedChinrest }, { ...right, simulation_options: { data: { response: 0 } } }],
    on_timeline_finish: () => {
      const pixels_per_mm = about.card_px / CARD_MM;
      const viewing_distance_mm = about.distance_mm;
      const pixels_per_degree = devicePixelRatio * pixels_per_mm * viewing_distance_mm * Math.tan(Math.PI / 180);
      const measured = { pixels_per_degree, viewing_distance_mm, pixels_per_mm };
      measurements.set(jsPsych, measured);
      jsPsych.data.addProperties(measured);
      on_measured(measured);
    },
  };
}
