"""Blur as a filter: from the radius of a blur disc to its optical transfer function, one class a shape of blur.

Frequencies are in cycles per unit of the radius: per pixel for radii in pixels, per radian for angles. A shape has unit
gain at frequency 0. See `Psf` for what a new shape gives, and `check_psf` for the check that it must pass.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from focalgradient.errors import InputError, check_finite
from focalgradient.psf.annulus import Annulus
from focalgradient.psf.blend import Blend, blend_transfer
from focalgradient.psf.check import check_psf, check_transfer
from focalgradient.psf.disc import DISC_K, Disc, disc_transfer
from focalgradient.psf.gaussian import Gaussian, gaussian_transfer
from focalgradient.psf.pixel import pixel_transfer
from focalgradient.psf.polygon import Polygon
from focalgradient.psf.registry import GROUP, names, psf_from, psf_of, shape_class
from focalgradient.psf.shape import Capability, Parameter, Psf, parameter

__all__ = [
    "DISC_K",
    "GROUP",
    "Annulus",
    "Blend",
    "Capability",
    "Disc",
    "Gaussian",
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
"""Name of a shape of blur (`names`)."""


def transfer(
    frequency: ArrayLike, radius: ArrayLike, psf: Psf | PsfName, k: float | None = None
) -> NDArray[np.float64]:
    """Transfer at `frequency` of the round blur whose disc has `radius`, of the shape `psf`; broadcasts.

    Parameters
    ----------
    frequency
        Radial frequency, in cycles per unit of `radius`.
    radius
        Radius of the geometric blur disc; 0 (a pinhole, or a point in focus) transfers everything.
    psf
        A shape, or the name of one: ``"disc"``, ``"gaussian"``, ``"blend"``, ``"annulus"``, ...
    k
        Of a Gaussian or a blend that is given by name, sigma / disc radius. The paper takes 1 and asks for
        calibration; the default of the Gaussian matches the second moment of the disc.

    Raises
    ------
    InputError
        If the shape is unknown or not alike in all directions, a frequency is not finite, a radius negative or NaN, or
        k not positive.

    Examples
    --------
    >>> transfer(0.1, [0.0, 2.0], "gaussian", k=0.5).round(4).tolist()
    [1.0, 0.8209]
    """
    shape = psf_of(psf, k)
    frequency = check_finite("frequency", frequency, "cycles per unit of the radius")
    if not np.all(np.asarray(radius, dtype=float) >= 0):
        raise InputError("radius holds negative or undefined values, but the radius of a blur disc is 0 or more.")
    return shape.transfer(frequency, radius)
