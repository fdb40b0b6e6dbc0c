"""Accommodation to a sinusoidally moving target in several lights, after Kruger et al. (1993)."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import asdict, dataclass, replace
from functools import lru_cache, partial
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from focalgradient.eye import Accommodation, Stimulus, accommodate
from focalgradient.files import write_whole
from focalgradient.observers import Observer
from focalgradient.published.record import Prediction, jackknife

__all__ = ["LIGHTS", "PAIRS", "Followed", "against_white", "follow", "gain_of_mean", "phase_of_mean", "responses"]

ComplexArray = NDArray[np.complex128]

LIGHTS: Mapping[str, Stimulus] = {
    "white": Stimulus(illuminant="3000 K"),
    "monochromatic": Stimulus(light_nm=590.0, illuminant="3000 K"),
    "neutralised": Stimulus(chromatic_scale=0.0, illuminant="3000 K"),
    "reversed": Stimulus(chromatic_scale=-1.0, illuminant="3000 K"),
}
"""Lights and chromatic aberrations of the experiment."""

HERTZ, MEAN, AMPLITUDE = 0.2, 2.0, 0.5
"""Temporal frequency (Hz), mean and amplitude (D) of the target, which moves from 1.5 to 2.5 D."""

PAIRS, SECONDS = 24, 6.0
"""Number of pairs of trials with opposite target motion, fixed before the outcome was known, and the duration of a
trial in seconds (our choice).
"""

SKIPPED = 1.0
"""Duration of the start of a trial that is not analysed, in seconds (our choice)."""


@dataclass(frozen=True, slots=True)
class Followed:
    """Accommodative response to the moving target.

    Parameters
    ----------
    response
        Accommodation divided by target at the target's frequency: modulus is the gain, angle the phase.
    focus, error
        Mean focus, and root-mean-square focus error, in dioptres.
    """

    response: complex
    focus: float
    error: float


def _target(way: int, time: float) -> float:
    return MEAN + way * AMPLITUDE * math.sin(2 * math.pi * HERTZ * time)


def follow(eye: Accommodation, light: Stimulus, seconds: float, seed: int) -> Followed:
    """Simulate accommodation to the target in two trials of `seconds` with opposite target motion.

    The response is computed from half the difference between the trials, in which fluctuations common to both cancel;
    mean and error are over both trials.

    >>> found = follow(Accommodation(pupil_diameter=0.004), LIGHTS["white"], 3.0, seed=0)
    >>> bool(0.5 < abs(found.response) < 1.2), bool(abs(found.focus - MEAN) < 0.5)
    (True, True)
    """
    there, back = (accommodate(partial(_target, way), seconds, eye, light, seed=seed) for way in (1, -1))
    halves = {name: (getattr(there, name) - getattr(back, name)) / 2 for name in ("target", "accommodation")}
    late = there.times >= SKIPPED
    focus = np.concatenate([there.accommodation[late], back.accommodation[late]])
    error = focus - np.concatenate([there.target[late], back.target[late]])
    response = replace(there, **halves).response(HERTZ, skip=SKIPPED)
    return Followed(response, float(focus.mean()), float(np.sqrt(np.mean(error**2))))


def responses(
    pupil: float, light: str, pairs: int, seconds: float, kept: Path | None = None, eye: Accommodation | None = None
) -> ComplexArray:
    """Return the response (accommodation divided by target at the target's frequency) in each pair of trials.

    Parameters
    ----------
    pupil
        Pupil diameter in metres.
    light
        Light, one of `LIGHTS`.
    pairs
        Number of pairs, with seeds 0, 1, ...
    seconds
        Duration of a trial, in seconds.
    kept
        Cache folder with one file per pair, so that interrupted runs continue; empty it if the model changes. None: no
        cache.
    eye
        Accommodation model; None: the default one with that pupil.
    """
    model = replace(Accommodation() if eye is None else eye, pupil_diameter=pupil)
    return np.array([*_responses(model, light, pairs, seconds, kept)])


def _responses(eye: Accommodation, light: str, pairs: int, seconds: float, kept: Path | None) -> Iterator[complex]:
    for seed in range(pairs):
        name = f"{light}-{1000 * eye.pupil_diameter:g}mm-{seconds:g}s-{seed}.json"
        file = None if kept is None else kept / name
        if file is not None and file.exists():
            known = json.loads(file.read_text(encoding="utf-8"))
            yield complex(known["real"], known["imaginary"])
            continue
        course = follow(eye, LIGHTS[light], seconds, seed)
        if file is not None:
            file.parent.mkdir(parents=True, exist_ok=True)
            about = {"real": course.response.real, "imaginary": course.response.imag, **asdict(course)}
            about.pop("response")
            write_whole(file, json.dumps(about).encode())
        yield course.response


def gain_of_mean(light: ComplexArray, white: ComplexArray) -> float:
    """Return the gain of the mean response in a light relative to that in white.

    >>> gain_of_mean(np.array([0.5, 0.5j]), np.array([1.0, 1.0j]))
    0.5
    """
    return float(abs(np.mean(light)) / abs(np.mean(white)))


def phase_of_mean(light: ComplexArray, white: ComplexArray) -> float:
    """Return the phase of the mean response in a light minus that in white, in degrees; more lag is negative.

    >>> round(phase_of_mean(np.array([1.0 - 1.0j]), np.array([2.0 + 0.0j])), 6)
    -45.0
    """
    return math.degrees(float(np.angle(np.mean(light) / np.mean(white))))


@lru_cache(maxsize=64)
def _kept_responses(pupil: float, light: str, pairs: int, kept: Path | None) -> ComplexArray:
    return responses(pupil, light, pairs, SECONDS, kept)


def against_white(
    observer: Observer,
    measure: Callable[[ComplexArray, ComplexArray], float],
    light: str,
    pairs: int,
    kept: Path | None = None,
) -> Prediction:
    """Compare the mean response over pairs of trials in a light with that in white, for the observer's pupil.

    The standard error is from the jackknife over pairs, with the same seeds in both lights.
    """
    seen, white = (_kept_responses(observer.pupil, name, pairs, kept) for name in (light, "white"))
    left_out = [measure(np.delete(seen, pair), np.delete(white, pair)) for pair in range(pairs)]
    return jackknife(measure(seen, white), left_out)
