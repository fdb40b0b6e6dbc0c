"""Information on depth in two views through different parts of one pupil, the eye's equivalent of dual pixels.

    python benchmarks/pupil_halves.py

An eye with a pupil of 4 mm in light of 555 nm looks at a natural texture (contrast 0.2, 64 arcmin, pixels of one
arcmin, noise 0.2 of the mean) half a dioptre nearer than its focus. Each row is a pair of views that share the light,
each through a weighted part of the pupil:

- halves: the left and the right half, as with two pinholes (Scheiner 1619) or a beam splitter;
- separately tuned cones: two classes of cones whose Stiles-Crawford functions, 10^(-0.05 r^2) with r in mm, peak on
  opposite sides of the pupil's centre, at the stated distance;
- whole pupil: two identical views;
- two wavebands: images of daylight for the L and M, and for the S cones, each in its own focus, through the whole
pupil.

Printed are the shift between the views per dioptre of defocus (arcmin), the SD of depth in dioptres of an ideal
observer of both views (Cramer-Rao bound; unknown texture with known power), and the discrimination of nearer from
farther than focus (Kullback-Leibler divergence in nats: 0 is none; from 5, errors are rare).
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from focalgradient.eye import Cones, Eye
from focalgradient.eye.cones import S_FINEST_CPD

Array = NDArray[np.float64]
Transfers = Callable[[float], tuple[NDArray[Any], NDArray[Any]]]
"""Function that returns the transfer of both views at a defocus (D), positive for nearer than focus."""

PUPIL, NM = 4e-3, 555.0
SIDE, PIXEL = 64, math.radians(1 / 60)
SAMPLES = 512
"""Number of samples of the pupil plane, 8 per pixel of the patch."""

CONTRAST, NOISE = 0.2, 0.2
RHO = 0.05
"""Stiles-Crawford coefficient in 1/mm^2 (base 10), usual in the fovea (Applegate & Lakshminarayanan 1993)."""

DEFOCUS = 0.5


def plane() -> tuple[Array, Array]:
    """Return pupil coordinates x and y in metres, whose spacing matches the frequencies of the patch."""
    step = 1e-9 * NM / (SIDE * PIXEL)
    along = step * (np.arange(SAMPLES) - SAMPLES // 2)
    return np.meshgrid(along, along)


def transfer(weight: Array, defocus: float) -> NDArray[np.complex128]:
    """Return the transfer at the patch's frequencies (half spectrum) for a pupil sensitivity and a defocus (D)."""
    x, y = plane()
    phase = 2 * np.pi / (1e-9 * NM) * defocus * (x**2 + y**2) / 2
    field = np.sqrt(weight) * np.exp(1j * phase)
    spread = np.abs(np.fft.fft2(np.fft.ifftshift(field))) ** 2
    whole = np.fft.ifft2(spread)
    rows = np.fft.fftfreq(SIDE, 1 / SIDE).astype(int)
    return np.asarray((whole / whole[0, 0].real)[rows][:, : SIDE // 2 + 1])


def shift(first: Array, second: Array) -> float:
    """Return the shift between the views per dioptre (arcmin): the distance between the centroids of their light."""
    x, _ = plane()
    apart = abs(float((first * x).sum() / first.sum() - (second * x).sum() / second.sum()))
    return 60 * math.degrees(apart)


def through(first: Array, second: Array) -> Transfers:
    """Return the views through two sensitivities of the pupil."""
    return lambda defocus: (transfer(first, defocus), transfer(second, defocus))


def wavebands() -> Transfers:
    """Return the views of the L and M, and of the S cones; defocus is relative to the focus of the former."""
    cones = [Cones.of(Eye(PUPIL, 0.0), "L+M"), Cones.of(Eye(PUPIL, 0.0), "S", finest_cpd=S_FINEST_CPD)]
    frequency = np.hypot(np.fft.fftfreq(SIDE, PIXEL)[:, None], np.fft.rfftfreq(SIDE, PIXEL))
    focus = cones[0].focus_vergence
    return lambda defocus: tuple(one.transfer(frequency, focus + defocus) for one in cones)  # type: ignore[return-value]


def covariance(views: Transfers, defocus: float) -> NDArray[np.complex128]:
    """Return the covariance of both views at each frequency, relative to the noise of a view with all the light."""
    radial = np.hypot(np.fft.fftfreq(SIDE)[:, None], np.fft.rfftfreq(SIDE))
    radial[0, 0] = np.inf
    power = np.where(radial < 0.5, radial**-2.0, 0.0)
    power *= (CONTRAST / NOISE) ** 2 * SIDE**2 / (2 * power.sum())
    pixel = np.sinc(np.fft.fftfreq(SIDE))[:, None] * np.sinc(np.fft.rfftfreq(SIDE))
    seen = np.stack([pixel * one for one in views(defocus)], axis=-1)
    # photon and cone noise, half of the photons and cones in each view
    return np.asarray(power[..., None, None] * seen[..., :, None] * seen[..., None, :].conj() + 2 * np.eye(2))


def deviation(views: Transfers) -> float:
    """Return the SD of depth in dioptres around `DEFOCUS`."""
    step = 0.01
    here = covariance(views, DEFOCUS)
    change = (covariance(views, DEFOCUS + step) - covariance(views, DEFOCUS - step)) / (2 * step)
    part = np.linalg.solve(here, change)
    return float(np.einsum("...ij,...ji->...", part, part).real.sum() ** -0.5)


def divergence(views: Transfers) -> float:
    """Return the divergence in nats between `DEFOCUS` nearer and the same farther."""
    near, far = (covariance(views, way * DEFOCUS) for way in (1, -1))
    ratio = np.linalg.solve(far, near)
    value = np.trace(ratio, axis1=-2, axis2=-1) - 2 - np.log(np.linalg.det(ratio))
    return float(value.real.sum())


def pairs() -> dict[str, tuple[Array, Array]]:
    """Return the two sensitivities over the pupil, by name."""
    x, y = plane()
    disc = (np.hypot(x, y) <= PUPIL / 2).astype(float)

    def tuned(millimetres: float) -> Array:
        return np.asarray(disc * 10 ** (-RHO * ((1e3 * x - millimetres) ** 2 + (1e3 * y) ** 2)))

    found = {"whole pupil": (disc, disc), "halves": (disc * (x >= 0), disc * (x <= 0))}
    return found | {f"cones tuned {mm:g} mm apart": (tuned(mm / 2), tuned(-mm / 2)) for mm in (0.2, 0.5, 1.0)}


def main() -> None:
    print(f"{'views':24}  arcmin/D  sd of depth (D)  nearer or farther (nats)")
    for name, weights in pairs().items():
        views = through(*weights)
        print(f"{name:24} {shift(*weights):9.2f} {deviation(views):16.3f} {divergence(views):25.2f}")
    print(f"{'two wavebands':24} {'-':>9} {deviation(wavebands()):16.3f} {divergence(wavebands()):25.2f}")


if __name__ == "__main__":
    main()
