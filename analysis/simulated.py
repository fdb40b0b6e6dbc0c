"""Data set of simulated observers in both experiments, from which the figures of answers are made."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path

from report import Progress

from focalgradient.design import DepthRatingDesign, NeckerDesign
from focalgradient.display import Display
from focalgradient.observers import cache_folder, encoded_cubes, encoded_stimuli, natural_set, simulate
from focalgradient.parallel import processes
from focalgradient.render.mitsuba_backend import variant
from focalgradient.stimuli import StimulusSet, make_depth_rating

__all__ = ["OBSERVERS", "SEED", "natural_pictures", "seconds", "take_part"]

OBSERVERS = 20
SEED = 1987
SCENES = 5  # including the standard
FULL_SCENES = 13
TAKING_PART = 45.0  # approximate duration of the observers' sessions, in seconds
EACH_SCENE = 60.0  # seconds to render the pictures of a scene, which are cached


def natural_pictures(progress: Callable[[float, str], object] | None = None, *, full: bool = False) -> StimulusSet:
    """Return the cached pictures of the figures, 512 pixels wide: path traced, or plain spheres without Mitsuba."""
    scenes = FULL_SCENES if full else SCENES
    if variant() is not None:
        return natural_set(scenes, progress)
    return make_depth_rating(
        cache_folder() / f"spheres-512-{scenes}",
        scenes=scenes,
        size=512,
        display=Display(pixel_pitch=0.25e-3),
        engine="cast",
        samples=64,
        progress=progress,
    )


def seconds(*, full: bool = False) -> float:
    """Estimate the duration of the sessions, on the first run including the pictures, which are cached."""
    scenes = FULL_SCENES if full else SCENES
    made = any((cache_folder() / f"{name}-{scenes}").exists() for name in ("natural", "spheres-512"))
    return TAKING_PART if made else TAKING_PART + scenes * EACH_SCENE


def take_part(out: Path, *, observer: str = "default", full: bool = False, progress: Progress | None = None) -> Path:
    """Let `OBSERVERS` simulated observers respond to the pictures and the cube; record a BIDS data set.

    Parameters
    ----------
    out
        Folder of the data set.
    observer
        Name of the observer in `focalgradient.observers.OBSERVERS`.
    full
        True for all scenes of the default design instead of four.
    progress
        Function called with the completed fraction, 0 to 1.

    Returns
    -------
    Path
        Folder of the data set.
    """
    report = progress or (lambda share: None)
    pictures = natural_pictures(lambda share, what: report(0.5 * share), full=full)
    rating = DepthRatingDesign(scenes=pictures.scenes[1:], standard_scene=pictures.scenes[0])
    turning = NeckerDesign()
    with processes(os.cpu_count() or 1) as pool:
        encoded = encoded_stimuli(pictures, pool, lambda share, what: report(0.5 + 0.2 * share))
        simulate(
            *(rating, out),
            observers=OBSERVERS,
            seed=SEED,
            observer=observer,
            encoded=encoded,
            stimuli=pictures.folder,
            executor=pool,
            progress=lambda share, what: report(0.7 + 0.15 * share),
        )
        simulate(
            *(turning, out),
            observers=OBSERVERS,
            seed=SEED,
            observer=observer,
            encoded=encoded_cubes(turning, pool),
            executor=pool,
            progress=lambda share, what: report(0.85 + 0.15 * share),
        )
    return out
