"""Accommodation to a sinusoidally moving target in several illuminants (Kruger et al. 1993)."""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache, partial
from math import inf
from pathlib import Path

import numpy as np

from focalgradient.observers import Observer
from focalgradient.published.following import ComplexArray, gain_of_mean, phase_of_mean, responses
from focalgradient.published.record import Finding, Prediction, Published, jackknife

__all__ = ["PAIRS", "against_white", "kruger1993"]

PAIRS = 24
"""Number of pairs of trials with opposite target motion, fixed before the outcome was known (our choice)."""

SECONDS = 6.0
"""Duration of a trial, in seconds (our choice)."""

Measure = Callable[[ComplexArray, ComplexArray], float]


@lru_cache(maxsize=64)
def _responses(pupil: float, light: str, pairs: int, kept: Path | None) -> ComplexArray:
    return responses(pupil, light, pairs, SECONDS, kept)


def against_white(observer: Observer, measure: Measure, light: str, pairs: int, kept: Path | None = None) -> Prediction:
    """Compare the mean response over pairs of trials in a light with that in white, for the observer's pupil.

    The standard error is from the jackknife over pairs, with the same seeds in both lights.
    """
    seen, white = (_responses(observer.pupil, one, pairs, kept) for one in (light, "white"))
    left_out = [measure(np.delete(seen, pair), np.delete(white, pair)) for pair in range(pairs)]
    return jackknife(measure(seen, white), left_out)


def kruger1993(pairs: int = PAIRS, kept: Path | None = None) -> Published:
    """Return the record of the experiment, with predictions from `pairs` pairs of trials.

    Parameters
    ----------
    pairs
        Number of pairs, 2 or more; about 10 s of processor time each, for all lights together.
    kept
        Cache folder with one file per pair, so that interrupted runs continue; empty it if the model changes.
    """
    gain = partial(against_white, measure=gain_of_mean, pairs=pairs, kept=kept)
    phase = partial(against_white, measure=phase_of_mean, pairs=pairs, kept=kept)
    remark = f"{pairs} pairs of trials of 6 s; the eye of `eye.accommodate` with the observer's pupil."
    return Published(
        key="kruger1993",
        citation="Kruger, Mathews, Aggarwala and Sanchez 1993, Vision Research 33, 1397-1411",
        doi="10.1016/0042-6989(93)90046-y",
        design="Accommodation of 25 people was measured while a target moved sinusoidally from 1.5 to 2.5 D at 0.2 Hz "
        "in light of 590 nm, or in white with chromatic aberration normal, neutralised or reversed.",
        conditions=("white", "monochromatic", "neutralised", "reversed"),
        needs="an accommodation stimulator with achromatising lenses, and an infrared optometer",
        findings=(
            Finding(
                quantity="gain in light of 590 nm over that in white",
                units="1",
                printed="gain decreases substantially",
                low=-inf,
                high=1.0,
                source="abstract",
                ask=partial(gain, light="monochromatic"),
                remark=remark,
            ),
            Finding(
                quantity="gain with aberration neutralised over that in white",
                units="1",
                printed="gain decreases substantially",
                low=-inf,
                high=1.0,
                source="abstract",
                ask=partial(gain, light="neutralised"),
                remark=remark,
            ),
            Finding(
                quantity="phase in light of 590 nm less that in white",
                units="degrees",
                printed="phase-lag increases",
                low=-inf,
                high=0.0,
                source="abstract",
                ask=partial(phase, light="monochromatic"),
                remark=remark,
            ),
            Finding(
                quantity="phase with aberration neutralised less that in white",
                units="degrees",
                printed="phase-lag increases",
                low=-inf,
                high=0.0,
                source="abstract",
                ask=partial(phase, light="neutralised"),
                remark=remark,
            ),
            Finding(
                quantity="gain with aberration reversed over that in white",
                units="1",
                printed="severely disrupts accommodation",
                low=-inf,
                high=0.5,
                source="abstract",
                ask=partial(gain, light="reversed"),
                remark=f"{remark} A gain below half is our reading of severe.",
            ),
        ),
    )
