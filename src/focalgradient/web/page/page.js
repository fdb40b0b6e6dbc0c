// One participant's session in the browser: what the server lists is shown, what is answered is sent, until all is done.

import { initJsPsych } from "jspsych";
import BrowserCheck from "@jspsych/plugin-browser-check";
import Call from "@jspsych/plugin-call-function";
import Fullscreen from "@jspsych/plugin-fullscreen";
import Buttons from "@jspsych/plugin-html-button-response";
import Keyboard from "@jspsych/plugin-html-keyboard-response";
import CubePlugin, { Cube } from "./cube.js";
import { measurement } from "./distance.js";
import { Exported } from "./exported.js";
import { measureFrame } from "./frames.js";
import { gammaMatches } from "./gamma.js";
import { significant } from "./numbers.js";
import { Outbox, post, Refused } from "./outbox.js";
import PicturePlugin, { load } from "./picture.js";
import { heldAlone, Practice } from "./practice.js";
import { ratioSlider } from "./slider.js";
import { stepsQuestion } from "./steps.js";
import { stopButton } from "./stopping.js";

const BEAT_MS = 5000; // between two signs of life, by which the server knows that this tab still shows the session
const AWAY_MS = 1000; // between two attempts to reach a server that is away
const FORGOTTEN_MS = 3600e3; // after which instructions are shown again
const OF_PERSON = ["PROLIFIC_PID", "survey_code", "workerId", "id"]; // identifiers of a person, as people.py lists them

const escaped = (text) => {
  const span = document.createElement("span");
  span.textContent = text;
  return span.innerHTML;
};

// A text of the session's words, its {names} filled in.
function filled(text, values = {}) {
  return text.replace(/\{(\w+)\}/g, (whole, name) => values[name] ?? whole);
}

// The first line of a page is its title, an empty line a new paragraph.
function html(text) {
  const [title, ...rest] = text.split("\n");
  const body = rest.join("\n").trim().split(/\n\s*\n/);
  return `<h1>${escaped(title)}</h1>` + body.map((part) => `<p>${escaped(part).replaceAll("\n", "<br>")}</p>`).join("");
}

