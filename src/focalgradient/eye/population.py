"""Simulated people: random pupil, chromatic and other aberrations, and microfluctuations, each from its own seed."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

import numpy as np

from focalgradient.errors import InputError, checked, described, is_number
from focalgradient.eye.chromatic import chromatic_difference
from focalgradient.eye.fluctuation import Microfluctuations
from focalgradient.eye.measured import ZernikePopulation
from focalgradient.eye.model_eye import Eye
from focalgradient.quantities import Seed, Whole

__all__ = ["Person", "draw_people"]


@dataclass(frozen=True, slots=True)
class Person:
    """Eye accommodated to infinity, and the microfluctuations of its accommodation."""

    eye: Eye
    fluctuation: Microfluctuations


@checked
def draw_people(
    count: Annotated[int, Whole(1)],
    seed: Seed,
    *,
    pupil_diameter: tuple[float, float] = (0.004, 0.0008),
    chromatic_span: tuple[float, float] = (1.54, 0.39),
    rms: tuple[float, float] = (0.1, 0.5),
    beta: tuple[float, float] = (1.1, 1.5),
    aberrations: ZernikePopulation | None = None,
) -> list[Person]:
    """Draw `count` people; each depends on seed and number alone, and each quantity has its own random stream.

    Parameters
    ----------
    count
        Number of people.
    seed
        Random seed.
    pupil_diameter
        Mean and standard deviation in metres of a normal distribution, drawn between 1.5 and 9 mm.
    chromatic_span
        Mean and standard deviation in dioptres of a normal distribution of the difference of refraction between 450 and
        650 nm, drawn above 0.3 D. By default as measured in eight people; the mean chromatic eye has 1.23 D, less than
        these had on average.
    rms, beta
        Limits of the standard deviation of accommodation (D, log-uniform) and of the slope of its low band (uniform).
    aberrations
        Population from which each eye's wavefront is drawn, resized to its pupil, which is then drawn within the
        measured one. None: chromatic aberration only.

    Raises
    ------
    InputError
        If the count is not positive, or a pair is not two valid numbers.

    Examples
    --------
    >>> person = draw_people(3, seed=1)[2]
    >>> [round(drawn, 2) for drawn in (1e3 * person.eye.pupil_diameter, person.eye.chromatic_scale)]
    [3.04, 0.99]
    """
    for name, pair, low, high, what in (
        ("pupil_diameter", pupil_diameter, 1.5e-3, 9e-3, "a mean between 0.0015 and 0.009, and a standard deviation"),
        ("chromatic_span", chromatic_span, 0.3, np.inf, "a mean above 0.3, and a standard deviation"),
        ("rms", rms, 1e-9, np.inf, "the lower and the upper end of a range"),
        ("beta", beta, 0.0, np.inf, "the lower and the upper end of a range"),
    ):
        if not (isinstance(pair, tuple | list) and len(pair) == 2 and all(map(is_number, pair))):
            raise InputError(f"{name} is {described(pair)}, but must be two numbers.")
        least = pair[0] if what.startswith("the lower") else 0
        if not (low <= pair[0] < high and least <= pair[1] < np.inf):
            raise InputError(f"{name} is {pair!r}, but must be {what}.")
    largest = 9e-3 if aberrations is None else min(9e-3, aberrations.measured_diameter)
    if not pupil_diameter[0] < largest:
        raise InputError(
            f"pupil_diameter has a mean of {1e3 * pupil_diameter[0]:g} mm, but the wavefronts were measured over "
            f"{1e3 * largest:g} mm: draw smaller pupils, or give wavefronts of larger ones."
        )
    mean_span = float(chromatic_difference(650, 450))

    def person(number: int) -> Person:
        pupil, colour, fluctuation, wavefront = (np.random.default_rng([seed, number, one]) for one in range(4))
        diameter = _normal(pupil, *pupil_diameter, 1.5e-3, largest)
        scale = _normal(colour, *chromatic_span, 0.3, np.inf) / mean_span
        if aberrations is None:
            eye = Eye(diameter, accommodation=0.0, chromatic_scale=scale)
        else:
            eye = Eye.from_zernike(
                aberrations.drawn(wavefront),
                diameter,
                measured_diameter=aberrations.measured_diameter,
                measured_nm=aberrations.measured_nm,
                chromatic_scale=scale,
            )
        size, slope = np.exp(fluctuation.uniform(*np.log(rms))), fluctuation.uniform(*beta)
        course = Microfluctuations(rms=float(size), beta=slope, seed=int(fluctuation.integers(2**31)))
        return Person(eye, course)

    return [person(number) for number in range(count)]


def _normal(random: np.random.Generator, mean: float, sd: float, low: float, high: float) -> float:
    """Draw a normal deviate truncated to between `low` and `high`."""
    while True:
        value = float(random.normal(mean, sd))
        if low <= value <= high:
            return value
