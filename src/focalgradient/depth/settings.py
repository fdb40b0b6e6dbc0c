"""What the user of `recover_depth` asked for: the settings that every method shares, checked."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, get_args

import numpy as np

from focalgradient.errors import InputError
from focalgradient.psf import PsfName

__all__ = ["RecoverySettings"]


@dataclass(frozen=True, slots=True)
class RecoverySettings:
    """The settings of `focalgradient.recover_depth`, in its own words."""

    method: str
    near: float | None
    far: float | None
    psf: PsfName
    k: float
    window: float
    noise: float | Sequence[float] | None
    align: bool
    false_alarm: float
    say: Callable[[str], object]

    def stated(self) -> dict[str, Any]:
        """The settings as a map's details state them."""
        return {
            "method": self.method,
            "near_m": self.near,
            "far_m": self.far,
            "psf": self.psf,
            "k": self.k,
            "window_px": self.window,
            "align": self.align,
            "false_alarm": self.false_alarm,
        }

    def check(self, count: int) -> None:
        """Refuse settings out of range, for `count` views."""

        def positive(name: str, value: Any, unit: str) -> None:
            if not (np.ndim(value) == 0 and value > 0):
                raise InputError(f"{name} is {value!r}, but must be a positive number{unit}.")

        near, far = self.near, self.far
        if near is not None:
            positive("near", near, " of metres")
        if far is not None:
            positive("far", far, " of metres")
        if near is not None and far is not None and near >= far:
            raise InputError(f"near {near:g} m lies beyond far {far:g} m, but must be less: exchange them.")
        if near is not None and math.isinf(near):
            raise InputError("near is infinite, but must be a finite distance in metres: leave it out to search all.")
        if self.psf not in get_args(PsfName):
            raise InputError(f"psf is {self.psf!r}, but must be one of {', '.join(get_args(PsfName))}.")
        if self.psf == "optics" and self.method != "equalise":
            raise InputError(
                f"psf is 'optics', which method {self.method!r} does not know: use method 'equalise', or psf 'disc'."
            )
        positive("k", self.k, ", sigma / disc radius")
        if math.isinf(self.k):
            raise InputError(
                "k is infinite, but must be finite: sigma / disc radius, 0.5 for the disc's second moment."
            )
        if not (np.ndim(self.window) == 0 and 2 <= self.window <= 64):
            raise InputError(f"window is {self.window!r}, but must be between 2 and 64 pixels.")
        values = np.asarray(1.0 if self.noise is None else self.noise, dtype=float)
        if values.ndim > 1 or values.size not in (1, count) or not np.all((values > 0) & np.isfinite(values)):
            raise InputError(
                f"noise is {self.noise!r}, but must be one positive number, or one for each of the {count} views."
            )
        if not 0 < self.false_alarm < 1:
            raise InputError(f"false_alarm is {self.false_alarm!r}, but must be a probability between 0 and 1.")
