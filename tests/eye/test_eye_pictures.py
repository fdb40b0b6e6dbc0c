"""Pictures with their depth in place of scenes: what each cone class sees of them, and depth from that."""

from __future__ import annotations

import numpy as np
import pytest
from textures import natural

from focalgradient import recover_depth
from focalgradient.eye import Eye, Oscillation, SpectralPicture, accommodation_views, band_views

PIXEL = np.radians(1 / 60)
EYE = Eye(pupil_diameter=0.003, accommodation=2.0)


def test_depth_of_a_picture_by_two_moments() -> None:
    """Two walls side by side, 0.6 D apart: each is found away from the border between them."""
    distance = np.full((128, 160), 1 / 1.6)
    distance[:, 80:] = 1 / 2.2
    shown = natural((160, 160))[:128]
    rendered = accommodation_views(
        (shown, distance), EYE, (0.125, 0.375), Oscillation(), shown.shape, PIXEL, noise=0.005
    )
    assert np.array_equal(rendered[0].distance, distance)
    depth = recover_depth([one.view for one in rendered])
    for part, vergence in ((np.s_[24:-24, 24:48], 1.6), (np.s_[24:-24, 112:136], 2.2)):
        valid = depth.valid[part]
        assert valid.mean() > 0.5
        assert np.median(depth.vergence[part][valid]) == pytest.approx(vergence, abs=0.03)


def test_each_cone_class_sees_its_own_light() -> None:
    """Of one colour all over, which blur leaves as it is."""
    colour = np.full((64, 64, 1), 0.8) * np.array([0.9, 0.4, 0.1])
    seen = band_views((colour, np.full((64, 64), 0.5)), EYE, (64, 64), PIXEL)
    for rendered, band in zip(seen, ("L+M", "S"), strict=True):
        wanted = SpectralPicture.of(colour).catch(band).mean()
        assert rendered.view.image == pytest.approx(wanted, rel=1e-4)
