// Practice repeated until its criterion is met, as in the laboratory; its responses are kept.

// Time in s for which only the given key was held.
export function heldAlone(presses, key, seconds) {
  const down = new Set();
  let total = 0;
  let before = 0;
  for (const [time, name, pressed] of [...presses, [seconds, "", false]]) {
    const now = Math.min(Math.max(time, 0), seconds);
    if (down.size === 1 && down.has(key)) total += now - before;
    before = now;
    pressed ? down.add(name) : down.delete(name);
  }
  return total;
}

// Whether a response is correct: `want` is {below}, {above} or {shape, share}; null if there is no correct response.
export function isRight(want, answer, keys) {
  if (!want) return null;
  if (want.below !== undefined) return answer.rating < want.below;
  if (want.above !== undefined) return answer.rating > want.above;
  const seconds = answer.trial_duration;
  return heldAlone(answer.presses, keys[want.shape], seconds) >= want.share * seconds;
}

export class Practice {
  // Of the session: `practice` {share, rounds} and `keys`; `count`: number of practice trials.
  constructor({ practice, keys }, count) {
    Object.assign(this, { ...practice, keys, count, answers: [], found: [], repeat: false });
  }

  // Note a practice response; return whether it belongs to a repetition, which is not a trial of the list.
  note(trial, answer) {
    const repeated = this.found.length > 0;
    const { phase, trial: number, right } = trial;
    this.answers.push({ phase, trial: number, right: isRight(right, answer, this.keys), answer: { ...answer } });
    if (this.answers.length === this.count) this.#judge();
    return repeated;
  }

  #judge() {
    const known = this.answers.filter(({ right }) => right !== null);
    const right = known.filter((one) => one.right).length;
    const round = this.found.length + 1;
    const passed = right >= this.share * known.length;
    const again = round === 1 ? [] : this.answers.map(({ phase, trial, answer }) => ({ phase, trial, answer }));
    this.found.push({ round, right, of: known.length, passed, again });
    this.answers = [];
    this.repeat = !passed && round < this.rounds;
  }

  // The round of practice that a trial belongs to; 1 for the main trials.
  round(phase) {
    return phase === "practice" ? this.found.length + 1 : 1;
  }

  // Return the results to be recorded, once.
  taken() {
    return this.found.splice(0);
  }
}
