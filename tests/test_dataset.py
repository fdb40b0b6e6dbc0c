"""Data sets: valid by the standard and by their design, read back as they were answered; and what is wrong is found."""

import hashlib
import json
import shutil
from datetime import UTC, datetime, timedelta
from itertools import pairwise
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from damaging import drop_row, swap_rows, told
from hypothesis import example, given, settings
from hypothesis import strategies as st
from recorded import edit, rating_file

from focalgradient.dataset import (
    Apparatus,
    Press,
    Rated,
    Session,
    Watched,
    bids_problems,
    check_stimuli,
    percepts,
    read_dataset,
    validate,
)
from focalgradient.dataset.arrival import too_early
from focalgradient.dataset.plausible import _wrong_times
from focalgradient.design import DepthRatingDesign, NeckerDesign, Pinhole
from focalgradient.errors import InputError

KEYS = {"rigid": "f", "nonrigid": "j"}
APPARATUS = Apparatus(
    "seconds of the display's clock, from the start of the sitting",
    screen_px=(1920, 1080),
    screen_m=(0.52, 0.29),
    viewing_distance_m=0.6,
    refresh_hz=59.95,
    versions={"psychopy": "2026.2.5"},
)
RATING = DepthRatingDesign(scenes=["a", "b"], catch_trials=2, practice_trials=2)
CUBE = NeckerDesign(repetitions=1, strengths_mm=[4.0])
DEMONSTRATION = Pinhole(repetitions=1)


def answered(design, trials, seed: int):
    """Answers of someone who presses keys and moves sliders at random."""
    rng = np.random.default_rng(seed)
    keys = "".join(design.keys) if design.task == "necker" else ""
    for number, trial in enumerate(trials):
        onset = 60.0 * number + rng.uniform(0, 1)
        dropped = int(rng.integers(0, 3))
        if design.task == "necker":
            times = np.sort(rng.uniform(-0.5, trial.trial_s, 12))
            presses = [Press(time, keys[rng.integers(2)], bool(rng.integers(2))) for time in times]
            yield Watched(onset=onset, presses=presses, trial_duration=trial.trial_s + 0.016, dropped_frames=dropped)
        else:
            stimulus = f"{trial.scene}_{trial.aperture.replace('/', '')}.png" if design.task == "depthrating" else None
            if trial.scene.startswith("example-"):
                stimulus = None  # a drawing, not of the set
            rating = np.exp(np.clip(rng.normal(0, 0.3), -1.3, 1.3))  # a NumPy number, as programs have them
            yield Rated(
                onset=onset, rating=rating, response_time=rng.uniform(0.3, 3), dropped_frames=dropped, stimulus=stimulus
            )


def hold(root: Path, design, participant: str, session: str | None = None, *, seed: int = 0, **more) -> Session:
    with Session.begin(root, design, participant, session, apparatus=APPARATUS, **more) as running:
        trials = running.remaining()
        for trial, answer in zip(trials, answered(design, trials, seed), strict=True):
            running.record(trial, answer)
    return running


@pytest.fixture(scope="module")
def pictures(tmp_path_factory) -> Path:
    """A folder of stimuli with its manifest."""
    folder = tmp_path_factory.mktemp("stimuli")
    names = [f"{s}_{a}.png" for s in ("a", "b", "spheres-00") for a in ("pinhole", "f22", "f11", "f5.6")]
    for name in names:
        (folder / name).write_bytes(name.encode())
    files = {name: hashlib.sha256(name.encode()).hexdigest() for name in names}
    (folder / "manifest.json").write_text(json.dumps({"seed": 1, "files": files}))
    return folder


@pytest.fixture(scope="module")
def made(tmp_path_factory, pictures) -> Path:
    root = tmp_path_factory.mktemp("made") / "data"
    hold(root, RATING, "01", stimuli=pictures, about={"age": 31, "sex": "F", "handedness": "right"})
    hold(root, RATING, "02", stimuli=pictures, seed=1)
    for session in ("1", "2"):
        hold(root, CUBE, "01", session)
    hold(root, DEMONSTRATION, "02")
    return root


