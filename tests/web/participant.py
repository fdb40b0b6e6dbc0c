"""A participant without a browser: what the page asks for and sends, by hand."""

from __future__ import annotations

import sys
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
from hurried import Hurried
from numpy.typing import NDArray
from PIL import Image
from starlette.testclient import TestClient

from focalgradient.design import load_design
from focalgradient.web import Limits, Lists, People, Study, application

sys.path.insert(0, str(Path(__file__).parents[1] / "experiments"))
from headless import make_set

__all__ = [
    *("DEPTH", "NECKER", "PASSWORD", "SHORT", "SITTING", "Hurried", "Participant"),
    *("client_of", "film_frames", "make_set", "study"),
]

PASSWORD = "secret"
NECKER = """
task = "necker"
repetitions = 1
trial_s = 2.0
practice_s = 2.0
practice_trials = 2
catch_trials = 0
strengths_mm = [4.0]
break_every = 0
"""
DEPTH = """
task = "depthrating"
apertures = ["pinhole", "f/5.6"]
scenes = ["spheres-01", "spheres-02"]
repetitions = 1
catch_trials = 3
practice_trials = 3
picture_s = 0.3
standard_s = 0.3
mark_s = 0.1
blank_s = 0.1
pause_s = 0.1
longest_run = 4
break_every = 6
least_break_s = 0.0
"""

SHORT = DEPTH.replace(', "spheres-02"', "").replace("_trials = 3", "_trials = 1").replace("every = 6", "every = 3")
"""Six trials instead of fourteen, with a break after three."""


SITTING: dict[str, Any] = {
    "screen_px": [1920, 1080],
    "card_px": 310.0,
    "blind_spot_px": [530.0, 540.0, 520.0, 532.0, 528.0],
    "pixel_ratio": 1.0,
    "refresh_hz": 60.0,
    "browser": "none",
    "now_ms": 100.0,
}
"""What a page sends when a session begins or goes on."""

SECONDS_EACH = 10.0
"""Between two answers of a `Participant`."""

DATABASE: list[str] = []
"""Address of the PostgreSQL in which studies are kept; empty where they are kept in their folder."""


def kept_in(address: str, folder: Path, **options: Any) -> Study:
    """A study of a folder whose journals are in a database; the server's own folder is new."""
    from focalgradient.web.postgres import Postgres, SharedPeople

    design = load_design(folder / "design.toml")
    manifest = Lists(design, options.get("stimuli")).manifest
    own = next(one for one in (folder / "data", *(folder / f"data-{n}" for n in range(2, 99))) if not one.exists())
    store = Postgres(address, own, design, manifest)
    made = Study(design, own, SharedPeople(store.database), store=store, **options)
    made.clock = Hurried()
    return made


def study(folder: Path, design: str = NECKER, **options: Any) -> Study:
    """A study in a folder, or in a database where there is one; made again there, it goes on."""
    path = folder / "design.toml"
    path.write_text(design)
    if "depthrating" in design or "blurthreshold" in design:
        if not (folder / "set").exists():
            make_set(folder / "set", ["spheres-00", "spheres-01", "spheres-02"], size=(320, 241))
        options["stimuli"] = folder / "set"
    if DATABASE:
        made = kept_in(DATABASE[0], folder, **options)
    else:
        made = Study(load_design(path), folder / "data", People(folder / "links.jsonl"), **options)
    made.clock = Hurried()
    return made


