"""The table that turns focal disparity into depth: computed from the optics.

For texture of a known spectrum both views' energies in a band follow from their blur, and with them the ratio.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from focalgradient.arrays import FloatArray
from focalgradient.depth.filters import SCENE_SLOPE
from focalgradient.errors import InputError
from focalgradient.optics import Optics
from focalgradient.psf import Psf, pixel_transfer, psf_of

__all__ = ["BANDS", "DisparityTable", "band_transfer", "two_apertures"]


BANDS = (1, 2, 4, 8)
"""Scales in pixels of the second differences: each responds to half the frequencies of the previous one."""

NYQUIST = 0.5
"""Frequency in cycles per pixel, in any direction, above which an image is assumed to contain no texture."""

FREQUENCIES = 96
"""Number of frequencies per direction at which spectra are computed, denser where blur attenuates less. Chosen by hand.
"""

TABLE_LEVELS = 65
"""Number of levels of defocus in a table, denser near focus, where disparity is quadratic. Chosen by hand."""

LARGEST_RADIUS = 24.0
"""Maximum blur radius of the tables, in pixels. Chosen by hand."""


@dataclass(frozen=True, slots=True, eq=False)
class DisparityTable:
    """Expected focal disparity against defocus, for two apertures at one focus.

    Parameters
    ----------
    bands
        Scale of each band's second difference, in pixels.
    focus
        Vergence of the plane of focus, in dioptres.
    defocus
        Size of the defocus, L levels rising from 0, in dioptres.
    curves
        Logarithm of the disparity, bands x L.
    pixels
        Blur radius in pixels per dioptre of defocus, through the smaller aperture and the larger.
    psf
        Shape of the blur.

    Examples
    --------
    A point half a dioptre from focus has at f/5.6, in the finest band, about a fifth of the detail that it has at f/16.

    >>> from focalgradient import Lens
    >>> lenses = [Lens(focal_length=0.025, f_number=n, focus_distance=0.85) for n in (16, 5.6)]
    >>> table = DisparityTable.of(lenses, pixel_angle=3.1e-4)
    >>> table.disparity([1 / 0.85, 1 / 0.85 - 0.5]).round(2).tolist()
    [1.0, 0.22]
    """

    bands: tuple[int, ...]
    focus: float
    defocus: FloatArray
    curves: FloatArray
    pixels: tuple[float, float]
    psf: Psf

    @classmethod
    def of(
        cls,
        lenses: Sequence[Optics],
        pixel_angle: float,
        *,
        reach: float | None = None,
        psf: Psf | str = "disc",
        k: float | None = None,
        bands: Sequence[int] = BANDS,
    ) -> DisparityTable:
        """Return the table of two lenses, for 1/f texture, a square pixel and the blur of the model.

        Parameters
        ----------
        lenses
            The one with the smaller aperture and the one with the larger, at one focus.
        pixel_angle
            Angle of one pixel, in radians.
        reach
            Largest defocus to tabulate, in dioptres; by default, and at most, that of a blur of 24 pixels.
        psf, k
            Shape of the blur, alike in all directions, as in `focalgradient.recover_depth`.
        bands
            Scales of the second difference: any of 1, 2, 4 and 8 pixels, from fine to coarse.

        Raises
        ------
        InputError
            If the lenses are not two apertures at one focus, or a band is unknown.
        """
        small, large = two_apertures(lenses)
        shape = psf_of(psf, k)
        if not bands or list(bands) != [band for band in BANDS if band in bands]:
            raise InputError(
                f"bands is {tuple(bands)!r}, but must be one or more of {', '.join(map(str, BANDS))}, in this order."
            )
        limit = LARGEST_RADIUS / (large.aperture_diameter / 2 / pixel_angle)
        defocus = min(limit, reach or limit) * np.linspace(0, 1, TABLE_LEVELS) ** 1.5
        pixels = small.aperture_diameter / 2 / pixel_angle, large.aperture_diameter / 2 / pixel_angle
        down, right, _ = frequencies()
        power = texture()[:, :, None] * np.stack([band_transfer(band, down, right) ** 2 for band in bands], axis=-1)
        energy = np.stack([np.tensordot(h**2, power, 2) for h in transfers(pixels, defocus, shape)])
        curves = np.log(energy[:, 1] / energy[:, 0]).T / 2
        return cls(tuple(bands), large.focus_vergence, defocus, curves, pixels, shape)

    def disparity(self, vergence: FloatArray | Sequence[float], band: int = 1) -> FloatArray:
        """Return the expected focal disparity at `vergence` (D, any shape) in one of the table's bands; 1 in focus."""
        size = np.abs(self.focus - np.asarray(vergence, dtype=float))
        return np.exp(np.interp(size, self.defocus, self.curves[self.bands.index(band)]))


