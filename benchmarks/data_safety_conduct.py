"""Cases of `data_safety.py` on conduct: impossible answers, displayed stimuli, untrue texts, killed sessions."""

from __future__ import annotations

import gzip
import re
import sys
import tempfile
from collections import Counter
from importlib import import_module
from pathlib import Path
from typing import Any

from data_safety_server import DESIGN, FRAMES, SCREEN, Hurried
from reruns import Lines
from starlette.testclient import TestClient

from focalgradient.dataset import Files, Journal, begin_dataset, read_dataset, repair, validate
from focalgradient.design import DepthRatingDesign, NeckerDesign, Pinhole, load_design
from focalgradient.design.consent import read_consent
from focalgradient.design.pages import pages_of
from focalgradient.design.sequence import Page, Repeat, Standard, Turn, sequence
from focalgradient.design.words import LANGUAGES, load_words
from focalgradient.report import make_report
from focalgradient.web import People, Study, application

LONG = DESIGN.replace("_s = 2.0", "_s = 10.0")
TESTS = Path(__file__).parents[1] / "tests"


class _Script:
    """Program that takes part without waiting."""

    def __init__(self, folder: Path, design: str):
        (folder / "design.toml").write_text(design)
        people = People(folder / "links.jsonl")
        self.study = Study(load_design(folder / "design.toml"), folder / "data", people)
        self.clock = self.study.clock = Hurried()
        self.client = TestClient(application(self.study, "secret"))
        token = self.client.post("/api/join", json={"platform": {}}).json()["token"]
        self.who = {"token": token, "tab": "tab-1"}
        self.practised: list[dict[str, Any]] = []

    def begin(self, **more: Any) -> Any:
        """Start the session; return the trials."""
        answer = self.client.post("/api/begin", json={**self.who, **SCREEN, **more})
        return answer.json().get("trials", answer.status_code)

    def answer(self, trial: dict[str, Any], number: int, **changed: Any) -> int:
        """Answer a trial after its usual duration; return the status."""
        key = {"phase": trial["phase"], "trial": trial["trial"]}
        passed = {}
        if trial["phase"] == "main" and self.practised:
            judged = self.client.post("/api/judge", json={**self.who, "round": 20, "answers": self.practised}).json()
            passed = {"practice_token": judged["practice_token"]} if "practice_token" in judged else {}
        given = self.client.post("/api/next", json={**self.who, **key, **passed}).json()
        seconds = sum(one["seconds"] for one in given["trials"][0]["intervals"]) if "trials" in given else 1.0
        told: dict[str, Any] = {
            "onset": 11.0 * number,
            "presses": [],
            "trial_duration": seconds,
            "frames": FRAMES,
        } | changed
        if trial["phase"] == "practice":
            self.practised.append({**key, "answer": told})
        self.client.post("/api/expose", json={**self.who, **key, "round": 1, "exposure": f"e-{number}"})
        key |= {"attempt": f"a-{number}", "trial_token": given.get("trial_tokens", ["none"])[0]}
        return self.client.post("/api/answer", json={**self.who, **key, "answer": told}).status_code


def fast_script() -> str:
    """Send 80 s of trials instantly: one rejected answer after another, and all at once after 20 s."""
    with tempfile.TemporaryDirectory() as name:
        script = _Script(Path(name), LONG)
        trials = script.begin()
        at_once = Counter(script.answer(trial, number) for number, trial in enumerate(trials))
        script.clock.ahead += 20.0
        later = Counter(script.answer(trial, number) for number, trial in enumerate(trials))
        script.client.post("/api/finish", json=script.who)
        data = Path(name, "data")
        found = sum("by the server's clock" in one for one in validate(data).problems)
        report = sum("by the server's clock" in one for one in make_report(data).problems)
    return f"at once {dict(at_once)}, after 20 s {dict(later)}: validate {found} problem, report {report}"


