// Display frames: plugins draw in them, and record the time stamp of each.

export const nextFrame = () => new Promise((resolve) => requestAnimationFrame(resolve));

const median = (values) => [...values].sort((a, b) => a - b)[Math.floor(values.length / 2)];

const SHORTEST_MS = 1; // minimum frame duration: 1000 Hz
const LONGEST_MS = 500;
const USUAL_MS = 1000 / 60; // if the frame duration is unknown

// Frame duration in ms; null if the browser hides it, for example by rounding its clock.
export async function measureFrame(count = 60) {
  const stamps = [];
  for (let n = 0; n <= count; n++) stamps.push(await nextFrame());
  const steps = stamps.slice(1).map((stamp, n) => stamp - stamps[n]);
  const usual = median(steps);
  return steps.every((step) => step > 0) && usual >= SHORTEST_MS && usual <= LONGEST_MS ? usual : null;
}

// Number of dropped frames: display refreshes without a new frame; 0 if the refresh rate is unknown.
export function late(stamps, frame) {
  let count = 0;
  if (!frame) return count;
  for (let n = 1; n < stamps.length; n++) count += Math.max(0, Math.round((stamps[n] - stamps[n - 1]) / frame) - 1);
  return count;
}

// Counts disturbances of the page: hidden, left full screen, zoomed.
export class Watch {
  constructor() {
    this.ratio = devicePixelRatio;
    this.lost = { hidden: 0, left_full_screen: 0, zoomed: 0 };
    this.listeners = [
      [document, "visibilitychange", () => (this.lost.hidden += document.hidden ? 1 : 0)],
      [document, "fullscreenchange", () => (this.lost.left_full_screen += document.fullscreenElement ? 0 : 1)],
      [window, "resize", () => (this.lost.zoomed += devicePixelRatio === this.ratio ? 0 : 1)],
    ];
    for (const [target, event, listener] of this.listeners) target.addEventListener(event, listener);
  }

  // Stop counting, and return the counts.
  end() {
    for (const [target, event, listener] of this.listeners) target.removeEventListener(event, listener);
    return this.lost;
  }
}

// Animate with `draw(seconds)` for a duration, or until `stopped(onset)`, from the next frame or the present one, `from`;
// return the time stamps of all frames from onset to offset.
export async function play(draw, seconds, frame, stopped = () => false, from = null) {
  const stamps = [];
  const begin = from ?? (await nextFrame());
  stamps.push(begin);
  draw(0);
  for (;;) {
    const now = await nextFrame();
    stamps.push(now);
    if (now - begin >= 1000 * seconds - (frame ?? USUAL_MS) / 2 || stopped(begin)) return stamps;
    draw((now - begin) / 1000);
  }
}

// Centre a canvas of the given size in device pixels in the window, aligned with the display's pixels.
export function inDevicePixels(canvas, width, height) {
  canvas.width = width;
  canvas.height = height;
  const place = (window, own) => `${Math.floor((window * devicePixelRatio - own) / 2) / devicePixelRatio}px`;
  Object.assign(canvas.style, {
    position: "fixed",
    width: `${width / devicePixelRatio}px`,
    height: `${height / devicePixelRatio}px`,
    left: place(innerWidth, width),
    top: place(innerHeight, height),
    imageRendering: "pixelated",
  });
}

// Time stamps of an interval's onset and offset only.
export const ends = (stamps) => rounded([stamps[0], stamps.at(-1)]);

export const rounded = (stamps) => stamps.map((stamp) => Math.round(stamp * 100) / 100);
