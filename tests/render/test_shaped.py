"""Pictures blurred by a shape: light, size, and which way up on either side of focus."""

from __future__ import annotations

import numpy as np
import pytest

from focalgradient import Lens, View, blur, recover_depth
from focalgradient.psf import Annulus, Disc, Gaussian, Polygon, Psf

ANGLE = 5e-4
LENS = Lens(0.04, 2.0, 1.0)  # 20 mm: 20 pixels of radius a dioptre


def point(shape: Psf | str, distance: float) -> np.ndarray:
    picture = np.zeros((81, 81))
    picture[40, 40] = 1.0
    return blur(picture, np.full(picture.shape, distance), LENS, pixel_angle=ANGLE, psf=shape).image.astype(float)


@pytest.mark.parametrize("distance", [1.25, 0.8])
@pytest.mark.parametrize("shape", [Polygon(5, 0.3), Polygon(6), Annulus(0.5), Gaussian(0.4)], ids=str)
def test_light_is_kept_and_the_second_moment_is_the_shapes(shape: Psf, distance: float) -> None:
    image = point(shape, distance)
    y, x = np.indices(image.shape) - 40
    radius = float(LENS.blur_radius(distance)) / ANGLE
    assert image.sum() == pytest.approx(1, abs=1e-5)
    assert image.min() >= 0
    for axis in (y, x):
        assert abs((image * axis).sum()) < 0.02
        assert np.sqrt((image * axis**2).sum()) == pytest.approx(float(shape.sd(radius)), rel=0.02)


def test_a_triangle_stands_upright_beyond_focus_and_is_turned_nearer() -> None:
    """Its corner at rotation 0 points right: the third moment along x is +R^3 / 40 of the triangle's, along y none."""
    for distance, sign in ((2.0, 1), (1 / 1.5, -1)):
        image = point(Polygon(3), distance)
        y, x = np.indices(image.shape) - 40
        corner = Polygon(3).circumradius * float(LENS.blur_radius(distance)) / ANGLE
        assert (image * x**3).sum() == pytest.approx(sign * corner**3 / 40, rel=0.05)
        assert abs((image * y**3).sum()) < 0.03 * corner**3 / 40


def test_a_ring_has_a_dark_middle_and_a_disc_is_as_before() -> None:
    ring = point("annulus", 2.0)
    assert ring[40, 40] < 0.05 * ring.max()
    assert (point("disc", 2.0) == point(Disc(), 2.0)).all()
    picture = np.zeros((81, 81))
    picture[40, 40] = 1.0
    assert (point("disc", 2.0) == blur(picture, np.full((81, 81), 2.0), LENS, pixel_angle=ANGLE).image).all()


@pytest.mark.slow
def test_a_rendered_slant_comes_back() -> None:
    """Many blurs, on both sides of one focus: a pentagon's two apertures tell the side, and depth."""
    random, shape = np.random.default_rng(4), Polygon(5, 0.3)
    y, x = np.fft.fftfreq(160)[:, None], np.fft.rfftfreq(200)
    texture = np.fft.irfft2(np.fft.rfft2(random.standard_normal((160, 200))) / np.maximum(np.hypot(y, x), 0.01))
    distance = 1 / np.linspace(0.8, 1.2, 200) * np.ones((160, 1))
    lenses = [Lens(0.025, number, 1.0) for number in (16, 3)]
    views = [blur(1 + 0.1 * texture / texture.std(), distance, lens, pixel_angle=3e-4, psf=shape) for lens in lenses]
    views = [
        View((view.image + 0.005 * random.standard_normal((160, 200))).astype(np.float32), view.optics, 3e-4)
        for view in views
    ]
    depth = recover_depth(views, psf=shape)
    error = np.abs(depth.vergence - 1 / distance)[depth.valid]
    assert depth.valid.mean() > 0.5
    assert np.median(error) < 0.004  # 2 % of the farthest defocus