def impossible_answers() -> str:
    """Send answers that no page sends."""
    cases: dict[str, dict[str, Any]] = {
        "unknown key": {"presses": [[0.5, "q", True]]},
        "key after the end": {"presses": [[70.0, "f", True]]},
        "trial of 100,000 s": {"trial_duration": 100_000.0},
        "trial of 1 s for 10 s": {"trial_duration": 1.0},
    }
    with tempfile.TemporaryDirectory() as name:
        script = _Script(Path(name), LONG)
        trials = script.begin()
        script.clock.ahead += 20.0
        found = {case: script.answer(trials[0], 0, **changed) for case, changed in cases.items()}
    return ", ".join(f"{case}: {status}" for case, status in found.items())


def after_outage() -> str:
    """Send the answers of an honest page that was offline for the whole session."""
    with tempfile.TemporaryDirectory() as name:
        script = _Script(Path(name), LONG)
        trials = script.begin()
        script.clock.ahead += 11.0 * len(trials)
        kept = sum(script.answer(trial, number) == 200 for number, trial in enumerate(trials))
        script.client.post("/api/finish", json=script.who)
        problems = validate(Path(name, "data")).problems
    return f"{kept} of {len(trials)} kept, {len(problems)} problems"


def standard_first() -> str:
    """Count runs that rate a picture before the standard, over scales and points of resumption."""
    words, right, count = load_words("en"), 0, 0
    for scale in ("ratio", "bipolar"):
        design = DepthRatingDesign(repetitions=1, scale=scale, catch_pictures=("flatter", "deeper"))
        trials = design.trials("01")
        for done in range(0, len(trials), 5):
            steps = sequence(design, words, pages_of(design, words, "01", browser=True), trials, done)
            turn = next(step for step in steps if isinstance(step, Turn))
            before = (*steps[: steps.index(turn)], *turn.lead)
            right += sum(isinstance(step, Standard) for step in before) == 1
            count += 1
    return f"{right} of {count}"


def form_and_consent() -> str:
    """Send form answers, and consent with a version."""
    with tempfile.TemporaryDirectory() as name:
        script = _Script(Path(name), LONG)
        script.begin(about={"age": "34", "sex": "f", "handedness": "left"})
        row = read_dataset(Path(name, "data")).participants.iloc[0]
        Path(name, "consent.txt").write_text("Version: 2.1\nWhat we do\n\nText.\fYour rights\n\nText.")
        consent = read_consent(Path(name, "consent.txt"))
    heads = [text.splitlines()[0] for text in consent.texts]
    return f"age {row['age']}, sex {row['sex']}, handedness {row['handedness']}; headings {heads}"


def phone() -> str:
    """Request the pages of a phone, and count the accepted labels; include a browser that hides the refresh rate."""
    sys.path[:0] = [str(TESTS / "web"), str(TESTS / "experiments")]
    chromium, served = import_module("chromium").chromium, import_module("test_browser").served
    with tempfile.TemporaryDirectory() as name, chromium() as browser:
        server = served(Path(name), DESIGN)
        size = {"width": 390, "height": 844}
        page = browser.new_context(viewport=size, screen=size, has_touch=True, is_mobile=True).new_page()
        page.goto(f"http://127.0.0.1:{server.port}/?PROLIFIC_PID=abc")
        page.wait_for_selector("h1")
        head = page.inner_text("h1")
        server.end()
        labels = sum("abc" in path.read_text() for path in Path(name).glob("data-links*"))
        script = _Script(Path(name), LONG)
        hidden = isinstance(script.begin(refresh_hz=None), list)
    return f"{head!r}, {labels} labels; hidden refresh rate {'taken' if hidden else 'refused'}"


