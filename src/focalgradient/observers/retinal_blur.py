"""Estimation of blur from one retinal image, in textures and at edges.

Natural textures have an amplitude spectrum of about 1/f. Blurred by a Gaussian of variance b^2 and filtered by
centre-surround receptive fields (Laplacian of a Gaussian of variance s^2), they have the mean square response

    E(s) = integral (2 pi f)^4 f^-2 exp(-4 pi^2 f^2 (s^2 + b^2)) 2 pi f df  =  C / (s^2 + b^2)^2 .

The decrease of responses with receptive-field size therefore gives blur without knowledge of the contrast C. Here E is
the root of the mean fourth power: for textures it is the same up to a constant; for edges, whose mean square decreases
with the power 3/2 only, so that they would seem blurred, it decreases with 7/4. For thin lines the power is 11/4.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.fft import irfft2, rfft2
from scipy.ndimage import gaussian_filter

from focalgradient.arrays import FloatArray
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


Law = Callable[[FloatArray, FloatArray], FloatArray]
"""Function for E, up to a factor, of receptive-field sizes (px) and blurs (SD, px): blurs x sizes."""

TEXTURE, LINE = 2.0, 2.75
"""Exponents of the decrease of E with s^2 + b^2, for textures and for lines."""

CONTRAST = 0.005
"""Noise contrast of vision per pixel; weaker responses carry no information."""

NOISES = tuple(2.0 ** np.arange(0.0, 6.1, 0.5))
"""Candidate noise levels of the picture itself, such as rendering noise, in units of `CONTRAST`, for each place."""

NOISE_PENALTY = 2.0
"""Penalty (twice the negative log likelihood) per factor of e in the picture noise: doubling it halves the likelihood.
Without it, sharp textures would seem slightly blurred and noisy.
"""

STEP = 0.05
"""Deviation of an edge from a blurred step that remains unnoticed, as a contrast."""

SAMPLING_BLUR = 0.5
"""Sampling blur in pixels; estimates are hypot(blur, SAMPLING_BLUR)."""

MISFIT = 0.1
"""Relative deviation of a texture's energies from the power law, in addition to sampling error."""

VAGUE = 0.5
"""SD of log blur above which blur counts as unknown."""

BAND = 16.0
"""Length of edge in pixels that gives one independent estimate."""

LEAST, LEVELS = 0.05, 50
"""Smallest candidate blur of textures in pixels, and number of candidates; the largest is the widest receptive field.
"""


class BlurEstimate(NamedTuple):
    """Blur at places on a square grid (rows x columns): log SD in pixels, and the SD of that logarithm.

    The latter is ``inf`` where blur cannot be estimated.
    """

    log_blur: FloatArray
    log_sd: FloatArray


def retinal_image(light: NDArray[np.floating], pixels_per_degree: float, pupil: float) -> FloatArray:
    """Blur `light` (H x W) by the mean eye's transfer function, for a display in focus.

    Parameters
    ----------
    light
        Linear light in any unit.
    pixels_per_degree
        Pixels per degree of the display.
    pupil
        Pupil diameter in metres.

    Examples
    --------
    A line one arcmin wide keeps its total light, and at most half of its height.

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
    knots = np.linspace(0, frequency.max(), 256)  # interpolated, as the transfer function is smooth but slow
    transfer = np.interp(frequency, knots, mean_eye_mtf(knots, pupil_diameter=pupil))
    blurred = irfft2(rfft2(padded) * transfer, padded.shape)
    return np.asarray(blurred[margin:-margin, margin:-margin])


def power_law(power: float) -> Law:
    """Return the law E = (s^2 + b^2)^-power of a texture or line with Gaussian blur only.

    >>> power_law(2.0)(np.array([1.0]), np.array([0.0, 1.0])).tolist()
    [[1.0], [0.25]]
    """

    def law(scales: FloatArray, blur: FloatArray) -> FloatArray:
        return np.asarray((scales**2 + blur[:, None] ** 2) ** -power)

    return law


def eye_law(slope: float, pixels_per_degree: float, pupil: float) -> Law:
    """Return the law of E for a texture of amplitude 1/f^slope seen through the mean eye, whose blur is excluded.

    It is the integral of (2 pi f)^4 f^(-2 slope) M(f)^2 exp(-4 pi^2 f^2 (s^2 + b^2)) over the frequencies of the pixel
    grid, where M is the transfer function of the eye. No Gaussian has this shape: approximated by one, steep textures
    would seem blurred.

    Examples
    --------
    The eye attenuates the response of small receptive fields: the decrease from one size to the next is less steep.

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
    """Return the squared transfer of the eye times the integration weight of each of `FREQUENCIES`."""
    within = np.clip(
        4 * np.arccos(np.minimum(0.5 / FREQUENCIES, 1.0)) / np.pi, 0, 1
    )  # part of the circle outside the square
    transfer = mean_eye_mtf(pixels_per_degree * FREQUENCIES, pupil_diameter=pupil)
    return np.asarray(transfer**2 * FREQUENCIES**2 * (1 - within))  # f df = f^2 d log f


def _gaussians(scales: FloatArray, blur: FloatArray) -> FloatArray:
    """Return the squared transfer of receptive field and blur: blurs x sizes x frequencies."""
    square = scales[:, None] ** 2 + blur[:, None, None] ** 2
    return np.asarray(np.exp(-((2 * np.pi * FREQUENCIES) ** 2) * square))