@pytest.fixture
def data(made, tmp_path) -> Path:
    """A copy to be spoilt."""
    return Path(shutil.copytree(made, tmp_path / "data"))


def cube_file(root: Path) -> Path:
    return root / "sub-01" / "ses-1" / "beh" / "sub-01_ses-1_task-necker_beh.tsv"


def forget_journals(root: Path) -> None:
    """So that what is found is not found by comparing with them."""
    shutil.rmtree(root / "sourcedata")


def test_it_is_valid_by_the_standard_and_by_its_design(made):
    found = validate(made)
    assert found.problems == ()
    assert found.sessions == 5
    assert found.trials == 2 * (32 + 2) + 2 * (6 + 1) + 9
    late = read_dataset(made).depth_rating.dropped_frames.gt(0).sum()
    assert any(note.startswith(f"{late} trials of depthrating had dropped frames") for note in found.notes)
    assert all(note.endswith(".") for note in found.notes), found.notes
    by_standard = bids_problems(made)
    if by_standard is None:
        pytest.skip("bids-validator-deno is not installed")
    assert by_standard == []


def test_the_validator_of_the_standard_looks_at_every_row(data):
    edit(rating_file(data), 34, "rating", "-1")
    edit(cube_file(data), 3, "percept", "wobbly")
    found = bids_problems(data)
    if found is None:
        pytest.skip("bids-validator-deno is not installed")
    assert len(found) == 2
    assert "rating" in found[0] + found[1]
    assert "wobbly" in found[0] + found[1]


def test_tables_say_what_was_answered(made):
    data = read_dataset(made)
    assert not data.simulated
    table = data.depth_rating
    assert list(table["participant_id"].unique()) == ["sub-01", "sub-02"]
    for participant, seed in (("01", 0), ("02", 1)):
        trials = RATING.trials(participant)
        pairs = [pair for pair in zip(trials, answered(RATING, trials, seed), strict=True) if pair[0].phase == "main"]
        rows = table[table["participant_id"] == f"sub-{participant}"]
        for name in ("trial", "scene", "aperture", "fixation", "repetition", "catch"):
            assert rows[name].tolist() == [getattr(trial, name) for trial, _ in pairs]
        assert rows["aperture_mm"].tolist() == pytest.approx([trial.aperture_mm for trial, _ in pairs], abs=1e-9)
        for name in ("rating", "response_time", "onset", "dropped_frames"):
            assert rows[name].tolist() == pytest.approx([getattr(answer, name) for _, answer in pairs], abs=1e-9)
    assert table["catch"].dtype == bool
    assert {table[name].dtype.kind for name in ("trial", "dropped_frames")} == {"i"}
    assert table.index[0] == (str(rating_file(made)), 2)
    assert list(data.participants.loc[0, ["participant_id", "kind", "age", "sex"]]) == ["sub-01", "human", 31, "F"]


def test_percepts_fill_their_trials(made):
    table = read_dataset(made).necker
    assert list(table["session"].unique()) == ["1", "2"]
    for _, rows in table.groupby(["session", "trial"]):
        ends = rows["onset"] + rows["duration"]
        assert rows["onset"].iloc[0] == 0
        assert rows["onset"].to_numpy()[1:] == pytest.approx(ends.to_numpy()[:-1], abs=1e-8)
        assert ends.iloc[-1] == pytest.approx(rows["trial_duration"].iloc[0], abs=1e-8)
        assert rows["censored"].tolist() == [False] * (len(rows) - 1) + [True]
    assert not table["catch"].all()
    assert (table["shape"] == "nonrigid").equals(table["catch"])


def test_simulated_observers_are_told_everywhere(tmp_path):
    root = tmp_path / "data"
    hold(root, DEMONSTRATION, "01", kind="simulated")
    description = json.loads((root / "dataset_description.json").read_text())
    assert "simulated observers" in description["Name"]
    assert description["Simulated"] is True
    assert "SIMULATED OBSERVERS, not people" in (root / "README").read_text()
    assert "sub-01\tsimulated\t" in (root / "participants.tsv").read_text()
    data = read_dataset(root)
    assert data.simulated
    assert data.pinhole["simulated"].all()
    assert data.depth_rating.empty
    assert data.depth_rating["rating"].dtype == float
    assert validate(root).problems == ()
    assert not bids_problems(root)


