"""One depth for a whole patch: how likely each vergence is, given all views of it together.

The model is the default method's: views of one sharp scene of natural power, each filtered by its own blur, with noise,
and in another waveband an independent texture on top. Here the patch lies at one vergence, and noise and what wavebands
share are known; the scene is integrated out, so that the result is the likelihood itself and not its maximum alone, and
what several patches or moments show can be brought together. One view gives the size of defocus, if the scene is as
natural as assumed, but hardly its sign; two give both.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike, NDArray

from focalgradient.arrays import FloatArray, Mask
from focalgradient.depth.filters import FINEST, LOW, SCENE_SLOPE
from focalgradient.depth.search import view_blur
from focalgradient.depth.settings import AUTO, noise_of_each
from focalgradient.errors import InputError, check_finite
from focalgradient.optics import capabilities
from focalgradient.psf import pixel_transfer
from focalgradient.view import View

__all__ = ["likelihood_of_transfers", "ring_transfer", "vergence_likelihood"]

RINGS = 2
"""Number of rings of frequency per step of the spectrum in which the views' powers are summed."""

POWERS: FloatArray = np.concatenate([np.geomspace(1e-3, 0.2, 8), np.geomspace(0.25, 8, 27)])
"""Scene powers over which the likelihood is averaged, relative to the low-frequency power of the sharpest view; the
lowest correspond to an empty field, in which only noise is visible."""

WEIGHTS: FloatArray = np.gradient(np.log(POWERS)) / np.gradient(np.log(POWERS)).sum()
"""Their probabilities: uniform in the logarithm."""


def vergence_likelihood(
    views: Sequence[View],
    vergences: ArrayLike,
    *,
    noise: float | Sequence[float],
    correlation: float = 1.0,
    gain: float = 1.0,
    wraps: bool = False,
) -> FloatArray:
    """Return the log likelihood of each of `vergences` for a patch at a single depth, relative to the maximum.

    Parameters
    ----------
    views
        One or more views of the patch, H x W, of one pixel angle, registered, of one exposure and without masked
        pixels; of about 40 x 40 pixels or more, or of 13 x 13 where the patch `wraps`.
    vergences
        L candidates in dioptres.
    noise
        Standard deviation of the pixels' noise in the images' units: one, or one for each view.
    correlation, gain
        Of the textures in other wavebands than the first view's with the first's, and their contrast over it.
    wraps
        Whether the patch's texture is periodic, like a wallpaper's; then the whole patch is compared.
        Otherwise it trails off towards its rim, so that pixels beyond do not matter.

    Returns
    -------
    ndarray
        L values.

    Raises
    ------
    InputError
        If the views are of several sizes, too small or masked, or a number is out of range.

    Examples
    --------
    A wall at 1.5 D in two wavebands of an eye focused at 1 D.

    >>> from focalgradient.eye import Eye, band_views
    >>> seen = band_views(1 / 1.5, Eye(0.004, 1.0), (64, 64), 2.909e-4, noise=0.01, seed=1)
    >>> vergences = np.arange(0, 3, 0.02)
    >>> found = vergence_likelihood([one.view for one in seen], vergences, noise=0.01)
    >>> bool(abs(vergences[found.argmax()] - 1.5) < 0.1)
    True
    """
    levels = check_finite("vergences", vergences, "dioptres")
    if levels.ndim != 1 or levels.size < 2:
        raise InputError("vergences must be a list of two or more numbers: give them in dioptres.")
    transfers = [ring_transfer(view, levels, wraps=wraps) for view in views]
    return likelihood_of_transfers(views, transfers, noise=noise, correlation=correlation, gain=gain, wraps=wraps)


def ring_transfer(view: View, vergences: ArrayLike, *, wraps: bool = False) -> FloatArray:
    """Return the transfer of a view's blur at each of `vergences` (L, in D) in the frequency rings compared: L x F."""
    blur, pixel = view_blur(view.optics, AUTO, view.pixel_angle)
    return blur.transfer(_rings(view.shape, wraps).radii / pixel, np.asarray(vergences, dtype=float)[:, None])


