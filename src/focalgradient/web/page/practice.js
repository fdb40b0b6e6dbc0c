// Practice that is repeated until its answers are right, as in the laboratory; what was answered in it is kept.

// Seconds for which one key was held, and no other.
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

// Whether an answer is right: `want` is {below}, {above} or {shape, share}; null where nothing is right or wrong.
export function isRight(want, answer, keys) {
  if (!want) return null;
  if (want.below !== undefined) return answer.rating < want.below;
  if (want.above !== undefined) return answer.rating > want.above;
  const seconds = answer.trial_duration;
  return heldAlone(answer.presses, keys[want.shape], seconds) >= want.share * seconds;
}

export class Practice {
  // Of the session: `practice` {share, rounds} and `keys`; `count` trials are practised.
  constructor({ practice, keys }, count) {
    Object.assign(this, { ...practice, keys, count, answers: [], found: [], repeat: false });
  }

  // An answer in practice; whether it is one of a repetition, which is no trial of the list.
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

  // What there is to record of it, once.
  taken() {
    return this.found.splice(0);
  }
}
