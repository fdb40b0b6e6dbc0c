// A participant's session in the browser: shows the trials that the server lists, and sends the responses.

import { initJsPsych } from "jspsych";
import Call from "@jspsych/plugin-call-function";
import Fullscreen from "@jspsych/plugin-fullscreen";
import Buttons from "@jspsych/plugin-html-button-response";
import AdjustedPlugin, { adjustedNode, loadSeries } from "./adjusted.js";
import { largeEnough, mayLackKeys, missing, onlyTouch, spacePressed } from "./device.js";
import { measurement } from "./distance.js";
import { exampleScale } from "./example.js";
import { Exported } from "./exported.js";
import FormPlugin from "./form.js";
import { ends, measureFrame } from "./frames.js";
import { gammaMatches } from "./gamma.js";
import { labelled } from "./held.js";
import { Network } from "./network.js";
import { significant } from "./numbers.js";
import { canStore, Outbox, Refused } from "./outbox.js";
import PicturePlugin, { access, load } from "./picture.js";
import { Practice } from "./practice.js";
import { question } from "./question.js";
import { Server } from "./server.js";
import { rest } from "./rest.js";
import { stopButton } from "./stopping.js";
import { escaped, filled, html, turned } from "./texts.js";
import { touching } from "./touch.js";

const BEAT_MS = 5000; // between two heartbeats, which tell the server that this tab still shows the session
const AWAY_MS = 600_000; // after which a reloaded page measures screen and distance again
const SOON = 2; // trials that are requested in advance

class Page {
  constructor(study) {
    this.study = study;
    this.shown = []; // events and texts shown, in order
    this.network = new Network((name, values) => (this.state ? this.words(name, values) : "…"));
  }

  // The device is checked and consent obtained before a new participant is counted.
  async join() {
    this.state = await this.network.until(() => this.study.opening());
    document.documentElement.lang = this.state.language;
    document.title = this.words("web.title");
    const lacks = missing(this.state);
    if (lacks) {
      this.say(this.words(...lacks));
      return false;
    }
    if (!(await canStore())) {
      this.say(this.words("web.needs_storage"));
      return false;
    }
    // The tab's identifier persists across reloads only.
    this.tab = sessionStorage.getItem("tab") ?? crypto.randomUUID();
    sessionStorage.setItem("tab", this.tab);
    if (mayLackKeys(this.state)) {
      this.say(this.words("web.needs_keyboard"));
      await spacePressed();
    }
    if (!this.study.known && !(await this.agreed())) return false;
    this.token = await this.study.join();
    if (this.study.withdraws) access.headers.Authorization = `Bearer ${this.token}`;
    this.outbox = new Outbox(this.token, this.tab, {
      post: (path, message) => this.study.post(path, message),
      waiting: (count) => this.network.waiting(count),
      refused: (error) => this.lost(error),
      // A restarted server accepts responses once the sitting is resumed, on the same clock.
      again: () => this.ask("/api/begin", this.begun()),
    });
    return true;
  }

  // Consent: the text is read page by page, and agreed to on the last page.
  async agreed() {
    const { consent } = this.state;
    const pages = this.consented || this.remembered().consent === consent?.sha256 ? [] : consent.pages;
    for (const [number, text] of pages.entries()) {
      this.shown.push(["consent", text]);
      const last = number === pages.length - 1;
      const labels = last ? [this.words("web.agree"), this.words("web.disagree")] : [this.words("web.go_on")];
      if ((await turned(text, labels)) === 0) continue;
      this.say(this.words("web.no_consent"));
      return false;
    }
    this.consented = true;
    return true;
  }

  // What this tab remembers of its session, so that a reloaded page does not ask again; a measurement of the screen only
  // for a short time, in which nobody has moved.
  remembered() {
    const { token, at, measured, ...kept } = JSON.parse(sessionStorage.getItem("session") ?? "{}");
    if (token !== this.token || !token) return {};
    return Math.abs(Date.now() - at) < AWAY_MS ? { ...kept, measured } : kept;
  }

  remember(values) {
    const kept = { ...this.remembered(), ...values, token: this.token, at: Date.now() };
    sessionStorage.setItem("session", JSON.stringify(kept));
  }

  words(name, values) {
    return filled(this.state.words[name] ?? name, values);
  }

  number(value) {
    return significant(value).replace(".", this.words("common.decimal"));
  }

