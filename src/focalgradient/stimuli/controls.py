"""Control measures: whether pictures of one scene differ only in blur, by luminance, geometry and spectrum.

Each picture is compared with a prediction from the pinhole picture and the blur alone (`render.blur_picture`), which is
independent of the renderer's lens samples.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import maximum_filter

from focalgradient.arrays import FloatArray
from focalgradient.errors import InputError
from focalgradient.optics import Optics
from focalgradient.psf import disc_transfer
from focalgradient.render.blurred import blur_picture
from focalgradient.render.rendered import LUMINANCE

__all__ = [
    "AGAIN",
    "LIMITS",
    "SMOOTH",
    "Sharp",
    "against_discs",
    "against_prediction",
    "judged",
    "refuse_seams",
    "spectrum",
]

LIMITS = {
    "mean_luminance_percent": 0.5,
    "shift_px": 0.05,
    "spectrum_percent": 5.0,
    "noise_steps": 0.5,
    "sharpest": 1.15,
}
"""Limits up to which a property counts as controlled: change of mean luminance from the pinhole picture; shift from the
prediction; amplitude difference from the prediction per octave of spatial frequency; rendering noise in 8-bit steps of
the display; and maximum gradient relative to that allowed by the blur of its surroundings."""

AGAIN = "and make it again"
"""Remedy for a picture that is sharper than its blur allows."""

SMOOTH = (
    "and if they do, smooth 1 / distance before blurring (such as by a Gaussian of 4 pixels), as errors of a depth map "
    "at occlusion boundaries have this effect"
)
"""Remedy for a picture, blurred by a measured depth map, that is sharper than its blur allows."""

BOUNDARY_D = 0.05  # difference between neighbouring pixels (D) that counts as an occlusion boundary
MIN_CYCLES = 4  # minimum number of cycles within the analysed part of the picture for an octave to be analysed


@dataclass(frozen=True, slots=True, eq=False)
class Sharp:
    """Pinhole view: radiance, H x W x 3, luminance noise and depth, H x W, and pixel angle (rad)."""

    light: NDArray[np.floating]
    residual: NDArray[np.floating]
    depth: NDArray[np.floating]
    pixel_angle: float


def against_prediction(
    light: NDArray[np.floating],
    residual: NDArray[np.floating],
    sharp: Sharp,
    optics: Sequence[Optics],
) -> dict[str, Any]:
    """Return the shift and spectrum of a picture relative to a prediction from the pinhole picture and the blur.

    Parameters
    ----------
    light
        Luminance of the picture, H x W.
    residual
        Half the difference of the two halves of its samples, H x W: its noise alone.
    sharp
        Pinhole view, with an integer multiple of the picture's resolution.
    optics
        Optics of the picture: one for all wavebands, or one each for red, green and blue.

    Returns
    -------
    dict
        ``shift_px``: right and down. ``spectrum``: amplitude relative to the prediction, per octave of spatial
        frequency, the finest first. Both are corrected for noise; a margin as wide as the blur is excluded. Empty if
        the remaining part has less than one octave; without ``spectrum`` if noise dominates.
    """
    (height, width), finer = light.shape, len(sharp.depth) // len(light)
    weights = np.array(LUMINANCE)
    halves = np.zeros((2, height, width))
    for half, sign in enumerate((1, -1)):
        # The colour channels share their noise, up to their weights.
        colours = sharp.light + sign * sharp.residual[..., None]
        parts = [colours @ weights] if len(optics) == 1 else np.moveaxis(colours * weights, 2, 0)
        for part, lens in zip(parts, optics, strict=True):
            blurred = blur_picture(part, sharp.depth, lens, pixel_angle=sharp.pixel_angle)
            halves[half] += blurred.reshape(height, finer, width, finer).mean(axis=(1, 3))
    radii = [lens.aperture_diameter / 2 * np.abs(lens.focus_vergence - 1 / sharp.depth).max() for lens in optics]
    widest = max(radii) / sharp.pixel_angle / finer
    inside, is_usable = _usable(sharp.depth, math.ceil(widest) + 2, finer)
    seen, noise = light[inside], residual[inside]
    if not _measurable(seen):
        return {}
    expected, uncertain = halves.mean(axis=0)[inside], (halves[0] - halves[1])[inside] / 2
    power, predicted = (spectrum(image) - spectrum(of) for image, of in ((seen, noise), (expected, uncertain)))
    is_usable |= is_usable.mean() < 0.1  # too little remains: include boundaries
    found = {"shift_px": _shift(seen, expected, is_usable)}
    if (predicted > 0).all():
        found["spectrum"] = np.sqrt(np.maximum(power, 0) / predicted).tolist()
    return found


def _measurable(part: NDArray[np.floating]) -> bool:
    """Return whether a part of a picture, H x W, is large enough for one octave of spatial frequency."""
    return min(part.shape) >= 4 * MIN_CYCLES


def spectrum(image: NDArray[np.floating]) -> FloatArray:
    """Return the power of an image, H x W, per octave of radial spatial frequency, from the Nyquist limit downwards.

    Octaves end where fewer than 4 cycles fit into the picture. A Hann window is applied.

    >>> wave = np.sin(2 * np.pi * 0.3 * np.arange(64)) * np.ones((64, 1))  # cycles per pixel
    >>> power = spectrum(wave)
    >>> int(power.argmax()), len(power)
    (0, 3)
    """
    window = np.hanning(image.shape[0] + 2)[1:-1, None] * np.hanning(image.shape[1] + 2)[1:-1]
    around = image - np.sum(window * image) / np.sum(window)
    power = np.abs(np.fft.fft2(window * around)) ** 2 / np.sum(window**2)
    frequency = np.hypot(*np.meshgrid(*(np.fft.fftfreq(side) for side in image.shape), indexing="ij"))
    octaves = max(1, int(math.log2(min(image.shape) / 2 / MIN_CYCLES)))
    edges = 0.5 / 2.0 ** np.arange(octaves + 1)
    return np.array([power[(frequency < high) & (frequency >= low)].mean() for high, low in pairwise(edges)])


def against_discs(
    light: NDArray[np.floating],
    sharp: NDArray[np.floating],
    distance: NDArray[np.floating],
    optics: Optics,
    pixel_angle: float,
) -> dict[str, Any]:
    """Return the shift and spectrum of a blurred photograph relative to analytic discs, away from occlusion boundaries.

    The prediction is independent of `render.blur_picture` except for the blur radius: the whole picture is blurred by 2
    J1(x) / x for radii a quarter pixel apart, and each pixel is interpolated at its own radius. At occlusion
    boundaries, where that is invalid, the prediction is replaced by the picture itself, so that differences there are
    ignored.

    Parameters
    ----------
    light, sharp
        Luminance of the picture and of the pinhole picture, H x W.
    distance
        Distance in metres, H x W.
    optics, pixel_angle
        Optics of the camera; pixel angle in radians.

    Returns
    -------
    dict
        As for `against_prediction`; empty if less than a tenth of the picture is away from occlusion boundaries, or the
        part inside a margin as wide as the blur is too small for one octave.
    """
    vergence = 1 / np.asarray(distance, float)
    radius = optics.aperture_diameter / 2 * np.abs(optics.focus_vergence - vergence) / pixel_angle
    inside, is_usable = _usable(distance, math.ceil(float(radius.max())) + 2)
    seen = light[inside]
    if not _measurable(seen) or is_usable.mean() < 0.1:
        return {}
    expected = np.where(is_usable, _by_discs(sharp, radius)[inside], seen)
    ratio = np.sqrt(spectrum(seen) / np.maximum(spectrum(expected), np.finfo(float).tiny))
    return {"shift_px": _shift(seen, expected, is_usable), "spectrum": ratio.tolist()}


def _usable(distance: NDArray[np.floating], rim: int, finer: int = 1) -> tuple[tuple[slice, slice], NDArray[np.bool_]]:
    """Return the part of a picture within a margin of `rim` pixels, and where no occlusion boundary is as near.

    There the prediction depends on hidden surfaces. `finer` is the resolution of the distances (m) relative to it.
    """
    vergence = 1 / np.asarray(distance, float)
    jumps = [np.abs(np.diff(vergence, axis=axis, prepend=vergence.take([0], axis))) > BOUNDARY_D for axis in (0, 1)]
    beside = maximum_filter(jumps[0] | jumps[1], finer * (2 * rim + 1))[::finer, ::finer]
    inside = (slice(rim, beside.shape[0] - rim), slice(rim, beside.shape[1] - rim))
    return inside, ~beside[inside]


def _shift(seen: NDArray[np.floating], expected: NDArray[np.floating], usable: NDArray[np.bool_]) -> list[float]:
    """Return the shift of a picture from the expected one, right and down, in pixels, by its `usable` pixels."""
    slopes = np.stack(np.gradient(expected)[::-1])[:, usable]
    # A picture displaced by s equals the original minus s times its gradient.
    return np.negative(np.linalg.lstsq(slopes.T, (seen - expected)[usable], rcond=None)[0]).tolist()


def _by_discs(sharp: NDArray[np.floating], radius: FloatArray) -> FloatArray:
    """Return the picture with each pixel blurred by a disc of its own radius (px), applied to the whole picture."""
    pad = math.ceil(float(radius.max())) + 1
    wide = np.pad(np.asarray(sharp, float), pad, mode="symmetric")
    waves = np.fft.rfft2(wide)
    frequency = np.hypot(np.fft.fftfreq(wide.shape[0])[:, None], np.fft.rfftfreq(wide.shape[1]))
    place = radius / 0.25
    made = np.zeros(radius.shape)
    for level in range(math.ceil(float(place.max())) + 1):
        weight = np.maximum(1 - np.abs(place - level), 0)
        if weight.any():
            blurred = np.fft.irfft2(waves * disc_transfer(frequency, 0.25 * level), wide.shape)
            made += weight * blurred[pad:-pad, pad:-pad]
    return made


def refuse_seams(scenes: Mapping[str, Mapping[str, Any]], remedy: str = AGAIN) -> None:
    """Raise `InputError`, naming the picture, if one is sharper somewhere than its blur allows.

    `scenes` is `controls.scenes` of a manifest: the pictures of each scene, with their measures. `remedy` is what to do
    if picture, depth and focus belong together.
    """
    for name, scene in scenes.items():
        for stem, one in scene["pictures"].items():
            if one.get("sharpest", 0.0) > LIMITS["sharpest"]:
                column, row = one.get("sharpest_px", ("?", "?"))
                raise InputError(
                    f"{name}/{stem} is sharper than its blur allows, {one['sharpest']:.3g} times at column {column}, "
                    f"row {row} (limit {LIMITS['sharpest']:g}): check that picture, depth and focus belong together, "
                    f"{remedy}."
                )


SIZES: Mapping[str, tuple[str, Callable[[Any], float]]] = {
    "mean_luminance_percent": ("mean_luminance_percent", abs),
    "shift_px": ("shift_px", lambda shift: math.hypot(*shift)),
    "spectrum_percent": ("spectrum", lambda ratios: max(100 * abs(ratio - 1) for ratio in ratios)),
    "noise_steps": ("noise_steps", float),
    "sharpest": ("sharpest", float),
}
"""Measure of a picture that each of `LIMITS` bounds, and its size."""


def judged(pictures: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """Return the worst value of each measure over the pictures that have it, its limit, and whether it is met."""
    found = {}
    for name, (measure, size) in SIZES.items():
        values = [size(picture[measure]) for picture in pictures if measure in picture]
        if values:
            found[name] = {"worst": max(values), "limit": LIMITS[name], "met": max(values) <= LIMITS[name]}
    return found
