// Touch-only devices: touches replace the mouse and the space bar in plugins.

const asMouse = { touchstart: "mousedown", touchmove: "mousemove", touchend: "mouseup" };

// The drawn card is dragged by its corner; a touch beside the red ball acts as the space bar, unless a dialog is open.
// Returns a function that ends this.
export function touching() {
  const listen = (event) => {
    const [touch] = event.changedTouches;
    const target = event.target;
    if (target.closest?.("#jspsych-resize-handle")) {
      const place = { clientX: touch.clientX, clientY: touch.clientY, pageX: touch.pageX, pageY: touch.pageY };
      target.dispatchEvent(new MouseEvent(asMouse[event.type], { ...place, bubbles: true, cancelable: true }));
      event.preventDefault();
    } else if (event.type === "touchstart" && document.querySelector("html:not(:has(dialog)) #virtual-chinrest-circle")) {
      event.preventDefault();
      for (const kind of ["keydown", "keyup"]) {
        document.getElementById("stage").dispatchEvent(new KeyboardEvent(kind, { key: " ", code: "Space", bubbles: true }));
      }
    }
  };
  for (const kind of Object.keys(asMouse)) addEventListener(kind, listen, { passive: false });
  return () => Object.keys(asMouse).forEach((kind) => removeEventListener(kind, listen));
}