  ask(path, message = {}) {
    return this.study.post(path, { token: this.token, tab: this.tab, ...message });
  }

  // As above, retried until there is a response.
  insist(path, message = () => ({})) {
    return this.network.until(() => this.ask(path, message()));
  }

  // Replaces all content: jsPsych can show nothing afterwards.
  say(text) {
    this.stopping?.remove();
    document.getElementById("stage").innerHTML = `<div class="page" role="status">${html(text)}</div>`;
  }

  async run() {
    if (!(await this.join())) return;
    await this.outbox.open();
    await this.alone();
    document.getElementById("stage").replaceChildren();
    if (this.state.status === "stopped") return this.say(this.words("web.stopped"));
    if (this.state.status === "complete") return this.finish();
    if (!(await this.agreed())) return;
    if (this.state.consent) this.remember({ consent: this.state.consent.sha256 });
    // Responses that an earlier page could not send belong to its sitting and clock: they are sent before the next
    // sitting.
    if (this.state.status === "begun") await this.outbox.send();
    this.beat = setInterval(() => {
      this.remember({});
      this.ask("/api/here").catch((error) => this.lost(error));
    }, BEAT_MS);
    addEventListener("pagehide", () => this.study.leave({ token: this.token, tab: this.tab }));
    await this.experiment();
    if (this.over) return;
    await this.outbox.send();
    await this.finish();
  }

  // Until the other window is closed or, if it crashed, the server has missed its heartbeats.
  async alone() {
    while ((this.state = await this.insist("/api/state")).status === "busy") {
      this.say(this.words("web.other_tab"));
      await new Promise((resolve) => setTimeout(resolve, BEAT_MS));
    }
  }

  // The session was stopped, or is open in another window; network failures are handled elsewhere.
  lost(error) {
    if (this.over || !(error instanceof Refused)) return;
    this.over = true;
    clearInterval(this.beat);
    this.jsPsych?.abortExperiment();
    const known = { 409: "web.other_tab", 404: "web.stopped", 410: "web.stopped" }[error.status] ?? "web.wrong";
    this.say(this.words(known, { reason: error.message }));
    if (error.answer?.busy) this.alone().then(() => location.reload());
  }

  // Not while a stimulus is shown.
  offerToStop() {
    const ways = [
      [this.words("web.go_on"), () => {}],
      [this.words("web.stop_keep"), () => this.stop(false)],
    ];
    if (this.study.withdraws) ways.push([this.words("web.stop_remove"), () => this.stop(true)]);
    return stopButton(this.words("web.stop"), html(this.words("web.stop_question")), ways);
  }

  // The participant ends the session, and has the responses kept or removed.
  async stop(remove) {
    this.over = true;
    clearInterval(this.beat);
    this.stopping.remove();
    this.jsPsych.abortExperiment();
    let text = this.words(remove ? "web.removed" : "web.kept");
    try {
      if (remove) {
        await this.insist("/api/withdraw").catch((error) => {
          if (error.status !== 404) throw error; // otherwise they were removed, but the acknowledgement was lost
        });
        await this.outbox.clear();
        sessionStorage.removeItem("session");
        this.study.forget(this.token);
      } else {
        await this.outbox.send();
        this.study.leave({ token: this.token, tab: this.tab });
      }
    } catch (error) {
      text = error.message; // the server's reason: the participant must know that the responses have not been removed
    }
    if (document.fullscreenElement) await document.exitFullscreen();
    this.say(text);
  }

  async finish() {
    const result = await this.insist("/api/finish");
    if (document.fullscreenElement) await document.exitFullscreen();
    this.stopping?.remove();
    for (const { event, text } of result.error ? [] : result.closing) {
      this.shown.push([event, text]);
      await turned(text, [this.words("web.go_on")]);
    }
    this.shown.push(["thanks", this.words("session.thanks")]);
    this.say(result.error ?? this.words("session.thanks"));
    const page = document.getElementById("stage").firstChild;
    page.id = result.error ? "undelivered" : "complete";
    const link = (id, text, more) => page.append(Object.assign(document.createElement("a"), { id, textContent: text, ...more }));
    if (result.completion) link("completion", this.words("web.completion"), { href: result.completion });
    if (result.file) link("file", result.file.name, { href: result.file.address, download: result.file.name });
    if (!result.error) await this.study.end();
  }

