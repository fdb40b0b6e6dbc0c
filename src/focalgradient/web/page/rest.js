// A break of a minimum duration: `button` counts down the seconds, with the text of `left(seconds)`.

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
