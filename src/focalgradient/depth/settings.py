"""The settings of `focalgradient.recover_depth` that every method shares, checked."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, Literal, get_args

import numpy as np
from numpy.typing import NDArray

from focalgradient.errors import InputError, is_number
from focalgradient.optics import Optics, own_blur
from focalgradient.progress import Progress
from focalgradient.psf import PsfName, check_psf

__all__ = ["BlurSource", "MethodName", "RecoverySettings"]

MethodName = Literal["equalise", "spectra", "ratio", "edges", "autofocus"]

BlurSource = Literal["auto", "optics", "disc", "gaussian", "blend"]
"""Where the blur of a view comes from: its optics' own (`optics.own_blur`), or a model of its radius."""

BY_RADIUS: tuple[PsfName, ...] = ("disc", "gaussian")
"""Shapes of blur that every method can use."""


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
        """Shape of the blur, for methods that know a view's blur by its radius alone; another shape is refused."""
        return check_psf(self.psf, BY_RADIUS, f"method {self.method!r}")

    def resolved(self, optics: Sequence[Optics]) -> RecoverySettings:
        """Return the same, with ``psf="auto"`` decided: these `optics`' own blur where any offer it, else a disc.

        Equalisation alone can use a blur of any form, and autofocus uses none. With other methods a disc must be asked
        for where optics offer another blur.
        """
        own = [one for one in map(own_blur, optics) if one is not None and one.forms_views]
        if self.psf != "auto":
            return self
        if not own:
            return replace(self, psf="disc")
        if self.method == "equalise":
            return replace(self, psf="optics")
        if self.method == "autofocus":
            return self
        raise InputError(
            f"the optics ({own[0].name}) offer a blur of their own, which method {self.method!r} cannot use: take "
            "method 'equalise', or give psf 'disc' to take the blur for a disc."
        )

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