def untrue_texts() -> str:
    """Count statements that contradict their design, over designs and languages."""
    wrong: Counter[str] = Counter()
    for language in LANGUAGES:
        words = load_words(language)
        for steps in range(2, 22):
            design = DepthRatingDesign(repetitions=1, scale="steps", steps=steps, catch_trials=0, practice_trials=0)
            told = _told(design, language)
            wrong["example on the flat side"] += (design.response_scale.example or 0.0) <= (1 + steps) / 2
            wrong["drawings that were not shown"] += words("depth.about_drawings").strip() in told
            wrong["digits that choose no step"] += words("depth.answer_steps") in told and steps > 9
        cube = _told(NeckerDesign(gradients=("none",), longest_run=20), language)
        wrong["no right or wrong before scored cubes"] += bool(re.search("right or wrong|kein Falsch", cube))
        wrong["blur without blur"] += words("necker.about_blur") in cube
        pinhole = _told(Pinhole(), language)
        wrong["debriefing not shown"] += words.entries["pinhole.debriefing"][0].splitlines()[0] not in pinhole
    return ", ".join(f"{what}: {count}" for what, count in wrong.items())


def _told(design: Any, language: str) -> str:
    words = load_words(language)
    steps = sequence(design, words, pages_of(design, words, "01"), design.trials("01"))
    pages = [step for step in steps if isinstance(step, Page)]
    pages += [page for step in steps if isinstance(step, Turn) for page in step.after]
    pages += [step.again for step in steps if isinstance(step, Repeat)]
    return "\n".join(page.text for page in pages)


def killed_focus() -> str:
    """Recover a focus-by-gaze session that was killed so that only its journal remains."""
    with tempfile.TemporaryDirectory() as name:
        root = Path(name, "data")
        begin_dataset(root, "human")
        files = Files(root, "gazefocus", "01")
        place = files.journal.with_name(files.journal.name.replace("_beh.", "_events."))
        with Journal.begin(
            place, {"event": "begun", "task": "gazefocus", "participant": "01", "session": None}
        ) as kept:
            tracker = {"name": "mouse", "pixels_per_degree": 40.0, "window_px": [1024, 768], "picture_px": [300, 200]}
            kept.write({"event": "note", "kind": "eye tracker", **tracker, "refresh_hz": 60.0, "frame_s": 1 / 60})
            for second in range(5):
                samples = [[second + frame / 60, 100.0, 100.0] for frame in range(60)]
                kept.write({"event": "note", "kind": "gaze", "samples": samples})
        before = len(validate(root).problems)
        repaired = len(repair(root))
        after = len(validate(root).problems)
        out = [gzip.decompress(path.read_bytes()).count(b"\n") for path in root.rglob("*_physio.tsv.gz")]
    return f"{before} problems, {repaired} repaired, then {after} problems; {sum(out)} of 300 samples"


def register(table: Lines) -> None:
    """Add the lines of this file to a table."""
    table.line("1.5.1", "script that answers 80 s of trials at once", "all taken; validate 0, report 0")(fast_script)
    taken = "unknown key: 200, key after the end: 200, trial of 100,000 s: 200, trial of 1 s for 10 s: 200"
    table.line("1.5.2", "answers that no page sends", taken)(impossible_answers)
    table.line("1.5.3", "honest answers after an outage", "8 of 8 kept, 0 problems")(after_outage)
    table.line("1.6", "sittings with the standard before the first rating", "first at main trial 1")(standard_first)
    lost = "age n/a, sex n/a, handedness n/a; heading 'Version: 2.1', one page"
    table.line("1.7.1", "form and consent in the browser", lost)(form_and_consent)
    table.line("1.7.2", "visit by a phone", "'refresh_hz: Input should be a valid number', 1 label")(phone)
    untrue = "example 4, drawings 40, digits 24, right or wrong 2, blur 2, debriefing 2"
    table.line("1.8", "untrue texts, 2 languages", untrue)(untrue_texts)
    killed = "2 problems, 0 repaired, then 2 problems; 0 of 300 samples"
    table.line("1.9", "focus by gaze after kill -9", killed)(killed_focus)
