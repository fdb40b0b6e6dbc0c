/* Builds the panels and sets their language. Nothing is stored, and nothing leaves the page. */
import { DisparityPanel } from "./disparity.js";
import { EyePanel } from "./eye.js";
import { LensPanel } from "./lens.js";
import { blurRadius, distancesOfBlur, eyeFocus, oscillation } from "./optics.js";
import { OwnPanel } from "./own.js";
import { imageOf } from "./panel.js";
import { RatingPanel } from "./rating.js";
import { TwoViews } from "./two-views.js";
import { language, speak, word, WORDS } from "./words.js";

const panels = [new LensPanel(), new DisparityPanel(), new EyePanel(), new RatingPanel(), new OwnPanel()];

function translate(chosen = language) {
  speak(chosen);
  document.documentElement.lang = language;
  for (const text of document.querySelectorAll("[data-word]")) text.innerHTML = word(text.dataset.word);
  document.title = word("title");
  document.getElementById("language").textContent = language === "en" ? "Deutsch" : "English";
  document.getElementById("language").lang = language === "en" ? "de" : "en";
  for (const panel of panels) {
    panel.captioned = null;
    panel.translate();
  }
}

document.getElementById("language").onclick = () => translate(language === "en" ? "de" : "en");
translate();
const ready = Promise.all(panels.map(panel => panel.load()));

// For tests and the film of the page.
Object.assign(globalThis, { panels, ready, translate, imageOf, TwoViews, WORDS, blurRadius, distancesOfBlur, eyeFocus, oscillation });
