// Rotating Necker cube, drawn frame by frame from the closed form of its blurred lines; and the plugin that shows it.
//
// The light of a line whose blur changes linearly along it is an integral with a closed form (a difference of two erfs
// times a Gaussian). Each line is divided into pieces in which the blur changes nearly linearly; every piece is drawn
// as
// one rectangle, and the graphics card sums the light of all pieces.

import { ParameterType } from "jspsych";
import { program, rectangle, SRGB, target, webgl } from "../../../src/focalgradient/live/gl.js";
import { inDevicePixels, late, play, rounded, Watch } from "../../../src/focalgradient/web/page/frames.js";
import { Presses } from "../../../src/focalgradient/web/page/held.js";

const REACH = 5; // distance from a line beyond which it is dark, in standard deviations
const PIECE = 0.1; // maximum change of arctan(blur / width) within one piece, in radians
const CORNERS = [-0.5, 0.5].flatMap((x) => [-0.5, 0.5].flatMap((y) => [-0.5, 0.5].map((z) => [x, y, z])));
const EDGES = [];
for (let a = 0; a < 8; a++) {
  for (let b = a + 1; b < 8; b++) {
    if (CORNERS[a].filter((value, axis) => value !== CORNERS[b][axis]).length === 1) EDGES.push([a, b]);
  }
}

const VERTEX = `#version 300 es
layout(location = 0) in vec2 corner;
layout(location = 1) in vec4 place;  // start, direction
layout(location = 2) in vec3 piece;  // length, first and last sigma
uniform vec2 size;
flat out vec4 start;
flat out vec3 line;
void main() {
  float reach = ${REACH.toFixed(1)} * max(piece.y, piece.z);
  vec2 at = vec2(mix(-reach, piece.x + reach, corner.x), mix(-reach, reach, corner.y));
  line = piece;
  start = place;
  vec2 pixel = place.xy + at.x * place.zw + at.y * vec2(place.w, -place.z) + 0.5;
  gl_Position = vec4(2.0 * pixel.x / size.x - 1.0, 1.0 - 2.0 * pixel.y / size.y, 0.0, 1.0);
}`;

const LIGHT = `#version 300 es
precision highp float;
uniform float brightness;
uniform vec2 size;
flat in vec4 start;
flat in vec3 line;
out vec4 light;
float erf(float x) {  // Abramowitz & Stegun 7.1.26: within 1.5e-7
  float t = 1.0 / (1.0 + 0.3275911 * abs(x));
  float tail = t * (0.254829592 + t * (-0.284496736 + t * (1.421413741 + t * (-1.453152027 + t * 1.061405429))));
  return sign(x) * (1.0 - tail * exp(-x * x));
}
void main() {
  // Computed from the pixel itself: interpolated positions would include the rounding of the rectangle's corners.
  vec2 from = vec2(gl_FragCoord.x, size.y - gl_FragCoord.y) - 0.5 - start.xy;
  vec2 at = vec2(dot(from, start.zw), from.x * start.w - from.y * start.z);
  float b = (line.z - line.y) / line.x;
  float foot = line.y + b * at.x;
  float square = foot * foot + b * b * at.y * at.y;
  float q = sqrt(square);
  float gap = line.x * q / (sqrt(2.0) * line.y * line.z);
  float found;
  if (gap < 0.02) {  // the erfs would cancel: use the integrand at the midpoint
    float s = line.x * line.y / (line.y + line.z);
    float sigma = line.y + b * s;
    found = line.x * exp(-(pow(at.x - s, 2.0) + at.y * at.y) / (2.0 * sigma * sigma)) / (6.28318531 * line.y * line.z);
  } else {
    float begin = (at.x * foot + b * at.y * at.y) / (sqrt(2.0) * line.y * q);
    found = exp(-at.y * at.y / (2.0 * square)) * (erf(begin) - erf(begin - gap)) / (2.0 * sqrt(6.28318531) * q);
  }
  light = vec4(vec3(brightness * max(found, 0.0)), 1.0);
}`;

const FULL = `#version 300 es
layout(location = 0) in vec2 corner;
void main() { gl_Position = vec4(2.0 * corner - 1.0, 0.0, 1.0); }`;

