"use strict";
/* A band of rows of a picture through a lens, as `focalgradient.render.blur` does it, in fewer steps. Runs in workers.
 *
 * Every pixel adds its light to a uniform disc; of each row of the disc only the two ends are written, and a running sum
 * along the row fills it. Sums are kept apart by surface: row x layer x column x (weight, red, green, blue). */
function makeEngine(scene, most) {
  const { w, h, light, vergence, hidden, behind, away } = scene;
  const FINE = 16;     // discs are prepared for every 1/16 pixel of radius
  const NONE = 1e-4;   // share of the lens below which a layer counts as empty
  const line = 4 * (w + 2), discs = [], levels = new Uint8ClampedArray(4097);
  let low = Infinity, high = -Infinity;
  for (const v of vergence) { low = Math.min(low, v); high = Math.max(high, v); }
  for (let n = 0; n <= 4096; n++) {  // linear light to sRGB
    const x = n / 4096;
    levels[n] = 255 * (x <= 0.0031308 ? 12.92 * x : 1.055 * x ** (1 / 2.4) - 0.055);
  }
  let sums = new Float32Array(0), used = new Uint8Array(0), top = 0, bottom = 0, layers = 1;

  function discOf(number) {
    if (discs[number]) return discs[number];
    // Its pixels' own squares spread light by 1/12 in each direction, a disc by r^2 / 4: the disc is made smaller.
    const r = Math.sqrt(Math.max((number / FINE) ** 2 - 1 / 3, 0.01));
    const area = y => {
      const t = Math.max(-r, Math.min(r, y));
      return (t * Math.sqrt(Math.max(r * r - t * t, 0)) + r * r * Math.asin(t / r)) / 2;
    };
    // Rows 0 to reach from the middle: `half` is half their width; the first pixel that they touch, and the share of it
    // that they leave out. In large discs whole pixels do.
    const reach = Math.max(0, Math.ceil(r - 0.5)), half = new Float64Array(reach + 1);
    const first = new Int32Array(reach + 1), part = new Float64Array(reach + 1);
    let sum = 0;
    for (let y = 0; y <= reach; y++) {
      const exact = area(y + 0.5) - area(y - 0.5);
      half[y] = r >= 6 ? Math.max(Math.round(exact - 0.5), 0) + 0.5 : exact;
      first[y] = Math.floor(0.5 - half[y]);
      part[y] = 0.5 - half[y] - first[y];
      sum += (y ? 4 : 2) * half[y];
    }
    return discs[number] = { reach, half, first, part, weight: 1 / sum };
  }

  function spread(i, j, layer, disc, r, g, b) {
    const { reach, half, first, part, weight } = disc;
    const inside = j - reach > 0 && j + reach < w - 1;
    for (let n = 0; n <= reach; n++) {
      const f = part[n], c = weight * f, d = weight - c;
      // A run of light begins by d and c, and ends by as much, in the opposite order.
      for (let side = n ? 0 : 1; side < 2; side++) {
        let row = side ? i + n : i - n;
        if (row < 0) row = -1 - row; else if (row >= h) row = 2 * h - 1 - row;  // the picture goes on mirrored
        if (row < top || row >= bottom) continue;
        const base = (row - top) * layers + layer;
        used[base] = 1;
        if (inside) {
          let p = base * line + 4 * (j + first[n]) | 0;
          sums[p] += d; sums[p + 1] += d * r; sums[p + 2] += d * g; sums[p + 3] += d * b;
          if (f) { sums[p + 4] += c; sums[p + 5] += c * r; sums[p + 6] += c * g; sums[p + 7] += c * b; }
          p = base * line + 4 * (j - first[n]) | 0;
          if (f) { sums[p] -= c; sums[p + 1] -= c * r; sums[p + 2] -= c * g; sums[p + 3] -= c * b; }
          sums[p + 4] -= d; sums[p + 5] -= d * r; sums[p + 6] -= d * g; sums[p + 7] -= d * b;
          continue;
        }
        const from = j + 0.5 - half[n], to = j + 0.5 + half[n];
        run(base * line, Math.max(from, 0), Math.min(to, w), weight, r, g, b);
        if (from < 0) run(base * line, 0, Math.min(-from, w), weight, r, g, b);
        if (to > w) run(base * line, Math.max(2 * w - to, 0), w, weight, r, g, b);
      }
    }
  }

  function run(base, from, to, weight, r, g, b) {  // light on [from, to) of a row
    for (let end = 0; end < 2; end++) {
      const x = end ? to : from, k = end ? -weight : weight, left = x | 0, c = k * (x - left), d = k - c, p = base + 4 * left;
      sums[p] += d; sums[p + 1] += d * r; sums[p + 2] += d * g; sums[p + 3] += d * b;
      sums[p + 4] += c; sums[p + 5] += c * r; sums[p + 6] += c * g; sums[p + 7] += c * b;
    }
  }

  function spreadAll(lights, depths, scale, focus, step, surfaces, isHidden) {
    for (let i = 0, at = 0; i < h; i++) for (let j = 0; j < w; j++, at++) {
      const v = depths[at];
      if (v < 0) continue;
      const radius = Math.abs(v - focus) * scale;
      // What lies hidden farther from an outline than blur reaches is seen by no part of the lens.
      if (isHidden && away[at] > 2 + Math.max(radius, Math.abs(vergence[at] - focus) * scale)) continue;
      const disc = discOf(Math.round(radius * FINE)), reach = disc.reach;
      if (i + reach < top && i >= reach || i - reach >= bottom && i + reach < h) continue;
      const layer = Math.min(Math.floor((v - low) * scale / step), surfaces - 1);
      spread(i, j, layer, disc, lights[3 * at], lights[3 * at + 1], lights[3 * at + 2]);
    }
  }

  function show(rows, surfaces, lamp) {  // from near to far, through what is left open
    const pixels = new Uint8ClampedArray(4 * rows * w), now = new Float64Array(4 * layers);
    for (let row = 0, to = 0; row < rows; row++) {
      now.fill(0);
      for (let x = 0; x < w; x++, to += 4) {
        let left = 1, weight = 0, r = 0, g = 0, b = 0, red = 0, green = 0, blue = 0;
        for (let n = layers - 1; n >= 0; n--) {
          if (!used[row * layers + n]) continue;
          const p = (row * layers + n) * line + 4 * x, q = 4 * n;
          now[q] += sums[p]; now[q + 1] += sums[p + 1]; now[q + 2] += sums[p + 2]; now[q + 3] += sums[p + 3];
          sums[p] = sums[p + 1] = sums[p + 2] = sums[p + 3] = 0;
        }
        for (let n = surfaces - 1; n >= -1 && left > NONE; n--) {
          const more = n >= 0 && used[row * layers + n] ? now[4 * n] : 0;
          if (more > NONE) {
            weight += more; r += now[4 * n + 1]; g += now[4 * n + 2]; b += now[4 * n + 3];
          } else if (weight > 10 * NONE) {  // a gap: what comes next lies behind
            const share = left / Math.max(weight, 1);
            red += share * r; green += share * g; blue += share * b;
            left *= 1 - Math.min(weight, 1);
            weight = r = g = b = 0;
          }
        }
        const all = left < 1 ? 1 / (1 - left) : 0;
        const glow = lamp < 0 ? 0 : now[4 * lamp + 1];
        pixels[to] = levels[Math.min(4096, Math.max(0, 4096 * (red * all + glow) + 0.5 | 0))];
        pixels[to + 1] = levels[Math.min(4096, Math.max(0, 4096 * (green * all + glow) + 0.5 | 0))];
        pixels[to + 2] = levels[Math.min(4096, Math.max(0, 4096 * (blue * all + glow) + 0.5 | 0))];
        pixels[to + 3] = 255;
      }
      for (let n = 0; n < layers; n++) {  // the places beyond the last column
        const p = (row * layers + n) * line + 4 * w;
        sums.fill(0, p, p + 8);
      }
    }
    return pixels;
  }

  /* Rows `from` to `to`, as sRGB. settings: scale (pixels of radius a dioptre), focus (dioptres),
   * lamp (null, or x and y in pixels, vergence in dioptres, light on each pixel of its disc). */
  return function draw({ scale, focus, lamp }, from, to) {
    const range = (high - low) * scale, step = Math.max(1, range / (most - 1));
    const surfaces = Math.floor(range / step) + 1;
    layers = surfaces + (lamp ? 1 : 0);
    top = from; bottom = to;
    const rows = to - from;
    if (sums.length < rows * layers * line) sums = new Float32Array(rows * layers * line);
    if (used.length < rows * layers) used = new Uint8Array(rows * layers);
    used.fill(0);
    spreadAll(light, vergence, scale, focus, step, surfaces, false);
    spreadAll(hidden, behind, scale, focus, step, surfaces, true);
    if (lamp) {
      const disc = discOf(Math.round(Math.abs(lamp.vergence - focus) * scale * FINE)), glow = lamp.light / disc.weight;
      spread(lamp.y, lamp.x, surfaces, disc, glow, glow, glow);
    }
    return show(rows, surfaces, lamp ? surfaces : -1);
  };
}