def frequencies() -> tuple[FloatArray, FloatArray, FloatArray]:
    """Nodes over the quarter plane, down (n x 1) and right (1 x n), in cycles per pixel, and their weights (n x n).

    Spectra here are even in both directions: a sum over the quarter with these weights is an integral over the square
    of a cycle per pixel.
    """
    share = (np.arange(FREQUENCIES) + 0.5) / FREQUENCIES
    nodes, widths = 0.5 * share**1.5, 1.5 * share**0.5 / FREQUENCIES
    return nodes[:, None], nodes[None, :], widths[:, None] * widths


def texture() -> FloatArray:
    """Power that pixels see of 1/f texture at each of the `frequencies`, times its weight."""
    down, right, weight = frequencies()
    frequency = np.hypot(down, right)
    return weight * pixel_transfer(down, right) ** 2 * frequency**-SCENE_SLOPE * (frequency <= NYQUIST)


def transfers(pixels: tuple[float, float], defocus: FloatArray, psf: Psf) -> FloatArray:
    """Return the transfer of each view's blur at each of the `frequencies`: levels x 2 x n x n."""
    down, right, _ = frequencies()
    frequency, radial = np.hypot(down, right), np.linspace(0, 0.75, 1025)  # isotropic: worked out along a radius
    return np.array(
        [[np.interp(frequency, radial, psf.transfer(radial, scale * d)) for scale in pixels] for d in defocus]
    )


def band_transfer(band: int, down: NDArray[np.floating], right: NDArray[np.floating]) -> FloatArray:
    """Return the transfer of the second difference of means over `band` x `band` pixels, by frequency (cycles/pixel).

    >>> float(band_transfer(1, np.array(0.5), np.array(0.5))), float(band_transfer(1, np.array(0.0), np.array(0.0)))
    (8.0, 0.0)
    """
    mean = [np.sinc(band * f) / np.sinc(f) for f in (down, right)]
    return mean[0] * mean[1] * (4 - 2 * np.cos(2 * np.pi * band * down) - 2 * np.cos(2 * np.pi * band * right))


def two_apertures(lenses: Sequence[Optics]) -> tuple[Optics, Optics]:
    """Return the lens with the smaller and the one with the larger aperture; `InputError` unless they share a focus."""
    if len(lenses) != 2:
        raise InputError(f"{len(lenses)} lenses given, but a ratio takes two: a small aperture and a large one.")
    small, large = sorted(lenses, key=lambda optics: optics.aperture_diameter)
    if abs(small.focus_vergence - large.focus_vergence) > 1e-9 * max(1.0, abs(small.focus_vergence)):
        raise InputError(
            f"the views are focused at {small.focus_vergence:.4g} and {large.focus_vergence:.4g} D, but a ratio "
            "compares two apertures at one focus: use another method for views that differ in focus."
        )
    if small.aperture_diameter == large.aperture_diameter:
        raise InputError(
            "both apertures are equal, so that their ratio is uninformative about depth: change one f-number."
        )
    return small, large