const ENCODE = `#version 300 es
precision highp float;
uniform sampler2D sum;
uniform float gamma;  // 0: the sRGB curve
out vec4 colour;
${SRGB}
void main() {
  vec3 light = clamp(texelFetch(sum, ivec2(gl_FragCoord.xy), 0).rrr, 0.0, 1.0);
  colour = vec4(gamma > 0.0 ? pow(light, vec3(1.0 / gamma)) : srgb(light), 1.0);
}`;

// Edges of the cube after a number of turns: start and end in pixels from the centre, and signed blur in pixels.
export function edges(cube, trial, turn) {
  const angle = 2 * Math.PI * turn * (trial.direction === "right" ? 1 : -1);
  const points = trial.shape === "nonrigid" ? wobbling(cube, angle, turn) : CORNERS.map((one) => turned(cube, scaled(one, cube.edge), angle));
  const project = ([x, y, z]) => [(cube.magnification * x) / z, (cube.magnification * y) / z];
  const kept = trial.shape === "rigid" ? EDGES.filter((edge) => inSight(points, edge)) : EDGES;
  const blurOf = ([, , z]) => {
    if (trial.gradient === "none" || trial.shape !== "ambiguous") return 0;
    const depth = trial.gradient === "rigid" ? z : 2 * cube.distance - z;
    return (cube.blur_k * cube.magnification * (trial.strength / 2000) * (1 / cube.nearest - 1 / depth)) / cube.pixel_angle;
  };
  return kept.map(([a, b]) => ({
    ends: [a, b].map((n) => project(points[n]).map((value) => value / cube.pixel_angle)),
    blur: [a, b].map((n) => blurOf(points[n])),
  }));
}

const scaled = (point, by) => point.map((value) => by * value);

function turned(cube, [x, y, z], angle) {
  [x, z] = [x * Math.cos(angle) - z * Math.sin(angle), x * Math.sin(angle) + z * Math.cos(angle)];
  [y, z] = [y * Math.cos(cube.tilt) - z * Math.sin(cube.tilt), y * Math.sin(cube.tilt) + z * Math.cos(cube.tilt)];
  return [x, y, cube.distance + z];
}

// The nonrigid example: it twists, shrinks and tapers as it rotates.
function wobbling(cube, angle, turn) {
  const phase = 2 * Math.PI * turn * 4;
  return CORNERS.map((corner) => {
    const [x, y, z] = scaled(corner, cube.edge);
    const side = Math.sign(y);
    const level = 1 - (cube.shrink * (1 - Math.sin(phase) * side)) / 2;
    const high = y * (1 - (cube.shrink * (1 - Math.cos(phase))) / 2);
    return turned(cube, [level * x, high, level * z], angle + cube.twist * Math.sin(phase) * side);
  });
}

// Whether an edge of the solid cube bounds a face that faces the eye.
function inSight(points, [a, b]) {
  const mean = (some) => [0, 1, 2].map((axis) => some.reduce((sum, point) => sum + point[axis], 0) / some.length);
  const middle = mean(points);
  return [0, 1, 2].some((axis) => {
    if (CORNERS[a][axis] !== CORNERS[b][axis]) return false;
    const face = mean(points.filter((_, n) => CORNERS[n][axis] === CORNERS[a][axis]));
    return face.reduce((sum, value, n) => sum + (value - middle[n]) * value, 0) < 0;
  });
}

// Pieces of the lines: start, direction, length, and blur at both ends.
function pieces(lines, width) {
  const found = [];
  for (const { ends, blur } of lines) {
    const [[x0, y0], [x1, y1]] = ends;
    const length = Math.hypot(x1 - x0, y1 - y0);
    if (length < 1e-9) continue;
    const [dx, dy] = [(x1 - x0) / length, (y1 - y0) / length];
    const [begin, end] = blur.map((value) => Math.atan(value / width));
    const count = Math.max(1, Math.ceil(Math.abs(end - begin) / PIECE));
    let from = 0;
    let sigma = width / Math.cos(begin);
    for (let n = 1; n <= count; n++) {
      const angle = begin + ((end - begin) * n) / count;
      const next = width / Math.cos(angle);
      const to = n < count ? (length * (width * Math.tan(angle) - blur[0])) / (blur[1] - blur[0]) : length;
      if (to > from) found.push(x0 + from * dx, y0 + from * dy, dx, dy, to - from, sigma, next);
      [from, sigma] = [to, next];
    }
  }
  return new Float32Array(found);
}

