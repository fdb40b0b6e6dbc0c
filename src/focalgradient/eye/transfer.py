"""Blur of an eye or a lens as a transfer function and as a point spread, in one wavelength or many.

Frequencies are in cycles per radian, as in the optics' own `transfer`; vergence is in dioptres. ``"disc"`` is geometric
optics, ``"gaussian"`` the paper's approximation of it; ``"wave"`` includes diffraction and an eye's aberrations.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any, cast

import numpy as np
from numpy.typing import ArrayLike, NDArray

from focalgradient.arrays import FloatArray
from focalgradient.errors import InputError, check_finite, check_number, checked
from focalgradient.eye.light import Light
from focalgradient.eye.protocol import is_eye
from focalgradient.eye.ranges import VISIBLE, AnyOptics, Vergence
from focalgradient.eye.wavefront import Pupil, pupil_spread
from focalgradient.optics import Optics, check_optics, own_blur
from focalgradient.optics.protocol import Transfer
from focalgradient.psf import Geometric, Psf, psf_of

__all__ = ["LENS_NM", "BlurName", "blur_transfer", "geometric_shape", "in_light", "point_spread"]

BlurName = str
"""Blur model: ``"wave"``, the waves of the pupil, or the name of a shape of geometric optics."""

WAVES = ("wave",)
"""Names that are not shapes of geometric optics."""

LENS_NM = 555.0
"""Default wavelength of a lens in nm: the peak of photopic luminosity."""

_UNIT = "cycles per radian"


def blur_transfer(
    frequency_y_per_rad: ArrayLike,
    frequency_x_per_rad: ArrayLike,
    optics: Optics,
    vergence: float,
    *,
    model: Psf | BlurName = "wave",
    k: float | None = None,
    wavelength_nm: float | None = None,
    light: Light | None = None,
) -> FloatArray | NDArray[np.complex128]:
    """Return the transfer function of an eye or a lens for points at `vergence` (D).

    Parameters
    ----------
    frequency_y_per_rad, frequency_x_per_rad
        Cycles per radian (57.3 times those per degree); broadcast against each other.
    optics
        An `Eye`, a `Lens`, or whatever else has an aperture and a focus. Optics that know their own transfer, such as
        `Cones`, give it as ``"wave"``.
    vergence
        Vergence of the points in dioptres.
    model
        ``"wave"``, or by geometric optics a shape of blur or its name, such as ``"disc"`` or ``"gaussian"``.
    k
        Ratio of sigma to disc radius, of a Gaussian given by name.
    wavelength_nm
        Wavelength of the light in nm; by default the eye's own, and 555 nm for a lens.
    light
        The transfer is the mean over its wavelengths: each in its own focus in an eye, and all in one in a lens.

    Returns
    -------
    ndarray
        1 at frequency 0. Real, unless the waves of an eye with aberrations or the Stiles-Crawford effect are asked for.

    Raises
    ------
    InputError
        If the optics are none, the model is unknown, a number is not finite, or a pinhole's waves are asked for.

    Examples
    --------
    A pupil of 4 mm, and a lens as wide, half a dioptre out of focus: 5 cycles per degree.

    >>> from focalgradient import Eye, Lens
    >>> eye, lens = Eye(pupil_diameter=0.004, accommodation=1.0), Lens(0.020, 5, 1.0)
    >>> [round(float(blur_transfer(0, np.degrees(5), eye, 0.5, model=model)), 3) for model in ("wave", "disc")]
    [0.637, 0.646]
    >>> [round(float(blur_transfer(0, np.degrees(5), lens, 0.5, model=model)), 3) for model in ("wave", "disc")]
    [0.638, 0.646]
    """
    shape = geometric_shape(model, k)
    check_number("vergence", vergence, "dioptres")
    check_optics(optics)
    down = check_finite("frequency_y_per_rad", frequency_y_per_rad, _UNIT)
    right = check_finite("frequency_x_per_rad", frequency_x_per_rad, _UNIT)
    own = None if is_eye(optics) else own_blur(optics)
    if shape is None and own is not None:
        if wavelength_nm is not None or light is not None:
            raise InputError("optics have light of their own, but wavelength_nm or light is given too: leave it out.")
        return own.optical_transfer(down, right, vergence)

    def seen(optics: Optics, nm: float) -> Transfer:
        if shape is not None:
            geometric = Geometric(shape, optics.aperture_diameter, optics.focus_vergence)
            return geometric.through_focus(down, right, vergence)[0]
        own = None if hasattr(optics, "pupil") else own_blur(optics)
        if own is not None:
            return own.optical_transfer(down, right, vergence)
        return _pupil(optics, nm, vergence).transfer(down, right)

    transfers = (share * seen(one, nm) for one, nm, share in in_light(optics, wavelength_nm, light))
    return sum(transfers, np.zeros(()))


@checked
def point_spread(
    angle_y: ArrayLike,
    angle_x: ArrayLike,
    optics: AnyOptics,
    vergence: Vergence,
    *,
    wavelength_nm: float | None = None,
    light: Light | None = None,
) -> FloatArray:
    """Return the point spread of an eye or a lens for a point at `vergence` (D), with diffraction and aberrations.

    For a clear pupil it is what the paper's appendix computes by Lommel's series.

    Parameters
    ----------
    angle_y, angle_x
        Angles in radians of the grid's M rows and N columns.
    optics, vergence, wavelength_nm, light
        As for `blur_transfer`.

    Returns
    -------
    ndarray
        M x N: light per steradian, as a share of all the light; never negative, and 1 in sum over the whole plane.

    Raises
    ------
    InputError
        If the optics are neither an eye nor a lens, or a pinhole, or a number is not finite.

    Examples
    --------
    >>> from focalgradient import Eye, Lens
    >>> angles = np.arange(-40, 41) * 5e-5  # rad
    >>> for optics in (Eye(0.003, 0.5, wavelength_nm=555), Lens(0.012, 4, 1.0)):
    ...     round(float(point_spread(angles, angles, optics, vergence=0.0).sum() * 5e-5**2), 2)
    0.98
    0.97
    """
    if own_blur(optics) is not None and not hasattr(optics, "pupil"):
        raise InputError("optics know their transfer, but not their point spread: give an Eye or a Lens.")
    spreads = (
        share * pupil_spread(angle_y, angle_x, _pupil(one, nm, vergence))
        for one, nm, share in in_light(optics, wavelength_nm, light)
    )
    return sum(spreads, np.zeros(()))


def geometric_shape(model: Psf | BlurName, k: float | None = None) -> Psf | None:
    """Return the geometric blur shape named `model`; None for the pupil's waves.

    >>> geometric_shape("gaussian"), geometric_shape("wave")
    (Gaussian(k=0.5), None)
    """
    return None if isinstance(model, str) and model in WAVES else psf_of(model, k, WAVES, "model")


def in_light(optics: Any, wavelength_nm: float | None, light: Light | None) -> Iterator[tuple[Any, float, float]]:
    """Return the optics in each wavelength (nm), and the wavelength's share: an eye's focus depends on it."""
    if light is not None:
        if wavelength_nm is not None:
            raise InputError("wavelength_nm and light are both given, but either states the light: leave out one.")
        samples = [
            (float(nm), float(part)) for nm, part in zip(light.wavelength_nm, light.share, strict=True) if part > 0
        ]
    else:
        one = wavelength_nm if wavelength_nm is not None else getattr(optics, "wavelength_nm", LENS_NM)
        VISIBLE.check("wavelength_nm", one)
        samples = [(float(one), 1.0)]
    for nm, part in samples:
        yield (optics.in_light(nm) if is_eye(optics) else optics), nm, part


def _pupil(optics: Any, nm: float, vergence: float) -> Pupil:
    """Return the pupil of an eye or a lens in one wavelength."""
    if not 0 < optics.aperture_diameter < math.inf:
        raise InputError(
            "optics are a pinhole, whose diffraction has no bound: give an aperture, or take the model 'disc'."
        )
    if hasattr(optics, "pupil"):
        return cast(Pupil, optics.pupil(vergence))
    return Pupil(optics.aperture_diameter, nm, optics.focus_vergence - vergence)
