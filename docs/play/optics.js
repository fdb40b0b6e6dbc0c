/* Eq. 1 and the table of the optics, from the numbers of `data.js`. Metres, dioptres, pixels. */

/* Sensor distance of a lens that is focused at a distance: Eq. 12. */
const sensorDistance = (focalLength, focus) => focalLength * focus / (focus - focalLength);

/* Radius of the blur disc on the sensor, of a point at a distance: Eq. 15. */
export const blurRadius = (focalLength, fNumber, focus, distance) =>
  sensorDistance(focalLength, focus) * focalLength / fNumber / 2 * Math.abs(1 / focus - 1 / distance);

/* Both distances that have this blur: Eqs. 1 and 16, with the paper's f = F / (radius of the lens). Infinity where there is none. */
export function distancesOfBlur(focalLength, fNumber, focus, sigma) {
  const v0 = sensorDistance(focalLength, focus), f = 2 * fNumber;
  const [far, near] = [1, -1].map(side => {
    const below = v0 - focalLength - side * sigma * f;
    return below > 1e-12 ? focalLength * v0 / below : Infinity;
  });
  return { near, far };
}

/* Mean Laplacian of the scene's texture after a blur of so many pixels in radius, relative to none. */
function detailAfter(radius) {
  const [low, high, count] = PLAY.radii, at = Math.min(Math.max((radius - low) / (high - low), 0), 1) * (count - 1);
  const below = Math.min(Math.floor(at), count - 2), part = at - below;
  return Math.exp((1 - part) * Math.log(PLAY.detail[below]) + part * Math.log(PLAY.detail[below + 1]));
}

/* Expected focal disparity at a defocus in dioptres. */
const disparityAt = (apertures, defocus, pixelAngle) =>
  detailAfter(apertures[1] / 2 * defocus / pixelAngle) / detailAfter(apertures[0] / 2 * defocus / pixelAngle);

/* The inverse: defocus at 128 ratios, even in their logarithm, from 1 to the smallest within reach. */
export function depthTable({ apertures, reach }, pixelAngle) {
  const steps = 400, logs = [];
  for (let n = 0; n <= steps; n++) logs.push(Math.min(Math.log(disparityAt(apertures, reach * n / steps, pixelAngle)), n ? logs[n - 1] : 0));
  const lowest = Math.min(logs[steps], -1e-6), table = new Float32Array(128);
  for (let n = 0, at = 0; n < 128; n++) {
    const wanted = lowest * n / 127;
    while (at < steps && logs[at] > wanted) at++;
    const before = logs[Math.max(at - 1, 0)], part = at && before > logs[at] ? (before - wanted) / (before - logs[at]) : 1;
    table[n] = reach * Math.max(at - 1 + part, 0) / steps;
  }
  return { table, lowest };
}

/* Vergence in focus of an unaccommodated eye, by the lens that corrects it 12 mm before the cornea. */
const farPoint = correction => -correction / (1 - 0.012 * correction);

/* Vergences in focus of an eye: across and upright, each of the L and M cones, of the S cones. */
export function eyeFocus({ sphere, cylinder, axis, accommodation }) {
  const across = farPoint(axis === 180 ? sphere : sphere + cylinder), upright = farPoint(axis === 180 ? sphere + cylinder : sphere);
  return [across, upright].map(relaxed => ["L+M", "S"].map(band => relaxed + accommodation - PLAY.chromatic[band]));
}

/* Change of accommodation at a time in seconds. */
export const oscillation = (amplitude, seconds) => amplitude * Math.sin(2 * Math.PI * PLAY.oscillation.frequency * seconds);
