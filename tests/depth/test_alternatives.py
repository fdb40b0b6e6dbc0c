"""Views that other models explain better: a ring, one view softened or moved; named, covered or rejected."""

from __future__ import annotations

import numpy as np
import pytest
from blurred import lens, wall
from judged import covered, over_sd, said
from scipy import ndimage
from scipy.special import j0

from focalgradient import View
from focalgradient.psf import transfer

APERTURES, FOCI = [lens(16), lens(5.6)], [lens(5.6, 0.8), lens(5.6, 1.25)]


@pytest.mark.slow
@pytest.mark.parametrize(("lenses", "near", "hole"), [(APERTURES, 0.85, 0.35), (FOCI, None, 0.5)])
def test_a_ring_is_named(lenses, near, hole, monkeypatch):
    def ring(frequency, radius, psf, k):
        outer, inner = transfer(frequency, radius, "disc"), transfer(frequency, hole * radius, "disc")
        return (outer - hole**2 * inner) / (1 - hole**2)

    monkeypatch.setattr("blurred.transfer", ring)
    depth, text = said(wall(lenses, 1.5, noise=0.01), near=near)
    assert "likelier a ring than a uniform disc" in text
    assert not depth.valid.any() or covered(depth, 1.5) > 0.85


def rim(frequency, radius, psf, k):
    """Transfer of a disc with 30 % of the light in its rim, of a disc's second moment."""
    radius = radius / np.sqrt(1.3)
    return 0.7 * transfer(frequency, radius, "disc") + 0.3 * j0(2 * np.pi * frequency * radius)


def mixed(frequency, radius, psf, k):
    """Transfer of half a disc and half a Gaussian, of a disc's second moment."""
    return (transfer(frequency, radius, "disc") + transfer(frequency, radius, "gaussian", 0.5)) / 2


@pytest.mark.slow
@pytest.mark.parametrize("form", [rim, mixed])
def test_blur_of_a_discs_second_moment_alone_is_named_and_covered(form, monkeypatch):
    monkeypatch.setattr("blurred.transfer", form)
    depth, _ = said(wall([lens(16), lens(5.6), lens(4)], 1.5), near=0.85)
    kind = "bright" if form is rim else "soft"
    assert f"likelier a disc with a {kind} rim than a uniform disc" in depth.details["likelier"]["cause"]
    assert depth.valid.mean() > 0.5
    assert covered(depth, 1.5) > 0.9
    assert 0.4 < np.sqrt(np.mean(over_sd(depth, 1.5) ** 2)) < 1.6


def test_motion_in_one_view_is_named():
    views = wall(APERTURES, 1.3, noise=0)
    random = np.random.default_rng(5)
    images = [views[0].image, ndimage.uniform_filter1d(views[1].image, 3, axis=1)]
    noisy = [image + 0.01 * random.standard_normal(image.shape).astype("f4") for image in images]
    depth, text = said([View(i, v.optics, v.pixel_angle) for i, v in zip(noisy, views, strict=True)], near=0.85)
    assert "not alike in all directions" in text
    assert max(depth.details["split_band"]["tau_by_direction"]) > 0.03


@pytest.mark.fast_cases(1)
@pytest.mark.parametrize("number", [0, 1])
def test_a_view_enlarged_from_half_its_size_is_named_or_rejected(number):
    views = wall(APERTURES, 1.3)
    half = views[number].image.reshape(120, 2, -1, 2).mean(axis=(1, 3))
    enlarged = ndimage.zoom(half, 2, order=3, mode="reflect", grid_mode=True)
    views[number] = View(enlarged, views[number].optics, views[number].pixel_angle)
    depth, text = said(views, near=0.85)
    assert f"view {number + 1} is softer" in text or not depth.valid.any()
