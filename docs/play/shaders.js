/* The shaders of two views of a scene, their Laplacians and the ratio of these, each a step of `TwoViews`. */
import { SRGB } from "../../src/focalgradient/live/gl.js";

export const SHADERS = (() => {
  const head = packed => `#version 300 es
precision highp float;
precision highp int;
precision highp sampler2D;
${packed ? "#define PACKED" : ""}
out vec4 made;
uniform ivec2 size;  // of what is drawn into, in its pixels

// Two numbers a pixel: floats, or 16 bits each, from 0 to 2, where a graphics card draws into no floats.
vec2 get(sampler2D from, ivec2 at) {
  vec4 stored = texelFetch(from, at, 0);
#ifdef PACKED
  return (floor(stored.xz * 255.0 + 0.5) * 256.0 + floor(stored.yw * 255.0 + 0.5)) / 32767.5;
#else
  return stored.xy;
#endif
}

vec4 put(vec2 value) {
#ifdef PACKED
  vec2 whole = clamp(floor(value * 32767.5 + 0.5), 0.0, 65535.0), high = floor(whole / 256.0), low = whole - high * 256.0;
  return vec4(high.x, low.x, high.y, low.y) / 255.0;
#else
  return vec4(value, 0.0, 1.0);
#endif
}

vec2 linear(vec2 coded) {
  return mix(coded / 12.92, pow((coded + 0.055) / 1.055, vec2(2.4)), step(0.04045, coded));
}

ivec2 mirrored(ivec2 at, ivec2 count) {
  at = (at + 2 * count) % (2 * count);
  return min(at, 2 * count - 1 - at);
}
`;
  return {
    head,

    // Eq. 7: each view is the scene, blurred by a Gaussian whose sigma is gain x |focus - vergence| pixels, along one
    // direction. A farther point does not spread over a sharper, nearer one.
    blur: `
uniform sampler2D scene, from;
uniform bool first, pair;      // whether the scene itself is blurred; whether it holds two photographs
uniform ivec2 along;
uniform int reach;
uniform vec2 focus, gain;      // dioptres, and pixels of sigma per dioptre, of either view
uniform float most;            // dioptres at a green of 1
uniform float noise, levels;   // standard deviation of a pixel's noise; 2^bits - 1, or 0 for no steps
uniform uint seed;

vec2 light(ivec2 at) {
  if (!first) return get(from, at);
  vec2 coded = texelFetch(scene, at, 0).rg;
  return linear(pair ? coded : coded.rr);
}

uint pcg(uint v) {
  uint s = v * 747796405u + 2891336453u, w = ((s >> ((s >> 28u) + 4u)) ^ s) * 277803737u;
  return (w >> 22u) ^ w;
}

float normal(uint key) {
  uint a = pcg(key), b = pcg(a);
  return sqrt(3.0) * (float((a >> 16u) + (a & 65535u) + (b >> 16u) + (b & 65535u)) / 65536.0 - 2.0);
}

void main() {
  ivec2 here = ivec2(gl_FragCoord.xy);
  float vergence = texelFetch(scene, here, 0).g * most;
  vec2 mine = gain * abs(focus - vergence), sum = vec2(0.0), weights = vec2(0.0);
  for (int i = -reach; i <= reach; i++) {
    ivec2 at = here + i * along;
    if (any(lessThan(at, ivec2(0))) || any(greaterThanEqual(at, size))) continue;
    float other = texelFetch(scene, at, 0).g * most;
    vec2 sigma = gain * abs(focus - other);
    if (other < vergence) sigma = min(sigma, mine);
    sigma = max(sigma, 0.1);
    vec2 fall = exp(-0.5 / (sigma * sigma)), total = mix(1.0 + 2.0 * fall, 2.5066283 * sigma, step(0.6, sigma));
    vec2 weight = exp(-0.5 * float(i * i) / (sigma * sigma)) / total;
    sum += weight * light(at);
    weights += weight;
  }
  vec2 value = sum / max(weights, 1e-9);
  if (noise > 0.0) {
    uint place = uint(here.x + size.x * here.y);
    value += noise * vec2(normal(place + pcg(2u * seed)), normal(place + pcg(2u * seed + 1u)));
    value = clamp(value, 0.0, 1.0);
  }
  if (levels > 0.0) value = floor(clamp(value, 0.0, 1.0) * levels + 0.5) / levels;
  made = put(value);
}`,

    // Sections III.B and III.C: mean size of the Laplacian, and mean brightness, over 4 x 4 pixels.
    squares: `
uniform sampler2D from;
uniform ivec2 frame;
uniform bool laplacian;
vec2 at(ivec2 place) { return get(from, clamp(place, ivec2(0), frame - 1)); }
void main() {
  ivec2 corner = 4 * ivec2(gl_FragCoord.xy);
  vec2 sum = vec2(0.0);
  for (int y = 0; y < 4; y++) for (int x = 0; x < 4; x++) {
    ivec2 p = corner + ivec2(x, y);
    vec2 middle = at(p);
    if (laplacian) middle = abs(4.0 * middle - at(p + ivec2(1, 0)) - at(p - ivec2(1, 0)) - at(p + ivec2(0, 1)) - at(p - ivec2(0, 1)));
    sum += middle;
  }
  made = put(sum / 16.0);
}`,

    // A Gaussian mean along one direction; of sizes, the root of the mean square.
    gather: `
uniform sampler2D from;
uniform ivec2 along;
uniform float sd;
uniform bool squared;
void main() {
  ivec2 here = ivec2(gl_FragCoord.xy);
  vec2 sum = vec2(0.0);
  float weights = 0.0;
  int reach = int(ceil(3.5 * sd));
  for (int i = -reach; i <= reach; i++) {
    float weight = exp(-float(i * i) / (2.0 * sd * sd));
    vec2 value = get(from, mirrored(here + i * along, size));
    sum += weight * (squared ? value * value : value);
    weights += weight;
  }
  sum /= weights;
  made = put(squared ? sqrt(sum) : sum);
}`,

    // The focal disparity: detail over brightness of the second view, divided by that of the first; an eighth of it.
    ratio: `
uniform sampler2D detail, light;
uniform float floors, least, clear;  // energy of the noise; limits of what can be compared
void main() {
  ivec2 here = ivec2(gl_FragCoord.xy);
  vec2 bright = get(light, here), energy = get(detail, here);
  energy = energy * energy - floors;
  bool valid = min(bright.x, bright.y) > 0.0 && energy.x > clear * floors && energy.x > least * least * bright.x * bright.x;
  float ratio = sqrt(max(energy.y, 0.0) / max(energy.x, 1e-12)) * bright.x / max(bright.y, 1e-6);
  made = put(valid ? vec2(min(ratio / 8.0, 1.9), 1.0) : vec2(0.0));
}`,

    // Vergence from the focal disparity, by the table of the optics; an eighth of it, in dioptres.
    depth: `
uniform sampler2D from;
uniform float table[128];   // defocus in dioptres, by the logarithm of the ratio, from 0 to lowest
uniform float lowest, plane, side;
void main() {
  vec2 ratio = get(from, ivec2(gl_FragCoord.xy));
  float at = clamp(log(max(8.0 * ratio.x, 1e-6)) / lowest, 0.0, 1.0) * 127.0;
  int below = min(int(at), 126);
  float defocus = mix(table[below], table[below + 1], at - float(below));
  made = put(vec2(max(plane - side * defocus, 0.0) / 8.0, ratio.y));
}`,

    // One tile of the canvas: 0 and 1 the views, 2 and 3 their detail, 4 the ratio, 5 the depth, 6 the true depth,
    // 7 the ratio by its side of 1.
    show: `
uniform sampler2D scene, views, detail, light, ratio, depth;
uniform int what;
uniform ivec2 origin, frame;
uniform float most, exposure;
${SRGB}
vec3 scale(float share) {  // from far, dark blue, to near, yellow
  share = clamp(share, 0.0, 1.0);
  return mix(mix(vec3(0.05, 0.10, 0.35), vec3(0.36, 0.45, 0.52), min(2.0 * share, 1.0)), vec3(0.98, 0.88, 0.30), max(2.0 * share - 1.0, 0.0));
}
vec3 grey(float value) { return srgb(vec3(clamp(value, 0.0, 1.0))); }
void main() {
  ivec2 here = ivec2(gl_FragCoord.xy) - origin;
  here = min(ivec2(vec2(here) * vec2(frame) / vec2(size)), frame - 1);
  here.y = frame.y - 1 - here.y;
  ivec2 square = min(here / 4, frame / 4 - 1);
  vec3 shown = vec3(0.0);
  if (what < 2) {
    vec2 value = get(views, here) * exposure;
    shown = grey(what == 0 ? value.x : value.y);
  } else if (what < 4) {
    vec2 value = get(detail, square) / max(get(light, square), 1e-3);
    shown = grey(2.0 * (what == 2 ? value.x : value.y));
  } else if (what == 6) {
    shown = scale(texelFetch(scene, here, 0).g);
  } else {
    vec2 value = get(ratio, square);
    if (what == 5) value = get(depth, square);
    if (value.y > 0.5) {
      if (what == 4) shown = vec3(min(8.0 * value.x, 1.0));
      else if (what == 5) shown = scale(8.0 * value.x / most);
      else {
        float side = clamp(log(max(8.0 * value.x, 1e-3)) / 1.5, -1.0, 1.0);
        shown = mix(vec3(0.92), side > 0.0 ? vec3(0.80, 0.33, 0.0) : vec3(0.0, 0.36, 0.65), abs(side));
      }
    }
  }
  made = vec4(shown, 1.0);
}`,
  };
})();
