// The experimenter's page: progress of all participants, updated every few seconds.

const EVERY_MS = 3000;

const row = (...cells) => {
  const made = document.createElement("tr");
  for (const cell of cells) {
    const place = document.createElement("td");
    place.append(cell);
    made.append(place);
  }
  return made;
};

function stopper(participant) {
  const button = document.createElement("button");
  button.textContent = "Stop";
  button.onclick = async () => {
    if (confirm(`Stop the session of ${participant}? Recorded responses are kept.`)) {
      const reply = await fetch(`/experimenter/stop/${participant}`, { method: "POST" });
      await refresh();
      if (!reply.ok) alert(`The session of ${participant} was not stopped: ${(await reply.json()).error}`);
    }
  };
  return button;
}

const ago = (seconds) => (seconds === null ? "none yet" : `${Math.round(seconds)} s ago`);

async function refresh() {
  const trouble = document.getElementById("trouble");
  try {
    const overview = await (await fetch("/experimenter/overview.json", { cache: "no-store" })).json();
    document.getElementById("task").textContent = `${overview.task}: ${overview.participants.length} participants`;
    document.querySelector("#people tbody").replaceChildren(
      ...overview.participants.map((one) =>
        row(one.participant, one.status + (one.same_identifier ? ", identifier used twice" : ""), `${one.done} of ${one.trials}`, ago(one.silent_s), String(one.lost),
          one.status === "begun" ? stopper(one.participant) : ""),
      ),
    );
    document.querySelector("#conditions tbody").replaceChildren(
      ...Object.entries(overview.answers_by_condition).map(([name, count]) => row(name, String(count))),
    );
    trouble.hidden = true;
  } catch (error) {
    trouble.textContent = `The server does not respond (${error.message}).`;
    trouble.hidden = false;
  }
}

await refresh();
setInterval(refresh, EVERY_MS);
