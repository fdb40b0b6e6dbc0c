// A server of ours, at the address that the page came from.

import { post } from "./outbox.js";

const AWAY_MS = 1000; // between two attempts to reach a server that is away
const OF_PERSON = ["PROLIFIC_PID", "survey_code", "workerId", "id"]; // identifiers of a person, as people.py lists them

// The secret of an own link.
const ownLink = () => location.pathname.match(/^\/s\/([\w-]+)$/)?.[1];

// What somebody came with by the open link, and where this browser keeps the secret for it.
function openLink() {
  const platform = Object.fromEntries(new URLSearchParams(location.search));
  const named = OF_PERSON.filter((name) => name in platform).map((name) => [name, platform[name]]);
  const place = `focalgradient secret ${JSON.stringify(named)}`;
  return { platform, named, place, kept: named.length ? localStorage : sessionStorage };
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
export class Server {
  post = post;
  withdraws = true; // removes a participant's answers

  leave(who) {
    navigator.sendBeacon("/api/leave", JSON.stringify(who));
  }

  // Whether this browser has joined before: nobody new is counted then.
  get known() {
    const { place, kept } = openLink();
    return Boolean(ownLink() ?? kept.getItem(place));
  }

  async opening() {
    const response = await fetch("/api/opening", { cache: "no-store" });
    if (!response.ok) throw new TypeError(`the server answered ${response.status}`);
    return response.json();
  }

  // By an own link, or as somebody new. The secret is made here, and kept before it is sent: joining may be sent again,
  // and nobody without it reaches the session, whatever they know of the person. With an identifier of a platform it is
  // kept for the next visit; without one, as on a laboratory's shared computer, until the address has it.
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

  // After a session's answers were removed, nothing of it stays in this browser.
  forget(token) {
    for (const name of Object.keys(localStorage)) {
      if (name === token || localStorage.getItem(name) === token) localStorage.removeItem(name);
    }
  }

  async end() {}
}