class Page {
  constructor(token, study) {
    Object.assign(this, { token, study });
    // The tab's own name outlives a reload, and nothing else.
    this.tab = sessionStorage.getItem("tab") ?? crypto.randomUUID();
    sessionStorage.setItem("tab", this.tab);
    // Beside the body, which jsPsych fills and listens to.
    this.note = Object.assign(document.createElement("p"), { id: "waiting", hidden: true });
    this.note.setAttribute("role", "status");
    document.documentElement.append(this.note);
    this.outbox = new Outbox(token, this.tab, {
      post: (path, message) => study.post(path, message),
      waiting: (count) => this.showWaiting(count),
      refused: (error) => this.lost(error),
      // A server that was started anew takes answers when the sitting goes on, on the same clock.
      again: () => this.ask("/api/begin", this.beginning),
    });
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

  // The same, until there is an answer: a network or a server that is away is waited for.
  async insist(path, message) {
    for (;;) {
      try {
        const answer = await this.ask(path, message);
        this.back();
        return answer;
      } catch (error) {
        if (!(error instanceof TypeError)) throw error;
        await this.away();
      }
    }
  }

  // Say that the network does not answer, beside what jsPsych shows, and wait before it is tried again.
  async away() {
    this.note.dataset.away = "yes";
    this.note.textContent = this.state ? this.words("web.network") : "…";
    this.note.hidden = false;
    await new Promise((resolve) => setTimeout(resolve, AWAY_MS));
  }

  back() {
    if (this.note.dataset.away) this.note.hidden = true;
    delete this.note.dataset.away;
  }

  showWaiting(count) {
    if (!count) {
      clearTimeout(this.late);
      this.late = null;
      this.note.hidden = true;
      return;
    }
    this.note.textContent = this.words("web.waiting", { count });
    this.late ??= setTimeout(() => (this.note.hidden = false), 3000);
  }

  // Instead of whatever is there: jsPsych can show nothing after it.
  say(text) {
    this.stopping?.remove();
    document.getElementById("stage").innerHTML = `<div class="page" role="status">${html(text)}</div>`;
  }

  async run() {
    await this.outbox.open();
    this.state = await this.insist("/api/state");
    document.documentElement.lang = this.state.language;
    document.title = this.words("web.title");
    // Until the other window is closed, or, where it crashed, the server has missed its signs of life.
    while (this.state.status === "busy") {
      this.say(this.words("web.other_tab"));
      await new Promise((resolve) => setTimeout(resolve, BEAT_MS));
      this.state = await this.insist("/api/state");
    }
    document.getElementById("stage").replaceChildren();
    if (this.state.status === "stopped") return this.say(this.words("web.stopped"));
    if (this.state.status === "complete") return this.finish();
    // Answers that an earlier page could not send are of its sitting, and of its clock: they come before the next one.
    if (this.state.status === "begun") await this.outbox.send();
    this.beat = setInterval(() => this.ask("/api/here").catch((error) => this.lost(error)), BEAT_MS);
    addEventListener("pagehide", () => this.study.leave({ token: this.token, tab: this.tab }));
    await this.experiment();
    if (this.over) return;
    await this.outbox.send();
    await this.finish();
  }

  // The session was stopped, or is shown by another window; a network that fails is waited for elsewhere.
  lost(error) {
    if (this.over || !(error instanceof Refused)) return;
    clearInterval(this.beat);
    this.jsPsych?.abortExperiment();
    this.say(this.words([404, 410].includes(error.status) ? "web.stopped" : "web.other_tab"));
  }

  // Not while there is something to look at.
  offerToStop() {
    const ways = [
      [this.words("web.go_on"), () => {}],
      [this.words("web.stop_keep"), () => this.stop(false)],
    ];
    if (this.study.withdraws) ways.push([this.words("web.stop_remove"), () => this.stop(true)]);
    return stopButton(this.words("web.stop"), html(this.words("web.stop_question")), ways);
  }

  // The participant ends the session, and keeps what was answered, or has it removed.
  async stop(remove) {
    this.over = true;
    clearInterval(this.beat);
    this.stopping.remove();
    this.jsPsych.abortExperiment();
    let text = this.words(remove ? "web.removed" : "web.kept");
    try {
      if (remove) {
        await this.insist("/api/withdraw").catch((error) => {
          if (error.status !== 404) throw error; // else they were removed, but the acknowledgement was lost
        });
        await this.outbox.clear();
        this.study.forget(this.token);
      } else {
        await this.outbox.send();
        this.study.leave({ token: this.token, tab: this.tab });
      }
    } catch (error) {
      text = error.message; // the server's reason for refusing: the participant must know that the answers are still there
    }
    if (document.fullscreenElement) await document.exitFullscreen();
    this.say(text);
  }

  async finish() {
    const result = await this.insist("/api/finish");
    if (document.fullscreenElement) await document.exitFullscreen();
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
      on_trial_start: ({ type }) => this.stopping && (this.stopping.hidden = type === PicturePlugin || type === CubePlugin),
    });
    const { trials: left, ...session } = await this.prepared();
    this.session = session;
    // Not before: the blind spot is looked for beside a black square.
    document.body.classList.toggle("dark", this.state.dark);
    Object.assign(this, { left, began: performance.now(), stopping: this.offerToStop() });
    const practised = left.filter(({ phase }) => phase === "practice");
    this.practice = new Practice(session, practised.length);
    const nodes = (phase) => left.filter((trial) => trial.phase === phase).flatMap((trial) => this.nodes(trial));
    const again = {
      timeline: [this.page(session.practice.again), ...nodes("practice")],
      conditional_function: () => this.practice.repeat,
      loop_function: () => this.practice.repeat,
    };
    const recent = Date.now() - Number(localStorage.getItem(this.token) ?? 0) < FORGOTTEN_MS;
    await this.jsPsych.run([...(recent ? [] : this.opening()), ...nodes("practice"), ...(practised.length ? [again] : []), ...nodes("main")]);
  }

  // Consent, screen and distance; then the session is begun or resumed on the server.
  async prepared() {
    const about = {};
    const timeline = [
      {
        type: BrowserCheck,
        minimum_width: 640,
        minimum_height: 480,
        window_resize_message: () => `<p>${escaped(this.words("web.enlarge"))}</p>`,
      },
    ];
    if (this.state.consent) timeline.push(this.consent());
    timeline.push({
      type: Fullscreen,
      fullscreen_mode: true,
      message: `<div class="page">${html(this.words("web.full_screen"))}</div>`,
      button_label: this.words("web.go_on"),
    });
    const words = (name, values) => this.words(name, values);
    timeline.push(measurement(about, words, html));
    const matches = [];
    if (this.state.gamma) timeline.push(gammaMatches(matches, words, html));
    timeline.push({ type: Call, async: true, func: (done) => measureFrame().then((frame) => done((this.frame = frame))) });
    await this.jsPsych.run(timeline);
    const pixels = [screen.width, screen.height].map((side) => Math.round(side * devicePixelRatio));
    this.beginning = {
      consent: this.state.consent ? this.state.consent.sha256 : null,
      screen_px: pixels,
      card_px: about.card_px,
      blind_spot_px: about.pressed.map((place) => Math.round(10 * place) / 10),
      gamma_matches: matches,
      pixel_ratio: devicePixelRatio,
      refresh_hz: 1000 / this.frame,
      browser: navigator.userAgent,
      now_ms: performance.now(),
    };
    return this.insist("/api/begin", this.beginning);
  }

  consent() {
    return {
      type: Buttons,
      stimulus: `<div class="page">${html(this.state.consent.text)}</div>`,
      choices: [this.words("web.agree"), this.words("web.disagree")],
      on_finish: (data) => {
        if (data.response === 0) return;
        this.say(this.words("web.no_consent"));
        throw new Error("no consent");
      },
    };
  }

  page(text, button = this.words("web.go_on")) {
    return {
      type: Buttons,
      stimulus: () => `<div class="page">${html(typeof text === "string" ? text : text())}</div>`,
      choices: [button],
      on_load: () => document.querySelector("#jspsych-html-button-response-btngroup button").focus(),
    };
  }

  opening() {
    return this.session.instructions.map((text) => this.page(text));
  }

  // All screens of a trial, of which the last sends the answer.
  nodes(trial) {
    const found = trial.cube ? [] : [{ type: Call, async: true, func: (done) => this.fetched(trial).then(done) }];
    if (trial.break) found.push(this.page(() => filled(trial.break, { minutes: this.minutes(trial) })));
    if (trial.standard) found.push(this.page(this.session.standard_text), this.picture([trial.standard]));
    return found.concat(trial.cube ? this.cubeNodes(trial) : this.depthNodes(trial));
  }

  // Minutes that the trials from this one on will take, at the pace so far; ten seconds each where there is none yet.
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

  depthNodes(trial) {
    const kept = {};
    const seconds = (ms) => (ms - this.session.start_ms) / 1000;
    const picture = {
      ...this.picture(trial.intervals),
      on_finish: (data) => {
        kept.onset = seconds(data.shown[0].stamps[0]);
        kept.frames = { shown: data.shown, ...data.lost };
        kept.dropped_frames = data.dropped_frames;
      },
    };
    const question = this.question(trial, (answer) => Object.assign(kept, answer));
    return [picture, question, this.sent(trial, kept)];
  }

  // Keep an answer in the browser's database, from where it is sent; the next trial need not wait for the network.
  sent(trial, answer) {
    const keep = async () => {
      localStorage.setItem(this.token, String(Date.now()));
      if (trial.phase === "practice" && this.practice.note(trial, answer)) return; // goes with the first that counts
      const practice = trial.phase === "main" ? this.practice.taken() : [];
      const message = { attempt: crypto.randomUUID(), answer, ...(practice.length ? { practice } : {}) };
      await this.outbox.put({ phase: trial.phase, trial: trial.trial }, message);
    };
    return { type: Call, async: true, func: (done) => keep().then(done) };
  }

  // Pictures are fetched before they are needed; a network that is away is waited for.
  async fetched(trial) {
    for (const { url } of [...trial.intervals, ...(trial.standard ? [trial.standard] : [])]) {
      for (;;) {
        try {
          await load(url);
          this.back();
          break;
        } catch {
          await this.away();
        }
      }
    }
  }

  question(trial, keep) {
    const { scale } = this.session;
    if (scale.kind === "choice") {
      return {
        type: Keyboard,
        stimulus: `<div class="ask"><h2>${escaped(scale.question)}</h2></div>`,
        prompt: `<p class="foot arrows">&larr; ${escaped(scale.ways[0])} &emsp; ${escaped(scale.ways[1])} &rarr;</p>`,
        choices: ["ArrowLeft", "ArrowRight"],
        on_finish: ({ response, rt }) => {
          const chosen = response.toLowerCase() === "arrowleft" ? 1 : 2;
          keep({ rating: chosen === trial.interval ? 1 : 0, response_time: rt / 1000 });
        },
      };
    }
    if (scale.kind === "steps") return stepsQuestion(scale, { escaped, keep });
    return ratioSlider(scale, { number: (value) => this.number(value), escaped, done: this.words("web.done"), keep });
  }

  cubeNodes(trial) {
    const { cube, keys } = this.session;
    const foot = Object.entries(keys).map(([name, key]) => [key, this.words(`necker.${name}`)]);
    const reminder = foot.map(([key, word]) => `<b>${escaped(key.toUpperCase())}</b> ${escaped(word)}`).join(" &emsp; ");
    const ready = {
      type: Keyboard,
      stimulus: `<div class="page"><h1>${escaped(this.words(trial.phase === "practice" ? "necker.practice" : "necker.ready"))}</h1>
        <p>${escaped(this.words("necker.hold"))}</p><p>${escaped(this.words("necker.start"))}</p></div>`,
      prompt: `<p class="foot">${reminder}</p>`,
      choices: [" "],
    };
    const kept = {};
    const shown = {
      type: CubePlugin,
      cube,
      trial: trial.cube,
      keys: Object.values(keys),
      foot: reminder,
      frame: this.frame,
      on_finish: (data) =>
        Object.assign(kept, {
          onset: (data.shown[0].stamps[0] - this.session.start_ms) / 1000,
          presses: data.presses,
          trial_duration: data.seconds,
          dropped_frames: data.dropped_frames,
          frames: { shown: data.shown, ...data.lost },
        }),
    };
    const feedback = () => {
      const share = Math.round((100 * heldAlone(kept.presses, keys[trial.right.shape], kept.trial_duration)) / kept.trial_duration);
      const shape = this.words(`necker.${trial.right.shape}`);
      return this.words("necker.feedback", { shape, key: keys[trial.right.shape].toUpperCase(), share });
    };
    return [ready, shown, ...(trial.right ? [this.page(feedback)] : []), this.sent(trial, kept)];
  }
}

