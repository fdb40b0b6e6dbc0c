// Practice repeated until the server's criterion is met, as in the laboratory; its responses are kept.

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

// Whether a response is correct: `want` is {below}, {above} or {key, share}; null if there is no correct response.
export function isRight(want, answer) {
  if (!want) return null;
  if (want.below !== undefined) return answer.rating < want.below;
  if (want.above !== undefined) return answer.rating > want.above;
  const seconds = answer.trial_duration;
  return heldAlone(answer.presses, want.key, seconds) >= want.share * seconds;
}

// The server's judgement of a round so far, for a page without a server: `entries` are the trials of its list.
export function judged({ round, answers }, entries, { practice_right, practice_rounds, again: page }) {
  let share = null;
  const known = [];
  for (const { trial: number, answer } of answers) {
    const { right: want, interval } = entries.find(({ phase, trial }) => phase === "practice" && trial === number);
    const rating = answer.chosen === undefined ? answer.rating : Number(answer.chosen === interval);
    const right = isRight(want, { ...answer, rating });
    if (right !== null) known.push(right);
    if (want?.key) share = Math.round((100 * heldAlone(answer.presses, want.key, answer.trial_duration)) / answer.trial_duration);
  }
  const right = known.filter(Boolean).length;
  const passed = right >= practice_right * known.length;
  return { right, of: known.length, passed, again: !passed && round < practice_rounds, share, page };
}

export class Practice {
  answers = []; // of this round
  repeat = false;
  page = null; // before the next round
  token = ""; // for the main trials

  // `judge` asks for the judgement of a round's responses so far, and records it; `count`: number of practice trials;
  // `number`: that of the first round.
  constructor(judge, count, number) {
    Object.assign(this, { judge, count, number });
  }

  // Judge a practice response; return the share of the time for which a cube's key was held.
  async judged({ phase, trial }, answer) {
    const answers = [...this.answers, { phase, trial, answer: { ...answer } }];
    return this.judge({ round: this.number, answers });
  }

  // Note a practice response; return whether it belongs to a repetition, which is not a trial of the list.
  async note({ phase, trial }, answer) {
    const repeated = this.number > 1;
    this.answers.push({ phase, trial, answer: { ...answer } });
    if (this.answers.length < this.count) return repeated;
    const { again, page = null, practice_token = "" } = await this.judge({ round: this.number, answers: this.answers });
    this.answers = [];
    this.number += 1;
    Object.assign(this, { repeat: again, page, token: practice_token });
    return repeated;
  }

  // The round of practice that a trial belongs to; 1 for the main trials.
  round(phase) {
    return phase === "practice" ? this.number : 1;
  }
}
