"""Three-dimensional fractal noise for rock, ground, clouds and mountains.

Each octave is gradient noise (Perlin 1985, with the smoother weights of 2002) on a lattice of half the previous
spacing. Octaves finer than a given detail are omitted, so that near and far surfaces have detail down to the pixel size
and no further.
"""

from __future__ import annotations

import math
from functools import partial

import numpy as np
from numpy.typing import ArrayLike

from focalgradient.arrays import FloatArray
from focalgradient.loops import compiled, inlined
from focalgradient.parallel import share_rows

__all__ = ["fractal"]


def fractal(points: ArrayLike, seed: int, *, coarsest: float, finest: ArrayLike, roughness: float = 0.5) -> FloatArray:
    """Return fractal noise at points in space, with mean 0, mostly between -1 and 1.

    Parameters
    ----------
    points
        Positions in metres, shape ... x 3.
    seed
        Random seed of the noise.
    coarsest
        Wavelength of the first octave in metres.
    finest
        Finest wavelength in metres, per point or common; octaves fade out as they approach it.
    roughness
        Amplitude ratio of successive octaves. 0.5 gives surfaces the amplitude spectrum 1/f^2 of mountains; values near
        1 the 1/f of natural images.

    Returns
    -------
    ndarray
        Noise, of the shape of `points` without its last axis.

    Examples
    --------
    >>> places = np.random.default_rng(0).uniform(-9, 9, (4000, 3))
    >>> noise = fractal(places, 1, coarsest=1.0, finest=0.1)
    >>> noise.shape, bool(abs(noise.mean()) < 0.05), 0.2 < float(noise.std()) < 0.5
    ((4000,), True, True)
    """
    points = np.asarray(points, dtype=float)
    flat = np.ascontiguousarray(points.reshape(-1, 3))
    detail = np.ascontiguousarray(np.broadcast_to(np.asarray(finest, dtype=float), points.shape[:-1])).ravel()
    octaves = max(1, math.ceil(math.log2(coarsest / float(detail.min(initial=coarsest)))) + 1)
    values = np.empty(len(flat))
    share_rows(len(flat), partial(_fractal, flat, detail, seed, coarsest, octaves, roughness, values))
    return values.reshape(points.shape[:-1])


@compiled
def _fractal(points, detail, seed, coarsest, octaves, roughness, values, start, stop):  # type: ignore[no-untyped-def]
    for n in range(start, stop):
        total, weight, wavelength = 0.0, 0.0, coarsest
        amplitude = 1.0
        for octave in range(octaves):
            # Full strength at twice the finest wavelength, fading to zero at the finest.
            share = min(1.0, wavelength / detail[n] - 1.0)
            if octave > 0 and share <= 0:
                break
            share = max(share, 0.0) if octave > 0 else 1.0
            x, y, z = points[n, 0] / wavelength, points[n, 1] / wavelength, points[n, 2] / wavelength
            # Offsets, so that lattices of different octaves share no corners.
            total += (
                amplitude
                * share
                * _noise(x + 0.37 * octave, y + 0.71 * octave, z + 0.13 * octave, seed + 7919 * octave)
            )
            weight += amplitude * amplitude
            amplitude *= roughness
            wavelength *= 0.5
        values[n] = 1.4 * total / math.sqrt(weight)


@inlined
def _corner(h, x, y, z):  # type: ignore[no-untyped-def]
    """Return the scalar product of a lattice corner's gradient (three 10-bit numbers of its hash) and the offset."""
    h = ((h ^ (h >> 15)) * 0x85EBCA6B) & 0xFFFFFFFF
    h ^= h >> 13
    return ((h & 1023) - 511.5) * x + (((h >> 10) & 1023) - 511.5) * y + (((h >> 20) & 1023) - 511.5) * z


@inlined
def _noise(x, y, z, seed):  # type: ignore[no-untyped-def]
    """Return one octave of gradient noise: gradients at the corners of a unit lattice, interpolated."""
    fx, fy, fz = math.floor(x), math.floor(y), math.floor(z)
    x, y, z = x - fx, y - fy, z - fz
    u = x * x * x * (x * (x * 6 - 15) + 10)
    v = y * y * y * (y * (y * 6 - 15) + 10)
    w = z * z * z * (z * (z * 6 - 15) + 10)
    key = (int(fx) * 0x1F123BB5 + int(fy) * 0x5F356495 + int(fz) * 0x2545F491 + seed * 0x68E31DA4) & 0xFFFFFFFF
    a = _corner(key, x, y, z)
    b = _corner((key + 0x1F123BB5) & 0xFFFFFFFF, x - 1, y, z)
    c = _corner((key + 0x5F356495) & 0xFFFFFFFF, x, y - 1, z)
    d = _corner((key + 0x7E47A04A) & 0xFFFFFFFF, x - 1, y - 1, z)
    e = _corner((key + 0x2545F491) & 0xFFFFFFFF, x, y, z - 1)
    f = _corner((key + 0x44583046) & 0xFFFFFFFF, x - 1, y, z - 1)
    g = _corner((key + 0x847B5926) & 0xFFFFFFFF, x, y - 1, z - 1)
    h = _corner((key + 0xA38D94DB) & 0xFFFFFFFF, x - 1, y - 1, z - 1)
    near = a + u * (b - a) + v * (c - a + u * (a - b - c + d))
    far = e + u * (f - e) + v * (g - e + u * (e - f - g + h))
    return (near + w * (far - near)) / 511.5