/* The scene at half the size: of each four pixels, those of the nearest surface. */
function halved({ w, h, light, vergence, hidden, behind, away }, near) {
  const W = w >> 1, H = h >> 1, small = { w: W, h: H };
  const reduce = (lights, depths) => {
    const l = new Float32Array(3 * W * H), d = new Float32Array(W * H);
    for (let i = 0; i < H; i++) for (let j = 0; j < W; j++) {
      const four = [0, 1, w, w + 1].map(n => 2 * i * w + 2 * j + n), best = Math.max(...four.map(n => depths[n]));
      const same = four.filter(n => depths[n] >= 0 && best - depths[n] <= near), to = i * W + j;
      d[to] = best < 0 ? -1 : same.reduce((sum, n) => sum + depths[n], 0) / same.length;
      for (let c = 0; c < 3; c++) l[3 * to + c] = best < 0 ? 0 : same.reduce((s, n) => s + lights[3 * n + c], 0) / same.length;
    }
    return [l, d];
  };
  [small.light, small.vergence] = reduce(light, vergence);
  [small.hidden, small.behind] = reduce(hidden, behind);
  small.away = new Uint8Array(W * H);
  for (let i = 0; i < H; i++) for (let j = 0; j < W; j++) small.away[i * W + j] = away[2 * i * w + 2 * j] >> 1;
  return small;
}