export class Cube {
  // `cube` contains the design's sizes; the canvas gets its width and height in device pixels.
  constructor(canvas, cube) {
    inDevicePixels(canvas, cube.width, cube.height);
    const gl = webgl(canvas);
    if (!gl.getExtension("EXT_color_buffer_float")) throw new Error("no WebGL2 with sums in floating point");
    const full = gl.getExtension("EXT_float_blend") !== null;
    Object.assign(this, { gl, cube, canvas });
    this.light = program(gl, LIGHT, VERTEX);
    this.encode = program(gl, ENCODE, FULL);
    this.target = target(gl, full ? gl.RGBA32F : gl.RGBA16F, cube.width, cube.height).frame;
    rectangle(gl, [0, 0, 1, 1]);
    this.instances = gl.createBuffer();
    gl.bindBuffer(gl.ARRAY_BUFFER, this.instances);
    for (const [place, count, offset] of [
      [1, 4, 0],
      [2, 3, 16],
    ]) {
      gl.enableVertexAttribArray(place);
      gl.vertexAttribPointer(place, count, gl.FLOAT, false, 28, offset);
      gl.vertexAttribDivisor(place, 1);
    }
    gl.viewport(0, 0, cube.width, cube.height);
  }

  draw(trial, turn) {
    const { gl, cube } = this;
    const line = cube.line_px; // standard deviation of a line's unblurred profile
    const middle = [(cube.width - 1) / 2, (cube.height - 1) / 2];
    const moved = edges(cube, trial, turn).map(({ ends, blur }) => ({
      ends: ends.map((end) => end.map((value, axis) => value + middle[axis])),
      blur,
    }));
    const found = pieces(moved, Math.sqrt(line ** 2 + 1 / 12));
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.target);
    gl.clearColor(0, 0, 0, 1);
    gl.clear(gl.COLOR_BUFFER_BIT);
    gl.useProgram(this.light);
    gl.uniform2f(gl.getUniformLocation(this.light, "size"), cube.width, cube.height);
    gl.uniform1f(gl.getUniformLocation(this.light, "brightness"), cube.level * Math.sqrt(2 * Math.PI) * line);
    gl.bufferData(gl.ARRAY_BUFFER, found, gl.DYNAMIC_DRAW);
    gl.enable(gl.BLEND);
    gl.blendFunc(gl.ONE, gl.ONE);
    gl.drawArraysInstanced(gl.TRIANGLE_STRIP, 0, 4, found.length / 7);
    gl.disable(gl.BLEND);
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
    gl.useProgram(this.encode);
    gl.uniform1f(gl.getUniformLocation(this.encode, "gamma"), cube.gamma);
    gl.drawArrays(gl.TRIANGLE_STRIP, 0, 4);
  }
}

// Keys and frames are time-stamped on one clock, that of performance.now().
export default class CubePlugin {
  static info = {
    name: "focalgradient-cube",
    version: "1.0.0",
    parameters: {
      cube: { type: ParameterType.OBJECT, default: {} },
      trial: { type: ParameterType.OBJECT, default: {} },
      keys: { type: ParameterType.KEYS, array: true, default: [] },
      foot: { type: ParameterType.HTML_STRING, default: "" },
      frame: { type: ParameterType.FLOAT, default: null },
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

  async trial(element, parameters) {
    const { cube, trial, keys, frame } = parameters;
    const watch = new Watch();
    const canvas = document.createElement("canvas");
    canvas.id = "cube";
    const foot = document.createElement("p");
    foot.className = "foot";
    foot.innerHTML = parameters.foot;
    element.replaceChildren(canvas, foot);
    const drawn = new Cube(canvas, cube);
    const presses = new Presses(keys);
    const stamps = await play((seconds) => drawn.draw(trial, seconds * cube.turns_per_s), trial.seconds, frame);
    element.replaceChildren();
    const [onset, offset] = [stamps[0], stamps.at(-1)];
    this.jsPsych.finishTrial({
      presses: presses.end().map(([time, key, down]) => [(time - onset) / 1000, key, down]),
      seconds: (offset - onset) / 1000,
      shown: [{ event: "cube", stamps: rounded(stamps) }],
      dropped_frames: late(stamps, frame),
      lost: watch.end(),
    });
  }
}
