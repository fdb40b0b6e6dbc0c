"""What an eye can be given: pupils up to 9 mm, light from 380 to 780 nm, moments in order."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from focalgradient.errors import InputError

__all__ = ["check_number", "check_pupil", "finite", "ordered_times", "wavelengths"]


def check_pupil(pupil_diameter: Any) -> None:
    """Refuse a pupil that no eye has; metres."""
    if not (_is_number(pupil_diameter) and 0 < pupil_diameter <= 9e-3):
        raise InputError(
            f"pupil_diameter is {pupil_diameter!r}, but must be above 0 and at most 0.009 (9 mm): give it in metres."
        )


def check_number(name: str, value: Any, unit: str, *, least: float = -np.inf) -> None:
    """Refuse what is no finite number, or one below `least`."""
    if not (_is_number(value) and least <= value < np.inf and value > -np.inf):
        bound = "" if least == -np.inf else f" of {least:g} or more"
        raise InputError(f"{name} is {value!r}, but must be a finite number{bound}: give it in {unit}.")


def wavelengths(wavelength_nm: ArrayLike, name: str = "wavelength_nm") -> NDArray[np.float64]:
    """Wavelengths as an array, refused unless all are visible (380 to 780 nm)."""
    values = np.asarray(wavelength_nm, dtype=float)
    if not np.all((values >= 380) & (values <= 780)):
        raise InputError(f"{name} is {_shown(wavelength_nm)}, but must lie between 380 and 780: give it in nanometres.")
    return values


def finite(name: str, values: ArrayLike, unit: str) -> NDArray[np.float64]:
    """`values` as an array, refused unless all are finite."""
    array = np.asarray(values, dtype=float)
    if not np.all(np.isfinite(array)):
        raise InputError(f"{name} holds NaN or infinite values, but must be finite: give it in {unit}.")
    return array


def ordered_times(times: ArrayLike) -> NDArray[np.float64]:
    """Moments in seconds as an array, refused unless each is later than the one before."""
    array = finite("times", times, "seconds")
    if array.ndim > 1 or not np.all(np.diff(np.atleast_1d(array)) > 0):
        raise InputError(f"times is {_shown(times)}, but each moment must be later than the one before: sort them.")
    return array


def _is_number(value: Any) -> bool:
    return isinstance(value, (int, float, np.integer, np.floating))


def _shown(values: ArrayLike) -> str:
    text = repr(values) if np.ndim(values) == 0 else np.array2string(np.asarray(values), threshold=6, edgeitems=3)
    return text.replace("\n", "")
