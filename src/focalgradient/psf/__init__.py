"""Point spread functions: from the radius of a blur disc to its optical transfer function, one class per shape.

Frequencies are in cycles per unit of the radius: per pixel for radii in pixels, per radian for angles. Every shape has
unit gain at frequency 0. See `Psf` for how to define a new shape, and `check_psf` to validate it.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from focalgradient.arrays import FloatArray
from focalgradient.errors import InputError, check_finite
from focalgradient.psf.registry import GROUP, check_psf, check_transfer, names, psf_from, psf_of, shape_class
from focalgradient.psf.shape import Capability, Geometric, Parameter, Psf, parameter
from focalgradient.psf.shapes import (
    DISC_K,
    Annulus,
    Blend,
    Disc,
    Gaussian,
    Polygon,
    blend_transfer,
    disc_transfer,
    gaussian_transfer,
    pixel_transfer,
)

__all__ = [
    "DISC_K",
    "GROUP",
    "Annulus",
    "Blend",
    "Capability",
    "Disc",
    "Gaussian",
    "Geometric",
    "Parameter",
    "Polygon",
    "Psf",
    "PsfName",
    "blend_transfer",
    "check_psf",
    "check_transfer",
    "disc_transfer",
    "gaussian_transfer",
    "names",
    "parameter",
    "pixel_transfer",
    "psf_from",
    "psf_of",
    "shape_class",
    "transfer",
]

PsfName = str
"""Name of a blur shape (see `names`)."""


def transfer(frequency: ArrayLike, radius: ArrayLike, psf: Psf | PsfName, k: float | None = None) -> FloatArray:
    """Return the transfer at `frequency` of isotropic blur of shape `psf` and disc radius `radius`; broadcasts.

    Parameters
    ----------
    frequency
        Radial frequency, in cycles per unit of `radius`.
    radius
        Radius of the geometric blur disc; at 0 (a pinhole, or a point in focus) the transfer is 1.
    psf
        A shape, or its name: ``"disc"``, ``"gaussian"``, ``"blend"``, ``"annulus"``, ...
    k
        sigma / disc radius of a Gaussian or Gaussian-edged disc given by name. The paper uses 1 and recommends
        calibration; the Gaussian's default matches the second moment of the disc.

    Raises
    ------
    InputError
        If the shape is unknown or not isotropic, a frequency is not finite, a radius is negative or NaN, or k is not
        positive.

    Examples
    --------
    >>> transfer(0.1, [0.0, 2.0], "gaussian", k=0.5).round(4).tolist()
    [1.0, 0.8209]
    """
    shape = psf_of(psf, k)
    frequency = check_finite("frequency", frequency, "cycles per unit of the radius")
    if not np.all(np.asarray(radius, dtype=float) >= 0):
        raise InputError("radius contains negative or NaN values, but blur radii must be 0 or more: correct them.")
    return shape.transfer(frequency, radius)
