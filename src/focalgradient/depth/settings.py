"""The settings of `focalgradient.recover_depth` that every method shares, checked."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from focalgradient.errors import InputError, is_number
from focalgradient.optics import Optics, own_blur
from focalgradient.progress import Progress
from focalgradient.psf import Disc, Psf, psf_of, shape_class

__all__ = [
    "AUTO",
    "LEAST_SIDE",
    "OPTICS",
    "SOURCES",
    "WINDOWS",
    "BlurSource",
    "MethodName",
    "RecoverySettings",
    "blur_source",
    "used_blur",
]

LEAST_SIDE, WINDOWS = 32, 4
"""Minimum side of a view in pixels, and in windows. Chosen by hand."""

MethodName = Literal["equalise", "spectra", "ratio", "edges", "autofocus", "dual-pixels"]


AUTO, OPTICS = "auto", "optics"
SOURCES = (AUTO, OPTICS)
"""Names of what stands for a shape: the blur that the views' optics offer, "auto" a disc where none offers any."""

BlurSource = Psf | str
"""Where the blur of a view comes from: a shape of its radius, or the name of one of `SOURCES`."""


def blur_source(psf: BlurSource | str, k: float | None = None) -> BlurSource:
    """Return the source of blur that a public function was given: itself, or that of its name.

    >>> blur_source("auto"), blur_source("gaussian", 0.4)
    ('auto', Gaussian(k=0.4))
    """
    shape = psf_of("disc" if psf in SOURCES else psf, k, SOURCES)  # which refuses a k out of range
    return psf if isinstance(psf, str) and psf in SOURCES else shape


def used_blur(details: Mapping[str, Any]) -> BlurSource | None:
    """Return the blur that a map was made by, from its `details`; None where its method has no model of the blur.

    >>> used_blur({"psf": "polygon", "psf_parameters": {"blades": 5}})
    Polygon(blades=5, rotation=0.0)
    """
    name: str | None = details.get("psf")
    if name is None or name in SOURCES:
        return name
    return shape_class(name).of(details.get("psf_parameters", {}))


@dataclass(frozen=True, slots=True)
class RecoverySettings:
    """The settings of `focalgradient.recover_depth`, by its parameters' names."""

    method: MethodName
    near: float | None
    far: float | None
    psf: BlurSource
    window: float
    noise: float | Sequence[float] | None
    align: bool
    false_alarm: float
    progress: Progress
    outlines: bool = True

    @property
    def shape(self) -> Psf:
        """Shape of the blur, for methods that know a view's blur by its radius alone."""
        if isinstance(self.psf, str):
            raise InputError(f"psf is {self.psf!r}, but method {self.method!r} needs a shape of blur: give 'disc'.")
        return self.psf

    def resolved(self, optics: Sequence[Optics]) -> RecoverySettings:
        """Return the same, with `AUTO` decided: these `optics`' own blur where any offer it, else a disc.

        Equalisation and dual pixels alone use the optics' own blur, and autofocus uses none. With other methods a disc
        must be asked for where optics offer another blur.
        """
        own = [one for one in map(own_blur, optics) if one is not None and one.forms_views]
        if self.psf != AUTO:
            return self
        if not own:
            return replace(self, psf=Disc())
        if self.method in ("equalise", "autofocus", "dual-pixels"):
            return replace(self, psf=OPTICS)
        raise InputError(
            f"the optics ({own[0].name}) offer a blur of their own, which method {self.method!r} cannot use: take "
            "method 'equalise', or give psf 'disc' to take the blur for a disc."
        )

    def given_noise(self, count: int) -> NDArray[np.float64] | None:
        """Standard deviation of the noise of each of `count` views, as given; None where it is to be estimated."""
        return None if self.noise is None else np.broadcast_to(np.asarray(self.noise, float), count)

    def stated(self) -> dict[str, Any]:
        """Return the settings for the details of a map."""
        parameters = {} if isinstance(self.psf, str) else self.psf.stated()
        return {
            "method": self.method,
            "near_m": self.near,
            "far_m": self.far,
            "psf": self.psf if isinstance(self.psf, str) else self.psf.name,
            "psf_parameters": parameters,
            "k": parameters.get("k"),
            "window_px": self.window,
            "align": self.align,
            "false_alarm": self.false_alarm,
            **({"continued_to_outlines": self.outlines} if self.method == "equalise" else {}),
        }

    def check(self, count: int) -> None:
        """Refuse settings out of range, for `count` views."""
        self._check_limits()
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


def _check_positive(name: str, value: Any, unit: str) -> None:
    if not (is_number(value) and value > 0):
        raise InputError(f"{name} is {value!r}, but must be a positive number{unit}.")
