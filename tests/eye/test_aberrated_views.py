"""Depth from what an eye with aberrations sees, its own optics known: blur that is not round, and not even in focus."""

from __future__ import annotations

import numpy as np
import pytest

from focalgradient import InputError, recover_depth, scenes
from focalgradient.depth.filters import ROUND, Spectra, natural_power, plane
from focalgradient.eye import Cones, Eye, Oscillation, accommodation_views, band_views, eye_views, score

PIXEL = np.radians(1 / 60)
PAIR = (0.125, 0.375)
TERMS = ((2, -2, 0.04), (2, 2, -0.07), (3, -1, -0.06), (3, 1, 0.07), (3, -3, -0.05), (4, 0, 0.04))
"""An eye over 3 mm: root mean square 0.14 um, of higher orders 0.11, in the upper part of what people have."""

COMA = ((3, 1, 0.15),)


def aberrated(pupil_diameter: float) -> Eye:
    grown = (pupil_diameter / 0.003) ** 3  # about as higher orders grow
    return Eye(pupil_diameter, 2.0, aberrations=tuple((n, m, c * min(grown, 3)) for n, m, c in TERMS))


@pytest.mark.fast_cases(1)
@pytest.mark.parametrize(("pupil", "beyond"), [(0.003, 0.3), (0.003, -0.6), (0.005, -0.5), (0.005, 0.6)])
def test_two_moments(pupil: float, beyond: float) -> None:
    eye, distance, few = aberrated(pupil), 1 / (2 - beyond), {"wavelengths": 3, "noise": 0.01}
    views = [one.view for one in accommodation_views(distance, eye, PAIR, Oscillation(), (128, 128), PIXEL, **few)]
    depth = recover_depth(views, near=0.28)
    found = score(depth.vergence, depth.valid, np.full((128, 128), distance), 2.0)
    assert depth.details["psf"] == "optics"
    assert found["valid"] > 0.5
    assert found["median_error_D"] < 0.02
    assert found["side_right"] > 0.99
    assert depth.details["split_band"]["tau"] < 0.1


@pytest.mark.fast_cases(1)
@pytest.mark.parametrize(("pupil", "beyond"), [(0.003, 0.5), (0.003, -0.6), (0.005, 0.4)])
def test_bands(pupil: float, beyond: float) -> None:
    """Most of the error is common to the frame, by the gain between the bands: within three standard deviations."""
    distance = 1 / (2 - beyond)
    few = {"wavelengths": 3, "noise": 0.01, "correlation": 0.95, "seed": 3}
    rendered = band_views(distance, aberrated(pupil), (128, 128), PIXEL, **few)
    depth = recover_depth([one.view for one in rendered], near=0.28)
    found = score(depth.vergence, depth.valid, rendered[0].distance, 2.0)
    assert found["valid"] > 0.2
    assert found["median_error_D"] < min(0.1, 3 * np.median(depth.vergence_sd[depth.valid]))
    assert found["side_right"] > 0.97


def test_the_planes_filters_are_those_of_the_radius() -> None:
    image = np.random.default_rng(1).standard_normal((96, 80)).astype(np.float32)
    spectra, at = Spectra.of([image], 32), plane(0.4)

    def shape(f):
        return np.where(f < 0.4, np.exp(-((f / 0.15) ** 2)) * np.cos(2 * np.pi * 5 * f), 0)

    one, two = (spectra.filtered(shape(some.radius)[None], some) for some in (ROUND, at))
    assert np.abs(one - two).max() < 2e-2 * one.std()
    density = shape(at.radius) ** 2
    assert at.to_radial(density) == pytest.approx(shape(ROUND.radius) ** 2, abs=0.02)
    whole = (shape(np.hypot(*np.mgrid[-0.5:0.5:512j, -0.5:0.5:512j])) ** 2).mean()
    assert density @ at.measure == pytest.approx(whole, rel=0.02)
    assert natural_power(1.0, plane()).shape == plane().radius.shape


def test_only_blur_that_is_round_has_a_radial_transfer() -> None:
    cones = Cones.of(Eye(0.005, 2.0, aberrations=((4, 0, 0.1),), stiles_crawford=0.05), "S", wavelengths=2)
    assert cones.isotropic
    radial = cones.transfer(np.degrees([0, 3, 8]), 1.6)
    assert radial[0] == pytest.approx(1, abs=1e-6)
    both = cones.optical_transfer(np.degrees([0, 1.8, 0]), np.degrees([0, 2.4, -8]), 1.6)
    assert np.allclose(radial, both, atol=2e-3)
    cones = Cones.of(Eye(0.004, 1.0, aberrations=COMA), "S")
    assert not cones.isotropic
    with pytest.raises(InputError, match="optical_transfer"):
        cones.transfer(np.degrees([1.0]), 1.0)
    assert Cones.of(Eye(0.004, 1.0, aberrations=COMA), "S", model="disc").isotropic


def test_scenes_show_an_eye_s_aberrations() -> None:
    """A wall as a scene loses the contrast that aberrations cost; near outlines light is kept."""
    plain, coma = Eye(0.004, 1.0), Eye(0.004, 1.0, aberrations=((3, 1, 0.3),))
    left, light = [], []
    for eye in (plain, coma):
        cones = [Cones.of(eye, "L+M", wavelengths=1)]
        image = eye_views(scenes.plane(1.0, seed=1), cones, (64, 64), PIXEL)[0].view.image
        left.append(image.std() / image.mean())
        steps = eye_views(scenes.step(0.5, 2.0, seed=1), cones, (64, 64), PIXEL)[0]
        light.append(steps.view.image.mean())
    assert left[1] < 0.9 * left[0]
    assert light[1] == pytest.approx(light[0], rel=0.03)
    assert sorted(set(steps.distance.ravel().tolist())) == pytest.approx([0.5, 2.0])
