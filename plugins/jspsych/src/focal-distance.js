// Size of the screen by a bank card, distance by the blind spot, as the pages of `focalgradient serve` measure them.

import { CARD_MM } from "../../../src/focalgradient/web/page/card.js";
import { measurement } from "../../../src/focalgradient/web/page/distance.js";
import { filled, html } from "../../../src/focalgradient/web/page/texts.js";
import { TEXTS } from "../build/shared.js";

// What was measured, by the instance of jsPsych: plugins that need degrees find it here.
export const measurements = new WeakMap();

// A node of a timeline. At its end every row of data has pixels_per_degree (of the display), viewing_distance_mm and
// pixels_per_mm (of the page); `on_measured` is called with them.
export function focalDistance(jsPsych, { language = "en", texts = {}, on_measured = () => {} } = {}) {
  const about = {};
  const known = { ...(TEXTS[language] ?? TEXTS.en), ...texts };
  const node = measurement(about, (name, values) => filled(known[name] ?? name, values), html);
  return {
    ...node,
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
