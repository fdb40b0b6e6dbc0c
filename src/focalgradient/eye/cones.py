"""Blur of an eye as seen by one class of cones: all wavelengths of the band together, up to the cones' resolution.

`Cones` are the optics of a view. They carry their own transfer, so that depth is estimated with the actual blur, and
the name of their waveband, so that views in different wavebands are not assumed to share all of a texture.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any, TypedDict, Unpack, get_args

import numpy as np
from numpy.typing import ArrayLike

from focalgradient.arrays import FloatArray
from focalgradient.errors import InputError, check_finite, check_number, described
from focalgradient.eye.chromatic import chromatic_difference
from focalgradient.eye.clear_pupil import wave_transfer
from focalgradient.eye.colours import PRIMARIES, display_primaries
from focalgradient.eye.light import Band, Light, band_light, band_sensitivity
from focalgradient.eye.parts import fewest, parts_of_band
from focalgradient.eye.protocol import EyeModel, check_eye, chromatic_scale
from focalgradient.eye.ranges import wavelengths as visible
from focalgradient.eye.scatter import Scatter
from focalgradient.eye.transfer import BlurName, geometric_shape
from focalgradient.optics.protocol import Transfer, blur_of, radial_transfer
from focalgradient.psf import Geometric, Psf

__all__ = ["S_FINEST_CPD", "Cones", "sampling", "wavelengths_needed"]

S_FINEST_CPD = 10.0
"""Highest frequency in cycles per degree that S cones, which are sparse, resolve."""

ROLL_OFF = 16
"""Exponent of the decline of resolution with frequency: sharp, but without ringing."""


class Resolved(TypedDict, total=False):
    """How finely light and space are resolved: keywords of `Cones.in_light`, with its defaults."""

    wavelengths: int | None
    finest_cpd: float
    model: BlurName


@dataclass(frozen=True, slots=True)
class Cones:
    """Optics of an eye at one moment, as seen by the cones of one band.

    Parameters
    ----------
    eye
        Pupil, accommodation, chromatic and other aberrations, and the Stiles-Crawford effect: an `Eye`, or a class of
        your own (`EyeModel`).
    light
        Name of the light, such as the band's: views with the same name share a texture, others need not.
    wavelengths_nm
        Wavelengths of the light in nm.
    finest_cpd
        Highest frequency in cycles per degree that the cones resolve: infinite for a mosaic finer than the pixels.
    model
        Blur model of each wavelength: ``"wave"``, or geometric optics, ``"disc"`` or its approximation ``"gaussian"``.
    weights
        Weight of each wavelength, in any unit; empty: equal weights.
    scatter
        Intraocular scatter (`Scatter`), the same at all wavelengths; None: no scatter.

    Raises
    ------
    InputError
        If a number is out of range, there is no wavelength, weights do not pair, or the model is unknown.

    Examples
    --------
    The same eye, accommodated to 1 m, seen by two cone classes.

    >>> from focalgradient import Eye
    >>> eye = Eye(pupil_diameter=0.004, accommodation=1.0)
    >>> reds, blues = Cones.of(eye, "L+M"), Cones.of(eye, "S", finest_cpd=10)
    >>> round(blues.focus_vergence - reds.focus_vergence, 2)
    0.78
    >>> blues.transfer(np.degrees([0, 5, 10, 20]), vergence=1.0).round(2).tolist()  # out of focus, and too fine
    [1.0, 0.16, -0.01, 0.0]
    """

    eye: Any
    light: str
    wavelengths_nm: tuple[float, ...]
    finest_cpd: float = np.inf
    model: BlurName = "wave"
    weights: tuple[float, ...] = ()
    scatter: Scatter | None = None

    def __post_init__(self) -> None:
        check_number("finest_cpd", self.finest_cpd, "cycles per degree", positive=True, finite=False)
        visible(check_finite("wavelengths_nm", self.wavelengths_nm, "nanometres"), "wavelengths_nm")
        if np.ndim(self.wavelengths_nm) != 1 or not np.size(self.wavelengths_nm):
            raise InputError(
                f"wavelengths_nm is {described(self.wavelengths_nm)}, but must be one or more wavelengths: give them "
                "in nanometres."
            )
        if check_finite("weights", self.weights, "any unit").size:
            Light(np.asarray(self.wavelengths_nm), np.asarray(self.weights))  # refuses weights that do not pair
        if self._shape is not None and not self._shape.isotropic:
            raise InputError(f"model is {self._shape}, but the blur of cones must be rotationally symmetric.")

    @classmethod
    def of(
        cls,
        eye: EyeModel,
        band: Band,
        *,
        illuminant: str = "D65",
        **resolved: Unpack[Resolved],
    ) -> Cones:
        """Return the cones of a `band` in an `illuminant`; further parameters as for `in_light`."""
        return cls.in_light(eye, band, band_light(band, illuminant), **resolved)

    @classmethod
    def in_light(
        cls,
        eye: EyeModel,
        band: str,
        light: Light,
        *,
        wavelengths: int | None = None,
        finest_cpd: float = np.inf,
        model: BlurName = "wave",
    ) -> Cones:
        """Return the cones named `band` in any `light`, given as the catch of these cones by wavelength.

        The light is represented by this number of `wavelengths`; None: enough for the transfer to be right to 0.01 (see
        `wavelengths_needed`).

        >>> from focalgradient import Eye
        >>> red = Light(np.array([630.0]), np.array([1.0]))
        >>> round(Cones.in_light(Eye(0.004, 1.0), "L+M", red).focus_vergence, 3)
        0.792
        """
        check_eye("eye", eye)
        if wavelengths is None:
            check_number("finest_cpd", finest_cpd, "cycles per degree", positive=True, finite=False)
            wavelengths = wavelengths_needed(light, eye.aperture_diameter, chromatic_scale(eye), finest_cpd)
        nm, share = parts_of_band(light, wavelengths)
        return cls(eye, band, nm, finest_cpd, model, share)

    @property
    def aperture_diameter(self) -> float:
        """Diameter of the pupil in metres."""
        return float(self.eye.aperture_diameter)

    @property
    def focus_vergence(self) -> float:
        """Mean vergence in dioptres of the plane in focus, over the light's wavelengths."""
        return float(self.shares @ self.eye.focus_in(self.wavelengths_nm))

    @property
    def shares(self) -> FloatArray:
        """Weights of the wavelengths, with a sum of 1."""
        weights = np.asarray(self.weights or np.ones(len(self.wavelengths_nm)), float)
        return weights / weights.sum()

    def eyes(self) -> list[Any]:
        """Return the eye in each of the light's wavelengths."""
        return [self.eye.in_light(nm) for nm in self.wavelengths_nm]

    def accommodated(self, accommodation: float) -> Cones:
        """Return the same cones of an `Eye` with another accommodation (D)."""
        return replace(self, eye=replace(self.eye, accommodation=accommodation))

    def refocused(self, vergence: float) -> Cones:
        """Return the same cones with their mean plane of focus at `vergence` (D)."""
        return replace(self, eye=self.eye.refocused(self.eye.focus_vergence + (vergence - self.focus_vergence)))

    @property
    def assumption(self) -> str:
        """The texture's colour, and by how much depth depends on it; empty without chromatic aberration.

        >>> from focalgradient import Eye
        >>> print(Cones.of(Eye(0.004, 1.0), "L+M").assumption)
        L+M cones see white texture: red texture would be stated about 0.3 D too near, blue texture about 0.4 D too far
        """
        scale = chromatic_scale(self.eye)
        if len(self.wavelengths_nm) == 1 or not scale or self.light not in get_args(Band):
            return ""
        red, blue = (scale * change for change in primary_differences(self.light))
        return (
            f"{self.light} cones see white texture: red texture would be stated {_error_of(red)}, "
            f"blue texture {_error_of(blue)}"
        )

    @property
    def isotropic(self) -> bool:
        """Whether blur is rotationally symmetric: of a clear pupil, or with aberrations of m = 0 only."""
        return self._shape is not None or blur_of(self.eye).isotropic

    def transfer(self, frequency: ArrayLike, vergence: ArrayLike) -> FloatArray:
        """Return the transfer for points at `vergence` (D) at `frequency` (cycles per radian); broadcasts.

        The mean over the wavelengths, each in its own focus, times the cones' resolution; the sign of the frequency is
        ignored. Blur that is not isotropic is given by `optical_transfer`.
        """
        frequency = check_finite("frequency", frequency, "cycles per radian")
        vergence = check_finite("vergence", vergence, "dioptres")
        if not self.isotropic:
            raise InputError(
                "the eye has aberrations of m other than 0, whose blur depends on direction: ask for optical_transfer."
            )
        return radial_transfer(self, frequency, vergence)

    def optical_transfer(self, frequency_y: ArrayLike, frequency_x: ArrayLike, vergence: float) -> Transfer:
        """Return the OTF at frequencies along y (down) and x (cycles per radian; broadcast), for blur of any form.

        >>> from focalgradient import Eye
        >>> coma = Eye(0.004, 1.0, aberrations=((3, 1, 0.2),))
        >>> complex(Cones.of(coma, "L+M").optical_transfer(0, np.degrees(5), 1.0).round(2))
        (0.53-0.09j)
        """
        if self._by_table:
            return self.through_focus(frequency_y, frequency_x, vergence)[0]
        down = check_finite("frequency_y", frequency_y, "cycles per radian")
        right = check_finite("frequency_x", frequency_x, "cycles per radian")
        blurs = (share * blur_of(eye).optical_transfer(down, right, vergence) for eye, share in self._shared())
        return sum(blurs, np.zeros(())) * self._seen(np.hypot(down, right))

    def through_focus(self, frequency_y: ArrayLike, frequency_x: ArrayLike, vergences: ArrayLike) -> Transfer:
        """Return the OTF for several vergences (D): L x the frequencies' shape.

        Right to 1e-3 (1e-4 for a clear pupil), and for an aberrated one much quicker than one vergence after another.
        """
        down = check_finite("frequency_y", frequency_y, "cycles per radian")
        right = check_finite("frequency_x", frequency_x, "cycles per radian")
        levels = np.atleast_1d(check_finite("vergences", vergences, "dioptres"))
        down, right = np.broadcast_arrays(down, right)
        resolved = np.asarray(self._seen(np.hypot(down, right)))
        some = (resolved > 0) | self._by_table
        blurs = (share * self._blurred(eye, down[some], right[some], levels) for eye, share in self._shared())
        seen = sum(blurs, np.zeros(())) * resolved[some]
        total = np.zeros((len(levels), *down.shape), seen.dtype)
        total[:, some] = seen
        return total

    @property
    def _by_table(self) -> bool:
        """Whether `through_focus` is as quick for whole grids of frequencies: by geometric optics, or a clear `Eye`."""
        return self._shape is not None or getattr(self.eye, "clear", False)

    def _shared(self) -> Iterator[tuple[Any, float]]:
        """Return the eye in each wavelength, and the wavelength's share."""
        return zip(self.eyes(), self.shares.tolist(), strict=True)

    def _blurred(self, eye: Any, down: FloatArray, right: FloatArray, levels: FloatArray) -> Transfer:
        """Return the OTF of the eye in one wavelength: L x frequencies."""
        if self._shape is not None:
            eye = Geometric(self._shape, eye.aperture_diameter, eye.focus_vergence)
        return blur_of(eye).through_focus(down, right, levels)

    @property
    def by_waves(self) -> bool:
        """Whether each wavelength is blurred by the waves of the pupil, rather than by a shape of geometric optics."""
        return self._shape is None

    @property
    def _shape(self) -> Psf | None:
        return geometric_shape(self.model)

    def _seen(self, frequency: FloatArray) -> FloatArray:
        """Return the contrast left by scatter and by cone sampling at `frequency` (cycles per radian)."""
        resolved = sampling(frequency, self.finest_cpd)
        return resolved if self.scatter is None else resolved * self.scatter.transfer(frequency)


