// A break that can be left after so many seconds at the soonest: `button` counts them down, as `left(seconds)` says.

export function rest(button, seconds, left) {
  const label = button.innerHTML;
  const end = performance.now() + 1000 * seconds;
  button.disabled = true;
  const tick = () => {
    const more = Math.ceil((end - performance.now()) / 1000);
    if (more > 0) {
      button.textContent = left(more);
      return setTimeout(tick, 200);
    }
    button.innerHTML = label;
    button.disabled = false;
    button.focus();
  };
  tick();
}
