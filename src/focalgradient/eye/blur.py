"""An eye's blur as a filter, by the name of its model, in one light or in the sum of many.

``"disc"`` is geometric optics, ``"gaussian"`` the paper's stand-in for it; ``"wave"`` has diffraction and all else that
the eye has.
"""

from __future__ import annotations

from typing import Literal, get_args

import numpy as np
from numpy.typing import ArrayLike, NDArray

from focalgradient.errors import InputError, check_finite, check_number
from focalgradient.eye.diffraction import optical_transfer
from focalgradient.eye.light import Light
from focalgradient.eye.optics import Eye
from focalgradient.eye.wavefront import pupil_transfer
from focalgradient.psf import DISC_K, disc_transfer, gaussian_transfer

__all__ = ["BlurName", "blur_transfer"]

BlurName = Literal["wave", "disc", "gaussian"]


def blur_transfer(
    frequency_y_cpd: ArrayLike,
    frequency_x_cpd: ArrayLike,
    eye: Eye,
    vergence: float,
    *,
    model: BlurName = "wave",
    k: float = DISC_K,
    light: Light | None = None,
) -> NDArray[np.float64] | NDArray[np.complex128]:
    """Transfer of the blur that `eye` gives to points at `vergence`.

    Parameters
    ----------
    frequency_y_cpd, frequency_x_cpd
        Cycles per degree; broadcast against each other.
    eye
        Its pupil, focus and colour, and for waves its aberrations.
    vergence
        Of the points, in dioptres.
    model
        ``"wave"``, ``"disc"`` or ``"gaussian"``.
    k
        For the Gaussian, sigma / disc radius.
    light
        The transfer is the mean over its wavelengths, each in its own focus; without it, in the eye's own wavelength.

    Returns
    -------
    ndarray
        1 at frequency 0. Real, unless the waves of an eye with aberrations or the Stiles-Crawford effect are asked for.

    Raises
    ------
    InputError
        If the model is unknown or a number is not finite.

    Examples
    --------
    >>> eye = Eye(pupil_diameter=0.004, accommodation=1.0)
    >>> [round(float(blur_transfer(0, 5, eye, 0.5, model=model)), 3) for model in ("wave", "disc", "gaussian")]
    [0.637, 0.646, 0.667]
    """
    if model not in get_args(BlurName):
        raise InputError(f"model is {model!r}, but must be one of {', '.join(get_args(BlurName))}.")
    check_number("vergence", vergence, "dioptres")
    if light is not None:
        transfers = (
            share * blur_transfer(frequency_y_cpd, frequency_x_cpd, eye.in_light(float(nm)), vergence, model=model, k=k)
            for nm, share in zip(light.wavelength_nm, light.share, strict=True)
            if share > 0
        )
        return sum(transfers, np.zeros(()))
    down = check_finite("frequency_y_cpd", frequency_y_cpd, "cycles per degree")
    right = check_finite("frequency_x_cpd", frequency_x_cpd, "cycles per degree")
    defocus = eye.focus_vergence - vergence
    if model != "wave":
        per_radian, radius = 180 / np.pi * np.hypot(down, right), abs(defocus) * eye.pupil_diameter / 2
        return disc_transfer(per_radian, radius) if model == "disc" else gaussian_transfer(per_radian, radius, k)
    pupil, nm = eye.pupil_diameter, eye.wavelength_nm
    if eye.aberrations or eye.stiles_crawford:
        return pupil_transfer(
            down,
            right,
            pupil_diameter=pupil,
            wavelength_nm=nm,
            defocus=defocus,
            aberrations=eye.aberrations,
            stiles_crawford=eye.stiles_crawford,
        )
    return optical_transfer(np.hypot(down, right), pupil_diameter=pupil, wavelength_nm=nm, defocus=defocus)
