"""Whether pictures of one scene differ in nothing but blur: their light, their geometry and their spectra, measured.

Each picture is held against what the blur alone makes of the pinhole picture (`render.blur_picture`), in which no ray
of the renderer has a part.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import maximum_filter
from scipy.special import j1

from focalgradient.errors import InputError
from focalgradient.optics import Optics
from focalgradient.render.blurred import blur_picture
from focalgradient.render.rendered import LUMINANCE

__all__ = ["LIMITS", "Sharp", "against_discs", "against_prediction", "judged", "refuse_seams", "spectrum"]

LIMITS = {
    "mean_luminance_percent": 0.5,
    "shift_px": 0.05,
    "spectrum_percent": 5.0,
    "noise_steps": 0.5,
    "sharpest": 1.15,
}
"""What is called controlled: change of the mean luminance from the pinhole picture; shift against the prediction;
difference of amplitude from the prediction, in each octave of spatial frequency; noise of the rendering, in steps of
the display's 8 bits; and the largest gradient over the largest that the blur of its surroundings allows."""

EDGE = 0.05  # dioptres between neighbouring pixels, from which on one thing is in front of another
FEWEST = 4  # cycles in the part of the picture that is looked at, below which an octave is not looked at


@dataclass(frozen=True, slots=True, eq=False)
class Sharp:
    """What a pinhole shows: light, H x W x 3, the noise of its luminance and its depth, H x W, and the pixel angle."""

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
    """Shift and spectrum of a picture against what blur alone makes of the pinhole picture.

    Parameters
    ----------
    light
        Luminance of the picture, H x W.
    residual
        Half the difference of the two halves of its samples, H x W: just its noise.
    sharp
        What the pinhole shows, with a whole number of times as many pixels each way.
    optics
        Through which the picture is seen: one for all light, or for red, green and blue.

    Returns
    -------
    dict
        ``shift_px``: right and down. ``spectrum``: ratio of the amplitudes to the prediction's, in octaves of spatial
        frequency, the finest first. Noise has no part in either; a rim as wide as the blur is left out. Empty where the
        blur leaves too little of the picture for one octave; without ``spectrum`` where it drowns in noise.
    """
    (height, width), finer = light.shape, len(sharp.depth) // len(light)
    weights = np.array(LUMINANCE)
    halves = np.zeros((2, height, width))
    for half, sign in enumerate((1, -1)):
        # Colours share their noise, but for their weights.
        colours = sharp.light + sign * sharp.residual[..., None]
        parts = [colours @ weights] if len(optics) == 1 else np.moveaxis(colours * weights, 2, 0)
        for part, lens in zip(parts, optics, strict=True):
            blurred = blur_picture(part, sharp.depth, lens, pixel_angle=sharp.pixel_angle)
            halves[half] += blurred.reshape(height, finer, width, finer).mean(axis=(1, 3))
    radii = [lens.aperture_diameter / 2 * np.abs(lens.focus_vergence - 1 / sharp.depth).max() for lens in optics]
    widest = max(radii) / sharp.pixel_angle / finer
    rim = math.ceil(widest) + 2
    inside = (slice(rim, light.shape[0] - rim), slice(rim, light.shape[1] - rim))
    seen, noise = light[inside], residual[inside]
    if not _measurable(seen):
        return {}
    expected, uncertain = halves.mean(axis=0)[inside], (halves[0] - halves[1])[inside] / 2
    power, predicted = (spectrum(image) - spectrum(of) for image, of in ((seen, noise), (expected, uncertain)))
    # Not where an edge hides what the prediction would need.
    vergence = 1 / sharp.depth
    jumps = [np.abs(np.diff(vergence, axis=axis, prepend=vergence.take([0], axis))) > EDGE for axis in (0, 1)]
    plain = ~maximum_filter(jumps[0] | jumps[1], finer * (2 * rim + 1))[::finer, ::finer][inside]
    plain |= plain.mean() < 0.1  # so little is left that edges are better than nothing
    slopes = np.stack(np.gradient(expected)[::-1])[:, plain]
    # A picture moved by s is the still one less s times its slope.
    shift = -np.linalg.solve(slopes @ slopes.T, slopes @ (seen - expected)[plain])
    found = {"shift_px": shift.tolist()}
    if (predicted > 0).all():
        found["spectrum"] = np.sqrt(np.maximum(power, 0) / predicted).tolist()
    return found


def _measurable(part: NDArray[np.floating]) -> bool:
    """Whether a part of a picture, H x W, holds an octave of spatial frequency."""
    return min(part.shape) >= 4 * FEWEST


def spectrum(image: NDArray[np.floating]) -> NDArray[np.float64]:
    """Power of an image, H x W, in octaves of spatial frequency in any direction, from the pixels' limit downwards.

    Octaves end where fewer than 4 cycles would lie in the picture. The picture fades out towards its rim.

    >>> wave = np.sin(2 * np.pi * 0.3 * np.arange(64)) * np.ones((64, 1))  # cycles per pixel
    >>> power = spectrum(wave)
    >>> int(power.argmax()), len(power)
    (0, 3)
    """
    window = np.hanning(image.shape[0] + 2)[1:-1, None] * np.hanning(image.shape[1] + 2)[1:-1]
    around = image - np.sum(window * image) / np.sum(window)
    power = np.abs(np.fft.fft2(window * around)) ** 2 / np.sum(window**2)
    frequency = np.hypot(*np.meshgrid(*(np.fft.fftfreq(side) for side in image.shape), indexing="ij"))
    octaves = max(1, int(math.log2(min(image.shape) / 2 / FEWEST)))
    edges = 0.5 / 2.0 ** np.arange(octaves + 1)
    return np.array([power[(frequency < high) & (frequency >= low)].mean() for high, low in pairwise(edges)])


