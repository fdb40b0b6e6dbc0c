// A study without a server of its own. The server's work is done here: trial lists made in advance are assigned, and
// responses stay in the browser's database until the platform that shows the page has stored them.

import { asked, Refused } from "./outbox.js";
import { csv, platforms } from "./platforms.js";
import { judged } from "./practice.js";

const FORMAT = 1; // version of the record format
const WAIT_MS = 3000; // before a delivery is retried

const pause = (milliseconds) => new Promise((resolve) => setTimeout(resolve, milliseconds));

async function fetched(path) {
  const response = await fetch(path, { cache: "no-cache" });
  if (!response.ok) throw new Error(`${path}: ${response.status}`);
  return response.json();
}

export class Exported {
  static async open({ platform, experiment }) {
    const study = new Exported();
    study.study = await fetched("study.json");
    study.platform = await platforms[platform]({ experiment });
    const request = indexedDB.open("focalgradient-exported", 1);
    request.onupgradeneeded = () => {
      request.result.createObjectStore("sessions", { keyPath: "token" });
      request.result.createObjectStore("lines");
    };
    study.database = await asked(request);
    // A page that is left sends what it has, without waiting.
    addEventListener("visibilitychange", () => document.hidden && study.flush(true).catch(() => {}));
    return study;
  }

  store(name) {
    return this.database.transaction(name).objectStore(name);
  }

  // A list is assigned once the participant has agreed.
  known = false;

  async opening() {
    return this.study.opening;
  }

  // Return the name of the unfinished session of this browser, or of a new one.
  async join() {
    const place = `focalgradient ${this.study.id}`;
    const wanted = this.wanted();
    const kept = await asked(this.store("sessions").get(localStorage.getItem(place) ?? ""));
    const goesOn = kept && !kept.finished && (!wanted || wanted === kept.participant);
    this.session = goesOn ? kept : { token: crypto.randomUUID(), participant: wanted ?? (await this.newcomer()), lines: 0, done: 0 };
    this.list = await fetched(`lists/${this.session.participant}.json`);
    if (!goesOn) await this.put(this.session);
    localStorage.setItem(place, this.session.token);
    this.owned = await this.own();
    if (goesOn) this.session = await asked(this.store("sessions").get(kept.token)); // in the state that its last owner left
    return this.session.token;
  }

  // The list that the link names, by label or by number.
  wanted() {
    const given = this.platform.parameters.participant;
    if (given === undefined) return null;
    const { labels } = this.study;
    const found = labels.find((label) => label === given || (/^\d+$/.test(given) && Number(label) === Number(given)));
    if (!found) throw new Error(`There is no list for participant ${given}: give ${labels[0]} to ${labels.at(-1)}.`);
    return found;
  }

  async newcomer() {
    const { labels } = this.study;
    return this.platform.choose ? this.platform.choose(labels) : labels[Math.floor(Math.random() * labels.length)];
  }

  // Whether this tab alone owns the session; a reloaded page waits until the previous one has closed.
  async own() {
    if (!navigator.locks) return true;
    const once = () =>
      new Promise((resolve) =>
        navigator.locks.request(`focalgradient ${this.session.token}`, { ifAvailable: true }, (lock) => {
          resolve(Boolean(lock));
          return lock && new Promise(() => {});
        }),
      );
    return (await once()) || (await pause(1000), once());
  }

  // Implements the server's routes.
  async post(path, { token, tab, ...message }) {
    const act = path.split("/").at(-1);
    if (!["state", "begin", "next", "judge", "answer", "expose", "here", "finish"].includes(act)) throw new Error(act);
    return this[act](message);
  }

  leave() {
    this.flush(true).catch(() => {});
  }

  async here() {
    return {};
  }

  async state() {
    if (!this.owned && (this.owned = await this.own())) {
      this.session = await asked(this.store("sessions").get(this.session.token)); // in the state that the other window left
    }
    const { done, lines } = this.session;
    const status = this.owned ? (done === this.list.trials.length ? "complete" : lines ? "begun" : "new") : "busy";
    return { ...this.study.opening, status, done };
  }

  async begin(sitting) {
    const { study, list, session } = this;
    const { participant } = session;
    const about = { participant, design: study.design, stimuli: study.stimuli, list: list.sha256, study: study.id };
    const event = session.lines ? { kind: "resumed" } : { kind: "begun", ...about };
    await this.add({ ...event, platform: this.platform.name, sitting });
    await this.flush(true).catch((error) => {
      if (error instanceof Refused) throw error; // report it now rather than after the session
    });
    const { practice_round = 1, done } = session; // above 1 if the page was reloaded between two rounds of practice
    const trials = list.trials.slice(practice_round > 1 ? 0 : done).map(({ phase, trial }) => ({ phase, trial }));
    this.practised = trials.filter(({ phase }) => phase === "practice").length;
    return { start_ms: sitting.now_ms, ...list.session, trials, practice_round };
  }

