"""Blur estimated from one retinal image: where there is texture, and at edges.

A texture of the world has about the amplitude spectrum 1/f; blurred by a Gaussian of variance b^2, and seen by centre-
surround receptive fields (the Laplacian of a Gaussian of variance s^2), it gives the mean square

    E(s) = integral (2 pi f)^4 f^-2 exp(-4 pi^2 f^2 (s^2 + b^2)) 2 pi f df  =  C / (s^2 + b^2)^2 .

So how responses fall from fields of one size to those of the next gives blur without knowing the contrast C. Here E is
the root of the mean fourth power: of a texture it is the same but for a constant, and by it an edge, whose mean square
falls with the power 3/2 only and would be taken for blurred, falls with 7/4. A thin line falls with 11/4.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.fft import irfft2, rfft2
from scipy.ndimage import gaussian_filter

from focalgradient.depth.edges.measure import measure_edges
from focalgradient.eye import mean_eye_mtf

__all__ = [
    "LINE",
    "TEXTURE",
    "BlurEstimate",
    "Law",
    "estimate_blur",
    "eye_law",
    "power_law",
    "retinal_image",
    "texture_slope",
]

FloatArray = NDArray[np.float64]

Law = Callable[[FloatArray, FloatArray], FloatArray]
"""E, but for a factor, of receptive fields of each scale (px) and each blur (sd, px): blurs x scales."""

TEXTURE, LINE = 2.0, 2.75
"""Powers by which E falls with s^2 + b^2."""

CONTRAST = 0.005
"""Noise of seeing a pixel, as a contrast; responses below what it makes carry no information."""

NOISES = tuple(2.0 ** np.arange(0.0, 6.1, 0.5))
"""Noise of the picture itself, as that of rendering with few rays, in units of `CONTRAST`: a place has any of these."""

UNLIKELY = 2.0
"""Cost, as twice the negative log likelihood, of noise e times as strong: twice the noise is half as likely. With none
of it sharp textures pass for slightly blurred and noisy ones."""

STEP = 0.05
"""Departure of an edge from a blurred step, as a contrast, that is not seen."""

SAMPLING_BLUR = 0.5
"""Blur in pixels of the sampling itself: what is estimated is hypot(blur, SAMPLING_BLUR)."""

MISFIT = 0.1
"""Departure of a texture's energies from the law, as a share, beyond chance."""

VAGUE = 0.5
"""Standard deviation of the logarithm of blur from which on it counts as unknown."""

BAND = 16.0
"""Length in pixels of edge that gives one estimate."""

LEAST, LEVELS = 0.05, 50
"""Least blur in pixels among those that a texture's is chosen from, and how many they are; the most is the widest
field."""


class BlurEstimate(NamedTuple):
    """Blur at places on a square grid, rows x columns: the logarithm of sd in pixels, and that logarithm's own sd.

    ``inf`` of the latter where it cannot be estimated.
    """

    log_blur: FloatArray
    log_sd: FloatArray


def retinal_image(light: NDArray[np.floating], pixels_per_degree: float, pupil: float) -> FloatArray:
    """What the eye's own optics make of `light` (H x W) on a display in focus: blurred by the mean eye's transfer.

    Parameters
    ----------
    light
        Linear, in any unit.
    pixels_per_degree
        Of the display.
    pupil
        Diameter in metres.

    Examples
    --------
    A line one arcmin wide keeps its light, and half of its height at most.

    >>> light = np.zeros((64, 64))
    >>> light[:, 32] = 1.0
    >>> seen = retinal_image(light, pixels_per_degree=60, pupil=0.004)
    >>> round(float(seen.mean() / light.mean()), 2), bool(seen.max() < 0.5)
    (1.0, True)
    """
    margin = 16
    padded = np.pad(np.asarray(light, float), margin, mode="symmetric")
    down = np.fft.fftfreq(padded.shape[0])[:, None]
    frequency = pixels_per_degree * np.hypot(down, np.fft.rfftfreq(padded.shape[1]))
    knots = np.linspace(0, frequency.max(), 256)  # the transfer is smooth, and takes long to compute
    transfer = np.interp(frequency, knots, mean_eye_mtf(knots, pupil_diameter=pupil))
    blurred = irfft2(rfft2(padded) * transfer, padded.shape)
    return np.asarray(blurred[margin:-margin, margin:-margin])


def power_law(power: float) -> Law:
    """E = (s^2 + b^2)^-power: of a texture or line without any transfer but that of a Gaussian blur.

    >>> power_law(2.0)(np.array([1.0]), np.array([0.0, 1.0])).tolist()
    [[1.0], [0.25]]
    """

    def law(scales: FloatArray, blur: FloatArray) -> FloatArray:
        return np.asarray((scales**2 + blur[:, None] ** 2) ** -power)

    return law


