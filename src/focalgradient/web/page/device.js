// Test of whether this device can show a study, before the participant takes part.

const [WIDE, HIGH] = [640, 480]; // minimum size of a window in CSS pixels, apart from the pictures' requirements

// Name of the text that states the missing capability, with its values; null if the study can be shown.
export function missing({ refocuses, ...study }) {
  const sides = [screen.width, screen.height].sort((a, b) => b - a);
  const [width, height] = smallest(study);
  if (sides[0] < width || sides[1] < height) return ["web.needs_screen", { width, height }];
  if (refocuses && !document.createElement("canvas").getContext("webgl2")) return ["web.needs_webgl", {}];
  return null;
}

// Smallest screen that the design allows, in CSS pixels, longer side first.
export const smallest = ({ smallest_screen }) => (smallest_screen?.length ? smallest_screen : [WIDE, HIGH]);

let waiting = null;

// Wait until the window has that size; `words` gives the text. A phone must be held in landscape format: upright it is
// narrower than a bank card, and than the distance from the fovea's to the blind spot's image.
export const largeEnough = (study, words) => (waiting ??= enlarged(study, words).finally(() => (waiting = null)));

async function enlarged(study, words) {
  const [width, height] = smallest(study);
  const fits = () => innerWidth >= width && innerHeight >= height;
  if (fits()) return;
  const textContent = words(onlyTouch() ? "web.across" : "web.enlarge");
  const said = Object.assign(document.createElement("dialog"), { className: "page", textContent });
  document.documentElement.append(said);
  said.showModal();
  while (!fits()) await new Promise((resolve) => addEventListener("resize", resolve, { once: true }));
  said.remove();
}

// Whether the only pointing device is a finger: such a device may also lack a keyboard.
export const onlyTouch = () => !matchMedia("(any-pointer: fine)").matches;

// Whether a required keyboard may be missing: designs that allow small screens can also be answered by touch.
export const mayLackKeys = ({ smallest_screen }) => onlyTouch() && !smallest_screen?.length;

export function spacePressed() {
  return new Promise((resolve) => {
    addEventListener("keydown", function listen(event) {
      if (event.key !== " ") return;
      event.preventDefault();
      removeEventListener("keydown", listen);
      resolve();
    });
  });
}
