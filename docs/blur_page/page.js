"use strict";
/* Sliders and the point of light. `window.blurPage` tells what is shown, for tests. */
const $ = id => document.getElementById(id);
const { w, h, low, high, pixelAngle, focalLength: F, stops } = FACTS;
const GLOW = 0.35;                     // light on each pixel of the point's disc, in shares of white

/* --- What is shown ---------------------------------------------------------------------------------------------- */

const span = high - low, nearest = high + 0.1 * span, farthest = Math.max(low - 0.1 * span, 0);
const state = { stop: 0, focus: FACTS.focus, vergence: FACTS.focus, x: FACTS.lamp[0], y: FACTS.lamp[1], lamp: true };
const sliderOf = v => Math.round(1000 * (nearest - v) / (nearest - farthest));
const vergenceOf = slider => nearest - slider / 1000 * (nearest - farthest);
const radius = (v = state.vergence) => F / stops[state.stop] / 2 * Math.abs(v - state.focus);  // radians
const metres = v => v < 1e-4 ? "infinity" : 1 / v < 100 ? `${(1 / v).toPrecision(3)} m` : `${Math.round(1 / v)} m`;
const both = v => `${metres(v)} (${v.toFixed(2)} D)`;
let vergences;  // of every pixel, once unpacked

function tell() {
  const diameter = F / stops[state.stop], v0 = F / (1 - F * state.focus), f = 2 * stops[state.stop], angle = radius();
  const sigma = angle * v0, nearer = state.vergence > state.focus;
  const distance = F * v0 / (v0 - F + (nearer ? 1 : -1) * sigma * f);
  const aperture = `f/${stops[state.stop]} (${(1e3 * diameter).toFixed(1)} mm)`;
  const texts = {
    "aperture-is": aperture, "focus-is": both(state.focus), "distance-is": both(state.vergence), sign: nearer ? "+" : "−",
    F: `${(1e3 * F).toFixed(0)} mm`, v0: `${(1e3 * v0).toFixed(2)} mm`, f: f.toFixed(2), sigma: `${(1e6 * sigma).toFixed(0)} µm`,
    D: Math.abs(distance) < 1e4 ? metres(1 / distance) : "infinity",
    angle: `${(60 * 180 / Math.PI * angle).toFixed(1)} arcmin`, pixels: `${(angle / pixelAngle).toFixed(1)} pixels` };
  for (const [id, text] of Object.entries(texts)) $(id).textContent = text;
  for (const [id, value, text] of [["aperture", state.stop, aperture], ["focus", sliderOf(state.focus), both(state.focus)],
    ["distance", sliderOf(state.vergence), both(state.vergence)]]) {
    $(id).value = value;
    $(id).setAttribute("aria-valuetext", text);
  }
  $("over").innerHTML = !state.lamp ? "" : [["#000", 3], ["#ffd400", 1.4]].map(([colour, wide]) =>
    `<circle cx="${state.x + 0.5}" cy="${state.y + 0.5}" r="${Math.max(angle / pixelAngle, 0.5)}" fill="none" stroke="${colour}" stroke-width="${wide * w / 800}"/>`).join("");
  graph();
}

function graph() {
  const X = v => 40 + 310 * (nearest - v) / (nearest - farthest), top = 60 * 180 / Math.PI * F / stops[0] / 2 * span * 1.05;
  const Y = r => 150 - 135 * Math.min(60 * 180 / Math.PI * r / top, 1.05);
  const line = [nearest, state.focus, farthest].map(v => `${X(v)},${Y(radius(v))}`).join(" ");
  const ticks = [0.3, 0.4, 0.5, 0.6, 0.8, 1, 1.5, 2, 3, 5, 10, Infinity].map(d => 1 / d).filter(v => v <= nearest && v >= farthest);
  let last = -Infinity, marks = "";
  for (const v of ticks) {
    if (X(v) - last < 26) continue;
    last = X(v);
    marks += `<line x1="${last}" x2="${last}" y1="150" y2="155" stroke="var(--line)"/><text x="${last}" y="168" text-anchor="middle">${v ? +(1 / v).toPrecision(2) : "∞"}</text>`;
  }
  const most = 4, step = [.1, .2, .5, 1, 2, 5, 10, 20, 50, 100].find(s => top / s <= most) ?? top / 2;
  for (let r = 0; r <= top; r += step) {
    const y = Y(r * Math.PI / 10800);
    marks += `<line x1="36" x2="40" y1="${y}" y2="${y}" stroke="var(--line)"/><text x="33" y="${y + 4}" text-anchor="end">${+r.toPrecision(2)}</text>`;
  }
  $("graph").innerHTML = `<path d="M40 12V150H350" fill="none" stroke="var(--line)"/>${marks}
    <text x="195" y="186" text-anchor="middle">distance in metres, evenly spaced in dioptres</text><text x="46" y="10">radius of the disc, arcmin</text>
    <polyline points="${line}" fill="none" stroke="var(--accent)" stroke-width="2.5"/>
    <circle cx="${X(state.vergence)}" cy="${Y(radius())}" r="5.5" fill="var(--point)" stroke="var(--panel)" stroke-width="1.5"/>`;
}