def eye_law(slope: float, pixels_per_degree: float, pupil: float) -> Law:
    """E of a texture of amplitude 1/f^slope seen through the mean eye: the blur is that of the picture alone.

    The integral of (2 pi f)^4 f^(-2 slope) M(f)^2 exp(-4 pi^2 f^2 (s^2 + b^2)) over the frequencies that pixels have,
    M being the eye's transfer. No Gaussian has its shape: taken for one, a steep texture looks blurred.

    Examples
    --------
    The eye leaves less to fine fields than the texture has: the fall from one size to the next is less steep.

    >>> scales, sharp = np.array([1.0, 2.0]), np.array([0.0])
    >>> one, other = (law(scales, sharp)[0] for law in (eye_law(1.0, 60, 0.004), power_law(TEXTURE)))
    >>> bool(one[0] / one[1] < other[0] / other[1])
    True
    """
    weight = _eye_weight(pixels_per_degree, pupil) * FREQUENCIES ** (4 - 2 * slope)

    def law(scales: FloatArray, blur: FloatArray) -> FloatArray:
        return _gaussians(scales, blur) @ weight

    return law


def _eye_weight(pixels_per_degree: float, pupil: float) -> FloatArray:
    """Squared transfer of the eye times what part of all frequencies each of `FREQUENCIES` stands for."""
    within = np.clip(4 * np.arccos(np.minimum(0.5 / FREQUENCIES, 1.0)) / np.pi, 0, 1)  # of a circle cut by a square
    transfer = mean_eye_mtf(pixels_per_degree * FREQUENCIES, pupil_diameter=pupil)
    return np.asarray(transfer**2 * FREQUENCIES**2 * (1 - within))  # f df = f^2 d log f


def _gaussians(scales: FloatArray, blur: FloatArray) -> FloatArray:
    """Squared transfer of field and blur: blurs x scales x frequencies."""
    square = scales[:, None] ** 2 + blur[:, None, None] ** 2
    return np.asarray(np.exp(-((2 * np.pi * FREQUENCIES) ** 2) * square))


def estimate_blur(
    image: FloatArray, spacing: int, *, law: Law | None = None, own: float = 0.0, edges: bool = True
) -> BlurEstimate:
    """Estimate blur at places `spacing` pixels apart, each from its surroundings.

    Parameters
    ----------
    image
        Contrast, as the logarithm of light, H x W.
    spacing
        Between places, a multiple of 4; the first is half as far from the image's corner.
    law
        How responses fall with the size of the field: that of a 1/f texture and a Gaussian blur if None;
        ``power_law(LINE)`` for drawings of lines; `eye_law` where blur is asked for without the eye's own.
    own
        Blur of the eye itself, in pixels, that is taken off that of edges.
    edges
        Whether sharp edges are used too.

    Examples
    --------
    A 1/f texture, blurred by a Gaussian of sd 2 pixels.

    >>> rng = np.random.default_rng(1)
    >>> frequency = np.hypot(np.fft.fftfreq(256)[:, None], np.fft.rfftfreq(256))
    >>> spectrum = np.fft.rfft2(rng.standard_normal((256, 256))) / np.maximum(frequency, 1 / 256)
    >>> image = np.fft.irfft2(spectrum * np.exp(-2 * (2 * np.pi * frequency) ** 2))
    >>> estimate = estimate_blur(image / image.std(), 32, edges=False)
    >>> round(float(np.exp(np.median(estimate.log_blur))), 1)
    2.0
    """
    log_blur, log_sd = _texture(image, spacing, law or power_law(TEXTURE))
    weight = log_sd**-2.0
    if edges:
        log_edge, edge_weight = _edges(image, spacing, own)
        weight, total = weight + edge_weight, weight * log_blur + edge_weight * log_edge
        log_blur = np.where(weight > 0, total / np.where(weight > 0, weight, 1.0), log_blur)
    with np.errstate(divide="ignore"):
        return BlurEstimate(log_blur, weight**-0.5)


