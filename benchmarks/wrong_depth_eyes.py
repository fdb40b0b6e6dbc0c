"""Wrong depth without a warning: truth outside the range searched, and user-defined optics."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from typing import Any

import numpy as np
from coverage_of_walls import measured
from reruns import Lines

from focalgradient import InputError, Lens, View, recover_depth
from focalgradient.eye import Cones, Eye, Photons, eye_views
from focalgradient.optics import Optics, own_blur
from focalgradient.psf import disc_transfer, pixel_transfer

PIXEL = 3.2e-4
NEAR, FAR = 0.7, 2.0
FACTORS = (0.25, 0.4, 0.6, 0.85, 1.2, 1.8, 3.0, 8.0)
"""True distance of walls relative to the nearer limit of the search, or if above 1, to the farther one."""


def add_lines(table: Lines) -> None:
    """Register the lines."""
    table.line("2.1.1", "an eye's four views of a wall at 4 D: 4 and 6 mm", "37 % valid, .94 D +- .27")(_four_views)
    table.line("2.1.2", "an eye's four views, walls at 0 to 6 D, 3 to 6 mm", "in 2 sd .84, beyond 5 sd 15 %")(_walls)
    table.line("2.1.3", "two foci: walls outside near and far", "up to 24 % valid, all beyond 5 sd")(_outside)
    table.line("2.3.1", "round blur by through_focus alone, psf auto and optics", "1.226 m, 1.190 m for 1.250 m")(_ring)
    table.line("2.3.2", "the same by the methods that know discs only", "a disc, in silence")(_other_methods)


def _recovered(views: Sequence[View], truth: float, **asked: Any) -> tuple[float, float, float, float]:
    """Return valid fraction, median vergence (D), and fractions within two and beyond five standard deviations."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        depth = recover_depth(views, **asked)
    if not depth.valid.any():
        return 0.0, np.nan, np.nan, np.nan
    found, sd = depth.vergence[depth.valid], depth.vergence_sd[depth.valid]
    over = np.abs(found - truth) / sd
    return float(depth.valid.mean()), float(np.median(found)), float(np.mean(over <= 2)), float(np.mean(over > 5))


def _pooled(each: Sequence[tuple[float, float, float, float]]) -> str:
    claimed = np.array([one for one in each if one[0] > 0]).reshape(-1, 4)
    if not len(claimed):
        return f"none of {len(each)} claimed"
    weight = claimed[:, 0] / claimed[:, 0].sum()
    within, beyond = weight @ claimed[:, 2], weight @ claimed[:, 3]
    return f"{len(claimed)} of {len(each)} claimed, in 2 sd {within:.2f}, beyond 5 sd {beyond:.1%}"


def _four_views() -> str:
    each = []
    for mm, seed in ((4, 1), (4, 2), (6, 1), (6, 2)):
        eyes = [Eye(1e-3 * mm, focus) for focus in (0.75, 0.25)]
        cones = [Cones.of(eye, band) for eye in eyes for band in ("L+M", "S")]
        seen = eye_views(0.25, cones, (144, 144), np.radians(1 / 60), noise=Photons(200.0), seed=seed)
        each.append(_recovered([one.view for one in seen], 4.0))
    return _pooled(each)


def _walls() -> str:
    each = []
    for mm in (3.0, 4.0, 6.0):
        for number, vergence in enumerate(np.arange(0, 6.01, 0.75).tolist()):
            row = measured("both", mm, 200.0, 0.5, vergence, number, 144)
            claimed = [float(row[name]) for name in ("in2", "in5")] if "in2" in row else [np.nan, np.nan]
            each.append((float(row["valid"]), np.nan, claimed[0], 1 - claimed[1]))
    return _pooled(each)


def _wall(optics: Sequence[Optics], distance: float, seed: int) -> list[View]:
    """Return views of a textured wall through lenses, or through optics with a round blur; 1 % noise."""
    random, size, edge = np.random.default_rng(seed), 512, 128
    down, right = np.fft.fftfreq(size)[:, None], np.fft.rfftfreq(size)
    radial = np.hypot(down, right)
    spectrum = np.fft.rfft2(random.standard_normal((size, size))) / np.maximum(radial, 1 / size)
    spectrum *= 0.2 / np.fft.irfft2(spectrum).std() * pixel_transfer(down, right)
    views = []
    for one in optics:
        own, radius = own_blur(one), one.aperture_diameter / 2 * abs(one.focus_vergence - 1 / distance)
        blurred = disc_transfer(radial / PIXEL, radius) if own is None else own.transfer(radial / PIXEL, 1 / distance)
        image = 1 + np.fft.irfft2(spectrum * blurred)[edge:-edge, edge:-edge]
        views.append(View((image + 0.01 * random.standard_normal(image.shape)).astype(np.float32), one, PIXEL))
    return views


def _outside() -> str:
    lenses, each = [Lens(0.025, 2.8, focus) for focus in (0.7, 1.0)], []
    for seed, factor in enumerate(FACTORS):
        distance = factor * (NEAR if factor < 1 else FAR)
        each.append(_recovered(_wall(lenses, distance, seed), 1 / distance, near=NEAR, far=FAR))
    return _pooled(each)


class Ring:
    """User-defined optics: a mirror lens with annular blur, given by `through_focus` only."""

    aperture_diameter = 0.008
    isotropic = True

    def __init__(self, focus: float, diameter: float = 0.008):
        self.focus_vergence, self.aperture_diameter = 1 / focus, diameter

    def through_focus(self, frequency_y: Any, frequency_x: Any, vergences: Any) -> Any:
        """Return the transfer for a list of vergences (D)."""
        radial = np.hypot(*np.broadcast_arrays(frequency_y, frequency_x))
        defocus = self.focus_vergence - np.asarray(vergences).reshape(-1, *(1,) * radial.ndim)
        radius = np.abs(defocus) * self.aperture_diameter / 2
        return (disc_transfer(radial, radius) - 0.25 * disc_transfer(radial, radius / 2)) / 0.75


def _ring() -> str:
    views = _wall([Ring(0.9), Ring(1.1)], 1.25, 1)
    return ", ".join(f"{1 / _recovered(views, 0.8, psf=psf)[1]:.3f} m" for psf in ("auto", "optics"))


def _other_methods() -> str:
    views, refused = _wall([Ring(0.9), Ring(0.9, 0.002)], 1.25, 1), []
    for method in ("spectra", "ratio", "edges"):
        try:
            recover_depth(views, method=method)
        except InputError as error:
            refused.append(f"{method}: {'by name' if 'Ring' in str(error) else error}")
    return "refused: " + ", ".join(refused)
