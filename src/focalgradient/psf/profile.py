"""Edge profile of a blur of any shape, along any direction, and its steepest slope: all in units of the blur radius."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from focalgradient.psf.shape import Psf

__all__ = ["edge_profile", "steepest_slope"]

PERIOD, PER_RADIUS = 32, 256
"""Extent of the sampled line response in blur radii, and its samples per blur radius: a disc's edge response is right
to 3e-5 then."""

DIRECTIONS = 24
"""Directions over half a turn in which the steepest slope is searched: a square's falls by 7 % within 4 degrees of its
side's, which is less than a picture's edges keep."""


def edge_profile(psf: Psf, direction: float = 0.0) -> Callable[[NDArray[np.float64]], NDArray[np.float64]]:
    """Return the function from position (blur radii beyond the edge) to the blurred image of a step from 0 to 1.

    Parameters
    ----------
    psf
        The shape, as pictures show it for points beyond the plane of focus.
    direction
        In which the step rises: radians from +x (right) towards +y (down).

    Examples
    --------
    >>> from focalgradient.psf import Disc, Polygon
    >>> edge_profile(Disc())(np.array([0.5])).round(4).tolist()
    [0.8045]
    >>> edge_profile(Polygon(64))(np.array([0.5])).round(4).tolist()
    [0.8045]
    """
    if psf.gives_edge_response:
        return lambda position: psf.edge_response(position, 1.0)
    line = _line(psf, direction)
    position = np.arange(len(line) + 1) / PER_RADIUS - PERIOD / 2
    edge = np.concatenate([[0.0], np.cumsum(line)]) / PER_RADIUS
    return lambda at: np.interp(at, position, edge)


def steepest_slope(psf: Psf) -> float:
    """Return the largest slope of the blurred image of a unit step, in any direction, times the blur radius.

    >>> from focalgradient.psf import Disc, Polygon
    >>> round(steepest_slope(Disc()), 4), round(steepest_slope(Polygon(64)), 2)  # 2 / pi
    (0.6366, 0.64)
    """
    if psf.gives_edge_response:
        positions = np.linspace(-psf.edge_reach, psf.edge_reach, 2001)
        return float(psf.line_response(positions, 1.0).max())
    return max(float(_line(psf, math.pi * turn / DIRECTIONS).max()) for turn in range(DIRECTIONS))


def _line(psf: Psf, direction: float) -> NDArray[np.float64]:
    """Means of the line response along a direction over each of the samples, from -PERIOD / 2 to PERIOD / 2."""
    frequency = np.fft.rfftfreq(PERIOD * PER_RADIUS, 1 / PER_RADIUS)
    otf = psf.optical_transfer(frequency * math.sin(direction), frequency * math.cos(direction), 1.0)
    # Averaged over a sample, and moved by half of one to its middle.
    otf = otf * np.sinc(frequency / PER_RADIUS) * np.exp(1j * np.pi * frequency / PER_RADIUS)
    return np.fft.fftshift(np.fft.irfft(otf)) * PER_RADIUS