def likelihood_of_transfers(
    views: Sequence[View],
    transfers: Sequence[FloatArray],
    *,
    noise: float | Sequence[float],
    correlation: float = 1.0,
    gain: float = 1.0,
    wraps: bool = False,
) -> FloatArray:
    """`vergence_likelihood` of L candidates that are given by the transfer they imply for each view (`ring_transfer`).

    So a candidate may have a vergence of its own for each view, as a patch that moves while its texture stays.
    """
    noises = _checked(views, noise, correlation, gain)
    rings = _rings(views[0].shape, wraps)
    radii, counts = rings.radii, rings.counts
    power = _powers([np.asarray(v.image, float) for v in views], noises, rings)
    over_noise = np.stack(transfers) / noises[:, None, None]
    wavebands = [capabilities(v.optics).waveband for v in views]
    other = np.array([name != wavebands[0] for name in wavebands])
    # What each source of texture, of power 1, puts into the views' spectra, over their noise: views x L x F.
    shared = over_noise * np.where(other, gain * correlation, 1.0)[:, None, None]
    own = over_noise * np.where(other, gain * np.sqrt(1 - correlation**2), 0.0)[:, None, None]
    sources = np.stack([shared, own] if other.any() else [shared])
    natural = rings.passed / radii**SCENE_SLOPE
    level = float(np.max(_levels(radii, counts, power) * noises**2))
    each = _marginals(*_terms(sources, power, natural * level), counts)
    total: FloatArray = np.logaddexp.reduce(each + np.log(WEIGHTS)[:, None], axis=0)
    return total - total.max()


