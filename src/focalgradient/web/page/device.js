// Whether a study can be shown on this device at all: known before the participant takes part.

const [WIDE, HIGH] = [640, 480]; // CSS pixels of a window, beside what pictures need

function drawsCubes() {
  const gl = document.createElement("canvas").getContext("webgl2");
  const draws = Boolean(gl?.getExtension("EXT_color_buffer_float"));
  gl?.getExtension("WEBGL_lose_context")?.loseContext();
  return draws;
}

// Name of the text that says what is missing, and its values; null where the study can be shown.
export function missing({ dark }) {
  const sides = [screen.width, screen.height].sort((a, b) => b - a);
  if (sides[0] < WIDE || sides[1] < HIGH) return ["web.needs_screen", { width: WIDE, height: HIGH }];
  if (dark && !drawsCubes()) return ["web.needs_graphics", {}];
  return null;
}

// Nothing but a finger to point with: such a device may have no keyboard either.
export const mayLackKeys = () => !matchMedia("(any-pointer: fine)").matches;

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
