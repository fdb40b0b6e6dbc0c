"""Record the frozen data sets: a small session of three participants, and one that was cut off, for each task.

Run once, with the version whose sessions are kept: python tests/frozen/record.py FOLDER
"""

from __future__ import annotations

import sys
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from focalgradient.dataset import Apparatus, Chosen, Press, Rated, Session, Watched
from focalgradient.design import BlurThresholdDesign, DepthRatingDesign, NeckerDesign, Pinhole

SCREEN = Apparatus("seconds since the window opened", screen_px=(1920, 1080), screen_m=(0.53, 0.3), refresh_hz=60.0)
SHORT: dict[str, Any] = {"practice_trials": 0, "break_every": 0, "least_break_s": 0.0, "seed": 3}
DESIGNS: dict[str, Any] = {
    "depthrating": DepthRatingDesign(
        scenes=["spheres-01", "spheres-02"],
        apertures=["pinhole", "f/5.6"],
        catch_trials=1,
        catch_pictures=["standard"],
        repetitions=1,
        **SHORT,
    ),
    "necker": NeckerDesign(strengths_mm=[4.0], trial_s=10.0, catch_trials=0, repetitions=1, **SHORT),
    "pinhole": Pinhole(forms=["picture"], scenes=["spheres-01"], repetitions=2, **SHORT),
    "blurthreshold": BlurThresholdDesign(scenes=["spheres-01"], catch_trials=1, repetitions=6, **SHORT),
}


def answer(design: Any, trial: Any, person: int, keys: Any) -> Any:
    """Return the answer of a person whose depth rises with the aperture."""
    onset, slow = 10.0 * trial.trial, 0.1 * ((trial.trial + person) % 7)
    times = {"onset": onset, "response_time": 1.0 + slow}
    if design.task == "depthrating":
        wide = trial.aperture != "pinhole" and not trial.catch
        return Rated(rating=round(1.0 + 0.5 * wide + slow * (not trial.catch), 4), start=0.5, **times)
    if design.task == "pinhole":
        return Rated(rating=round({"pinhole": 1.2}.get(trial.viewing, 0.9) + slow, 4), **times)
    if design.task == "necker":
        change = 3.0 + slow * 5
        presses = [
            Press(0.5, keys["rigid"], True),
            Press(change, keys["rigid"], False),
            Press(change + 0.1, keys["nonrigid"], True),
            Press(9.0 + slow, keys["nonrigid"], False),
        ]
        return Watched(onset=onset, presses=presses, trial_duration=trial.trial_s)
    level = design.levels[-1] if trial.catch else design.levels[(trial.trial * 7 + person) % len(design.levels)]
    right = level > 0.2
    return Chosen(level=level, answer=trial.interval if right else 3 - trial.interval, correct=right, **times)


def record(folder: Path) -> None:
    """Record all data sets into a folder, one for each task."""
    for task, design in DESIGNS.items():
        for person in range(1, 5):
            begun = datetime(2026, 11, 27, 9, person, tzinfo=UTC)
            with Session.begin(folder / task, design, f"{person:02}", apparatus=SCREEN, time=begun) as session:
                keys = session.design.keys_of(f"{person:02}") if task == "necker" else None
                left = session.remaining()
                for trial in left[: len(left) // 2] if person == 4 else left:
                    session.record(trial, answer(design, trial, person, keys))


if __name__ == "__main__":
    record(Path(sys.argv[1]))