def _terms(
    sources: FloatArray, power: FloatArray, natural: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """Return the coefficients a, b, c and d (L x F each) of the likelihood's dependence on the scene's power p.

    With U the sources' amplitudes over the noise, the views' covariance is 1 + p U U'; by Woodbury's identity the
    likelihood's logarithm is half the sum of tr(M^-1 p U' S U) - log det M, M = 1 + p U' U, S the views' own spectra.
    Of one or two sources det M = 1 + a p + b p^2, and the trace is (c p + d p^2) / det M.
    """
    met = np.einsum("aslf,stf,btlf->ablf", sources, power, sources, optimize=True)
    size = np.einsum("aslf,bslf->ablf", sources, sources, optimize=True)
    if len(size) == 1:
        nothing = np.zeros_like(size[0, 0])
        return size[0, 0] * natural, nothing, met[0, 0] * natural, nothing
    crossed = size[1, 1] * met[0, 0] - 2 * size[0, 1] * met[0, 1] + size[0, 0] * met[1, 1]
    return (
        (size[0, 0] + size[1, 1]) * natural,
        (size[0, 0] * size[1, 1] - size[0, 1] ** 2) * natural**2,
        (met[0, 0] + met[1, 1]) * natural,
        crossed * natural**2,
    )


def _marginals(a: FloatArray, b: FloatArray, c: FloatArray, d: FloatArray, counts: FloatArray) -> FloatArray:
    """Return the log likelihood at each of `POWERS`, sources of texture integrated out: P x L."""
    found = np.empty((POWERS.size, len(a)))
    for row, factor in zip(found, POWERS.tolist(), strict=True):
        determinant = b * factor
        determinant += a
        determinant *= factor
        determinant += 1
        gained = d * factor
        gained += c
        gained *= factor
        gained /= determinant
        gained -= np.log(determinant, out=determinant)
        row[:] = gained @ counts / 2
    return found


def _levels(radii: FloatArray, counts: FloatArray, power: FloatArray) -> FloatArray:
    """Estimate each view's sharp scene power at frequency 1, relative to that of the noise."""
    low = (radii < LOW[1]) & (counts > 0)  # no moderate blur takes anything there
    if not low.any():
        raise InputError(
            "the patch is too small to show coarse detail, which gives the strength of its texture: give 40 x 40 "
            "pixels or more, or 13 x 13 of a periodic texture (wraps=True)."
        )
    own = np.maximum(np.diagonal(power).T[:, low] - 1, 0) * radii[low] ** SCENE_SLOPE
    return np.asarray(np.maximum((own * counts[low]).sum(axis=1) / counts[low].sum(), 1e-9))


@dataclass(frozen=True, eq=False)
class _Rings:
    """Rings of frequency of a patch: F `radii` (cycles per pixel) and what goes with them.

    `counts` is the effective number of samples in each, `passed` the share of power that the pixels' own size lets
    through; `used` and `place` say which frequencies are compared and in which ring each of them lies, `twice` how
    often each counts, and `taper` is the patch's window.
    """

    radii: FloatArray
    counts: FloatArray
    passed: FloatArray
    taper: FloatArray
    used: Mask
    place: NDArray[np.intp]
    twice: FloatArray

    def mean(self, values: FloatArray) -> FloatArray:
        """Return the mean over each ring of `values` at the frequencies compared."""
        counts = np.bincount(self.place, self.twice)
        return np.asarray(np.bincount(self.place, self.twice * values) / counts)


@lru_cache(maxsize=8)
def _rings(shape: tuple[int, int], wraps: bool) -> _Rings:
    height, width = shape
    taper = np.ones((height, width))
    if not wraps:
        taper = np.outer(*(np.sin(np.pi * (np.arange(n) + 0.5) / n) ** 2 for n in (height, width)))
    effective = float((taper**2).sum()) ** 2 / float((taper**4).sum()) / (height * width)
    down, right = np.fft.fftfreq(height)[:, None], np.fft.rfftfreq(width)
    radial = np.hypot(down, right)
    twice = np.full(radial.shape, 2.0)
    twice[:, 0] = 1.0
    if width % 2 == 0:
        twice[:, -1] = 1.0
    ring = np.rint(radial * RINGS * min(height, width)).astype(int)
    used = (radial > 0 if wraps else radial > 2.5 / min(height, width)) & (radial < FINEST)
    _, place = np.unique(ring[used], return_inverse=True)
    twice = twice[used]
    counts = np.bincount(place, twice)
    radii = np.bincount(place, twice * radial[used]) / counts
    passed = np.bincount(place, twice * pixel_transfer(down, right)[used] ** 2) / counts
    return _Rings(radii, np.asarray(counts * effective, float), passed, taper, used, place, twice)


def _powers(images: Sequence[FloatArray], noises: FloatArray, rings: _Rings) -> FloatArray:
    """Return the mean cross powers of the views in each ring, relative to that of the noise: n x n x F."""
    taper = rings.taper
    energy = float((taper**2).sum())
    spectra = [
        (np.fft.rfft2((image - (image * taper).sum() / taper.sum()) * taper) / (sd * np.sqrt(energy)))[rings.used]
        for image, sd in zip(images, noises, strict=True)
    ]
    power = np.empty((len(images), len(images), rings.radii.size))
    for i, first in enumerate(spectra):
        for j, second in enumerate(spectra[: i + 1]):
            power[i, j] = power[j, i] = rings.mean((first.conj() * second).real)
    return power


def _checked(views: Sequence[View], noise: float | Sequence[float], correlation: float, gain: float) -> FloatArray:
    if len({capabilities(v.optics).waveband for v in views} - {""}) > 2:
        raise InputError("views are in three wavebands or more, but two at most can be compared: leave one out.")
    if len(views) < 1 or len({(view.shape, view.pixel_angle) for view in views}) > 1:
        raise InputError(f"views holds {len(views)} views, but must hold one or more of one size and pixel angle.")
    if any(view.mask is not None and not view.mask.all() for view in views):
        raise InputError("a view has masked pixels, but all of a patch is compared: crop it to where none is masked.")
    noises = noise_of_each(noise, len(views))
    if not (0 < correlation <= 1 and gain > 0):
        raise InputError(
            f"correlation is {correlation!r} and gain {gain!r}, but must be above 0, the correlation at most 1."
        )
    return noises
