// A prompt below what is shown: canvases lie in the middle of the window, whatever else the page has.

export const FOOT = { position: "fixed", bottom: "1rem", left: "50%", transform: "translateX(-50%)" };

const STYLE = Object.entries(FOOT).map((entry) => entry.join(": ")).join("; ");

export const atFoot = (prompt) => prompt && `<div style="${STYLE}">${prompt}</div>`;
