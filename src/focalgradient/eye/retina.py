"""Blur of an eye as seen by one class of cones: all wavelengths of the band together, up to the cones' resolution.

`Cones` are the optics of a view. They carry their own transfer, so that depth is estimated with the actual blur, and
the name of their waveband, so that views in different wavebands are not assumed to share all of a texture.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.ndimage import map_coordinates

from focalgradient.errors import InputError, check_finite, check_number, described
from focalgradient.eye.chromatic import chromatic_difference
from focalgradient.eye.diffraction import cutoff_cpd
from focalgradient.eye.light import Band, Light, band_light
from focalgradient.eye.model_eye import Eye
from focalgradient.eye.parts import fewest, parts_of_band
from focalgradient.eye.quadrature import panels
from focalgradient.eye.ranges import check_kind
from focalgradient.eye.ranges import wavelengths as visible
from focalgradient.eye.scatter import Scatter
from focalgradient.eye.through_focus import through_focus
from focalgradient.eye.transfer import BlurName, blur_transfer, geometric_shape
from focalgradient.eye.wavefront import Pupil
from focalgradient.psf import Psf

__all__ = ["S_FINEST_CPD", "Cones", "sampling", "wavelengths_needed"]

S_FINEST_CPD = 10.0
"""Highest frequency in cycles per degree that S cones, which are sparse, resolve."""

ROLL_OFF = 16
"""Exponent of the decline of resolution with frequency: sharp, but without ringing."""


@dataclass(frozen=True, slots=True)
class Cones:
    """Optics of an eye at one moment, as seen by the cones of one band.

    Parameters
    ----------
    eye
        Pupil, accommodation, chromatic and other aberrations, and the Stiles-Crawford effect.
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

    >>> eye = Eye(pupil_diameter=0.004, accommodation=1.0)
    >>> reds, blues = Cones.of(eye, "L+M"), Cones.of(eye, "S", finest_cpd=10)
    >>> round(blues.focus_vergence - reds.focus_vergence, 2)
    0.78
    >>> blues.transfer(np.degrees([0, 5, 10, 20]), vergence=1.0).round(2).tolist()  # out of focus, and too fine
    [1.0, 0.16, -0.01, 0.0]
    """

    eye: Eye
    light: str
    wavelengths_nm: tuple[float, ...]
    finest_cpd: float = np.inf
    model: BlurName = "wave"
    weights: tuple[float, ...] = ()
    scatter: Scatter | None = None

    def __post_init__(self) -> None:
        check_number("finest_cpd", self.finest_cpd, "cycles per degree", positive=True, finite=False)
        if np.ndim(self.wavelengths_nm) != 1 or not np.size(self.wavelengths_nm):
            raise InputError(
                f"wavelengths_nm is {described(self.wavelengths_nm)}, but must be one or more wavelengths: give them "
                "in nanometres."
            )
        visible(self.wavelengths_nm, "wavelengths_nm")
        if len(self.weights):
            Light(np.asarray(self.wavelengths_nm), np.asarray(self.weights))  # refuses weights that do not pair
        if self._shape is not None and not self._shape.isotropic:
            raise InputError(f"model is {self._shape}, but the blur of cones must be rotationally symmetric.")

    @classmethod
    def of(
        cls,
        eye: Eye,
        band: Band,
        *,
        illuminant: str = "D65",
        wavelengths: int | None = None,
        finest_cpd: float = np.inf,
        model: BlurName = "wave",
    ) -> Cones:
        """Return the cones of a `band` in an `illuminant`, with this number of `wavelengths`.

        None: as many as the pupil needs for the transfer to be right to 0.01 (see `wavelengths_needed`).
        """
        light = band_light(band, illuminant)
        return cls.in_light(eye, band, light, wavelengths=wavelengths, finest_cpd=finest_cpd, model=model)

    @classmethod
    def in_light(
        cls,
        eye: Eye,
        band: str,
        light: Light,
        *,
        wavelengths: int | None = None,
        finest_cpd: float = np.inf,
        model: BlurName = "wave",
    ) -> Cones:
        """Return the cones named `band` in any `light`, given as the catch of these cones by wavelength.

        >>> red = Light(np.array([630.0]), np.array([1.0]))
        >>> round(Cones.in_light(Eye(0.004, 1.0), "L+M", red).focus_vergence, 3)
        0.792
        """
        check_kind("eye", eye, Eye, "give Eye(pupil_diameter, accommodation)")
        if wavelengths is None:
            check_number("finest_cpd", finest_cpd, "cycles per degree", positive=True, finite=False)
            wavelengths = wavelengths_needed(light, eye.pupil_diameter, eye.chromatic_scale, finest_cpd)
        nm, share = parts_of_band(light, wavelengths)
        return cls(eye, band, nm, finest_cpd, model, share)

    @property
    def aperture_diameter(self) -> float:
        """Diameter of the pupil in metres."""
        return self.eye.pupil_diameter

    @property
    def focus_vergence(self) -> float:
        """Mean vergence in dioptres of the plane in focus, over the light's wavelengths."""
        return float(self.shares @ self.eye.focus_in(self.wavelengths_nm))

    @property
    def shares(self) -> NDArray[np.float64]:
        """Weights of the wavelengths, with a sum of 1."""
        weights = np.asarray(self.weights or np.ones(len(self.wavelengths_nm)), float)
        return weights / weights.sum()

    def eyes(self) -> list[Eye]:
        """Return the eye in each of the light's wavelengths."""
        return [self.eye.in_light(nm) for nm in self.wavelengths_nm]

    def accommodated(self, accommodation: float) -> Cones:
        """Return the same cones with another accommodation (D)."""
        return replace(self, eye=replace(self.eye, accommodation=accommodation))

    def refocused(self, vergence: float) -> Cones:
        """Return the same cones with their mean plane of focus at `vergence` (D)."""
        return self.accommodated(self.eye.accommodation + (vergence - self.focus_vergence))

    @property
    def isotropic(self) -> bool:
        """Whether blur is rotationally symmetric: of a clear pupil, or with aberrations of m = 0 only."""
        return self._shape is not None or self.eye.isotropic

    def transfer(self, frequency: ArrayLike, vergence: ArrayLike) -> NDArray[np.float64]:
        """Return the transfer for points at `vergence` (D) at `frequency` (cycles per radian); broadcasts.

        The mean over the wavelengths, each in its own focus, times the cones' resolution; the sign of the frequency is
        ignored. By waves, of a clear pupil, it is interpolated from a table, right to about 1e-4. Blur that is not
        isotropic is given by `optical_transfer`.
        """
        frequency = np.abs(check_finite("frequency", frequency, "cycles per radian"))
        vergence = check_finite("vergence", vergence, "dioptres")
        if not self.isotropic:
            raise InputError(
                "the eye has aberrations of m other than 0, whose blur depends on direction: ask for optical_transfer."
            )
        if self._shape is None and not self._clear:
            return self._radial(frequency, vergence)
        total, shape = np.zeros(np.broadcast_shapes(frequency.shape, vergence.shape)), self._shape
        for eye, share in zip(self.eyes(), self.shares, strict=True):
            defocus = np.abs(eye.focus_vergence - vergence)
            if shape is None:
                total += share * _wave_transfer(frequency, defocus, eye.pupil_diameter, eye.wavelength_nm)
            else:
                total += share * shape.transfer(frequency, defocus * eye.pupil_diameter / 2)
        return total * self._seen(frequency)

    def optical_transfer(
        self, frequency_y: ArrayLike, frequency_x: ArrayLike, vergence: float
    ) -> NDArray[np.float64] | NDArray[np.complex128]:
        """Return the OTF at frequencies along y (down) and x (cycles per radian; broadcast), for blur of any form.

        >>> coma = Eye(0.004, 1.0, aberrations=((3, 1, 0.2),))
        >>> complex(Cones.of(coma, "L+M").optical_transfer(0, np.degrees(5), 1.0).round(2))
        (0.53-0.09j)
        """
        down = check_finite("frequency_y", frequency_y, "cycles per radian")
        right = check_finite("frequency_x", frequency_x, "cycles per radian")
        if self._shape is not None or self._clear:
            return self.transfer(np.hypot(down, right), vergence)
        seen = np.zeros(np.broadcast_shapes(down.shape, right.shape), np.complex128)
        for eye, share in zip(self.eyes(), self.shares, strict=True):
            seen += share * blur_transfer(down, right, eye, vergence)
        seen *= self._seen(np.hypot(down, right))
        return seen

    def through_focus(
        self, frequency_y: ArrayLike, frequency_x: ArrayLike, vergences: ArrayLike
    ) -> NDArray[np.float64] | NDArray[np.complex128]:
        """Return the OTF for several vergences (D): L x the frequencies' shape.

        Right to 1e-3, and for a pupil with aberrations much quicker than one vergence after another.
        """
        down = check_finite("frequency_y", frequency_y, "cycles per radian")
        right = check_finite("frequency_x", frequency_x, "cycles per radian")
        levels = np.atleast_1d(check_finite("vergences", vergences, "dioptres"))
        down, right = np.broadcast_arrays(down, right)
        radial = np.hypot(down, right)
        if self._shape is not None or self._clear:
            return self.transfer(radial, levels.reshape(-1, *(1,) * radial.ndim))
        resolved = self._seen(radial)
        some = resolved > 0
        total = np.zeros((len(levels), *radial.shape), np.complex128)
        for eye, share in zip(self.eyes(), self.shares, strict=True):
            pupil = Pupil(eye.pupil_diameter, eye.wavelength_nm, 0.0, eye.wavefront, eye.stiles_crawford, eye.lens)
            total[:, some] += share * through_focus(down[some], right[some], pupil, eye.focus_vergence - levels)
        total *= resolved
        return total

    @property
    def by_waves(self) -> bool:
        """Whether each wavelength is blurred by the waves of the pupil, rather than by a shape of geometric optics."""
        return self._shape is None

    @property
    def _shape(self) -> Psf | None:
        return geometric_shape(self.model)

    @property
    def _clear(self) -> bool:
        own = self.eye.aberrations or self.eye.stiles_crawford or self.eye.lens
        return not (own or any(self.eye.pupil_offset))

    def _seen(self, frequency: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the contrast left by scatter and by cone sampling at `frequency` (cycles per radian)."""
        resolved = sampling(frequency, self.finest_cpd)
        return resolved if self.scatter is None else resolved * self.scatter.transfer(frequency)

    def _radial(self, frequency: NDArray[np.float64], vergence: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the isotropic transfer of an aberrated pupil at each frequency and vergence; broadcasts."""
        radii, place = np.unique(frequency, return_inverse=True)
        levels, level = np.unique(vergence, return_inverse=True)
        table = self.through_focus(np.zeros_like(radii), radii, levels).real
        return np.asarray(table[level.reshape(vergence.shape), place.reshape(frequency.shape)])


def sampling(frequency: ArrayLike, finest_cpd: float) -> NDArray[np.float64]:
    """Return cones' contrast at `frequency` (cycles per radian) if they resolve `finest_cpd`: exp(-(f / finest)^16).

    >>> sampling(np.degrees([5, 10, 12]), 10).round(2).tolist()
    [1.0, 0.37, 0.0]
    """
    share = np.exp(-((np.radians(np.asarray(frequency, dtype=float)) / finest_cpd) ** ROLL_OFF))
    return np.where(share < 1e-3, 0.0, share)


@lru_cache(maxsize=64)
def wavelengths_needed(light: Light, pupil_diameter: float, chromatic_scale: float, finest_cpd: float) -> int:
    """Return the number of parts of a band with which the transfer of a clear pupil is right to 0.01.

    At all frequencies up to 60 cycles per degree that the cones resolve, in focus (where it takes the most parts: what
    is out of focus has less fine detail) and up to half a dioptre to either side.

    >>> [wavelengths_needed(band_light("L+M", "D65"), mm / 1000, 1.0, np.inf) for mm in (2, 4, 7)]
    [5, 9, 15]
    """
    frequency = np.degrees(np.linspace(0.5, min(1.25 * finest_cpd, HIGHEST_CPD), FREQUENCIES))
    focus = light.difference()

    def made(count: int) -> NDArray[np.float64]:
        total = np.zeros((len(DEFOCI), FREQUENCIES))
        for nm, share in zip(*parts_of_band(light, count), strict=True):
            own = chromatic_scale * (float(chromatic_difference(nm)) - focus)
            total += share * _wave_transfer(frequency, np.abs(DEFOCI + own), pupil_diameter, nm)
        return total * sampling(frequency, finest_cpd)

    return fewest(made)


HIGHEST_CPD, FREQUENCIES = 60.0, 60
"""Highest frequency (cycles per degree) that people resolve, and the number of frequencies compared."""

DEFOCI: NDArray[np.float64] = np.array([[-0.5], [-0.2], [0.0], [0.2], [0.5]])
"""Defoci (D) at which numbers of wavelengths are compared."""

SHIFTS = np.linspace(0, 1, 65)[:-1]
"""Frequencies of the table's rows, over the cut-off."""

PHASE_STEP = 0.05
"""Spacing of the table's columns, in radians of phase."""


def _wave_transfer(
    frequency: NDArray[np.float64], defocus: NDArray[np.float64], pupil_diameter: float, wavelength_nm: float
) -> NDArray[np.float64]:
    """Interpolate `optical_transfer` from a table, for arrays of frequencies (cycles per radian) and defocus (D)."""
    s = np.radians(frequency) / cutoff_cpd(pupil_diameter, wavelength_nm)
    phase = np.pi * pupil_diameter * defocus * frequency * np.clip(1 - s, 0, None)
    table = _table(float(2 ** np.ceil(np.log2(phase.max(initial=16.0)))))
    places = np.stack(np.broadcast_arrays(np.minimum(s * len(SHIFTS), len(SHIFTS) - 1), phase / PHASE_STEP))
    read = map_coordinates(table, places.reshape(2, -1), order=1, mode="nearest")  # which takes no scalars
    return np.asarray(read.reshape(places.shape[1:]) * _in_focus(s))


def _in_focus(s: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the transfer of a pupil in focus at the share `s` of its cut-off."""
    s = np.minimum(s, 1)
    focused: NDArray[np.float64] = 2 / np.pi * (np.arccos(s) - s * np.sqrt(1 - s**2))
    return focused


@lru_cache(maxsize=4)
def _table(largest: float) -> NDArray[np.float64]:
    """Return the transfer over that in focus, by frequency (SHIFTS) and phase at the pupil's rim (to `largest`)."""
    nodes, weights = panels(largest)
    span = np.arccos(SHIFTS)[:, None]
    angle = span * nodes
    # Phases at the nodes over that at the rim; cosines of their multiples by the recurrence of Chebyshev.
    turn = (np.cos(angle) - SHIFTS[:, None]) / (1 - SHIFTS[:, None]) * PHASE_STEP
    twice, before, now = 2 * np.cos(turn), np.cos(turn), np.ones_like(turn)
    light = 4 / np.pi * span * np.sin(angle) ** 2 * weights / _in_focus(SHIFTS)[:, None]
    table = np.empty((len(SHIFTS), int(largest / PHASE_STEP) + 2))
    for column in table.T:
        column[:] = (now * light).sum(axis=1)
        now, before = twice * now - before, now
    return table
