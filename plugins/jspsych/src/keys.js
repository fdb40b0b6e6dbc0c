// Keys with the time stamps of their events, on the clock of the frames.

export function pressed(jsPsych, choices) {
  const found = [];
  let tell = () => {};
  const meant = (key) =>
    choices === "ALL_KEYS" || (choices !== "NO_KEYS" && choices.some((one) => jsPsych.pluginAPI.compareKeys(one, key)));
  const listen = (event) => {
    if (event.repeat || !meant(event.key)) return;
    found.push({ key: event.key.toLowerCase(), time: event.timeStamp });
    tell();
  };
  addEventListener("keydown", listen, true); // jsPsych’s simulated keys do not bubble
  return {
    // The first key since an onset, or null.
    since(onset) {
      const first = found.find(({ time }) => time >= onset);
      return first ? { key: first.key, rt: first.time - onset } : null;
    },
    // The same, waited for this many milliseconds; `early`: no longer than until there is one.
    async wait(onset, milliseconds, early) {
      if (!(early && this.since(onset)) && milliseconds > 0) {
        await new Promise((resolve) => {
          tell = () => early && this.since(onset) && resolve();
          if (Number.isFinite(milliseconds)) setTimeout(resolve, milliseconds);
        });
      }
      return this.since(onset);
    },
    end: () => removeEventListener("keydown", listen, true),
  };
}
