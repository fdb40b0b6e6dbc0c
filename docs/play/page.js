"use strict";
/* Builds the panels and sets their language. Nothing is stored, and nothing leaves the page. */
const panels = [new LensPanel(), new DisparityPanel(), new EyePanel(), new RatingPanel(), new OwnPanel()];

function translate() {
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

document.getElementById("language").onclick = () => { language = language === "en" ? "de" : "en"; translate(); };
translate();
const ready = Promise.all(panels.map(panel => panel.load()));
