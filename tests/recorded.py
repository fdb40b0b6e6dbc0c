"""Data sets of simulated subjects of a statistical model, recorded as sessions record them."""

import math
from pathlib import Path

import numpy as np

from focalgradient.dataset import Apparatus, Press, Rated, Session, Watched
from focalgradient.design import DepthRatingDesign, NeckerDesign, NeckerTrial
from focalgradient.power import Model, simulated_ratings

APPARATUS = Apparatus("seconds of the simulation, from the start of the sitting")
RATING = DepthRatingDesign(
    scenes=["spheres-01", "spheres-02"], catch_trials=2, catch_pictures=["standard"], practice_trials=0
)
CUBE = NeckerDesign(strengths_mm=[4.0], practice_trials=0, trial_s=20.0)


def record_ratings(root: Path, subjects: int, model: Model | None = None, *, design=RATING, kind="simulated") -> Path:
    table = simulated_ratings(design, subjects, model or Model(effect=2.0), np.random.default_rng(1))
    for name, rows in table.groupby("participant_id", sort=False):
        with Session.begin(root, design, name.removeprefix("sub-"), apparatus=APPARATUS, kind=kind) as session:
            for trial, rating in zip(session.remaining(), rows["rating"], strict=True):
                rating = min(max(rating, design.least_rating), design.most_rating)
                session.record(trial, Rated(onset=5.0 * trial.trial, rating=rating, response_time=1.5))
    return root


def record_necker(root: Path, subjects: int) -> Path:
    """Readings that alternate; a gradient that agrees with one makes it last exp(1 / 2) times as long."""
    rng = np.random.default_rng(1)
    for number in range(1, subjects + 1):
        level = rng.normal(0.5, 0.2)
        with Session.begin(root, CUBE, f"{number:02}", apparatus=APPARATUS, kind="simulated") as session:
            keys = session.design.keys_of(session.files.participant)
            for trial in session.remaining():
                assert isinstance(trial, NeckerTrial)
                lean = {"none": 0.0, "rigid": -1.0, "nonrigid": 1.0}[trial.gradient] + 4 * (trial.shape == "nonrigid")
                presses, now, rigid = [], rng.uniform(0.2, 0.5), True
                while now < trial.trial_s:
                    lasts = rng.gamma(3, math.exp(level - lean / 2 if rigid else -level + lean / 2))
                    key = keys["rigid" if rigid else "nonrigid"]
                    presses.append(Press(now, key, True))
                    if now + lasts < trial.trial_s:
                        presses.append(Press(now + lasts, key, False))
                    now, rigid = now + lasts + 0.02, not rigid
                answer = Watched(onset=60.0 * trial.trial, presses=presses, trial_duration=trial.trial_s)
                session.record(trial, answer)
    return root


def edit(path: Path, row: int, column: str, text: str) -> None:
    lines = [line.split("\t") for line in path.read_text().splitlines()]
    lines[row - 1][lines[0].index(column)] = text
    path.write_text("".join("\t".join(line) + "\n" for line in lines))


def rating_file(root: Path, participant: str = "01") -> Path:
    return root / f"sub-{participant}" / "beh" / f"sub-{participant}_task-depthrating_beh.tsv"
