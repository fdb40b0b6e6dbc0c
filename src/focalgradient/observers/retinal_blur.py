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
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.fft import irfft2, rfft2
from scipy.ndimage import gaussian_filter

from focalgradient.depth.edges.measure import measure_edges
from focalgradient.eye import mean_eye_mtf

__all__ = ["LINE", "TEXTURE", "BlurEstimate", "estimate_blur", "retinal_image", "texture_power"]

FloatArray = NDArray[np.float64]

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


def estimate_blur(image: FloatArray, spacing: int, *, power: float = TEXTURE, edges: bool = True) -> BlurEstimate:
    """Estimate blur at places `spacing` pixels apart, each from its surroundings.

    Parameters
    ----------
    image
        Contrast, as the logarithm of light, H x W.
    spacing
        Between places, a multiple of 4; the first is half as far from the image's corner.
    power
        `TEXTURE`, or `LINE` for drawings of lines.
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
    log_blur, log_sd = _texture(image, spacing, power)
    weight = log_sd**-2.0
    if edges:
        log_edge, edge_weight = _edges(image, spacing)
        weight, total = weight + edge_weight, weight * log_blur + edge_weight * log_edge
        log_blur = np.where(weight > 0, total / np.where(weight > 0, weight, 1.0), log_blur)
    with np.errstate(divide="ignore"):
        return BlurEstimate(log_blur, weight**-0.5)


def _texture(image: FloatArray, spacing: int, power: float) -> tuple[FloatArray, FloatArray]:
    window = spacing / 2
    scales = np.asarray(2.0 ** np.arange(0.0, math.log2(window / 1.4) + 0.01, 0.5), float)
    blur = np.geomspace(LEAST, scales[-1], LEVELS)[:, None]
    energy = _energies(image, scales, spacing)[None]  # blurs x scales x places
    square = (scales**2)[:, None]
    variance = (square / window**2) + MISFIT**2
    precision = 1 / (variance * energy**2)
    law = (square + blur[..., None] ** 2) ** -power
    floor = CONTRAST**2 / (2 * math.pi * square**3)
    costs = []
    for times in NOISES:
        noise = times**2 * floor
        # The contrast that fits best, each energy weighted by its precision; then how well it fits.
        contrast = (precision * law * (energy - noise)).sum(1) / (precision * law**2).sum(1)
        expected = np.maximum(contrast, 0.0)[:, None] * law + noise
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
    shape = (image.shape[0] // spacing, image.shape[1] // spacing)
    return mean.reshape(shape), np.where(reliable, sd, np.inf).reshape(shape)


POWERS = np.arange(1.25, 2.51, 0.05)
"""Powers of texture that are compared: amplitude spectra from 1/f^1.75 to 1/f^0.5."""


def texture_power(image: FloatArray, spacing: int) -> float:
    """Estimate the power by which E falls with s^2 + b^2, one for the whole picture, whatever the blur of each place.

    The power of the largest likelihood, blur and contrast of each place integrated or fitted. At 60 pixels per degree
    and a spacing of 32 it is 0.05 to 0.25 below 3 - slope for textures of amplitude 1/f^slope, slopes 0.75 to 1.5: the
    eye's own transfer is not the Gaussian that the law supposes.
    """
    window = spacing / 2
    scales = np.asarray(2.0 ** np.arange(0.0, math.log2(window / 1.4) + 0.01, 0.5), float)
    blur = np.geomspace(LEAST, scales[-1], LEVELS)[:, None, None]
    energy = _energies(image, scales, spacing)[None]
    square = (scales**2)[:, None]
    variance = square / window**2 + MISFIT**2
    precision = 1 / (variance * energy**2)
    evidence = []
    for power in POWERS:
        law = (square + blur**2) ** -power
        contrast = (precision * law * energy).sum(1) / (precision * law**2).sum(1)
        cost = (np.log(energy / (contrast[:, None] * law)) ** 2 / variance).sum(1)
        least = cost.min(axis=0)
        evidence.append(float((np.log(np.exp(-(cost - least) / 2).mean(axis=0)) - least / 2).sum()))
    return float(POWERS[int(np.argmax(evidence))])


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


def _edges(image: FloatArray, spacing: int) -> tuple[FloatArray, FloatArray]:
    """Mean logarithm of the blur of the edges in each place's square, and its weight: 1 / variance."""
    edges = measure_edges(image, noise=STEP, length=BAND)
    good = edges.valid
    rows, columns = (length // spacing for length in image.shape)
    row, column = (np.floor((where[good] + 0.5) / spacing).astype(np.intp) for where in (edges.row, edges.column))
    inside = (row < rows) & (column < columns) & (row >= 0) & (column >= 0)
    place = (row * columns + column)[inside]
    radius, sd = edges.radius[good][inside], edges.radius_sd[good][inside]
    # Points of one band are one estimate.
    weight = 1 / BAND / ((radius * sd / (radius**2 + SAMPLING_BLUR**2)) ** 2 + MISFIT**2)
    total = np.bincount(place, weight, rows * columns)
    weighted = np.bincount(place, weight * np.log(np.hypot(radius, SAMPLING_BLUR)), rows * columns)
    mean = np.where(total > 0, weighted / np.where(total > 0, total, 1.0), 0.0)
    return np.asarray(mean.reshape(rows, columns), float), np.asarray(total.reshape(rows, columns), float)