def _error_of(change: float) -> str:
    """Return the error of a vergence where focus has changed by `change` (D) unnoticed."""
    return f"about {abs(change):.1f} D too {'near' if change < 0 else 'far'}"


@lru_cache
def primary_differences(band: Band) -> tuple[float, float]:
    """Return the change of focus (D) of cones from white to the red, and to the blue, of a display."""
    nm, primaries = display_primaries(PRIMARIES)
    red, white, blue = (
        Light(nm, band_sensitivity(band, nm) * light).difference()
        for light in (primaries[:, 0], primaries.sum(axis=1), primaries[:, 2])
    )
    return white - red, white - blue


def sampling(frequency: ArrayLike, finest_cpd: float) -> FloatArray:
    """Return cones' contrast at `frequency` (cycles per radian) if they resolve `finest_cpd`: exp(-(f / finest)^16).

    >>> sampling(np.degrees([5, 10, 12]), 10).round(2).tolist()
    [1.0, 0.37, 0.0]
    """
    share = np.exp(-((np.radians(np.asarray(frequency, dtype=float)) / finest_cpd) ** ROLL_OFF))
    return np.where(share < 1e-3, 0.0, share)


@lru_cache(maxsize=64)
def wavelengths_needed(light: Light, pupil_diameter: float, scale: float, finest_cpd: float) -> int:
    """Return the number of parts of a band with which the transfer of a clear pupil is right to 0.01.

    At all frequencies up to 60 cycles per degree that the cones resolve, in focus (where it takes the most parts: what
    is out of focus has less fine detail) and up to half a dioptre to either side.

    >>> [wavelengths_needed(band_light("L+M", "D65"), mm / 1000, 1.0, np.inf) for mm in (2, 4, 7)]
    [5, 9, 15]
    """
    frequency = np.degrees(np.linspace(0.5, min(1.25 * finest_cpd, HIGHEST_CPD), FREQUENCIES))
    focus = light.difference()

    def made(count: int) -> FloatArray:
        total = np.zeros((len(DEFOCI), FREQUENCIES))
        for nm, share in zip(*parts_of_band(light, count), strict=True):
            own = scale * (float(chromatic_difference(nm)) - focus)
            total += share * wave_transfer(frequency, np.abs(DEFOCI + own), pupil_diameter, nm)
        return total * sampling(frequency, finest_cpd)

    return fewest(made)


HIGHEST_CPD, FREQUENCIES = 60.0, 60
"""Highest frequency (cycles per degree) that people resolve, and the number of frequencies compared."""

DEFOCI: FloatArray = np.array([[-0.5], [-0.2], [0.0], [0.2], [0.5]])
"""Defoci (D) at which numbers of wavelengths are compared."""
