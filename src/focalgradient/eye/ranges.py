"""What an eye can be given: pupils up to 9 mm, light from 380 to 780 nm, moments in order."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from focalgradient.errors import InputError, check_finite, described, is_number

__all__ = ["check_pupil", "ordered_times", "wavelengths"]


def check_pupil(pupil_diameter: Any) -> None:
    """Refuse a pupil that no eye has; metres."""
    if not (is_number(pupil_diameter) and 0 < pupil_diameter <= 9e-3):
        raise InputError(
            f"pupil_diameter is {described(pupil_diameter)}, but must be above 0 and at most 0.009 (9 mm): "
            "give it in metres."
        )


def wavelengths(wavelength_nm: ArrayLike, name: str = "wavelength_nm") -> NDArray[np.float64]:
    """Wavelengths as an array, refused unless all are visible (380 to 780 nm)."""
    values = np.asarray(wavelength_nm, dtype=float)
    if not np.all((values >= 380) & (values <= 780)):
        raise InputError(f"{name} is {_shown(wavelength_nm)}, but must lie between 380 and 780: give it in nanometres.")
    return values


def ordered_times(times: ArrayLike) -> NDArray[np.float64]:
    """Moments in seconds as an array, refused unless each is later than the one before."""
    array = check_finite("times", times, "seconds")
    if array.ndim > 1 or not np.all(np.diff(np.atleast_1d(array)) > 0):
        raise InputError(f"times is {_shown(times)}, but each moment must be later than the one before: sort them.")
    return array


def _shown(values: ArrayLike) -> str:
    text = repr(values) if np.ndim(values) == 0 else np.array2string(np.asarray(values), threshold=6, edgeitems=3)
    return text.replace("\n", "")
