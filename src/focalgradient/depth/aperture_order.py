"""Detect f-numbers in the wrong order: of two views with one focus, the larger aperture never shows finer detail."""

from __future__ import annotations

from itertools import combinations

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from focalgradient.depth.filters import smoothed
from focalgradient.depth.registration import RegisteredViews, measure_placement, resample
from focalgradient.depth.search import Search, one_focus

__all__ = ["misordered_apertures"]

SIDE = 1024
"""Side in pixels of the most textured part, in which detail is compared; limits the time. Chosen by hand."""

SCALES = (1.0, 1.5, 2.0)
"""Standard deviations in pixels of the narrower of two Gaussians, whose difference is the detail compared."""

FREQUENCY = 0.14
"""Middle frequency (cycles per pixel) of the detail at the finest scale, for the effect of diffraction."""

MARGIN = 8
"""Distance in pixels from saturated and masked pixels within which detail is left out. Chosen by hand."""

SHARPER, SOFTER = 1.05, 0.95
"""The order is contradicted if the larger aperture has more than `SHARPER` times the smaller one's detail, and this
less than `SOFTER` times that of the larger one. Of 29 pairs of photographs (20 rooms) none was contradicted as stated,
and 24 were (15 rooms) when reversed (`benchmarks/aperture_order.py`)."""

GREEN = 550e-9
"""Wavelength in metres of the diffraction that softens the smaller aperture in focus."""


def misordered_apertures(registered: RegisteredViews, search: Search) -> str | None:
    """Return a clause about two views whose f-numbers seem to be in the opposite order; None if there are none.

    Each view's detail is predicted from the other's by least squares: noise and displacement can only reduce it.
    """
    apertures = [optics.aperture_diameter for optics in search.optics]
    comparable = one_focus(search.focus) and len(set(search.wavebands)) == 1 and search.isotropic
    if not comparable or len(set(apertures)) == 1:
        return None
    part = registered.most_textured_crop(SIDE)
    inside = ndimage.minimum_filter(part.usable, 2 * MARGIN + 1, mode="constant", cval=False)
    contrasts = [[float(np.linalg.norm(_detail(image, scale)[inside])) for scale in SCALES] for image in part.images]
    images: list[NDArray[np.float32]] = []
    for pair in combinations(range(len(apertures)), 2):
        small, large = sorted(pair, key=lambda number: apertures[number])
        cut_off = (np.inf if apertures[n] == 0 else apertures[n] / GREEN for n in (small, large))
        in_focus = [max(0.0, 1 - 1.27 * FREQUENCY / search.pixel_angle / limit) for limit in cut_off]
        if apertures[small] == apertures[large] or in_focus[0] == 0:
            continue
        # Less contrast contradicts nothing however the views are placed, which takes most of the time.
        if not any(less < more for less, more in zip(contrasts[small], contrasts[large], strict=True)):
            continue
        images = images or [part.images[0], *(_placed(part.images[0], i, part.usable) for i in part.images[1:])]
        softened = in_focus[0] / in_focus[1]
        for scale in SCALES:
            less, more = _gains(images[small], images[large], inside, scale)
            if more > SHARPER / softened and less < SOFTER * softened:
                return (
                    f"view {large + 1} shows finer detail than view {small + 1} ({more:.2f} times its contrast), but "
                    "is stated to have the larger aperture: their f-numbers are probably in the opposite order "
                    f"(f_number); if not, view {small + 1} was moved, denoised or focused elsewhere"
                )
    return None


def _placed(
    reference: NDArray[np.float32], image: NDArray[np.float32], usable: NDArray[np.bool_]
) -> NDArray[np.float32]:
    """Return `image` shifted, turned and scaled onto `reference` (both H x W)."""
    return resample(image, measure_placement(reference, image, usable)[0])[0]


def _detail(image: NDArray[np.float32], scale: float) -> NDArray[np.float32]:
    """Return the difference of `image` (H x W) smoothed by Gaussians of `scale` and of twice that, in pixels."""
    return np.asarray(smoothed(image, scale) - smoothed(image, 2 * scale))


def _gains(
    small: NDArray[np.float32], large: NDArray[np.float32], inside: NDArray[np.bool_], scale: float
) -> tuple[float, float]:
    """Return the detail of `small` relative to `large`, and that of `large` relative to `small`, at least."""
    one, other = (_detail(image, scale)[inside] for image in (small, large))
    shared = float(one @ other)
    return shared / max(float(other @ other), 1e-30), shared / max(float(one @ one), 1e-30)
