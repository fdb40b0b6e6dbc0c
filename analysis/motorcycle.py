"""Depth recovered from a real photograph with known depth, rendered through two apertures.

The photograph and its true disparity are `skimage.data.stereo_motorcycle` of scikit-image, which ships them: the scene
'Motorcycle' of the Middlebury 2014 benchmark (D. Scharstein, H. Hirschmueller, Y. Kitajima, G. Krathwohl, N. Nesic,
X. Wang and P. Westling, High-resolution stereo datasets with subpixel-accurate ground truth, GCPR 2014), reduced four
times. Its calibration is in that function's docstring.
"""

from __future__ import annotations

import os
from concurrent.futures import ThreadPoolExecutor

import numpy as np
from numba import njit
from numpy.typing import NDArray
from report import Progress, Shown, alone
from scipy import ndimage, special

from focalgradient import DepthMap, Lens, View, recover_depth
from focalgradient.depth.limits import texture_bound
from focalgradient.depth.settings import MethodName
from focalgradient.photographs import srgb_to_linear
from focalgradient.plotting import depth_figure
from focalgradient.render import noisy
from focalgradient.view import LUMINANCE

FOCAL_PX, BASELINE, OFFSET = 994.978, 0.193001, 31.086  # px, m, px: for the reduced photograph
PIXEL_ANGLE = 1 / FOCAL_PX
FOCUS = 1.8  # m: nearer than the scene, which is 2.1 to 5 m away
SMALL, WIDE = (Lens(focal_length=0.090, f_number=number, focus_distance=FOCUS) for number in (8, 2))
NOISE = 0.005  # relative to white paper in full light
WINDOW = 8.0
JUMP = 0.01  # D between neighbouring pixels, about a quarter of a pixel of blur radius: a depth discontinuity
MARGIN = 16  # pixels, two windows

METHODS: tuple[MethodName, ...] = ("equalise", "ratio")

OWN_BLUR = 0.6
"""Standard deviation in pixels of the Gaussian in every rendered view, which prevents aliasing."""

RADIUS_STEP = 1 / 64
"""Step of the tabulated blur radii, in pixels."""

LAYERS = 4
"""Number of depth layers per pixel of blur radius; nearer layers occlude farther ones."""


def photograph() -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.bool_]]:
    """Return linear luminance, distance in metres, and a mask of its known values (H x W each).

    Unknown disparities, mostly half-occlusions, are filled with the farther of the nearest known values to the left and
    right.
    """
    from skimage.data import stereo_motorcycle

    colour, _, disparity = stereo_motorcycle()  # type: ignore[no-untyped-call]
    luminance = srgb_to_linear(colour / 255) @ np.array(LUMINANCE)
    known = np.isfinite(disparity)
    filled = np.where(known, disparity, np.inf)
    sides = []
    for flip in (slice(None), slice(None, None, -1)):
        there = known[:, flip]
        last = np.maximum.accumulate(np.where(there, np.arange(there.shape[1]), -1), axis=1)
        value = np.take_along_axis(filled[:, flip], np.maximum(last, 0), axis=1)
        sides.append(np.where(last >= 0, value, np.inf)[:, flip])
    filled = np.where(known, filled, np.minimum(*sides))
    return luminance, FOCAL_PX * BASELINE / (filled + OFFSET), known


def discs(largest: float) -> NDArray[np.float32]:
    """Return discs of radius 0 to `largest` pixels in steps of RADIUS_STEP, each smoothed by OWN_BLUR.

    The result (R x S x S) contains the light at each whole-pixel offset (down, right) of 0 to S - 1 from the disc's
    centre.
    """
    radius = np.arange(0, largest + 2 * RADIUS_STEP, RADIUS_STEP)
    size = int(np.ceil(largest + 4 * OWN_BLUR)) + 1
    distance = np.hypot(*np.indices((size, size)))
    some, place = np.unique(distance, return_inverse=True)
    frequency = (np.arange(1500) + 0.5) / 1000  # cycles per pixel, up to where OWN_BLUR removes all contrast
    x = 2 * np.pi * np.maximum(radius, 1e-6)[:, None] * frequency
    transfer = 2 * special.j1(x) / x * np.exp(-2 * (np.pi * OWN_BLUR * frequency) ** 2)
    light = (transfer * 2 * np.pi * frequency / 1000) @ special.j0(2 * np.pi * frequency[:, None] * some)
    # a small minimum weight fills regions hidden behind a boundary from their surroundings
    return np.maximum(light[:, place.reshape(distance.shape)], 1e-7).astype(np.float32)


