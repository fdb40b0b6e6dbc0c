"""Gaze: fixations against made paths, distances from the object, files that journal and disk must agree on."""

from __future__ import annotations

import gzip
import json
from pathlib import Path

import numpy as np
import pytest

from focalgradient.dataset import Apparatus, Rated, Session, bids_problems, read_dataset, repair, validate
from focalgradient.dataset.gaze import Sample, Shown, away, fixations
from focalgradient.design import DepthRatingDesign
from focalgradient.errors import InputError
from focalgradient.report import make_report

pytestmark = pytest.mark.usefixtures("unrendered")

PIXELS = 40.0
"""Per degree."""


def path(places: list[tuple[float, float]], seconds: float, rate: float = 250.0, noise: float = 0.05) -> list[Sample]:
    """Samples that stay at each place so long, with the noise of a tracker (degrees), and jump between them."""
    chance = np.random.default_rng(1)
    count = round(seconds * rate)
    found = []
    for number, (x, y) in enumerate(places):
        for step in range(count):
            dx, dy = chance.normal(0, noise * PIXELS, 2)
            found.append(Sample((number * count + step) / rate, x + dx, y + dy))
    return found


def test_stays_are_found_where_they_were_made() -> None:
    places = [(100.0, 100.0), (300.0, 120.0), (320.0, 400.0)]
    found = fixations(path(places, 0.4), PIXELS)
    assert len(found) == 3
    for (x, y), one in zip(places, found, strict=True):
        assert one.x == pytest.approx(x, abs=1)
        assert one.y == pytest.approx(y, abs=1)
        assert one.duration == pytest.approx(0.4, abs=0.03)


def test_a_sweep_is_no_fixation_and_a_blink_or_a_gap_ends_one() -> None:
    sweep = [Sample(step / 250, 4.0 * step, 0.0) for step in range(200)]  # 25 degrees a second
    assert fixations(sweep, PIXELS) == []
    still = path([(50.0, 50.0)], 1.0)
    blinked = [Sample(one.time, None, None) if 0.4 < one.time < 0.6 else one for one in still]
    assert [round(one.onset, 1) for one in fixations(blinked, PIXELS)] == [0.0, 0.6]
    lost = [one for one in still if not 0.43 < one.time < 0.5]  # longer than a period of the least rate
    assert [round(one.onset, 1) for one in fixations(lost, PIXELS)] == [0.0, 0.5]


def test_only_what_was_seen_of_the_picture_counts() -> None:
    samples = path([(0.0, 0.0), (200.0, 0.0)], 1.0)  # 5 degrees apart
    assert away(samples, [Shown(0.0, 0.95, 0.0, 0.0)], PIXELS) == pytest.approx(0.0, abs=0.05)
    assert away(samples, [Shown(0.0, 2.0, 0.0, 0.0)], PIXELS) == pytest.approx(5.0, abs=0.05)
    lost = [Sample(one.time, None, None) if one.time > 0.3 else one for one in samples]
    assert away(lost, [Shown(0.0, 1.0, 0.0, 0.0)], PIXELS) is None
    assert away([], [Shown(0.0, 1.0, 0.0, 0.0)], PIXELS) is None


DESIGN = DepthRatingDesign(
    apertures=("pinhole", "f/11", "f/5.6"),
    scenes=("a", "b"),
    repetitions=1,
    catch_trials=0,
    practice_trials=1,
    break_every=0,
    longest_run=6,
    gaze="tracker",
)
LEFT = {2, 5}