def estimate_blur(
    image: FloatArray, spacing: int, *, law: Law | None = None, own: float = 0.0, edges: bool = True
) -> BlurEstimate:
    """Estimate blur at places `spacing` pixels apart, each from its surroundings.

    Parameters
    ----------
    image
        Contrast (log light), H x W.
    spacing
        Distance between places, a multiple of 4; the first is half as far from the image's corner.
    law
        Decrease of responses with receptive-field size; None: that of a 1/f texture with Gaussian blur. Use
        ``power_law(LINE)`` for line drawings, and `eye_law` to exclude the blur of the eye.
    own
        Blur of the eye in pixels, which is subtracted from that of edges.
    edges
        True to use sharp edges as well.

    Examples
    --------
    A 1/f texture blurred by a Gaussian with an SD of 2 pixels.

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
        # fit the contrast, each energy weighted by its precision; then compute the goodness of fit
        contrast = (precision * shape * (energy - noise)).sum(1) / (precision * shape**2).sum(1)
        expected = np.maximum(contrast, 0.0)[:, None] * shape + noise
        costs.append((np.log(energy / expected) ** 2 / variance).sum(1) + NOISE_PENALTY * math.log(times))
    cost = np.array(costs)  # noises x blurs x places
    posterior = np.exp(-0.5 * (cost - cost.min((0, 1))))
    posterior /= posterior.sum((0, 1))
    of_blur, of_noise = posterior.sum(0), posterior.sum(1)
    log = np.log(np.hypot(blur, SAMPLING_BLUR))
    mean = (of_blur * log).sum(0)
    sd = np.sqrt((of_blur * (log - mean) ** 2).sum(0) + MISFIT**2)
    noise = floor * (of_noise.T @ np.array(NOISES)) ** 2
    # if only the largest fields respond, they respond to structure outside the place
    reliable = ((energy[0] > 2 * noise).mean(0) > 0.6) & (sd < VAGUE)
    places = (image.shape[0] // spacing, image.shape[1] // spacing)
    return mean.reshape(places), np.where(reliable, sd, np.inf).reshape(places)


SLOPES = np.arange(0.5, 1.91, 0.05)
"""Candidate texture slopes: amplitude spectra from 1/f^0.5 to 1/f^1.9."""

FREQUENCIES = np.geomspace(2e-4, math.sqrt(0.5), 400)
"""Frequencies in cycles per pixel of the integral of E, logarithmically spaced, up to the corner of the pixel grid."""


def texture_slope(images: Sequence[FloatArray], spacing: int, pixels_per_degree: float, pupil: float) -> float:
    """Estimate one slope of the texture amplitude spectrum, 1/f^slope, for all images, independent of local blur.

    It is the slope of maximum likelihood by `eye_law`, with contrast fitted and blur integrated at each place.
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
    """Return receptive-field sizes in pixels: half octaves from one pixel to the largest that fits a place."""
    return np.asarray(2.0 ** np.arange(0.0, math.log2(spacing / 2.8) + 0.01, 0.5), float)


def _energies(image: FloatArray, scales: FloatArray, spacing: int) -> FloatArray:
    """Return E around each place for receptive fields of each size (sizes x places)."""
    margin = int(4 * scales[-1])
    padded = np.pad(image, margin, mode="symmetric")
    square = (2 * np.pi) ** 2 * (np.fft.fftfreq(padded.shape[0])[:, None] ** 2 + np.fft.rfftfreq(padded.shape[1]) ** 2)
    spectrum = rfft2(padded) * square
    rows, columns = (length // spacing for length in image.shape)
    cell = spacing // 4
    energies = []
    for scale in scales:
        response = irfft2(spectrum * np.exp(-square * scale**2 / 2), padded.shape)[margin:, margin:]
        fourth = np.square(np.square(response[: rows * spacing, : columns * spacing]))
        # window with an SD of two cells around the centre of each place's 4 x 4 cells
        smooth = gaussian_filter(fourth.reshape(4 * rows, cell, 4 * columns, cell).mean((1, 3)), 2.0)
        energies.append(np.sqrt(smooth.reshape(rows, 4, columns, 4)[:, 1:3, :, 1:3].mean((1, 3)).ravel() / 3))
    return np.maximum(np.array(energies), 1e-30)


def _edges(image: FloatArray, spacing: int, own: float) -> tuple[FloatArray, FloatArray]:
    """Return the mean log blur of the edges in the square of each place, and its weight, 1 / variance."""
    edges = measure_edges(image, noise=STEP, length=BAND)
    good = edges.valid
    rows, columns = (length // spacing for length in image.shape)
    row, column = (np.floor((where[good] + 0.5) / spacing).astype(np.intp) for where in (edges.row, edges.column))
    inside = (row < rows) & (column < columns) & (row >= 0) & (column >= 0)
    place = (row * columns + column)[inside]
    radius, sd = edges.radius[good][inside], edges.radius_sd[good][inside]
    seen, radius = radius, np.sqrt(np.maximum(radius**2 - own**2, 0.0))
    # points of one band count as one estimate
    weight = 1 / BAND / ((seen * sd / (radius**2 + SAMPLING_BLUR**2)) ** 2 + MISFIT**2)
    total = np.bincount(place, weight, rows * columns)
    weighted = np.bincount(place, weight * np.log(np.hypot(radius, SAMPLING_BLUR)), rows * columns)
    mean = np.where(total > 0, weighted / np.where(total > 0, total, 1.0), 0.0)
    return np.asarray(mean.reshape(rows, columns), float), np.asarray(total.reshape(rows, columns), float)
