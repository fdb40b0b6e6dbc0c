"""Import and export of ISETBio and ISETCam scenes and optical images (MATLAB files).

A ``scene`` of ISETBio (https://github.com/isetbio/isetbio) is the photons that each place emits, in photons/s/sr/m^2/nm
at each wavelength, and an ``oi``, the optical image, those that fall on the retina, in photons/s/m^2/nm.
"""

from __future__ import annotations

import os
from dataclasses import dataclass
from typing import Annotated

import numpy as np
from scipy import constants

from focalgradient.arrays import FloatArray
from focalgradient.errors import InputError, check_fields, check_finite
from focalgradient.eye.ranges import wavelengths
from focalgradient.files import printable
from focalgradient.files.matlab import read_matlab
from focalgradient.quantities import Range

__all__ = ["SpectralImage", "read_isetbio", "save_isetbio"]


KINDS = {"scene": "scene", "oi": "opticalimage"}
"""Names of the two structures, and their types in ISETBio."""

FOCAL_LENGTH = 0.0171883
"""Focal length in metres of ISETBio's human optics, which converts the angle of an optical image to its size: 300 um
per degree."""


@dataclass(frozen=True, slots=True, eq=False)
class SpectralImage:
    """Scene or retinal image by wavelength.

    Parameters
    ----------
    energy
        H x W x N: radiance of a scene in W/sr/m^2/nm, or irradiance of the retina in W/m^2/nm.
    wavelength_nm
        N wavelengths, increasing.
    field_deg
        Visual angle of the width, in degrees.
    distance
        Distance from the eye to the scene in metres.
    is_retinal
        Whether the image is on the retina (an ``oi``) rather than a scene.

    Raises
    ------
    InputError
        If shapes do not agree, energy is negative, or a number is out of range.
    """

    energy: FloatArray
    wavelength_nm: FloatArray
    field_deg: Annotated[float, Range("degrees", most=179.9, positive=True)]
    distance: Annotated[float, Range("metres", positive=True)] = 1.0
    is_retinal: bool = False

    def __post_init__(self) -> None:
        check_fields(self)
        nm = wavelengths(self.wavelength_nm)
        energy = check_finite("energy", self.energy, "W/sr/m^2/nm, or W/m^2/nm")
        if energy.ndim != 3 or nm.ndim != 1 or energy.shape[2] != nm.size or np.any(np.diff(nm) <= 0):
            raise InputError(
                f"energy has shape {energy.shape} and wavelength_nm {nm.shape}, but must be H x W x N for N increasing "
                "wavelengths."
            )
        if np.any(energy < 0):
            raise InputError("energy holds negative values, but light is 0 or more: check the picture.")

    @property
    def photons(self) -> FloatArray:
        """Return the image in photons per second: energy x wavelength / (h c)."""
        return np.asarray(self.energy * (1e-9 * np.asarray(self.wavelength_nm) / (constants.h * constants.c)))


def save_isetbio(path: str | os.PathLike[str], image: SpectralImage, name: str = "focalgradient") -> None:
    """Save a ``scene`` or, of a retinal image, an ``oi``, to be used in ISETBio after ``load``.

    Examples
    --------
    >>> from pathlib import Path
    >>> from tempfile import TemporaryDirectory
    >>> image = SpectralImage(np.full((2, 3, 2), 0.1), np.array([500.0, 600.0]), field_deg=1.0, distance=0.57)
    >>> with TemporaryDirectory() as folder:
    ...     save_isetbio(Path(folder, "scene.mat"), image)
    ...     back = read_isetbio(Path(folder, "scene.mat"))
    >>> back.field_deg, back.distance, bool(np.allclose(back.energy, image.energy))
    (1.0, 0.57, True)
    """
    from scipy.io import savemat

    kind = "oi" if image.is_retinal else "scene"
    structure: dict[str, object] = {
        "type": KINDS[kind],
        "name": name,
        "spectrum": {"wave": np.asarray(image.wavelength_nm, dtype=float)[:, None]},
        "data": {"photons": image.photons},
        "wAngular": image.field_deg,
        "distance": image.distance,
    }
    if image.is_retinal:
        structure["optics"] = {"type": "optics", "focalLength": FOCAL_LENGTH}
    else:
        structure["magnification"] = 1.0
    try:
        savemat(path, {kind: structure}, do_compression=True)
    except OSError as error:
        raise InputError(f"{printable(path)} cannot be written: {error.strerror or error}.") from error


def read_isetbio(path: str | os.PathLike[str]) -> SpectralImage:
    """Read a ``scene`` or an ``oi`` saved by ISETBio or `save_isetbio` (MATLAB format 7 or earlier).

    Raises
    ------
    InputError
        If the file cannot be read, or has neither.
    """
    content = read_matlab(path)
    kind = next((name for name in KINDS if name in content), None)
    try:
        record = content[str(kind)]
        nm = np.atleast_1d(np.asarray(record.spectrum.wave, dtype=float))
        photons = np.asarray(record.data.photons, dtype=float)
        field, distance = float(record.wAngular), float(getattr(record, "distance", 1.0))
    except (KeyError, AttributeError, TypeError, ValueError) as error:
        raise InputError(
            f"{printable(path)} has no scene or oi with spectrum.wave, data.photons and wAngular: save one in ISETBio."
        ) from error
    photons = photons.reshape(*photons.shape[:2], nm.size) if photons.ndim == 2 and nm.size == 1 else photons
    energy = photons * (constants.h * constants.c) / (1e-9 * nm)
    return SpectralImage(energy, nm, field, distance, kind == "oi")
