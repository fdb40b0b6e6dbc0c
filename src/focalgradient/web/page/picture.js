// jsPsych plugin: pictures and films shown pixel for pixel, each after a fixation mark; all frames are recorded.

import { ParameterType } from "jspsych";
import { ends, inDevicePixels, late, play, rounded, Watch } from "./frames.js";
import { Presses } from "./held.js";
import { tone } from "./tone.js";

export const access = { headers: {} }; // identifies the participant to the server

const MOST = 24; // pictures that are kept
const loaded = new Map();

// Decode a picture without colour management or scaling.
const decoded = (blob) => createImageBitmap(blob, { colorSpaceConversion: "none", premultiplyAlpha: "none" });

// Frames of a film's file: PNGs, each after its number of bytes; 0 bytes end them.
function frames(film) {
  const [view, found] = [new DataView(film), []];
  for (let at = 0, size; (size = view.getUint32(at)); at += 4 + size) found.push(decoded(new Blob([film.slice(at + 4, at + 4 + size)], { type: "image/png" })));
  return Promise.all(found);
}

// A picture, or a film as it is stored: its decoded frames take a hundred times the memory.
export async function load(url, film) {
  if (!loaded.has(url)) {
    loaded.set(
      url,
      fetch(url, access)
        .then((response) => {
          if (!response.ok) throw new TypeError(`${url}: ${response.status}`);
          return film ? response.arrayBuffer() : response.blob().then(decoded);
        })
        .catch((error) => {
          throw new TypeError(String(error)); // also of a picture that arrived incompletely: it is requested again
        }),
    );
    loaded.get(url).catch(() => loaded.delete(url));
    for (const old of loaded.keys()) {
      if (loaded.size <= MOST) break;
      loaded.delete(old);
    }
  }
  return loaded.get(url);
}

// A dark and bright ring and point, visible on any background; its radius in device pixels.
function drawMark(context, { x, y }, radius) {
  for (const [colour, width] of [
    ["black", 3],
    ["white", 1.2],
  ]) {
    context.strokeStyle = context.fillStyle = colour;
    context.lineWidth = (width * radius) / 10;
    context.beginPath();
    context.arc(x, y, radius, 0, 2 * Math.PI);
    context.stroke();
    context.beginPath();
    context.arc(x, y, (context.lineWidth * 2) / 3, 0, 2 * Math.PI);
    context.fill();
  }
}

const WHITE_S = 0.5; // white screen after a look at the real world

// A look at the real world, with a text on the screen; a tone and a white screen end it. Returns its time stamps.
async function look(element, { look: { text }, seconds }, frame) {
  const shown = Object.assign(document.createElement("p"), { className: "look", textContent: text });
  element.append(shown);
  const stamps = await play(() => {}, seconds, frame);
  tone();
  shown.remove();
  document.body.classList.add("white");
  await play(() => {}, WHITE_S, frame);
  document.body.classList.remove("white");
  return stamps;
}

export default class PicturePlugin {
  static info = {
    name: "focalgradient-picture",
    version: "1.0.0",
    parameters: {
      // Of each: url, seconds, mark {x, y}, mark_seconds, mark_kept, name of its event; whether it follows without a gap;
      // frames per second of a film; or the text of a look at the real world.
      intervals: { type: ParameterType.COMPLEX, array: true, default: [] },
      mark_radius: { type: ParameterType.FLOAT, default: 10 },
      blank_seconds: { type: ParameterType.FLOAT, default: 0.5 },
      pause_seconds: { type: ParameterType.FLOAT, default: 0 },
      frame: { type: ParameterType.FLOAT, default: null },
      foot: { type: ParameterType.HTML_STRING, default: null },
      keys: { type: ParameterType.KEYS, array: true, default: [] }, // whose presses and releases are recorded
      stopped: { type: ParameterType.FUNCTION, default: () => false }, // given the onset: whether to remove the picture
    },
    data: {
      presses: { type: ParameterType.COMPLEX },
      shown: { type: ParameterType.COMPLEX },
      dropped_frames: { type: ParameterType.INT },
      lost: { type: ParameterType.COMPLEX },
    },
  };

  constructor(jsPsych) {
    this.jsPsych = jsPsych;
  }

  async trial(element, trial) {
    const watch = new Watch();
    const canvas = document.createElement("canvas");
    canvas.id = "picture";
    element.replaceChildren(canvas);
    if (trial.foot) element.append(Object.assign(document.createElement("div"), { className: "foot", innerHTML: trial.foot }));
    const presses = new Presses(trial.keys ?? []);
    const shown = [];
    let dropped = 0;
    let last = null; // frame in which a picture ended
    const empty = (context) => context.clearRect(0, 0, canvas.width, canvas.height);
    for (const [number, one] of trial.intervals.entries()) {
      canvas.hidden = Boolean(one.look);
      if (one.look) {
        shown.push({ event: one.event, stamps: ends(await look(element, one, trial.frame)) });
        continue;
      }
      const content = await load(one.url, one.film);
      const images = one.film ? await frames(content) : [content];
      const [image] = images;
      inDevicePixels(canvas, image.width, image.height);
      const context = canvas.getContext("2d", { colorSpace: "srgb" });
      context.imageSmoothingEnabled = false;
      const pause = (seconds) => play(() => empty(context), seconds, trial.frame);
      if (trial.pause_seconds && !number) await pause(trial.pause_seconds);
      if (one.mark_seconds) {
        const mark = () => (empty(context), drawMark(context, one.mark, trial.mark_radius));
        shown.push({ event: "mark", stamps: ends(await play(mark, one.mark_seconds, trial.frame)) });
      }
      const draw = (seconds) => {
        if (seconds > 0 && !one.film) return; // the picture is already drawn
        context.drawImage(images[Math.round(seconds * (one.film ?? 0)) % images.length], 0, 0);
        if (one.mark_kept) drawMark(context, one.mark, trial.mark_radius);
      };
      const stamps = await play(draw, one.seconds, trial.frame, trial.stopped, one.follows ? last : null);
      last = stamps.at(-1);
      dropped += late(stamps, trial.frame);
      shown.push({ event: one.event, stamps: rounded(stamps) });
      if (one.film) for (const frame of images) frame.close();
      if (trial.intervals[number + 1]?.follows) continue;
      empty(context);
      if (trial.blank_seconds) await pause(trial.blank_seconds);
    }
    element.replaceChildren();
    this.jsPsych.finishTrial({ presses: presses.end(), shown, dropped_frames: dropped, lost: watch.end() });
  }
}
