// Whether a study can be shown on this device at all: known before the participant takes part.

const [WIDE, HIGH] = [640, 480]; // CSS pixels of a window, beside what pictures need

function drawsCubes() {
  const gl = document.createElement("canvas").getContext("webgl2");
  const draws = Boolean(gl?.getExtension("EXT_color_buffer_float"));
  gl?.getExtension("WEBGL_lose_context")?.loseContext();
  return draws;
}

// Name of the text that says what is missing, and its values; null where the study can be shown.
export function missing({ dark, refocuses, ...study }) {
  const sides = [screen.width, screen.height].sort((a, b) => b - a);
  const [width, height] = smallest(study);
  if (sides[0] < width || sides[1] < height) return ["web.needs_screen", { width, height }];
  if (refocuses && !document.createElement("canvas").getContext("webgl2")) return ["web.needs_webgl", {}];
  if (dark && !drawsCubes()) return ["web.needs_graphics", {}];
  return null;
}

// CSS pixels of the smallest screen that the design allows, the longer side first.
export const smallest = ({ smallest_screen }) => (smallest_screen?.length ? smallest_screen : [WIDE, HIGH]);

// Of a plugin that waits for a window of that size; a phone has to be held across: upright it is narrower than a bank
// card, and than what lies between the eye's centre and its blind spot.
export function smallestWindow(study, words) {
  const [minimum_width, minimum_height] = smallest(study);
  return { minimum_width, minimum_height, window_resize_message: () => words(onlyTouch() ? "web.across" : "web.enlarge") };
}

// Nothing but a finger to point with: such a device may have no keyboard either.
export const onlyTouch = () => !matchMedia("(any-pointer: fine)").matches;

// Whether a keyboard is needed that may not be there: designs that allow small screens are answered by touch as well.
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
