"""Simulated observers take part in both experiments: the data set that the figures of answers are made of."""

from __future__ import annotations

import os
from pathlib import Path

from report import Progress

from focalgradient.design import DepthRatingDesign, NeckerDesign
from focalgradient.observers import encoded_cubes, encoded_stimuli, simulate, small_set
from focalgradient.parallel import processes

__all__ = ["OBSERVERS", "SEED", "take_part"]

OBSERVERS = 20
SEED = 1987
FEW = ("spheres-01", "spheres-02", "spheres-03", "spheres-04")  # scenes, for a first look


def take_part(out: Path, *, observer: str = "default", full: bool = False, progress: Progress | None = None) -> Path:
    """Let `OBSERVERS` of them look at the pictures and at the cube, and record what they answer as a BIDS data set.

    Parameters
    ----------
    out
        Folder of the data set.
    observer
        By name, of `focalgradient.observers.OBSERVERS`.
    full
        All scenes of the usual design instead of four.
    progress
        Called now and then with the share done, 0 to 1.

    Returns
    -------
    Path
        The folder.
    """
    report = progress or (lambda share: None)
    rating = DepthRatingDesign() if full else DepthRatingDesign(scenes=FEW)
    pictures = small_set(1 + len(rating.scenes), lambda share, what: report(0.5 * share))
    turning = NeckerDesign(strengths_mm=(4.0, 12.0))  # the second is as strong as the rigidity of the cube
    with processes(os.cpu_count() or 1) as pool:
        seen = encoded_stimuli(pictures, pool, lambda share: report(0.5 + 0.2 * share))
        simulate(
            *(rating, out),
            observers=OBSERVERS,
            seed=SEED,
            observer=observer,
            seen=seen,
            stimuli=pictures.folder,
            executor=pool,
            progress=lambda share: report(0.7 + 0.15 * share),
        )
        simulate(
            *(turning, out),
            observers=OBSERVERS,
            seed=SEED,
            observer=observer,
            seen=encoded_cubes(turning, pool),
            executor=pool,
            progress=lambda share: report(0.85 + 0.15 * share),
        )
    return out
