// Platforms that store the responses of a study without its own server: JATOS, DataPipe and Pavlovia, each through its
// own interface.
//
// Each provides: `name`; `batch`, the number of records sent together; `parameters` of the link; `choose(labels)`, the
// list of a new participant, if the platform counts them; `send(lines, name)`, which resolves on delivery;
// `end(address)`. Temporary failures throw a TypeError, as network failures do; permanent ones throw Refused.

import { Refused } from "./outbox.js";

const BATCH = 20; // responses per file, if every delivery creates one
const KEEPALIVE = 60000; // bytes of requests that a browser completes after the page is closed: at most 64 KiB in total
const ATTEMPTS = 30;

const pause = (milliseconds) => new Promise((resolve) => setTimeout(resolve, milliseconds));
const query = () => Object.fromEntries(new URLSearchParams(location.search));

// One CSV column of JSON records.
export const csv = (lines) => ["record", ...lines.map((line) => `"${line.replaceAll('"', '""')}"`), ""].join("\r\n");

// Send a request; return the response's JSON. `permanent(status, answer)` distinguishes permanent from temporary
// failures.
async function request(method, url, content, permanent) {
  const body = content && JSON.stringify(content);
  const keepalive = Boolean(body) && body.length < KEEPALIVE;
  const response = await fetch(url, { method, headers: { "Content-Type": "application/json" }, body, keepalive });
  const answer = await response.json().catch(() => ({}));
  if (response.ok) return answer;
  if (permanent(response.status, answer)) throw new Refused(response.status, { error: answer.message ?? `${url}: ${response.status}` });
  throw new TypeError(answer.message ?? `${url}: ${response.status}`);
}

const never = (status) => status >= 400 && status < 500 && status !== 408 && status !== 429;

// JATOS serves jatos.js beside the page; each response is appended to the result of the study run.
async function jatos() {
  const { jatos } = globalThis;
  if (!jatos) throw new Error("jatos.js is missing: open this study with a study link of JATOS.");
  await new Promise((resolve) => jatos.onLoad(resolve));
  const promised = (given) =>
    new Promise((resolve, reject) => given.then(resolve, (error) => reject(new TypeError(`JATOS: ${error}`))));
  return {
    name: "jatos",
    batch: 1,
    parameters: jatos.urlQueryParameters ?? query(),
    send: (lines) => promised(jatos.appendResultData(lines.map((line) => `${line}\n`).join(""))),
    // The batch session is versioned: if two participants take a list at once, one update fails and is retried.
    choose: async (labels) => {
      for (let n = 0; n < ATTEMPTS; n++) {
        const taken = jatos.batchSession.getAll() ?? {};
        const free = labels.find((label) => !(`list-${label}` in taken));
        if (!free) throw new Error("All lists of this study have been assigned.");
        try {
          await promised(jatos.batchSession.set(`list-${free}`, jatos.studyResultId));
          return free;
        } catch {
          await pause(200 + 300 * Math.random());
        }
      }
      throw new Error("JATOS does not respond: reload this page.");
    },
    end: (address) => (address ? jatos.endStudyAndRedirect(address) : jatos.endStudy()),
  };
}

// Each delivery becomes a file in the OSF project.
async function datapipe({ experiment }) {
  if (!experiment) throw new Error("The experiment ID of DataPipe is missing: write it into datapipe.html.");
  const permanent = (status, { error }) => never(status) && !String(error).startsWith("OSF");
  const post = (path, content) =>
    request("POST", `https://pipe.jspsych.org/api/${path}/`, { experimentID: experiment, ...content }, permanent);
  return {
    name: "datapipe",
    batch: BATCH,
    parameters: query(),
    send: async (lines, name) => {
      try {
        await post("data", { filename: `${name}.csv`, data: csv(lines) });
      } catch (error) {
        if (!/exists/i.test(error.message)) throw error; // an earlier attempt whose acknowledgement was lost
      }
    },
    choose: async (labels) => labels[(await post("condition")).condition % labels.length],
    end: () => {},
  };
}

// The calls of Pavlovia's own jsPsych plugin (5.0.0); the results of a pilot link are offered as a file.
async function pavlovia() {
  const { pavlovia, experiment } = await request("GET", "config.json", undefined, never);
  const parameters = query();
  const pilot = parameters.__pilotToken;
  const sessions = `${pavlovia.URL}/api/v2/experiments/${encodeURIComponent(experiment.fullpath)}/sessions`;
  const opened = await request("POST", sessions, pilot ? { pilotToken: pilot } : {}, never);
  const session = `${sessions}/${opened.token}`;
  const running = opened.experiment?.status2 === "RUNNING" && !pilot;
  const kept = [];
  return {
    name: "pavlovia",
    batch: BATCH,
    parameters,
    send: async (lines, name) => {
      if (!running) kept.push(...lines);
      else await request("POST", `${session}/results`, { key: `${experiment.name}_${name}.csv`, value: csv(lines) }, never);
    },
    end: () => request("DELETE", session, { isCompleted: true }, never),
    kept,
  };
}

export const platforms = { jatos, datapipe, pavlovia };