def test_columns_that_a_lab_adds_to_the_participants_stay(data, pictures):
    path = data / "participants.tsv"
    lines = path.read_text().splitlines()
    path.write_text("\n".join([lines[0] + "\teye", *(line + "\tleft" for line in lines[1:])]))
    hold(data, RATING, "03", stimuli=pictures, about={"age": 40})
    assert path.read_text().splitlines()[1:] == [
        *(line + "\tleft" for line in lines[1:]),
        "sub-03\thuman\t40\tn/a\tn/a\tn/a",
    ]
    assert validate(data).problems == ()


# What is pressed, with times on a grid, so that presses coincide with each other and with the trial's ends.
presses = st.lists(
    st.builds(Press, st.integers(-8, 48).map(lambda n: n / 4), st.sampled_from("fjx"), st.booleans()), max_size=30
).map(sorted)


@settings(deadline=None)
@given(presses, st.sampled_from([0.1, 10.0, 1e-9]))
@example([Press(10.0, "f", True)], 10.0)
def test_percepts_tile_the_trial_exactly(pressed, duration):
    seen = percepts(pressed, KEYS, duration)
    assert seen[0].onset == 0
    assert seen[-1].end == duration
    assert all(one.end == other.onset for one, other in pairwise(seen))
    assert all(one.onset < one.end for one in seen)
    assert all(one.percept != other.percept for one, other in pairwise(seen))
    assert [one.censored for one in seen] == [False] * (len(seen) - 1) + [True]


@settings(deadline=None)
@given(presses, st.floats(0, 10, exclude_max=True))
def test_at_every_moment_the_percept_is_what_is_held(pressed, moment):
    held = set()
    for key in "fj":
        own = [press for press in pressed if press.key == key]
        before = [press for press in own if press.time <= moment]
        # Before its first event a key is held only if that event is its release.
        if before[-1].down if before else bool(own) and not own[0].down:
            held.add(key)
    expected = {"": "none", "f": "rigid", "j": "nonrigid", "fj": "both"}["".join(sorted(held))]
    assert [one.percept for one in percepts(pressed, KEYS, 10.0) if one.onset <= moment < one.end] == [expected]


WRONG = {
    "trial missing": (drop_row, r"1 of 34 trials of the .* 4\)"),
    "order changed": (swap_rows, "its trials are not in the order of the design"),
    "another seed": (told("Design", RATING.model_dump(mode="json") | {"seed": 1}), "seed differ from those of sub-"),
    "no design": (told("Design", {"task": "depthrating", "scenes": []}), "no scenes is given"),
}


@pytest.mark.parametrize("name", WRONG)
def test_what_contradicts_the_design_is_found(data, name):
    spoil, sentence = WRONG[name]
    forget_journals(data)
    before = validate(data).problems
    assert all("has no journal to compare it with" in problem for problem in before)
    assert len(before) == 5
    spoil(data)
    problems = [problem for problem in validate(data).problems if problem not in before]
    assert problems
    with pytest.raises(InputError, match=sentence):
        raise InputError(" | ".join(problems))


