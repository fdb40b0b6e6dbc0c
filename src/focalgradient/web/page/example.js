// The scale with an example response, below a text that explains it; it accepts no response.

import { shareOf } from "./numbers.js";
import { escaped } from "./texts.js";

export function exampleScale(scale, at, number) {
  if (scale.kind === "steps") {
    const bipolar = scale.steps[0].value < 0;
    const signed = (value) => `${bipolar && value > 0 ? "+" : ""}${number(value)}`.replace("-", "−");
    const step = ({ value, label }) =>
      `<span class="step ${value === at ? "chosen" : ""}">${signed(value)}${label ? `<br><small>${escaped(label)}</small>` : ""}</span>`;
    return `<div class="example steps">${scale.steps.map(step).join("")}</div>`;
  }
  const share = (value) => 100 * shareOf(scale, value);
  const tick = (value) => `<span class="tick" style="left: ${share(value)}%">${number(value)}</span>`;
  return `<div class="example"><div class="ends"><span>${escaped(scale.ends[0])}</span><output>${scale.numbered ? number(at) : ""}</output>
    <span>${escaped(scale.ends[1])}</span></div><div class="line"><span class="at" style="left: ${share(at)}%"></span>
    ${scale.ticks.map(tick).join("")}</div></div>`;
}
