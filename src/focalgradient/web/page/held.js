// Keys held while pictures are shown: pressed and released on a keyboard, or by touch on their labels.

// Names that designs give to keys, by code or key of the browser's events.
const KEYS = {
  ArrowLeft: "left",
  ArrowRight: "right",
  ArrowUp: "up",
  ArrowDown: "down",
  " ": "space",
  Enter: "return",
  ShiftLeft: "lshift",
  ShiftRight: "rshift",
  ControlLeft: "lctrl",
  ControlRight: "rctrl",
};

// Labels of held keys, from left to right; as buttons they can be held themselves.
export function labelled({ keys, names, labels }, escaped, tag = "span") {
  const parts = keys.map((key, n) => `<${tag} class="held" data-key="${escaped(key)}" tabindex="-1"><b>${escaped(names[n])}</b> ${escaped(labels[n])}</${tag}>`);
  return parts.join("");
}

// Presses and releases of keys from now on, with time stamps on the clock of performance.now().
export class Presses {
  found = [];
  touches = new Map(); // key by pointer

  constructor(keys) {
    const press = (event, key, down) => keys.includes(key) && this.found.push([event.timeStamp, key, down]);
    const keyed = (event) => {
      if (!event.repeat) press(event, KEYS[event.code] ?? KEYS[event.key] ?? event.key.toLowerCase(), event.type === "keydown");
    };
    const touched = (event) => {
      const key = event.target.closest?.("button.held")?.dataset.key;
      if (!key) return;
      event.preventDefault();
      this.touches.set(event.pointerId, key);
      press(event, key, true);
    };
    const released = (event) => {
      if (this.touches.has(event.pointerId)) press(event, this.touches.get(event.pointerId), false);
      this.touches.delete(event.pointerId);
    };
    this.listeners = { keydown: keyed, keyup: keyed, pointerdown: touched, pointerup: released, pointercancel: released };
    for (const [kind, listener] of Object.entries(this.listeners)) addEventListener(kind, listener, true);
  }

  // Stop listening, and return presses and releases as [ms, key, is pressed].
  end() {
    for (const [kind, listener] of Object.entries(this.listeners)) removeEventListener(kind, listener, true);
    return this.found;
  }
}
