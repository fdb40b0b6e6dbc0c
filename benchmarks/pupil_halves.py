"""What two views through different parts of one eye's pupil would tell of depth: the eye's dual pixels.

    python benchmarks/pupil_halves.py

An eye of 4 mm in light of 555 nm looks at a natural texture (contrast 0.2, 64 minutes of arc, pixels of one minute,
noise 0.2 of the mean) half a dioptre nearer than its focus. Each row is a pair of views that share the light, each
through a weighted part of the pupil:

- halves: the left and the right half, as two pinholes (Scheiner 1619), or a beam splitter, would have it;
- cones tuned apart: two kinds of cones whose Stiles-Crawford functions, 10^(-0.05 r^2) with r in mm, peak on opposite
  sides of the pupil's middle, at the distance that is named;
- whole pupil: both views alike;
- two wavebands: what the L and M, and the S cones see of daylight, each in its own focus, through the whole pupil.

Printed are the shift of one view against the other for a dioptre of defocus (minutes of arc), the standard deviation of
depth in dioptres that an ideal observer of both views has (Cramer and Rao's bound; texture unknown, its power known),
and how well it tells nearer from farther than focus (Kullback-Leibler divergence in nats: 0 is not at all, and with 5
or more errors are rare).
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from focalgradient.eye import Cones, Eye
from focalgradient.eye.retina import S_FINEST_CPD

Array = NDArray[np.float64]
Transfers = Callable[[float], tuple[NDArray[Any], NDArray[Any]]]
"""Transfer of both views at a defocus (D), positive for nearer than focus."""

PUPIL, NM = 4e-3, 555.0
SIDE, PIXEL = 64, math.radians(1 / 60)
SAMPLES = 512
"""Of the pupil's plane, which has 8 for each pixel of the patch."""

CONTRAST, NOISE = 0.2, 0.2
RHO = 0.05
"""Stiles-Crawford effect in 1/mm^2 (base 10): usual in the fovea (Applegate & Lakshminarayanan 1993)."""

DEFOCUS = 0.5


def plane() -> tuple[Array, Array]:
    """Places x and y in the pupil, in metres, whose differences give frequencies that the patch has."""
    step = 1e-9 * NM / (SIDE * PIXEL)
    along = step * (np.arange(SAMPLES) - SAMPLES // 2)
    return np.meshgrid(along, along)


def transfer(weight: Array, defocus: float) -> NDArray[np.complex128]:
    """Transfer at the patch's frequencies (its half spectrum) of a pupil of a sensitivity and a defocus (D)."""
    x, y = plane()
    phase = 2 * np.pi / (1e-9 * NM) * defocus * (x**2 + y**2) / 2
    field = np.sqrt(weight) * np.exp(1j * phase)
    spread = np.abs(np.fft.fft2(np.fft.ifftshift(field))) ** 2
    whole = np.fft.ifft2(spread)
    rows = np.fft.fftfreq(SIDE, 1 / SIDE).astype(int)
    return np.asarray((whole / whole[0, 0].real)[rows][:, : SIDE // 2 + 1])


def shift(first: Array, second: Array) -> float:
    """Minutes of arc by which the views move apart for a dioptre: how far apart the centres of their light are."""
    x, _ = plane()
    apart = abs(float((first * x).sum() / first.sum() - (second * x).sum() / second.sum()))
    return 60 * math.degrees(apart)


def through(first: Array, second: Array) -> Transfers:
    """Views through two sensitivities of the pupil."""
    return lambda defocus: (transfer(first, defocus), transfer(second, defocus))


def wavebands() -> Transfers:
    """Views of the L and M, and of the S cones; defocus counts from where the former are in focus."""
    cones = [Cones.of(Eye(PUPIL, 0.0), "L+M"), Cones.of(Eye(PUPIL, 0.0), "S", finest_cpd=S_FINEST_CPD)]
    frequency = np.hypot(np.fft.fftfreq(SIDE, PIXEL)[:, None], np.fft.rfftfreq(SIDE, PIXEL))
    focus = cones[0].focus_vergence
    return lambda defocus: tuple(one.transfer(frequency, focus + defocus) for one in cones)  # type: ignore[return-value]


def covariance(views: Transfers, defocus: float) -> NDArray[np.complex128]:
    """Covariance of both views at each frequency, in units of the noise of a view that has all the light."""
    radial = np.hypot(np.fft.fftfreq(SIDE)[:, None], np.fft.rfftfreq(SIDE))
    radial[0, 0] = np.inf
    power = np.where(radial < 0.5, radial**-2.0, 0.0)
    power *= (CONTRAST / NOISE) ** 2 * SIDE**2 / (2 * power.sum())
    pixel = np.sinc(np.fft.fftfreq(SIDE))[:, None] * np.sinc(np.fft.rfftfreq(SIDE))
    seen = np.stack([pixel * one for one in views(defocus)], axis=-1)
    # Noise of photons and cones: half of them in each view.
    return np.asarray(power[..., None, None] * seen[..., :, None] * seen[..., None, :].conj() + 2 * np.eye(2))


def deviation(views: Transfers) -> float:
    """Standard deviation of depth in dioptres, about `DEFOCUS`."""
    step = 0.01
    here = covariance(views, DEFOCUS)
    change = (covariance(views, DEFOCUS + step) - covariance(views, DEFOCUS - step)) / (2 * step)
    part = np.linalg.solve(here, change)
    return float(np.einsum("...ij,...ji->...", part, part).real.sum() ** -0.5)


def divergence(views: Transfers) -> float:
    """Nats by which `DEFOCUS` nearer differs from as much farther."""
    near, far = (covariance(views, way * DEFOCUS) for way in (1, -1))
    ratio = np.linalg.solve(far, near)
    value = np.trace(ratio, axis1=-2, axis2=-1) - 2 - np.log(np.linalg.det(ratio))
    return float(value.real.sum())


def pairs() -> dict[str, tuple[Array, Array]]:
    """The two sensitivities over the pupil, by name."""
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
