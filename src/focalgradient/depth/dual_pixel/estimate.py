"""Depth from dual-pixel halves: each is filtered with the other's transfer, and their difference is least.

With L = H_l T and R = H_r T of an unknown texture T, H_r L - H_l R vanishes at the true radius; divided by
sqrt(|H_l|^2 + |H_r|^2) its noise is white in every frequency and alike at all radii. Its local energy is a likelihood
over the radius. Both sides of focus are searched: the phase of the halves, of tangent a (f_x / f) J2 / J1, has the sign
of the defocus.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.fft import irfft2, rfft2
from scipy.ndimage import gaussian_filter

from focalgradient.arrays import FloatArray, Mask
from focalgradient.depth.filters import Floats, Image
from focalgradient.depth.numerics import interpolate_nodes
from focalgradient.depth.read import parabola_minimum
from focalgradient.depth.search import Estimate, Problem
from focalgradient.depth.settings import halves_of
from focalgradient.depth.validity import SECONDARY_MINIMUM, blur_is_known
from focalgradient.optics import DualPixel
from focalgradient.optics.dual_pixel import half_transfer

__all__ = ["MODEL_ERROR", "estimate", "half_asymmetry", "half_radius"]

FINE_SD, COARSE_SD = 1.2, 12.0
"""Standard deviations (pixels) of the Gaussians that limit the compared detail: finer detail is aliased in half pixels,
and coarser detail differs in brightness."""

EVEN = 24.0
"""Standard deviation in pixels of the window in which the ratio of the halves' brightness is measured; the ratio varies
smoothly. Chosen by hand."""

POOL = 4
"""Side in pixels of the squares over which energy is summed; windows are larger."""

RADIUS_STEP = 0.25
"""Spacing in pixels of the candidate radii. Chosen by hand."""

WINDOWS = 4
"""Number of window sizes, each twice the previous one; the smallest that determines the blur is used. Chosen by hand.
"""

RADIUS_KNOWN = 0.15
"""Standard deviation of the radius in pixels below which no larger window is tried: half of the largest valid standard
deviation."""

SETS = 3
"""Number of asymmetries at which the likelihood is computed if asymmetry varies over the field. Chosen by hand."""

PADDED = 16
"""Width in pixels by which the halves are extended beyond their borders. Chosen by hand."""


def half_radius(
    left: Floats,
    right: Floats,
    asymmetry: Floats,
    limits: tuple[float, float],
    window: float,
    usable: Mask | None = None,
) -> tuple[Floats, Floats, Mask, float]:
    """Estimate the signed blur radius of two halves, positive nearer than focus.

    Parameters
    ----------
    left, right
        H x W, of one exposure but for a ratio that varies smoothly.
    asymmetry
        H x W, positive: of the left half.
    limits
        Least and largest radius, in pixels.
    window
        Standard deviation of the narrowest window, in pixels.
    usable
        H x W; None: all.

    Returns
    -------
    radius, sd
        In pixels, h x w blocks; `sd` is that of noise and of what the model leaves.
    clear
        Whether the likelihood has one minimum, away from the ends of the search.
    noise
        Standard deviation of the halves' noise.
    """
    compared = _Compared.of(left, right, usable)
    radii = np.arange(np.floor(limits[0] / RADIUS_STEP), np.ceil(limits[1] / RADIUS_STEP) + 1) * RADIUS_STEP
    blocks = _blocks(asymmetry.astype(np.float32))
    low, high = float(blocks.min()), float(blocks.max())
    sets = np.linspace(low, high, SETS) if high - low > 0.02 * high else np.array([(low + high) / 2])
    # The parabola through three: the energy is nearly a quadratic form in the asymmetry.
    at = np.zeros(blocks.shape, np.float32) if len(sets) == 1 else (blocks - low) / np.float32(sets[1] - sets[0])
    shares = np.stack([(at - 1) * (at - 2) / 2, -at * (at - 2), at * (at - 1) / 2])
    energies = np.empty((len(radii), *blocks.shape), np.float32)
    for level, radius in enumerate(radii):
        each = compared.energies(radius, sets)
        energies[level] = each[0] if len(each) == 1 else np.maximum((shares * each).sum(axis=0), 1e-12)
    *found, left_over = compared.minimum(energies, radii, window)
    for wider in window * 2.0 ** np.arange(1, WINDOWS):
        if wider > min(left.shape) / 4:
            break
        take = (found[1] > RADIUS_KNOWN) | (found[2] < 1)
        now = compared.minimum(energies, radii, wider)[:3]
        found = [np.where(take, new, old) for new, old in zip(now, found, strict=True)]
    return found[0], found[1], found[2] > 0, float(np.sqrt(np.median(left_over) / compared.power))


def half_asymmetry(
    left: Floats, right: Floats, radius: float, candidates: Floats, window: float
) -> tuple[Floats, Floats, Mask]:
    """Estimate the asymmetry of two halves of a flat sheet whose blur `radius` (pixels, signed) is known.

    Returns
    -------
    tuple
        The asymmetry and its standard deviation at h x w blocks, and whether the likelihood has one clear minimum among
        the evenly spaced `candidates`.
    """
    compared = _Compared.of(left, right, None)
    found, sd, clear, _ = compared.minimum(compared.energies(radius, candidates), candidates, window)
    return found, sd, clear > 0


@dataclass(frozen=True, slots=True, eq=False)
class _Compared:
    """Two halves' spectra in the band that is compared."""

    spectra: tuple[NDArray[np.complex64], NDArray[np.complex64]]
    frequencies: tuple[Floats, Floats]
    shape: tuple[int, int]
    weight: Image
    count: Image
    share: float  # independent values in a pixel after these filters
    power: float  # of white noise that the band passes

    @classmethod
    def of(cls, left: Floats, right: Floats, usable: Mask | None) -> _Compared:
        weight = np.ones(left.shape, np.float32) if usable is None else usable.astype(np.float32)
        padded = [
            np.pad(_flattened(np.asarray(half, np.float32), weight), PADDED, mode="reflect") for half in (left, right)
        ]
        rows, columns = padded[0].shape
        down, across = np.fft.fftfreq(rows)[:, None], np.fft.rfftfreq(columns)[None]
        square = (2 * np.pi) ** 2 * (down**2 + across**2)
        band = (np.exp(-square * FINE_SD**2 / 2) - np.exp(-square * COARSE_SD**2 / 2)).astype(np.float32)
        first, second = ((rfft2(half) * band).astype(np.complex64) for half in padded)
        whole = np.concatenate([band, band[:, 1:-1]], axis=1) ** 2
        height, width = left.shape
        return cls(
            (first, second),
            (down, across),
            (height, width),
            weight,
            np.maximum(_blocks(weight), 1e-3),
            float(whole.mean() ** 2 / (whole**2).mean()),
            float(whole.mean()),
        )

    def energies(self, radius: float, asymmetries: Floats) -> Image:
        """Return the mean energy of the halves' difference in each block, at one radius and several asymmetries."""
        height, width = self.shape
        even, odd = (part.astype(np.float32) for part in half_transfer(*self.frequencies, radius))
        each = []
        for one in asymmetries:
            norm = np.sqrt(2 * (even**2 + np.float32(one) ** 2 * odd**2) + np.float32(1e-3))
            here = ((even + np.complex64(1j * one) * odd) / norm).astype(np.complex64)
            off = irfft2(
                self.spectra[0] * here - self.spectra[1] * here.conj(), s=(height + 2 * PADDED, width + 2 * PADDED)
            )
            off = off[PADDED : PADDED + height, PADDED : PADDED + width]
            each.append(_blocks(off**2 * self.weight) / self.count)
        return np.stack(each)

    def minimum(self, energies: Floats, radii: Floats, window: float) -> tuple[Floats, Floats, Floats, Floats]:
        """Locate the minimum of the mean energy in a `window` (pixels) over `radii`.

        Returns radius, sd, whether it is unambiguous (1 or 0), and value.
        """
        cost = np.stack([gaussian_filter(one * self.count, window / POOL) for one in energies])
        cost /= np.maximum(gaussian_filter(self.count, window / POOL), 1e-3)
        independent = 4 * np.pi * window**2 * self.share
        step = radii[1] - radii[0]
        place, least, bend = parabola_minimum(cost)
        least = np.maximum(least, 1e-30)
        sd = step * np.sqrt(2 * least / (independent * bend))
        radius = radii[0] + step * place
        # The best of what lies farther off than the minimum itself reaches must be clearly worse.
        away = np.abs(radii[:, None, None] - radius) > np.maximum(4 * sd, 6 * step)
        second = np.where(away, cost, np.inf).min(axis=0)
        best = cost.argmin(axis=0)
        clear = (independent / 2 * (second / least - 1) > SECONDARY_MINIMUM / 2) & (best > 1) & (best < len(radii) - 2)
        return radius, sd, clear.astype(float), least


