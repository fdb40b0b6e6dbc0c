// The tone that ends a look at the real world, as in the laboratory.

const HERTZ = 880;
const SECONDS = 0.3;
const RAMP_S = 0.01; // onset and offset, which prevent clicks

export function tone() {
  const context = new AudioContext();
  const [source, gain, now] = [context.createOscillator(), context.createGain(), context.currentTime];
  source.frequency.value = HERTZ;
  gain.gain.setValueAtTime(0, now);
  gain.gain.linearRampToValueAtTime(1, now + RAMP_S);
  gain.gain.setValueAtTime(1, now + SECONDS - RAMP_S);
  gain.gain.linearRampToValueAtTime(0, now + SECONDS);
  source.connect(gain).connect(context.destination);
  source.start(now);
  source.stop(now + SECONDS);
  source.onended = () => context.close();
}