def recorded(root: Path, label: str, cut: int | None = None) -> None:
    """A session whose gaze left the object in two trials; with `cut` it ends after so many trials."""
    apparatus = Apparatus("seconds", (1024, 768), (0.5, 0.375), 0.57)
    chance = np.random.default_rng(int(label))
    files = root / f"sourcedata/sub-{label}/beh/sub-{label}_task-depthrating_beh.jsonl"
    if files.exists():
        session = Session.resume(root, "depthrating", label, apparatus=apparatus)
    else:
        session = Session.begin(root, DESIGN, label, apparatus=apparatus, about={"age": 30})
    with session:
        session.note("eye tracker", name="made", pixels_per_degree=PIXELS, sampling_rate=250)
        for number, trial in enumerate(session.remaining()):
            if number == cut:
                return
            left = trial.phase == "main" and trial.trial in LEFT
            places = [(512.0, 384.0), (812.0, 384.0)] if left else [(512.0, 384.0)]
            samples = [one._replace(time=round(one.time + 20 * number, 4)) for one in path(places, 1.0, 60)]
            shown = [Shown(20.0 * number, 20.0 * number + 3, 512.0, 384.0)]
            far = away(samples, shown, PIXELS)
            rating = float(np.exp(0.1 * trial.aperture_mm * (trial.fixation == "nearest") + 0.1 * chance.normal()))
            session.note("gaze", phase=trial.phase, trial=trial.trial, samples=[list(one) for one in samples])
            answer = Rated(
                onset=20.0 * number,
                rating=float(np.clip(rating, 0.3, 3.9)),
                response_time=1.5 + 0.1 * chance.random(),
                start=1.0 + chance.random(),
                gaze_away=far,
                gaze_left=far is None or far > DESIGN.gaze_within_deg,
            )
            session.record(trial, answer)


@pytest.mark.slow
def test_a_data_set_with_gaze_is_valid_and_reported_with_and_without(tmp_path: Path) -> None:
    root = tmp_path / "data"
    for label in ("01", "02", "03", "04"):
        recorded(root, label)
    recorded(root, "05", cut=4)
    recorded(root, "05")  # in two sittings
    found = validate(root)
    assert found.problems == ()
    assert bids_problems(root) == []
    table = read_dataset(root).depth_rating
    assert set(table["trial"][table["gaze_left"]]) == LEFT
    assert table["gaze_away"].max() == pytest.approx(7.5, abs=0.2)
    report = make_report(root)
    text = report.files["report.md"].decode()
    assert "In 10 of 60 trials" in text
    assert "Without those trials:" in text
    assert "gaze.csv" in report.files
    with gzip.open(root / "sub-05/beh/sub-05_task-depthrating_recording-eye1_physio.tsv.gz", "rt") as file:
        times = [float(line.split("\t")[0]) for line in file]
    assert times == sorted(times)


@pytest.mark.parametrize("end", ["physio.tsv.gz", "physioevents.json"])
def test_files_of_the_gaze_that_were_changed_are_found_and_repaired(tmp_path: Path, end: str) -> None:
    root = tmp_path / "data"
    recorded(root, "01")
    place = root / f"sub-01/beh/sub-01_task-depthrating_recording-eye1_{end}"
    whole = place.read_bytes()
    for damaged in (b"", whole[: len(whole) // 2], _changed(whole)):
        place.write_bytes(damaged)
        assert any(place.name in problem for problem in validate(root).problems)
    repair(root)
    assert validate(root).problems == ()
    place.write_bytes(gzip.compress(gzip.decompress(whole), 1) if end.endswith("gz") else whole)
    assert validate(root).problems == ()  # other compression, the same rows
    place.unlink()
    assert any("is missing" in problem for problem in validate(root).problems)


def _changed(content: bytes) -> bytes:
    if content[:2] == b"\x1f\x8b":
        return gzip.compress(gzip.decompress(content).replace(b"1", b"2", 1))
    key = "SamplingFrequency" if b"SamplingFrequency" in content else "OnsetSource"
    return json.dumps(json.loads(content) | {key: "other"}).encode()


def test_answers_and_design_must_agree_on_the_gaze(tmp_path: Path) -> None:
    apparatus = Apparatus("seconds")
    with Session.begin(tmp_path / "data", DESIGN, "01", apparatus=apparatus) as session:
        trial = session.remaining()[0]
        with pytest.raises(InputError, match="gaze_left is None, but must be true or false"):
            session.record(trial, Rated(onset=0.0, rating=1.0, response_time=1.0))
    with Session.begin(tmp_path / "other", DepthRatingDesign(), "01", apparatus=apparatus) as session:
        trial = session.remaining()[0]
        with pytest.raises(InputError, match="gaze is 'none'"):
            session.record(trial, Rated(onset=0.0, rating=1.0, response_time=1.0, gaze_left=True))