  async experiment() {
    this.jsPsych = initJsPsych({
      display_element: "stage",
      on_close: () => {},
      on_trial_start: ({ type }) => {
        const shows = type === PicturePlugin;
        if (this.stopping) this.stopping.hidden = shows || type === AdjustedPlugin;
        document.body.classList.toggle("watching", shows || type === Call); // hide the pointer until the question
      },
    });
    const { trials: left, practice_round = 1, again, ...session } = await this.prepared();
    this.session = session;
    // Only now: the blind spot is measured beside a black square on white.
    document.body.classList.toggle("dark", this.state.dark);
    Object.assign(this, { left, began: performance.now(), stopping: this.offerToStop() });
    const practised = left.filter(({ phase }) => phase === "practice");
    this.practice = new Practice((round) => this.insist("/api/judge", () => round), practised.length, practice_round);
    await this.played(this.steps([...session.opening, ...(practice_round > 1 ? [again] : [])]));
    for (const [n, trial] of left.entries()) {
      await this.given(trial);
      if (this.over) return;
      await this.played([...this.steps(n ? trial.before : trial.first, trial), ...this.turn(trial)]);
      if (trial !== practised.at(-1)) continue;
      while (this.practice.repeat && !this.over) {
        await this.played([...this.steps([this.practice.page].filter(Boolean)), ...practised.flatMap((one) => this.turn(one))]);
      }
    }
    document.body.classList.remove("watching");
  }

  async played(timeline) {
    if (timeline.length && !this.over) await this.jsPsych.run(timeline);
  }

  // Form, screen and distance; then the session is begun or resumed on the server.
  async prepared() {
    const about = {};
    const words = (name, values) => this.words(name, values);
    const large = () => largeEnough(this.state, words);
    const timeline = [{ type: Call, async: true, func: (done) => large().then(done) }];
    if (this.state.status === "new" && this.state.ask.length) {
      const on_load = () => this.shown.push(["form", this.words("web.about")]);
      timeline.push({ type: FormPlugin, ask: this.state.ask, words, on_load, on_finish: (data) => (about.form = data.about) });
    }
    timeline.push({
      type: Fullscreen,
      fullscreen_mode: true,
      message: `<div class="page">${html(this.words("web.full_screen"))}</div>`,
      button_label: this.words("web.go_on"),
    });
    const untouched = onlyTouch() ? touching() : () => {};
    const pixels = [screen.width, screen.height].map((side) => Math.round(side * devicePixelRatio));
    const matches = [];
    const { measured } = this.remembered();
    const isSame = measured?.pixel_ratio === devicePixelRatio && String(measured?.screen_px) === String(pixels);
    if (!isSame) timeline.push(measurement(about, words, html, large));
    if (!isSame && this.state.gamma) timeline.push(gammaMatches(matches, words, html));
    timeline.push({ type: Call, async: true, func: (done) => measureFrame().then((frame) => done((this.frame = frame))) });
    await this.jsPsych.run(timeline);
    untouched();
    const now = () => ({
      screen_px: pixels,
      pixel_ratio: devicePixelRatio,
      card_px: about.card_px,
      blind_spot_px: about.pressed.map((place) => Math.round(10 * place) / 10),
      gamma_matches: matches,
    });
    const measurements = isSame ? measured : now();
    this.remember({ measured: measurements });
    this.beginning = {
      ...measurements,
      consent: this.state.consent ? this.state.consent.sha256 : null,
      refresh_hz: this.frame && 1000 / this.frame,
      browser: navigator.userAgent,
      now_ms: performance.now(),
      about: about.form ?? {},
    };
    return this.insist("/api/begin", () => this.begun());
  }

  // Data that begin a sitting; their delay by the network determines when the page's clock began.
  begun() {
    return { ...this.beginning, waited_ms: Math.max(0, performance.now() - this.beginning.now_ms) };
  }

  // Screens of the pages before, between and after trials; `values` fill in the values known when they are shown.
  steps(steps, trial, values = () => ({ minutes: this.minutes(trial) })) {
    return steps.flatMap((step) => {
      const held = trial?.scale?.kind === "held" && step.event === "ready";
      const page = { ...this.page(step, values), prompt: held ? `<div class="foot">${labelled(trial.scale, escaped)}</div>` : null };
      if (!step.standard) return [page];
      const shown = [step.standard];
      return [this.fetching({ intervals: shown }), page, ...this.looks(shown), this.standard(step.standard)];
    });
  }

