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
EACH_PICTURE = 8.0  # seconds to render a picture, which is cached
PICTURES = 7  # of a scene: through the pinhole, and through three apertures with either object in focus


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
    """Estimate the duration of the sessions, with that of the pictures that are not in the cache yet."""
    scenes = FULL_SCENES if full else SCENES
    made = max(len([*(cache_folder() / f"{name}-{scenes}").glob("*/*.png")]) for name in ("natural", "spheres-512"))
    return TAKING_PART + EACH_PICTURE * max(scenes * PICTURES - made, 0)


def take_part(
    out: Path,
    *,
    observer: str = "default",
    full: bool = False,
    progress: Progress | None = None,
    name: Callable[[str], object] | None = None,
) -> Path:
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
    name
        Function called with a description of the work, such as the scene that is rendered.

    Returns
    -------
    Path
        Folder of the data set.
    """
    whole = seconds(full=full)
    drawing = 1 - TAKING_PART / whole

    def rendered(share: float, what: str) -> None:
        (progress or (lambda share: None))(drawing * share)
        if name is not None:
            name(what)

    def report(share: float) -> None:
        (progress or (lambda share: None))(drawing + (1 - drawing) * share)

    pictures = natural_pictures(rendered, full=full)
    if name is not None:
        name("observers")
    rating = DepthRatingDesign(scenes=pictures.scenes[1:], standard_scene=pictures.scenes[0])
    turning = NeckerDesign()
    with processes(os.cpu_count() or 1) as pool:
        encoded = encoded_stimuli(pictures, pool, lambda share, what: report(0.4 * share))
        simulate(
            *(rating, out),
            observers=OBSERVERS,
            seed=SEED,
            observer=observer,
            encoded=encoded,
            stimuli=pictures.folder,
            executor=pool,
            progress=lambda share, what: report(0.4 + 0.3 * share),
        )
        simulate(
            *(turning, out),
            observers=OBSERVERS,
            seed=SEED,
            observer=observer,
            encoded=encoded_cubes(turning, pool),
            executor=pool,
            progress=lambda share, what: report(0.7 + 0.3 * share),
        )
    return out
