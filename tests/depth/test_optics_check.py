"""Wrong optics are warned of: an order reversed, apertures off by a factor, foci exchanged."""

import re
from dataclasses import replace
from functools import cache

import judged
import numpy as np
import pytest
from blurred import PIXEL, SHAPE, TILE, Camera, lens, wall
from scipy import ndimage
from textures import natural_spectrum

from focalgradient import Lens, View
from focalgradient.depth.hypotheses import misordered_apertures
from focalgradient.depth.registration import RegisteredViews
from focalgradient.depth.search import Search
from focalgradient.psf import Disc, transfer


@cache
def slant(lenses, low, high):
    """Views of a textured slant from `high` (D, left) to `low` (right)."""
    random = np.random.default_rng(0)
    frequency = np.hypot(np.fft.fftfreq(TILE)[:, None], np.fft.rfftfreq(TILE))
    spectrum = natural_spectrum((TILE, TILE), random)
    height, width = SHAPE
    vergence, column = np.linspace(high, low, width), np.arange(width)
    views = []
    for one in lenses:
        radius = one.aperture_diameter / 2 * np.abs(one.focus_vergence - vergence) / PIXEL
        radii = np.linspace(0, radius.max() + 0.01, 24)
        blurred = np.stack([np.fft.irfft2(spectrum * transfer(frequency, r, "disc"))[:height, :width] for r in radii])
        place = np.clip(radius / radii[1], 0, 22.99)
        below = place.astype(int)
        image = (
            1 + blurred[below, :, column].T * (below + 1 - place) + blurred[below + 1, :, column].T * (place - below)
        )
        views.append(View((image + 0.01 * random.standard_normal(SHAPE)).astype(np.float32), one, PIXEL))
    return views


def said(views, stated, **limits):
    """What is warned of where the views are said to be through the lenses `stated`."""
    return judged.said([View(v.image, one, PIXEL) for v, one in zip(views, stated, strict=True)], **limits)[1]


STOPS = (lens(16), lens(4))


@pytest.mark.fast_cases(1)
@pytest.mark.parametrize(
    ("stated", "named"),
    [
        (STOPS, None),
        (STOPS[::-1], "apertures in reverse order"),
        ([lens(16), lens(8)], r"0\.5 times the f-number of view 2"),
    ],
)
def test_apertures(stated, named):
    text = said(slant(STOPS, 0.5, 1.1), stated, near=0.85)
    if named is None:
        assert "contradict" not in text
    else:
        assert re.search(f"contradict the optics stated: they fit better with (the )?{named}", text)
        assert "(f_number, focus_distance)" in text


@pytest.mark.fast_cases(2)
@pytest.mark.parametrize(("factor", "named"), [(1.0, None), (2**0.5, r"0\.71"), (2**-0.5, r"1\.4")])
def test_a_common_factor_of_all_f_numbers_shows_with_two_foci(factor, named):
    foci = (lens(5.6, 0.85), lens(5.6, 1.5))
    text = said(slant(foci, 0.5, 1.1), [lens(5.6 * factor, 0.85), lens(5.6 * factor, 1.5)], near=0.85)
    assert "not quite a disc" not in text
    assert bool(re.search(f"fit better with {named} times all f-numbers", text)) == (named is not None)


@pytest.mark.slow
def test_more_blur_than_at_infinity_names_the_focus_distance():
    feet = [lens(n, 0.85 / 0.3048) for n in (16, 4)]
    text = said(slant(STOPS, 0.5, 1.1), feet, near=0.85)
    assert "more blur than infinity would have" in text
    assert "focus_distance, and that it is in metres" in text
    assert "infinity" not in said(slant(STOPS, 0.0, 0.1), STOPS, near=0.85)  # a scene that is there


@pytest.mark.slow
def test_foci_of_a_stack():
    foci = lens(5.6, 0.7), lens(5.6, 1.0), lens(5.6, 1.5)
    views = slant(foci, 0.7, 1.4)
    assert "contradict" not in said(views, foci)
    assert "foci of views 1 and 2 exchanged" in said(views, [foci[1], foci[0], foci[2]])


def test_the_magnification_of_two_foci_tells_their_order_and_their_unit():
    """Sharp pictures of one texture, of the magnifications of two foci: no depth is needed."""
    near, far = lens(5.6, 0.6), lens(5.6, 1.5)
    scale = far.sensor_distance / near.sensor_distance
    pictures = [wall([lens(64, 0.9)], 0.9, cameras=[camera])[0].image for camera in (Camera(), Camera(scale=scale))]
    for order, reversed_order in (((near, far), False), ((far, near), True)):
        views = [View(p, o, 8e-6 / o.sensor_distance) for p, o in zip(pictures, order, strict=True)]
        warned = " ".join(RegisteredViews.of(views, align=True).warnings)
        assert ("opposite order (focus_distance)" in warned) == reversed_order
    for unit, named in ((1.0, False), (1 / 0.3048, True), (2.0, False)):
        stated = [lens(5.6, unit * one) for one in (0.6, 1.5)]
        views = [View(p, o, 8e-6 / o.sensor_distance) for p, o in zip(pictures, stated, strict=True)]
        warned = " ".join(RegisteredViews.of(views, align=False).warnings)
        assert ("in feet: give them in metres (focus_distance)" in warned) == named
        assert ("displaced" in warned) == (unit == 2.0)


@pytest.mark.parametrize("order", [1, -1])
def test_the_sharper_view_has_the_smaller_aperture(order):
    """Also of views that no optics explain: here with uneven noise and a shift, as in photographed rooms."""
    random = np.random.default_rng(3)
    views = [
        View((v.image + 0.01 * random.standard_normal(SHAPE)).astype(np.float32), v.optics, PIXEL)
        for v in slant(STOPS, 0.5, 1.1)
    ]
    views[1] = View(np.roll(views[1].image, 1, axis=0), views[1].optics, PIXEL)
    stated = [View(v.image, one, PIXEL) for v, one in zip(views, STOPS[::order], strict=True)]
    search = Search.over([v.optics for v in stated], PIXEL, 0.85, None, Disc())
    text = misordered_apertures(RegisteredViews.of(stated, align=False), search)
    assert (text or "").startswith("view 1 shows finer detail than view 2") == (order == -1)
    assert (text is None) == (order == 1)


def test_diffraction_does_not_contradict_the_order():
    """A wall in focus, sampled at 1 um: f/32 is softer than f/4 by diffraction alone."""
    pixel = 1e-6 / 0.025
    lenses = [Lens(0.025, n, 1.0) for n in (32, 4)]
    texture = wall([lens(16)], 1.1, noise=0.003)[0].image.astype(float)
    softened = [ndimage.gaussian_filter(texture, one.f_number / 16).astype(np.float32) for one in lenses]
    views = [View(image, one, pixel) for image, one in zip(softened, lenses, strict=True)]
    registered, search = RegisteredViews.of(views, align=False), Search.over(lenses, pixel, None, None, Disc())
    assert misordered_apertures(registered, search) is None
    assert misordered_apertures(registered, replace(search, pixel_angle=10 * pixel))