  page({ event, text, at, least_s }, values) {
    const example = at === undefined ? "" : exampleScale(this.session.scale, at, (value) => this.number(value));
    const shown = () => filled(text, values());
    return {
      type: Buttons,
      stimulus: () => `<div class="page ${example && "wide"}">${html(shown())}${example}</div>`,
      choices: [this.words("web.go_on")],
      on_load: () => {
        this.shown.push([event, text]);
        const button = document.querySelector("#jspsych-html-button-response-btngroup button");
        if (least_s) rest(button, least_s, (seconds) => this.words("session.rest_wait", { seconds }));
        else button.focus();
      },
    };
  }

  // The pages before looks at the real world.
  looks(intervals) {
    return intervals.flatMap(({ look }) => (look ? [this.page({ event: "ready", text: look.page }, () => ({}))] : []));
  }

  standard(interval) {
    const on_start = () => this.shown.push(["standard", ""]);
    return { ...this.picture([interval]), blank_seconds: 0, pause_seconds: 0, on_start };
  }

  // What a trial shows, with the token without which its response is refused; and the next few, so that the session
  // goes on while the network does not answer.
  async given(trial) {
    const place = this.left.indexOf(trial);
    const keep = ({ trials, trial_tokens = [] }) =>
      trials.forEach((one, n) => {
        const token = trial_tokens[n];
        Object.assign(this.left[place + n], one, token && { token });
        this.fetched(one).catch(() => {}); // in advance
      });
    const message = { phase: trial.phase, trial: trial.trial, practice_token: this.practice.token };
    try {
      if (!trial.lead) {
        await this.outbox.send();
        keep(await this.insist("/api/next", () => message));
      } else if (this.left[place + SOON] && !this.left[place + SOON].lead) {
        this.ask("/api/next", message).then(keep, () => {}); // without an answer it is asked again later and waited for
      }
    } catch (error) {
      this.lost(error);
    }
  }

  // Stimuli of a trial are fetched in advance, and shown in a window that is large enough.
  fetching(trial) {
    const ready = () => largeEnough(this.state, (name) => this.words(name));
    return { type: Call, async: true, func: (done) => this.fetched(trial).then(ready).then(done) };
  }

  // A trial with its pages, also in repeated practice.
  turn(trial) {
    const kept = {};
    let verdict = {};
    const judged = (done) => this.practice.judged(trial, kept).then((found) => done((verdict = found)), (error) => this.lost(error));
    const judging = trial.phase === "practice" && trial.after.length ? [{ type: Call, async: true, func: judged }] : [];
    const shown = trial.knob ? this.knobNodes(trial, kept) : this.pictureNodes(trial, kept);
    const after = [...this.further(trial, kept), ...judging, ...this.steps(trial.after, trial, () => verdict), this.sent(trial, kept)];
    return [this.fetching(trial), ...this.steps(trial.lead, trial), ...shown, ...after];
  }

  // Estimated minutes left from this trial on at the pace so far; at 10 s per trial if there is none yet.
  minutes(trial) {
    const main = this.left.filter((one) => one.phase === "main");
    const place = main.indexOf(trial);
    const each = place > 0 ? (performance.now() - this.began) / 1000 / place : 10;
    return Math.max(1, Math.round((each * (main.length - place)) / 60));
  }

  picture(intervals) {
    const { blank_s, pause_s, mark_radius_px } = this.session;
    return {
      type: PicturePlugin,
      intervals,
      blank_seconds: blank_s,
      pause_seconds: pause_s,
      mark_radius: mark_radius_px,
      frame: this.frame,
    };
  }

  // An exposure is stored before it begins, and sent like the responses: a page that is reloaded leaves it recorded.
  exposing(trial) {
    const { phase, trial: number } = trial;
    const kept = () => this.outbox.put({ phase, trial: number }, { exposure: crypto.randomUUID(), round: this.practice.round(phase) });
    return { type: Call, async: true, func: (done) => kept().then(done) };
  }