def seen_through(
    sharp: NDArray[np.float64], vergence: NDArray[np.float64], lens: Lens, pixel_angle: float = PIXEL_ANGLE
) -> View:
    """Render a photograph through a wide aperture: the light of each pixel is spread over the disc of its depth.

    At each pixel, light is taken from the nearest depth layer first, until the pixel is full. Gaps behind a boundary,
    where the photograph contains no information, are filled with the farthest visible layer nearby. Exact on smooth
    surfaces; approximate within a blur's width of boundaries.

    Parameters
    ----------
    sharp
        Linear radiance, H x W, completely in focus.
    vergence
        Vergence in dioptres, H x W.
    lens, pixel_angle
        Lens and pixel angle (rad) of the view.
    """
    radius = np.abs(lens.focus_vergence - vergence) * (lens.aperture_diameter / 2 / pixel_angle)
    table = discs(float(radius.max()))
    reach = table.shape[1] - 1
    layer = (vergence.max() - vergence) / np.ptp(vergence) * max(1, np.ceil(LAYERS * np.ptp(radius)))
    wide = [np.pad(values, reach, mode="symmetric") for values in (sharp, radius / RADIUS_STEP, layer)]
    light = wide[0].astype(np.float32)
    size, depth = (np.rint(values).astype(np.int32) for values in wide[1:])
    image = np.empty(sharp.shape, np.float32)
    rows = np.array_split(np.arange(len(sharp)), 32)
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        list(pool.map(lambda part: _gather(light, size, depth, table, part[0], part[-1] + 1, image), rows))
    return View(image, lens, pixel_angle)


@njit(nogil=True, cache=True, error_model="numpy", fastmath={"contract"})
def _gather(light, size, depth, table, first, last, image):  # type: ignore[no-untyped-def]
    reach = table.shape[1] - 1
    layers = depth.max() + 1
    share, colour = np.empty(layers, np.float32), np.empty(layers, np.float32)
    for y in range(first, last):
        for x in range(image.shape[1]):
            share[:] = 0
            colour[:] = 0
            for i in range(2 * reach + 1):
                for j in range(2 * reach + 1):
                    weight = table[size[y + i, x + j], abs(i - reach), abs(j - reach)]
                    share[depth[y + i, x + j]] += weight
                    colour[depth[y + i, x + j]] += weight * light[y + i, x + j]
            full, total, behind = np.float32(0), np.float32(0), np.float32(0)
            for n in range(layers):
                if share[n] > 0:
                    taken = min(share[n], 1 - full)
                    behind = colour[n] / share[n]
                    total += behind * taken
                    full += taken
            image[y, x] = total + (1 - full) * behind


def near_jumps(vergence: NDArray[np.float64], margin: int) -> NDArray[np.bool_]:
    """Return a mask of pixels within `margin` of a depth discontinuity: a change above JUMP between neighbours."""
    down, right = np.diff(vergence, axis=0, append=vergence[-1:]), np.diff(vergence, axis=1, append=vergence[:, -1:])
    smooth = np.maximum(np.abs(down), np.abs(right)) <= JUMP
    return np.asarray(ndimage.distance_transform_edt(smooth) <= margin)


def bound(sharp: NDArray[np.floating], vergence: NDArray[np.float64], noise: float) -> NDArray[np.float64]:
    """Return the bound on the SD of vergence (H x W, D) of any unbiased method, at each pixel in the window."""
    levels = np.linspace(vergence.min(), vergence.max(), 5)
    maps = [
        texture_bound(sharp, (SMALL, WIDE), float(level), PIXEL_ANGLE, noise=noise, window=WINDOW) for level in levels
    ]
    place = (vergence - levels[0]) / (levels[1] - levels[0])
    logarithm: NDArray[np.float64] = ndimage.map_coordinates(
        np.log(maps), [place, *np.indices(vergence.shape)], order=1, mode="nearest"
    )
    return np.exp(logarithm)


