// What the page says while the server does not answer, or has not yet received all responses.

const AWAY_MS = 1000; // between two attempts to reach an unavailable server
const LATE_MS = 3000; // for which unsent responses are not mentioned

export class Network {
  constructor(words) {
    this.words = words;
    // Outside the body, which jsPsych fills and listens to.
    this.note = Object.assign(document.createElement("p"), { id: "waiting", hidden: true });
    this.note.setAttribute("role", "status");
    document.documentElement.append(this.note);
  }

  // Ask again until there is an answer, which may be a refusal.
  async until(asked) {
    for (;;) {
      try {
        const answer = await asked();
        if (this.note.dataset.away) this.note.hidden = true;
        delete this.note.dataset.away;
        return answer;
      } catch (error) {
        if (!(error instanceof TypeError)) throw error;
        this.note.dataset.away = "yes";
        this.note.textContent = this.words("web.network");
        this.note.hidden = false;
        await new Promise((resolve) => setTimeout(resolve, AWAY_MS));
      }
    }
  }

  // State the number of unsent responses, if it takes long.
  waiting(count) {
    clearTimeout(count ? null : this.late);
    if (!count) {
      this.late = null;
      this.note.hidden = true;
      return;
    }
    this.note.textContent = count === 1 ? this.words("web.waiting_one") : this.words("web.waiting", { count });
    this.late ??= setTimeout(() => (this.note.hidden = false), LATE_MS);
  }
}
