// A server at the address from which the page was loaded.

import { post } from "./outbox.js";

const AWAY_MS = 1000; // between two attempts to reach an unavailable server
const OF_PERSON = ["PROLIFIC_PID", "survey_code", "workerId", "id"]; // parameters that identify a person, as in people.py

// The secret of a personal link.
const ownLink = () => location.pathname.match(/^\/s\/([\w-]+)$/)?.[1];

// Parameters of the open link, and the key under which this browser stores the secret for them.
function openLink() {
  const platform = Object.fromEntries(new URLSearchParams(location.search));
  const named = OF_PERSON.filter((name) => name in platform).map((name) => [name, platform[name]]);
  const place = `focalgradient secret ${JSON.stringify(named)}`;
  return { platform, named, place, kept: named.length ? localStorage : sessionStorage };
}

// Join the study; retried while the server is unavailable or overloaded.
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

// A server at the address from which the page was loaded.
export class Server {
  post = post;
  withdraws = true; // can remove a participant's responses

  leave(who) {
    navigator.sendBeacon("/api/leave", JSON.stringify(who));
  }

  // Whether this browser has joined before: no new participant is then counted.
  get known() {
    const { place, kept } = openLink();
    return Boolean(ownLink() ?? kept.getItem(place));
  }

  async opening() {
    const response = await fetch("/api/opening", { cache: "no-store" });
    if (!response.ok) throw new TypeError(`the server answered ${response.status}`);
    return response.json();
  }

  // By a personal link, or as a new participant. The secret is generated here, and stored before it is sent: joining
  // may be
  // retried, and nobody without the secret reaches the session. With a platform identifier the secret is kept for the
  // next
  // visit; without one, as on a laboratory's shared computer, only until the page's address contains it.
  async join() {
    const token = ownLink();
    if (token) return token;
    const { platform, named, place, kept } = openLink();
    const secret = kept.getItem(place) ?? crypto.randomUUID();
    kept.setItem(place, secret);
    await joined({ platform, secret });
    if (!named.length) kept.removeItem(place);
    history.replaceState(null, "", `/s/${secret}`);
    return secret;
  }

  // After a session's responses were removed, none of its data stay in this browser.
  forget(token) {
    for (const name of Object.keys(localStorage)) {
      if (name === token || localStorage.getItem(name) === token) localStorage.removeItem(name);
    }
  }

  async end() {}
}