def _flattened(image: Image, weight: Image) -> Image:
    """Divide an image by its local mean, and with it the smooth ratio of the halves' brightness."""
    mean = gaussian_filter(image * weight, EVEN) / np.maximum(gaussian_filter(weight, EVEN), 1e-3)
    return np.where(weight > 0, image / np.maximum(mean, 1e-12), 1.0).astype(np.float32)


def _blocks(values: Image) -> Image:
    """Return the means of blocks of `POOL` x `POOL` pixels; the last take the remainder."""
    height, width = values.shape
    rows, columns = height // POOL, width // POOL
    cut = values[: rows * POOL, : columns * POOL].reshape(rows, POOL, columns, POOL)
    return np.asarray(cut.mean(axis=(1, 3)), np.float32)


MODEL_ERROR = 0.05
"""Error of the radius beyond noise, relative to the radius: scatter of a photographed sheet about a smooth field."""

VARIES = 1.5
"""Standard deviation, in windows, of the Gaussian within which variation of the radius contributes to its error. Chosen
by hand."""

STEADY = 0.25
"""Maximum variation of the radius within the Gaussian of `VARIES`, relative to the radius, for valid depth. Chosen by
hand."""

LEAST_ERROR = 0.06
"""Minimum error of the radius beyond noise, in pixels, which dominates near focus. Chosen by hand."""