def test_trials_follow_each_other_within_a_sitting_and_start_anew_with_the_next() -> None:
    """Pictures of 1 s: the second sitting's clock begins at 0; its first trial ends at 2.5 s, its second at 5 s."""
    design = SimpleNamespace(shown_s=1.0)

    def wrong(onsets: tuple[float, ...], seconds: tuple[float, ...]) -> list[str]:
        rows = enumerate(zip((1, 1, 2, 2, 2), onsets, seconds, strict=True), start=1)
        shown = [(sitting, {"trial": n, "onset": onset, "response_time": time}) for n, (sitting, onset, time) in rows]
        return [*_wrong_times(shown, design)]

    onsets, seconds = (0.0, 9.0, 0.5, 3.0, 6.0), (2.0, 3.0, 1.0, 1.0, 1.0)
    assert wrong(onsets, seconds) == []
    assert wrong((0.0, 9.0, 0.5, 2.0, 6.0), seconds) == [
        "trial 4: it begins 1.5 s after the previous one, whose picture and answer took 2 s"
    ]
    assert wrong(onsets, (2.0, 301.0, 1.0, 1.0, 299.0)) == [
        "trial 2: response_time is 301 s, 150 times the median",
        "trial 5: response_time is 299 s, 150 times the median",
    ]


@pytest.mark.parametrize(("seconds", "since"), [((7.0, 9.0), None), ((7.0, 9.2), "sitting"), ((33.0, 0.0), "session")])
def test_answers_of_a_sitting_need_time_within_it(monkeypatch, seconds, since) -> None:
    """One answer 30 s after the session began; another 7 s after it was resumed: 2 s and 1 % may be missing."""
    began = datetime(2026, 3, 1, 9, 0, tzinfo=UTC)
    first, resumed, second = (
        {"event": name, "time": at.isoformat(), "received": at.isoformat(), "phase": "main", "trial": trial}
        for name, at, trial in (
            ("trial", began + timedelta(seconds=30), 1),
            ("resumed", began + timedelta(seconds=60), None),
            ("trial", began + timedelta(seconds=67), 2),
        )
    )
    spent = [(first, seconds[0]), (resumed, 0.0), (second, seconds[1])]
    monkeypatch.setattr("focalgradient.dataset.arrival._spent", lambda *_: iter(spent))
    found = [*too_early(SimpleNamespace(head={"time": began.isoformat()}), None, ())]
    assert len(found) == (since is not None)
    assert since is None or f"after the {since} began" in found[0]


def test_pictures_are_checked_against_their_manifest(data, pictures, tmp_path):
    assert validate(data, pictures).problems == ()
    others = Path(shutil.copytree(pictures, tmp_path / "others"))
    (others / "manifest.json").write_text((others / "manifest.json").read_text().replace('"seed": 1', '"seed": 2'))
    assert "is not the set of pictures that was shown" in validate(data, others).problems[0]
    assert validate(data, others).problems[0].endswith("give another folder.")
    Session.begin(tmp_path / "unseen", RATING, "01", apparatus=APPARATUS)._journal.close()
    unseen = " ".join(validate(tmp_path / "unseen", pictures).problems)
    assert "as the sessions name no pictures: leave it out." in unseen
    killed = Session.begin(tmp_path / "killed", RATING, "06", apparatus=APPARATUS, stimuli=pictures)
    killed._journal.close()
    assert not any("set of pictures" in problem for problem in validate(tmp_path / "killed", pictures).problems)
    with Session.begin(data, RATING, "05", apparatus=APPARATUS, stimuli=pictures):
        pass  # left at once
    with pytest.raises(InputError, match="others is given for the pictures, but the session began"):
        Session.resume(data, "depthrating", "05", apparatus=APPARATUS, stimuli=others)
    with pytest.raises(InputError, match=r"no folder is given .*\(the set whose manifest is .*\): give those"):
        Session.resume(data, "depthrating", "05", apparatus=APPARATUS)
    (others / "a_f22.png").write_bytes(b"changed")
    with pytest.raises(InputError, match=r"a_f22\.png has changed since the manifest was written: make .* again"):
        Session.begin(data, RATING, "04", apparatus=APPARATUS, stimuli=others)
    (others / "a_f22.png").unlink()
    with pytest.raises(InputError, match=r"a_f22\.png is in the manifest but cannot be read"):
        check_stimuli(others)
    (others / "manifest.json").write_text("{}")
    with pytest.raises(InputError, match="is not a manifest of stimuli"):
        check_stimuli(others)
    with pytest.raises(InputError, match="written by 'focalgradient stimuli'"):
        check_stimuli(tmp_path)