/* --- Drawing ---------------------------------------------------------------------------------------------------- */

const canvas = $("picture");
canvas.width = w; canvas.height = h;
$("over").setAttribute("viewBox", `0 0 ${w} ${h}`);
let view, series = [], wanted = true, frames = [], drawn = 0;

function change() { wanted = true; tell(); }

function next(now) {
  if (sweeping) {
    state.focus = (low + high) / 2 + span / 2 * Math.sin((now - sweeping) / 700);
    change();
  }
  if (wanted && series[state.stop]) {
    wanted = false;
    const lamp = state.lamp && { x: state.x, y: state.y, radius: radius() / pixelAngle, light: GLOW };
    view.draw(series[state.stop], state.focus, lamp || null);
    frames = frames.filter(one => now - one < 1000).concat(now);
    drawn += 1;
    const rate = frames.length > 1 ? (frames.length - 1) / (now - frames[0]) * 1000 : 0;
    $("speed").textContent = sweeping && rate ? `${rate.toFixed(0)} frames a second.` : "Drawn by WebGL, one draw a frame.";
    window.blurPage.last = { rate };
  }
  requestAnimationFrame(next);
}

async function begin() {
  const packed = Uint8Array.from(atob(FACTS.depth), c => c.charCodeAt(0));
  const bytes = await new Response(new Blob([packed]).stream().pipeThrough(new DecompressionStream("deflate"))).arrayBuffer();
  vergences = Float32Array.from(new Uint16Array(bytes), level => low + span * level / 65535);
  goTo(state.x, state.y);
  view = new FocusView(canvas, FACTS.shaders);
  for (const [number, one] of FACTS.series.entries()) series[number] = await view.load(one);
  change();
}

/* --- Controls --------------------------------------------------------------------------------------------------- */

let sweeping = 0;
function goTo(x, y) {
  state.x = Math.max(0, Math.min(w - 1, x)); state.y = Math.max(0, Math.min(h - 1, y));
  if (vergences) state.vergence = vergences[state.y * w + state.x];
  change();
}
function focusThere() { stopSweep(); state.focus = state.vergence; change(); }
function stopSweep() { sweeping = 0; $("sweep").setAttribute("aria-pressed", "false"); }
$("aperture").max = stops.length - 1;
$("aperture").oninput = event => { state.stop = +event.target.value; change(); };
$("focus").oninput = event => { stopSweep(); state.focus = vergenceOf(+event.target.value); change(); };
$("distance").oninput = event => { state.vergence = vergenceOf(+event.target.value); change(); };
$("lamp").onchange = event => { state.lamp = event.target.checked; change(); };
$("there").onclick = focusThere;
$("sweep").onclick = () => {
  if (sweeping) { stopSweep(); return; }
  sweeping = performance.now(); frames = [];
  $("sweep").setAttribute("aria-pressed", "true");
};
const placeOf = event => [Math.floor(event.offsetX / canvas.clientWidth * w), Math.floor(event.offsetY / canvas.clientHeight * h)];
canvas.onclick = event => goTo(...placeOf(event));
canvas.ondblclick = focusThere;
canvas.onkeydown = event => {
  const far = event.shiftKey ? 20 : 4, step = { ArrowLeft: [-far, 0], ArrowRight: [far, 0], ArrowUp: [0, -far], ArrowDown: [0, far] }[event.key];
  if (step) goTo(state.x + step[0], state.y + step[1]);
  else if (event.key === "Enter") focusThere();
  else return;
  event.preventDefault();
};
window.blurPage = { state, change, stops, drawn: () => drawn, settled: () => !wanted && drawn > 0 && series.length === stops.length };
change();
begin().catch(error => { $("speed").textContent = `This browser cannot draw it: ${error.message}`; });
requestAnimationFrame(next);