  // As from the server, without tokens.
  async next({ phase, trial }) {
    const first = this.list.trials.findIndex((one) => one.phase === phase && one.trial === trial);
    return { trials: this.list.trials.slice(first, first + 2) };
  }

  // Results of whole rounds are stored until they are recorded with the first response of the main trials.
  async judge(given) {
    const { again, ...found } = judged(given, this.list.trials, this.list.session);
    const { round, answers } = given;
    const { rounds = [] } = this.session;
    if (answers.length >= this.practised && !rounds.some((one) => one.round === round)) {
      const { right, of, passed } = found;
      const result = { round, right, of, passed, again: round > 1 ? answers : [] };
      await this.put({ ...this.session, rounds: [...rounds, result], practice_round: again ? round + 1 : 1 });
    }
    return { ...found, again };
  }

  async expose(shown) {
    await this.add({ kind: "shown", shown });
    return { recorded: true };
  }

  async answer(given) {
    const { done } = this.session;
    const place = this.list.trials.findIndex(({ phase, trial }) => phase === given.phase && trial === given.trial);
    if (place < 0 || place > done) throw new Refused(409, { error: `Trial ${given.trial} (${given.phase}) is not the next trial.` });
    if (place < done) return { recorded: true, again: true, done };
    const { rounds = [] } = this.session;
    const practice = given.phase === "main" && rounds.length ? { practice: rounds } : {};
    await this.add({ kind: "answer", given: { ...given, ...practice } }, { done: done + 1, rounds: practice.practice ? [] : rounds });
    this.flush().catch(() => {});
    return { recorded: true, done: done + 1 };
  }

  // All records must be delivered before the end; if the platform rejects them, they are offered as a file.
  async finish() {
    for (;;) {
      try {
        await this.flush(true);
        break;
      } catch (error) {
        if (error instanceof Refused) return this.offered(error);
        this.waiting(await asked(this.store("lines").count(this.range())));
        await pause(WAIT_MS);
      }
    }
    this.waiting(0);
    await this.put({ ...this.session, finished: true });
    const kept = this.platform.kept ?? [];
    const { closing } = this.list.session;
    return { completion: this.study.completion, done: this.session.done, closing, file: kept.length ? this.file(kept) : null };
  }

  async offered(error) {
    return { completion: null, done: this.session.done, error: error.message, file: this.file(await this.pending()) };
  }

  file(lines) {
    const address = URL.createObjectURL(new Blob([csv(lines)], { type: "text/csv" }));
    return { address, name: `${this.name(0, lines.length - 1)}.csv` };
  }

  async end() {
    await this.platform.end(this.study.completion);
  }

  range() {
    return IDBKeyRange.bound(`${this.session.token}/`, `${this.session.token}/\uffff`);
  }

  pending() {
    return asked(this.store("lines").getAll(this.range()));
  }

  name(first, last) {
    return `${this.session.participant}_${this.session.token}_${first}-${last}`;
  }

  async put(session) {
    this.session = session;
    await this.written((transaction) => transaction.objectStore("sessions").put(session));
  }

  // Store a record and the session's new state, both or neither.
  async add(content, changed = {}) {
    const { token, lines } = this.session;
    const line = JSON.stringify({
      focalgradient: FORMAT,
      session: token,
      line: lines,
      time: new Date().toISOString(),
      ...content,
    });
    const session = { ...this.session, lines: lines + 1, ...changed };
    await this.written((transaction) => {
      transaction.objectStore("lines").put(line, `${token}/${String(lines).padStart(6, "0")}`);
      transaction.objectStore("sessions").put(session);
    });
    this.session = session;
  }

  written(act) {
    const transaction = this.database.transaction(["sessions", "lines"], "readwrite", { durability: "strict" });
    act(transaction);
    return new Promise((resolve, reject) => {
      transaction.oncomplete = resolve;
      transaction.onerror = transaction.onabort = () => reject(transaction.error);
    });
  }

  // Deliver stored records: once a batch is complete, or all of them; one delivery at a time.
  flush(all = false) {
    this.flushing = (this.flushing ?? Promise.resolve()).catch(() => {}).then(() => this.#flush(all));
    return this.flushing;
  }

  async #flush(all) {
    if (!this.session || !this.owned) return;
    const lines = await this.pending();
    if (!lines.length || (!all && lines.length < this.platform.batch)) return;
    const first = JSON.parse(lines[0]).line;
    const last = first + lines.length - 1;
    await this.platform.send(lines, this.name(first, last));
    const sent = `${this.session.token}/${String(last).padStart(6, "0")}`;
    await this.written((transaction) => transaction.objectStore("lines").delete(IDBKeyRange.bound(this.range().lower, sent)));
  }
}