// Join; a server that is away, or has too many at this moment, is asked again.
async function joined(message) {
  for (;;) {
    try {
      return await post("/api/join", message);
    } catch (error) {
      if (!(error instanceof TypeError)) throw error;
      document.getElementById("stage").textContent = "…";
      await new Promise((resolve) => setTimeout(resolve, Math.max(AWAY_MS, error.wait_ms ?? 0)));
    }
  }
}

// A server of ours, at the address that the page came from.
class Server {
  post = post;
  withdraws = true; // removes a participant's answers

  leave(who) {
    navigator.sendBeacon("/api/leave", JSON.stringify(who));
  }

  // By an own link, or as somebody new. The secret is made here, and kept before it is sent: joining may be sent again,
  // and nobody without it reaches the session, whatever they know of the person. With an identifier of a platform it is
  // kept for the next visit; without one, as on a laboratory's shared computer, until the address has it.
  async join() {
    const token = location.pathname.match(/^\/s\/([\w-]+)$/)?.[1];
    if (token) return token;
    const platform = Object.fromEntries(new URLSearchParams(location.search));
    const named = OF_PERSON.filter((name) => name in platform).map((name) => [name, platform[name]]);
    const place = `focalgradient secret ${JSON.stringify(named)}`;
    const kept = named.length ? localStorage : sessionStorage;
    const secret = kept.getItem(place) ?? crypto.randomUUID();
    kept.setItem(place, secret);
    await joined({ platform, secret });
    if (!named.length) kept.removeItem(place);
    history.replaceState(null, "", `/s/${secret}`);
    return secret;
  }

  // After a session's answers were removed, nothing of it stays in this browser.
  forget(token) {
    for (const name of Object.keys(localStorage)) {
      if (name === token || localStorage.getItem(name) === token) localStorage.removeItem(name);
    }
  }

  async end() {}
}

async function start() {
  const study = document.body.dataset.platform ? await Exported.open(document.body.dataset) : new Server();
  const page = new Page(await study.join(), study);
  study.waiting = (count) => page.showWaiting(count);
  globalThis.focalgradient = { page, Cube, load }; // for who tests or debugs the page
  await page.run();
}

start().catch((error) => {
  console.error(error);
  const stage = document.getElementById("stage");
  if (!stage.querySelector("[role=status]")) {
    stage.innerHTML = `<div class="page" role="alert"><h1>${escaped(error.message)}</h1></div>`;
  }
});
