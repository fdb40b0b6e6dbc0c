// Responses stay in the browser's database until the server confirms that they are on its disk.

const WAIT_MS = [500, 1000, 2000, 5000]; // delays before successive retries

const TOO_EARLY = 425;

const LAST = "~"; // ends the name of a response, which follows its exposures, named by hexadecimal digits

export class Refused extends Error {
  constructor(status, answer) {
    super(answer.error ?? `the server answered ${status}`);
    this.status = status;
    this.answer = answer;
  }
}

// Send one request; throws a TypeError if the network fails or the server is unavailable, `Refused` if it rejects it.
export async function post(path, message) {
  const response = await fetch(path, {
    method: "POST",
    headers: { "Content-Type": "application/json" },
    body: JSON.stringify(message),
    cache: "no-store",
  });
  if (response.status >= 500 || [408, 429].includes(response.status)) {
    const wait_ms = 1000 * (Number(response.headers.get("Retry-After")) || 0);
    throw Object.assign(new TypeError(`the server answered ${response.status}`), { wait_ms });
  }
  const answer = await response.json();
  if (!response.ok) throw new Refused(response.status, answer);
  return answer;
}

export const asked = (request) =>
  new Promise((resolve, reject) => {
    request.onsuccess = () => resolve(request.result);
    request.onerror = () => reject(request.error);
  });

export class Outbox {
  // `post` sends a response; `waiting(count)` is called when the number of unsent responses changes, `refused(error)`
  // if one
  // is rejected, and `again()` if the server must first resume the session.
  constructor(token, tab, { waiting, refused, again, post }) {
    Object.assign(this, { token, tab, waiting, refused, again, post, sending: null });
  }

  async open() {
    const request = indexedDB.open("focalgradient", 1);
    request.onupgradeneeded = () => request.result.createObjectStore("answers");
    this.database = await asked(request);
  }

  store(mode) {
    return this.database.transaction("answers", mode).objectStore("answers");
  }

  range() {
    return IDBKeyRange.bound(`${this.token}/`, `${this.token}/\uffff`);
  }

  // Number of responses that are not sent.
  async pending() {
    const names = await asked(this.store("readonly").getAllKeys(this.range()));
    return names.filter((name) => name.endsWith(LAST)).length;
  }

  // Store a response, or a trial's exposure, and send all that is stored in the order of the trials.
  async put(key, answer) {
    const trial = `${key.phase === "main" ? 1 : 0}/${String(key.trial).padStart(6, "0")}`;
    const name = `${this.token}/${trial}/${answer.exposure ?? LAST}`;
    const transaction = this.database.transaction("answers", "readwrite", { durability: "strict" });
    transaction.objectStore("answers").put({ ...key, ...answer }, name);
    await new Promise((resolve, reject) => {
      transaction.oncomplete = resolve;
      transaction.onerror = transaction.onabort = () => reject(transaction.error);
    });
    this.send().catch(this.refused);
  }

  // Delete the stored responses.
  async clear() {
    await asked(this.store("readwrite").delete(this.range()));
  }

  // Send the stored responses; only one run at a time.
  send() {
    this.sending ??= this.#sendAll().finally(() => (this.sending = null));
    return this.sending;
  }

  async #sendAll() {
    for (let failed = 0; ; ) {
      const cursor = await asked(this.store("readonly").openCursor(this.range()));
      this.waiting(await this.pending());
      if (!cursor) return;
      const { key, value } = cursor;
      try {
        await this.post(value.exposure ? "/api/expose" : "/api/answer", { token: this.token, tab: this.tab, ...value });
        await asked(this.store("readwrite").delete(key));
        failed = 0;
      } catch (error) {
        if (error.status === TOO_EARLY) await this.again().catch(() => {});
        else if (!(error instanceof TypeError)) throw error;
        await new Promise((resolve) => setTimeout(resolve, WAIT_MS[Math.min(failed++, WAIT_MS.length - 1)]));
      }
    }
  }
}
