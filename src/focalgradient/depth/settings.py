"""The settings of `focalgradient.recover_depth` that every method shares, checked."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, Literal, get_args

import numpy as np
from numpy.typing import NDArray

from focalgradient.errors import InputError, is_number
from focalgradient.optics import HasTransfer, Optics
from focalgradient.progress import Progress
from focalgradient.psf import PsfName

__all__ = ["BlurSource", "MethodName", "RecoverySettings"]

MethodName = Literal["equalise", "spectra", "ratio", "edges", "autofocus"]

BlurSource = Literal["auto", "optics", "disc", "gaussian", "blend"]
"""Where the blur of a view comes from: its optics' own transfer (`optics.HasTransfer`), or a model of the radius."""


@dataclass(frozen=True, slots=True)
class RecoverySettings:
    """The settings of `focalgradient.recover_depth`, by its parameters' names."""

    method: MethodName
    near: float | None
    far: float | None
    psf: BlurSource
    k: float
    window: float
    noise: float | Sequence[float] | None
    align: bool
    false_alarm: float
    progress: Progress
    outlines: bool = True

    @property
    def model(self) -> PsfName:
        """Model of the blur, for what knows a view's blur by its radius alone."""
        return "gaussian" if self.psf == "gaussian" else "disc"

    def resolved(self, optics: Sequence[Optics]) -> RecoverySettings:
        """The same, with ``psf="auto"`` decided for these `optics`: their own transfer where all know it, else a disc.

        Equalisation alone can use a transfer of any form.
        """
        if self.psf != "auto":
            return self
        own = self.method == "equalise" and all(isinstance(one, HasTransfer) for one in optics)
        return replace(self, psf="optics" if own else "disc")

    def given_noise(self, count: int) -> NDArray[np.float64] | None:
        """Standard deviation of the noise of each of `count` views, as given; None where it is to be estimated."""
        return None if self.noise is None else np.broadcast_to(np.asarray(self.noise, float), count)

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
            **({"continued_to_outlines": self.outlines} if self.method == "equalise" else {}),
        }

    def check(self, count: int) -> None:
        """Refuse settings out of range, for `count` views."""
        self._check_limits()
        self._check_blur()
        if not (is_number(self.window) and 2 <= self.window <= 64):
            raise InputError(f"window is {self.window!r}, but must be between 2 and 64 pixels.")
        values = np.asarray(1.0 if self.noise is None else self.noise)
        numbers = values.dtype.kind in "iuf" and values.ndim < 2 and values.size in (1, count)
        if not (numbers and np.all((values > 0) & np.isfinite(values))):
            raise InputError(
                f"noise is {self.noise!r}, but must be one positive number, or one for each of the {count} views."
            )
        if not (is_number(self.false_alarm) and 0 < self.false_alarm < 1):
            raise InputError(f"false_alarm is {self.false_alarm!r}, but must be a probability between 0 and 1.")

    def _check_limits(self) -> None:
        near, far = self.near, self.far
        if near is not None:
            _check_positive("near", near, " of metres")
        if far is not None:
            _check_positive("far", far, " of metres")
        if near is not None and far is not None and near >= far:
            raise InputError(f"near {near:g} m lies beyond far {far:g} m, but must be less: exchange them.")
        if near is not None and math.isinf(near):
            raise InputError("near is infinite, but must be a finite distance in metres: leave it out to search all.")

    def _check_blur(self) -> None:
        if self.psf not in get_args(BlurSource):
            raise InputError(f"psf is {self.psf!r}, but must be one of {', '.join(get_args(BlurSource))}.")
        if self.psf in ("optics", "blend") and self.method != "equalise":
            raise InputError(
                f"psf is {self.psf!r}, which method {self.method!r} cannot use: use method 'equalise', or psf 'disc'."
            )
        _check_positive("k", self.k, ", sigma / disc radius")
        if math.isinf(self.k):
            raise InputError(
                "k is infinite, but must be finite: sigma / disc radius, 0.5 for the disc's second moment."
            )


def _check_positive(name: str, value: Any, unit: str) -> None:
    if not (is_number(value) and value > 0):
        raise InputError(f"{name} is {value!r}, but must be a positive number{unit}.")