def _texture(image: FloatArray, spacing: int, law: Law) -> tuple[FloatArray, FloatArray]:
    window = spacing / 2
    scales = _scales(spacing)
    blur = np.geomspace(LEAST, scales[-1], LEVELS)[:, None]
    energy = _energies(image, scales, spacing)[None]  # blurs x scales x places
    square = (scales**2)[:, None]
    variance = (square / window**2) + MISFIT**2
    precision = 1 / (variance * energy**2)
    shape = law(scales, blur[:, 0])[..., None]
    floor = CONTRAST**2 / (2 * math.pi * square**3)
    costs = []
    for times in NOISES:
        noise = times**2 * floor
        # The contrast that fits best, each energy weighted by its precision; then how well it fits.
        contrast = (precision * shape * (energy - noise)).sum(1) / (precision * shape**2).sum(1)
        expected = np.maximum(contrast, 0.0)[:, None] * shape + noise
        costs.append((np.log(energy / expected) ** 2 / variance).sum(1) + UNLIKELY * math.log(times))
    cost = np.array(costs)  # noises x blurs x places
    posterior = np.exp(-0.5 * (cost - cost.min((0, 1))))
    posterior /= posterior.sum((0, 1))
    of_blur, of_noise = posterior.sum(0), posterior.sum(1)
    log = np.log(np.hypot(blur, SAMPLING_BLUR))
    mean = (of_blur * log).sum(0)
    sd = np.sqrt((of_blur * (log - mean) ** 2).sum(0) + MISFIT**2)
    noise = floor * (of_noise.T @ np.array(NOISES)) ** 2
    # Where only the widest fields respond, it is to what lies beside the place.
    reliable = ((energy[0] > 2 * noise).mean(0) > 0.6) & (sd < VAGUE)
    places = (image.shape[0] // spacing, image.shape[1] // spacing)
    return mean.reshape(places), np.where(reliable, sd, np.inf).reshape(places)


SLOPES = np.arange(0.5, 1.91, 0.05)
"""Slopes of texture that are compared: amplitude spectra from 1/f^0.5 to 1/f^1.9."""

FREQUENCIES = np.geomspace(2e-4, math.sqrt(0.5), 400)
"""Cycles per pixel over which E is summed, at equal steps of the logarithm, to the corner of what pixels have."""


def texture_slope(images: Sequence[FloatArray], spacing: int, pixels_per_degree: float, pupil: float) -> float:
    """Estimate the slope of a texture's amplitude, 1/f^slope, one for all of the images, whatever each place's blur.

    The slope of the largest likelihood, blur and contrast of each place integrated or fitted, by `eye_law`.
    """
    scales = _scales(spacing)
    blur = np.geomspace(LEAST, scales[-1], LEVELS)
    energy = np.concatenate([_energies(image, scales, spacing) for image in images], axis=1)[None]
    variance = (scales**2)[:, None] / (spacing / 2) ** 2 + MISFIT**2
    precision = 1 / (variance * energy**2)
    passed, weight = _gaussians(scales, blur), _eye_weight(pixels_per_degree, pupil)
    evidence = []
    for slope in SLOPES:
        shape = (passed @ (weight * FREQUENCIES ** (4 - 2 * slope)))[..., None]
        contrast = (precision * shape * energy).sum(1) / (precision * shape**2).sum(1)
        cost = (np.log(energy / (contrast[:, None] * shape)) ** 2 / variance).sum(1)
        least = cost.min(axis=0)
        evidence.append(float((np.log(np.exp(-(cost - least) / 2).mean(axis=0)) - least / 2).sum()))
    return float(SLOPES[int(np.argmax(evidence))])


def _scales(spacing: int) -> FloatArray:
    """Sizes of receptive fields in pixels: half octaves from a pixel up to what a place has room for."""
    return np.asarray(2.0 ** np.arange(0.0, math.log2(spacing / 2.8) + 0.01, 0.5), float)


def _energies(image: FloatArray, scales: FloatArray, spacing: int) -> FloatArray:
    """E about each place for receptive fields of each scale, scales x places."""
    margin = int(4 * scales[-1])
    padded = np.pad(image, margin, mode="symmetric")
    square = (2 * np.pi) ** 2 * (np.fft.fftfreq(padded.shape[0])[:, None] ** 2 + np.fft.rfftfreq(padded.shape[1]) ** 2)
    spectrum = rfft2(padded) * square
    rows, columns = (length // spacing for length in image.shape)
    cell = spacing // 4
    found = []
    for scale in scales:
        response = irfft2(spectrum * np.exp(-square * scale**2 / 2), padded.shape)[margin:, margin:]
        fourth = np.square(np.square(response[: rows * spacing, : columns * spacing]))
        # A window of sd two cells about the middle of each place's four by four.
        smooth = gaussian_filter(fourth.reshape(4 * rows, cell, 4 * columns, cell).mean((1, 3)), 2.0)
        found.append(np.sqrt(smooth.reshape(rows, 4, columns, 4)[:, 1:3, :, 1:3].mean((1, 3)).ravel() / 3))
    return np.maximum(np.array(found), 1e-30)


def _edges(image: FloatArray, spacing: int, own: float) -> tuple[FloatArray, FloatArray]:
    """Mean logarithm of the blur of the edges in each place's square, and its weight: 1 / variance."""
    edges = measure_edges(image, noise=STEP, length=BAND)
    good = edges.valid
    rows, columns = (length // spacing for length in image.shape)
    row, column = (np.floor((where[good] + 0.5) / spacing).astype(np.intp) for where in (edges.row, edges.column))
    inside = (row < rows) & (column < columns) & (row >= 0) & (column >= 0)
    place = (row * columns + column)[inside]
    radius, sd = edges.radius[good][inside], edges.radius_sd[good][inside]
    seen, radius = radius, np.sqrt(np.maximum(radius**2 - own**2, 0.0))
    # Points of one band are one estimate.
    weight = 1 / BAND / ((seen * sd / (radius**2 + SAMPLING_BLUR**2)) ** 2 + MISFIT**2)
    total = np.bincount(place, weight, rows * columns)
    weighted = np.bincount(place, weight * np.log(np.hypot(radius, SAMPLING_BLUR)), rows * columns)
    mean = np.where(total > 0, weighted / np.where(total > 0, total, 1.0), 0.0)
    return np.asarray(mean.reshape(rows, columns), float), np.asarray(total.reshape(rows, columns), float)