class Participant:
    """Somebody with a link and a tab, who waits for as long as the answers say that the trials took."""

    def __init__(self, client: TestClient, token: str | None = None, tab: str = "tab-1"):
        self.client, self.tab = client, tab
        self.token = token or client.post("/api/join", json={"platform": {}}).json()["token"]
        self.trials: list[dict[str, Any]] = []
        self.trial_tokens: dict[str, str] = {}
        self.practised: dict[int, dict[str, Any]] = {}
        self.exposed: set[str] = set()
        self.holds = False

    def ask(self, path: str, **message: Any) -> Any:
        """Ask for something; gives the answer, whatever its status."""
        if path == "answer":
            Hurried.ahead += SECONDS_EACH
            if "trial_token" not in message:
                message["trial_token"] = self.trial_token(message)
            self.show(message)
            if message.get("phase") == "practice":
                self.practised[message["trial"]] = {key: message[key] for key in ("phase", "trial", "answer")}
        if path == "next" and message.get("phase") == "main" and "practice_token" not in message:
            message["practice_token"] = self.practice_token()
        answer = self.client.post(f"/api/{path}", json={"token": self.token, "tab": self.tab, **message})
        if path == "expose" and answer.status_code == 200:
            self.exposed.add(str({"phase": message["phase"], "trial": message["trial"]}))
        return answer

    def practice_token(self) -> str:
        """What the server gives with the judgement of the last round of practice, whether or not it is passed."""
        judged, number = {"again": bool(self.practised)}, 0
        while judged.get("again"):
            number += 1
            Hurried.ahead += SECONDS_EACH
            judged = self.ask("judge", round=number, answers=[*self.practised.values()]).json()
            Hurried.ahead -= SECONDS_EACH  # the repetitions take no time
        return str(judged.get("practice_token", ""))

    def show(self, trial: dict[str, Any]) -> None:
        """Report a trial's exposure, unless that was done."""
        key = {name: trial.get(name) for name in ("phase", "trial")}
        if str(key) not in self.exposed:
            self.ask("expose", **key, round=1, exposure=f"shown-{key['phase']}-{key['trial']}")

    def trial_token(self, message: dict[str, Any]) -> str:
        """What the server gives with a trial."""
        key = (message.get("phase"), message.get("trial"))
        if str(key) not in self.trial_tokens:
            found = self.ask("next", phase=key[0], trial=key[1])
            if found.status_code != 200:
                return "none"
            self.trial_tokens[str(key)] = found.json()["trial_tokens"][0]
        return self.trial_tokens[str(key)]

    def entry(self, number: int) -> dict[str, Any]:
        """The `number`-th of the trials that are left, as the page gets it."""
        key = {name: self.trials[number][name] for name in ("phase", "trial")}
        return dict(self.ask("next", **key).json()["trials"][0])

    def picture(self, url: str) -> bytes:
        """A picture, by the address that the page gets."""
        return bytes(self.client.get(url, headers={"Authorization": f"Bearer {self.token}"}).content)

    def begin(self, **changed: Any) -> Any:
        """Begin, or go on."""
        answer = self.ask("begin", **(SITTING | changed))
        if answer.status_code == 200:
            self.trials, self.practised = answer.json()["trials"], {}
            self.holds = bool(self.trials) and self.entry(0)["scale"]["kind"] == "held"
        return answer

    def message(self, trial: dict[str, Any], number: int) -> dict[str, Any]:
        """An answer to a trial, the `number`-th of the session."""
        events = ("picture",) if self.holds else ("mark", "picture", "question")
        frames = {
            "shown": [
                {"event": event, "stamps": [100.0 * place, 100.0 * place + 16.7, 100.0 * place + 33.3]}
                for place, event in enumerate(events)
            ]
        }
        given: dict[str, Any] = {"onset": 1.0 + SECONDS_EACH * number, "dropped_frames": 0, "frames": frames}
        if self.holds:
            given |= {"presses": [[0.5, "f", True], [1.5, "f", False]], "trial_duration": 2.0}
        else:
            given |= {"rating": 1.0 + 0.1 * (number % 5), "response_time": 1.0 + 0.1 * (number % 40), "start": 0.5}
        key = {"phase": trial["phase"], "trial": trial["trial"], "attempt": f"attempt-{number}"}
        return {**key, "answer": given}

    def answer(self, number: int, **changed: Any) -> Any:
        """Answer the `number`-th of the trials that are left."""
        return self.ask("answer", **(self.message(self.trials[number], number) | changed))


def film_frames(film: bytes) -> list[NDArray[np.uint8]]:
    """The frames of a film's file, each a PNG after its number of bytes."""
    at, frames = 0, []
    while size := int.from_bytes(film[at : at + 4], "big"):
        frames.append(np.asarray(Image.open(BytesIO(film[at + 4 : at + 4 + size]))))
        at += 4 + size
    return frames


def client_of(served: Study, limits: Limits | None = None) -> TestClient:
    """A client of a server of its own."""
    return TestClient(application(served, PASSWORD, limits=limits), raise_server_exceptions=True)