def estimate(problem: Problem) -> Estimate:
    """Return depth from the left and the right half of one lens' dual pixels; with the side of focus."""
    pair = halves_of(problem.views)
    assert pair is not None  # as the registry asks for
    optics = problem.views[pair[0]].optics
    assert isinstance(optics, DualPixel)
    search, settings, registered = problem.search, problem.settings, problem.registered
    settings.progress(0.2, "comparing the halves")
    slope = optics.aperture_diameter / 2 / problem.views[0].pixel_angle  # pixels of radius for a dioptre
    focus = optics.focus_vergence
    limits = (slope * (search.lowest - focus), slope * (search.highest - focus))
    radius, noise_sd, clear, noise = half_radius(
        registered.images[pair[0]],
        registered.images[pair[1]],
        optics.asymmetry * optics.over(registered.shape),
        limits,
        settings.window,
        registered.usable,
    )
    model = np.maximum(MODEL_ERROR * np.abs(radius), LEAST_ERROR)
    # Where a window reaches over an outline its depth is that of either side.
    varies = _local_spread(radius, VARIES * settings.window / POOL)
    sd = np.hypot(np.hypot(noise_sd, varies), model)
    valid = clear & blur_is_known(np.hypot(noise_sd, varies), radius, STEADY)
    shape = registered.shape
    vergence = focus + interpolate_nodes(radius.astype(float), None, POOL, shape) / slope
    return Estimate(
        np.clip(vergence, search.lowest, search.highest).astype(np.float32),
        (interpolate_nodes(sd, None, POOL, shape) / slope).astype(np.float32),
        (interpolate_nodes(valid.astype(float), None, POOL, shape) > 0.5) & registered.usable,
        noise=[noise * float(image.mean()) for image in registered.images],
        details={"halves": {"asymmetry": optics.asymmetry, "field": list(optics.field), "model_error": MODEL_ERROR}},
    )


def _local_spread(values: Floats, window: float) -> FloatArray:
    """Return the standard deviation of values within a Gaussian window, in blocks."""
    middle = np.asarray(values, float) - float(np.median(values))
    square = gaussian_filter(middle**2, window) - gaussian_filter(middle, window) ** 2
    return np.asarray(np.sqrt(np.maximum(square, 0.0)), float)
