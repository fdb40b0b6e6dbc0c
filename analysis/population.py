"""Eyes drawn from a population and their noisy views of walls, with depth estimated with each eye's own optics.

`people` draws the results; `benchmarks/depth_of_people.py` compares estimators with less knowledge.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from focalgradient import View, recover_depth
from focalgradient.eye import Cones, Eye, Oscillation, ZernikePopulation, eye_views, osa_order, score
from focalgradient.eye.cones import S_FINEST_CPD
from focalgradient.optics import Optics

PIXEL = np.radians(1 / 60)
FOCUS, SHAPE = 2.0, (112, 112)
NEAR, FAR = 0.3, 2.0
"""Limits of the depth search, in metres."""

PUPILS = (0.003, 0.005)
KINDS = ("bands", "moments")
MOMENTS = [0.125, 0.375]
"""Times of the views in seconds: the extremes of an oscillation of 0.25 D at 2 Hz."""


FARTHEST, NEAREST = -0.9, 1.2
"""Range of the walls, in dioptres beyond focus."""

GAP = 0.125
"""Range on either side of focus without walls, in dioptres."""

NOISE, CORRELATION = 0.01, 0.95
"""Standard deviation of pixel noise relative to the mean; correlation between the textures of the bands."""

Row = dict[str, float | str]


def population(folder: Path | None) -> ZernikePopulation:
    """Return the population (over 6 mm) whose mean and covariance are in `folder`; None: a substitute.

    The substitute is our choice: independent coefficients with mean 0, from the third order on, with standard
    deviations of 0.2 um that halve with each radial order.
    """
    if folder is not None:
        return ZernikePopulation.read(folder / "mean_6mm.csv", folder / "covariance_6mm.csv", 0.006)
    sd = np.array([0.0 if osa_order(j)[0] < 3 else 0.2 * 0.5 ** (osa_order(j)[0] - 3) for j in range(28)])
    return ZernikePopulation(np.zeros(28), np.diag(sd**2), 0.006)


def walls(count: int) -> NDArray[np.float64]:
    """Return the vergences of walls in dioptres beyond focus, evenly spaced except for a gap around focus."""
    even = np.linspace(FARTHEST, NEAREST - 2 * GAP, count)
    return np.where(even > -GAP, even + 2 * GAP, even)


def at_focus(coefficients: Sequence[float], pupil: float) -> Eye:
    """Return the eye with these coefficients, corrected for sphere and cylinder, accommodated to FOCUS."""
    corrected = [0.0 if j < 6 else float(value) for j, value in enumerate(coefficients)]
    eye = Eye.from_zernike(corrected, pupil, measured_diameter=0.006)
    return replace(eye, accommodation=eye.accommodation + FOCUS - eye.focus_vergence)


def cones_of(kind: str, eye: Eye) -> list[Cones]:
    """Return the cones of an eye's two views: two wavebands, or two moments."""
    if kind == "moments":
        return [Cones.of(one, "L+M") for one in eye.through(MOMENTS, Oscillation())]
    blue = Cones.of(eye, "S", finest_cpd=S_FINEST_CPD)
    return [Cones.of(eye, "L+M"), blue]


def seen(cones: Sequence[Cones], beyond: float, seed: int) -> list[View]:
    """Return noisy views of a wall `beyond` focus (D), with correlated textures of the bands."""
    found = eye_views(1 / (FOCUS - beyond), cones, SHAPE, PIXEL, noise=NOISE, correlation=CORRELATION, seed=seed)
    return [one.view for one in found]


def read(views: Sequence[View], optics: Sequence[Optics], beyond: float) -> Row:
    """Score the depth estimated with these `optics`, over valid pixels and over all pixels."""
    depth = recover_depth(
        [View(one.image, own, PIXEL) for one, own in zip(views, optics, strict=True)], near=NEAR, far=FAR
    )
    truth = np.full(SHAPE, 1 / (FOCUS - beyond))
    off = np.abs(depth.vergence - 1 / truth)[depth.valid] / depth.vergence_sd[depth.valid]
    # estimates of rejected pixels are scored separately
    whole = score(depth.vergence, np.ones(SHAPE, bool), truth, FOCUS)
    return {
        **score(depth.vergence, depth.valid, truth, FOCUS),
        "within_2_sd": float(np.mean(off < 2)) if off.size else np.nan,
        "unmasked_error_D": whole["median_error_D"],
        "unmasked_side": whole["side_right"],
    }


@dataclass(frozen=True)
class Look:
    """One eye and pupil: index, coefficients, and vergences of the walls (D beyond focus)."""

    number: int
    pupil: float
    coefficients: tuple[float, ...]
    beyond: tuple[float, ...]


def drawn(people: ZernikePopulation, number: int) -> tuple[float, ...]:
    """Return the coefficients of one eye of the population; they do not depend on the number drawn."""
    return tuple(people.drawn(np.random.default_rng([1, number])).tolist())


def looked(look: Look) -> list[Row]:
    """Score each wall in the two wavebands of an eye with known optics."""
    cones = cones_of("bands", at_focus(look.coefficients, look.pupil))
    about: Row = {"eye": look.number, "pupil_mm": 1e3 * look.pupil, "views": "bands", "reader": "own"}
    return [
        {**about, "beyond_D": beyond, **read(seen(cones, beyond, 1000 * look.number + 1 + place), cones, beyond)}
        for place, beyond in enumerate(look.beyond)
    ]