  pictureNodes(trial, kept) {
    const seconds = (ms) => (ms - this.session.start_ms) / 1000;
    const held = trial.scale.kind === "held";
    const picture = {
      ...this.picture(() => trial.intervals),
      ...(held ? { keys: trial.scale.keys, foot: labelled(trial.scale, escaped, "button") } : {}),
      on_start: () => this.shown.push(["trial", `${trial.phase} ${trial.trial}`]),
      on_finish: (data) => {
        const onset = data.shown.find(({ event }) => event !== "mark").stamps[0];
        kept.onset = seconds(onset);
        kept.frames = { shown: data.shown, ...data.lost };
        kept.dropped_frames = data.dropped_frames;
        if (!held) return;
        kept.presses = data.presses.map(([time, key, down]) => [(time - onset) / 1000, key, down]);
        kept.trial_duration = (data.shown.at(-1).stamps.at(-1) - onset) / 1000;
      },
    };
    const question = held ? [] : [this.question(trial, kept, (answer) => Object.assign(kept, answer))];
    return [...this.looks(trial.intervals), this.exposing(trial), picture, ...question];
  }

  knobNodes(trial, kept) {
    const keep = ({ onset_ms, ...answer }) => Object.assign(kept, answer, { onset: (onset_ms - this.session.start_ms) / 1000 });
    const on_start = () => this.shown.push(["trial", `${trial.phase} ${trial.trial}`]);
    const adjusted = adjustedNode(trial.knob, { escaped, practice: this.practised(trial), done: this.words("web.done"), frame: this.frame, keep });
    return [this.exposing(trial), { ...adjusted, on_start }];
  }

  // The design's additional questions; the response to a choice is 1 or 2.
  further(trial, kept) {
    return (trial.also ?? []).map(({ name, scale }) => {
      const value = ({ rating, chosen }) => chosen ?? rating;
      return this.question({ ...trial, scale }, kept, (answer) => {
        const start = (answer.start ?? null) === null ? {} : { [`${name}_start`]: answer.start };
        kept.also = { ...kept.also, [name]: value(answer), ...start };
      }, name === "confidence" ? name : "question");
    });
  }

  // Store a response in the browser's database, from which it is sent; the next trial does not wait for the network.
  sent(trial, answer) {
    const keep = async () => {
      if (trial.phase === "practice" && (await this.practice.note(trial, answer))) return; // recorded when it is judged
      const shown = trial.token ? { trial_token: trial.token } : {};
      const message = { ...shown, attempt: crypto.randomUUID(), answer };
      await this.outbox.put({ phase: trial.phase, trial: trial.trial }, message);
    };
    return { type: Call, async: true, func: (done) => keep().then(done, (error) => this.lost(error)) };
  }

  // Pictures are fetched in advance.
  async fetched({ knob, intervals = [] }) {
    const loading = knob ? loadSeries : load;
    for (const { url, film } of knob?.views ?? intervals) if (url) await this.network.until(() => loading(url, film));
  }

  // A question after a trial; its time is kept with the frames, its response by `keep`.
  question(trial, kept, keep, event = "question") {
    let asked = null;
    const node = question(trial.scale ?? this.session.scale, {
      number: (value) => this.number(value),
      escaped,
      head: ({ question, below = "" }) => `<div class="ask">${this.practised(trial)}<h2>${escaped(question)}</h2><p>${escaped(below)}</p></div>`,
      done: this.words("web.done"),
      wrong: (ends) => this.words("scale.typed_wrong", ends),
      keep: (answer) => {
        kept.frames.shown.push({ event, stamps: ends([asked, asked + 1000 * answer.response_time]) });
        keep(answer);
      },
    });
    const { on_load } = node;
    node.on_load = () => {
      asked = performance.now();
      on_load?.();
    };
    return node;
  }

  // Marks practice beside its question.
  practised({ phase }) {
    return phase === "practice" ? `<p class="practice">${escaped(this.words("web.practice"))}</p>` : "";
  }
}

async function start() {
  const { platform } = document.body.dataset;
  if (platform && !(await canStore())) throw new Error("The study needs storage in this browser: allow cookies and site data for this page.");
  const study = platform ? await Exported.open(document.body.dataset) : new Server();
  const page = new Page(study);
  study.waiting = (count) => page.network.waiting(count);
  globalThis.focalgradient = { page, load }; // for tests and debugging
  await page.run();
}

start().catch((error) => {
  console.error(error);
  const stage = document.getElementById("stage");
  if (!stage.querySelector("[role=status]")) {
    stage.innerHTML = `<div class="page" role="alert"><h1>${escaped(error.message)}</h1></div>`;
  }
});