def against_discs(
    light: NDArray[np.floating],
    sharp: NDArray[np.floating],
    distance: NDArray[np.floating],
    optics: Optics,
    pixel_angle: float,
) -> dict[str, Any]:
    """Shift and spectrum of a blurred photograph against discs by their analytic transfer, away from outlines.

    The prediction shares nothing with `render.blur_picture` but the law of blur: the whole picture is blurred by
    2 J1(x) / x, once for each quarter pixel of radius, and each pixel interpolated at its own radius. At outlines,
    where that is wrong, the prediction is replaced by the picture itself: differences there are not measured.

    Parameters
    ----------
    light, sharp
        Luminance of the picture and of the pinhole picture, H x W.
    distance
        In metres, H x W.
    optics, pixel_angle
        Of the camera; radians of a pixel.

    Returns
    -------
    dict
        As of `against_prediction`; empty where less than a tenth of the picture is away from outlines, or what is left
        of it within a rim as wide as the blur is too small for one octave.
    """
    vergence = 1 / np.asarray(distance, float)
    radius = optics.aperture_diameter / 2 * np.abs(optics.focus_vergence - vergence) / pixel_angle
    rim = math.ceil(float(radius.max())) + 2
    inside = (slice(rim, light.shape[0] - rim), slice(rim, light.shape[1] - rim))
    jumps = [np.abs(np.diff(vergence, axis=axis, prepend=vergence.take([0], axis))) > EDGE for axis in (0, 1)]
    plain = ~maximum_filter(jumps[0] | jumps[1], 2 * rim + 1)[inside]
    seen = light[inside]
    if not _measurable(seen) or plain.mean() < 0.1:
        return {}
    expected = np.where(plain, _by_discs(sharp, radius)[inside], seen)
    slopes = np.stack(np.gradient(expected)[::-1])[:, plain]
    shift = -np.linalg.lstsq(slopes.T, (seen - expected)[plain], rcond=None)[0]
    ratio = np.sqrt(spectrum(seen) / np.maximum(spectrum(expected), np.finfo(float).tiny))
    return {"shift_px": shift.tolist(), "spectrum": ratio.tolist()}


def _by_discs(sharp: NDArray[np.floating], radius: NDArray[np.float64]) -> NDArray[np.float64]:
    """Each pixel of a picture blurred by a disc of its own radius in pixels, as if all of it had that radius."""
    pad = math.ceil(float(radius.max())) + 1
    wide = np.pad(np.asarray(sharp, float), pad, mode="symmetric")
    waves = np.fft.rfft2(wide)
    frequency = np.hypot(np.fft.fftfreq(wide.shape[0])[:, None], np.fft.rfftfreq(wide.shape[1]))
    place = radius / 0.25
    made = np.zeros(radius.shape)
    for level in range(math.ceil(float(place.max())) + 1):
        weight = np.maximum(1 - np.abs(place - level), 0)
        if weight.any():
            x = 2 * np.pi * frequency * 0.25 * level
            transfer = np.where(x > 0, 2 * j1(x) / np.where(x > 0, x, 1), 1.0)
            made += weight * np.fft.irfft2(waves * transfer, wide.shape)[pad:-pad, pad:-pad]
    return made


def refuse_seams(scenes: Mapping[str, Mapping[str, Any]]) -> None:
    """Raise InputError, with its name, for a picture that is sharper somewhere than its blur allows.

    `scenes` is `controls.scenes` of a manifest: of each scene its pictures, with what was measured in them.
    """
    for name, scene in scenes.items():
        for stem, one in scene["pictures"].items():
            if one.get("sharpest", 0.0) > LIMITS["sharpest"]:
                column, row = one.get("sharpest_px", ("?", "?"))
                raise InputError(
                    f"{name}/{stem} is sharper than its blur allows, {one['sharpest']:.3g} times at column {column}, "
                    f"row {row} (limit {LIMITS['sharpest']:g}): check that picture, depth and focus belong together, "
                    "and make it again."
                )


def judged(pictures: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """The worst of each measure among the pictures that have it, the limit, and whether it is met."""
    found = {
        "mean_luminance_percent": [
            abs(one["mean_luminance_percent"]) for one in _with(pictures, "mean_luminance_percent")
        ],
        "shift_px": [math.hypot(*one["shift_px"]) for one in _with(pictures, "shift_px")],
        "spectrum_percent": [100 * abs(ratio - 1) for one in _with(pictures, "spectrum") for ratio in one["spectrum"]],
        "noise_steps": [one["noise_steps"] for one in _with(pictures, "noise_steps")],
        "sharpest": [one["sharpest"] for one in _with(pictures, "sharpest")],
    }
    return {
        name: {"worst": max(values), "limit": LIMITS[name], "met": max(values) <= LIMITS[name]}
        for name, values in found.items()
        if values
    }


def _with(pictures: Sequence[Mapping[str, Any]], key: str) -> list[Mapping[str, Any]]:
    return [one for one in pictures if key in one]