def score(
    depth: DepthMap, vergence: NDArray[np.float64], least: NDArray[np.float64], where: NDArray[np.bool_]
) -> dict[str, float]:
    """Return errors over the valid pixels of `where`, given true `vergence` and the SD bound `least` (D, H x W)."""
    usable = depth.valid & where
    error = depth.vergence[usable] - vergence[usable]
    percent = 100 * (depth.distance[usable] * vergence[usable] - 1)
    return {
        "valid_percent": 100 * float(usable.sum() / where.sum()),
        "median_size_of_error_percent": float(np.median(np.abs(percent))),
        "bias_percent": float(np.median(percent)),
        "median_size_of_error_D": float(np.median(np.abs(error))),
        "within_2_vergence_sd_percent": 100 * float(np.mean(np.abs(error) <= 2 * depth.vergence_sd[usable])),
        # the median absolute value of a normal variable is 0.674 SD
        "median_multiple_of_the_bound": float(np.median(np.abs(error) / least[usable]) / 0.674),
    }


def make(*, full: bool = False, progress: Progress | None = None) -> Shown:
    report = progress or (lambda share: None)
    luminance, distance, known = photograph()
    vergence = 1 / distance
    clean = [seen_through(luminance, vergence, lens) for lens in (SMALL, WIDE)]
    report(0.3)
    views = [noisy(view, NOISE, seed) for seed, view in enumerate(clean)]
    sharp = seen_through(luminance, vergence, Lens(SMALL.focal_length, np.inf, FOCUS)).image
    least = bound(sharp, vergence, NOISE)
    report(0.5)
    outlines = near_jumps(vergence, MARGIN)
    regions = {"away from jumps": known & ~outlines, "near jumps": known & outlines, "all": known}
    scores, maps = {}, {}
    for method in METHODS:
        maps[method] = recover_depth(views, method=method, near=FOCUS, window=WINDOW)
        scores[method] = {name: score(maps[method], vergence, least, where) for name, where in regions.items()}
        report(0.5 + 0.5 * len(maps) / len(METHODS))
    blur = WIDE.blur_radius(distance) / PIXEL_ANGLE
    return Shown(
        title="A real photograph with true depth",
        caption=(
            "A photograph whose true depth was measured by structured light (‘Motorcycle’, Middlebury 2014, as "
            "scikit-image ships it), every pixel’s light spread over the disc of its own depth as an aperture of "
            f"{1e3 * SMALL.aperture_diameter:.0f} and of {1e3 * WIDE.aperture_diameter:.0f} mm would, focused at "
            f"{FOCUS:g} m, in front of everything: discs of {blur.min():.1f} to {blur.max():.1f} pixels radius in the "
            f"wider. Noise is {100 * NOISE:g} % of white. Where the photograph does not show what lies behind an "
            "outline, the blur there is an approximation.",
            "Hatched: rejected, or of unknown true depth. Where the surface is smooth over two windows "
            f"({MARGIN} pixels) the error is near the least possible in that texture, noise and window; near jumps in "
            "depth errors are larger, some of them larger than stated. Blank walls are rejected.",
            "The bound is worked out pixel by pixel from the photograph’s own texture.",
        ),
        figure=depth_figure(
            views,
            maps["equalise"],
            names=["simulated view 1", "simulated view 2"],
            truth=np.where(known, distance, np.nan),
        ),
        summary={
            f"{method}_{region.replace(' ', '_')}_{name}": value
            for method, by_region in scores.items()
            for region, values in by_region.items()
            for name, value in values.items()
        },
        plotted={
            "across_the_middle": {
                "row": len(distance) // 2,
                "true_m": np.where(known, distance, np.nan)[len(distance) // 2],
                "recovered_m": maps["equalise"].distance[len(distance) // 2],
                "valid": maps["equalise"].valid[len(distance) // 2],
            },
        },
    )


if __name__ == "__main__":
    alone("motorcycle", make)
