"""Experiment 1 on each of its scales, in both languages, in real windows: from the first page to the report."""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Callable, Mapping
from pathlib import Path

import pytest
from headless import LOOK, PAGES, Headless, Running, design, headless, keep, make_set, psychopy_here, session
from walked import walked

from focalgradient.dataset import read_dataset, read_journal, validate
from focalgradient.design import DepthTrial, load_design
from focalgradient.design.pages import pages_of
from focalgradient.design.sequence import sequence
from focalgradient.design.words import load_words
from focalgradient.report import make_report

pytestmark = psychopy_here

SCENES, APERTURES = ["spheres-01", "spheres-02"], ["pinhole", "f/11", "f/5.6"]
SHORT = {"scenes": SCENES, "apertures": APERTURES, "fixations": ["nearest"], "catch_trials": 2, "practice_trials": 3}
SHORT |= {"break_every": 2, "least_break_s": 0.5, "picture_s": 0.3, "reference_s": 0.1, "mask": "noise", "mask_s": 0.1}

Answer = Callable[[Headless, DepthTrial], None]


def take_part(screen: Headless, folder: Path, settings: Mapping[str, str], answer: Answer) -> tuple[Running, list[str]]:
    """Answer each question until the end: what ran, and its events."""
    make_set(folder / "set", ["spheres-00", *SCENES])
    running = Running(screen, "depth-rating", *session(folder, design("depthrating", **SHORT, **settings)))
    trials = list(load_design(folder / "design.toml").trials("01"))
    practice = [trial for trial in trials if trial.phase == "practice"]
    events: list[str] = []
    done = 0
    for event in running.events():
        events.append(event)
        keep(screen, f"{folder.name}-{event.strip('?')}-{events.count(event)}")
        if event == "feedback":  # practice once more
            trials[done:done] = practice
        if event == "question":
            time.sleep(0.1)  # until it is shown
            page = screen.pixels()
            assert abs(int(page[5, 5, 0]) - 127) <= 1, "the page is not as bright as the background of pictures"
            assert (page[60:95].min() < 60) == (trials[done].phase == "practice"), "practice is marked"
            answer(screen, trials[done])
            done += 1
        elif event in PAGES:
            screen.keys("space")
    assert running.end() == 0, running.errors
    return running, events


def is_deep(trial: DepthTrial) -> bool:
    return trial.scene == "example-deep" or trial.aperture != "pinhole"


def by_arrows(screen: Headless, trial: DepthTrial) -> None:
    """To the end of the scale that is right, from wherever the marker came."""
    screen.keys(*["Right" if is_deep(trial) else "Left"] * 70, "Return")


def by_digits(screen: Headless, trial: DepthTrial) -> None:
    screen.keys("6" if is_deep(trial) else "2", "Return")


def which(screen: Headless, trial: DepthTrial) -> None:
    deeper = trial.interval if is_deep(trial) else 3 - trial.interval
    screen.keys("Left" if deeper == 1 else "Right")


SCALES = {
    "ratio": ({"language": "de"}, by_arrows, (0.25, 4.0)),
    "steps": ({}, by_digits, (2.0, 6.0)),
    "choice": ({"reference": "same-scene"}, which, (0.0, 1.0)),
}


@pytest.mark.slow
@pytest.mark.parametrize("scale", SCALES)
def test_each_scale_from_its_first_page_to_a_valid_data_set(scale, tmp_path):
    settings, answer, (low, high) = SCALES[scale]
    folder = tmp_path / scale
    folder.mkdir()
    with headless(folder / "x") as screen:
        running, events = take_part(screen, folder, {"scale": scale, **settings}, answer)
    made = load_design(folder / "design.toml")
    words = load_words(made.language)
    steps = sequence(made, words, pages_of(made, words, "01"), made.trials("01"))
    wanted = ["question" if event == "trial" else event for event, _ in walked(steps, 1 + events.count("feedback"))]
    assert [event for event in events if event in {*wanted, "standard"}] == wanted
    found = validate(folder / "data", folder / "set")
    assert found.problems == ()
    table = read_dataset(folder / "data").depth_rating
    deep = (table["aperture"] != "pinhole") | (table["scene"] == "example-deep")
    other = ~deep & (table["scene"] != "spheres-00")
    assert (table["rating"][deep] == high).all()
    assert (table["rating"][other] == low).all()
    assert table["start"].notna().all() == (scale == "ratio")
    if scale == "ratio":
        assert table["start"].between(low, high).all()
        assert table["start"].nunique() > 1
    log = read_journal(running.journal())
    assert [note["passed"] for note in log.of("note") if note["kind"] == "practice"] == [True]
    head = next(note for note in log.of("note") if note["kind"] == "sitting")
    assert head["words"]["language"] == made.language
    _frames(log)
    assert Counter(events)["reference"] == (len(log.of("trial")) if scale == "choice" else 0)
    report = make_report(folder / "data")
    assert report.problems == ()
    assert len(report.files["depth_rating_trials.csv"].splitlines()) == 1 + len(table)
    if LOOK:
        Path(LOOK, f"{scale}.html").write_bytes(report.files["report.html"])
    assert table["standard_before"].tolist() == [scale == "ratio", *[False] * (len(table) - 1)]


def _frames(log) -> None:
    """Mark, picture, mask, blank and pause are no shorter than the design says, and no longer where no frame is late.

    On a busy machine frames are late, and the next text or picture is not always ready: one trial in time is asked for.
    """
    wanted = {"mark": 0.1, "picture": 0.3, "mask": 0.1, "pause": 0.1, "off": 0.1}
    longer: dict[str, list[float]] = {name: [] for name in wanted}
    for note in (one for one in log.of("note") if one["kind"] == "events"):
        first = [name for name, _, _ in note["events"]].index("pause")
        for (name, start, _), (_, end, _) in zip(note["events"][first:-1], note["events"][first + 1 :], strict=True):
            if name in wanted:
                longer[name].append(end - start - wanted[name])
    assert all(min(times) > -1.5 / 60 for times in longer.values())
    assert all(min(longer[name]) < 1.5 / 60 for name in ("mark", "picture", "mask")), longer
