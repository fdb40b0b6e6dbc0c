"""Pictures of known depth as seen through optics: what `Viewing` adds to the functions that it calls."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from focalgradient import Eye, InputError
from focalgradient.eye import chromatic_stimulus, parts_needed
from focalgradient.photographs import DepthPicture, picture_of
from focalgradient.psf import Disc
from focalgradient.render import blur_picture
from focalgradient.stimuli import Viewing

ANGLE = math.radians(1 / 60)


def picture() -> DepthPicture:
    random = np.random.default_rng(3)
    light = random.uniform(0, 1, (16, 32, 3)).astype(np.float32)
    metres = np.where(np.arange(32) < 16, 1.0, 2.0) * np.ones((16, 1))
    return DepthPicture("room", picture_of(light, "linear"), metres, 0.0, ANGLE)


def test_the_number_of_wavelengths_includes_the_screen() -> None:
    """A screen that is out of focus needs as many as a surface there."""
    shown, eye = replace(picture(), metres=np.ones((16, 32))), Eye(0.005, 1.0)
    alike, near = (Viewing(eye, chromatic=True, screen=metres).resolved(shown).foci for metres in (1.0, 0.5))
    assert (alike, near) == (5, parts_needed([0.5, 1.0], eye, pixel_angle=ANGLE))
    assert alike < near


def test_without_spectra_red_green_and_blue_have_one_focus_each(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("focalgradient.stimuli.viewing.find_spec", lambda name: None)
    shown, eye = picture(), Eye(0.004, 1.0)
    viewing = Viewing(eye, chromatic=True)
    with pytest.warns(match="colour-science is not installed"):
        seen = viewing.see(shown)
    assert viewing.foci == 3
    blue = blur_picture(shown.light[..., 2], shown.metres, eye.in_light(464.0), pixel_angle=ANGLE)
    np.testing.assert_array_equal(seen.light[..., 2], blue)


def test_what_a_display_shows_is_in_the_units_of_the_picture() -> None:
    shown, eye = picture(), Eye(0.004, 1.0)
    seen = Viewing(eye, chromatic=True, wavelengths=3, screen=1.0, white=2.0).see(shown)
    how: dict[str, Any] = {"screen": 1.0, "pixel_angle": ANGLE, "wavelengths": 3}
    found = chromatic_stimulus(shown.light / 2, shown.metres, eye, **how)
    np.testing.assert_allclose(seen.light, 2 * found.shown, rtol=1e-6)
    assert seen.residuals is not None
    assert seen.residuals["residual"] == list(found.residual)


@pytest.mark.parametrize(
    ("refraction", "meridians"), [("+1.00 -2.00 x 180", (1.0, -1.0)), ("-1.00 -2.00 x 30", (-1.0, -3.0))]
)
def test_the_blur_of_an_astigmat_is_that_of_its_more_blurred_meridian(
    refraction: str, meridians: tuple[float, float]
) -> None:
    """The image of a point is an ellipse: twice the standard deviation is the pupil's radius x defocus."""
    eye = Eye(refraction=refraction, response=0.0, pupil_diameter=0.006)
    point = np.zeros((129, 129), np.float32)
    point[64, 64] = 1.0
    shown = DepthPicture("point", picture_of(point, "linear"), np.full(point.shape, 4.0), 0.0, ANGLE / 1.5)
    seen = Viewing(eye).see(shown)
    place, light = np.indices(point.shape) - 64, seen.light / seen.light.sum()
    axes = 2 * np.sqrt(np.linalg.eigvalsh(np.einsum("iyx,jyx,yx->ij", place, place, light)))
    # Spectacles of S dioptres, 12 mm before the eye, correct a far point at S / (1 - 0.012 S) dioptres behind it.
    expected = sorted(0.003 * abs(-power / (1 - 0.012 * power) - 1 / 4) / (ANGLE / 1.5) for power in meridians)
    assert seen.largest_blur_px == pytest.approx(expected[1], rel=1e-6)
    assert axes == pytest.approx(expected, rel=0.03)


@pytest.mark.parametrize(
    ("optics", "given", "said"),
    [
        (Eye(0.004, 1.0), {"wavelengths": 5}, "wavelengths is the number of wavelength samples of chromatic"),
        (Eye(0.004, 1.0), {"screen": 1.0}, "screen requires an eye and a display at focus"),
        (Eye(0.004, 1.0), {"psf": Disc()}, "psf is the shape of a lens's blur, but an eye has its own"),
    ],
)
def test_contradictions_are_refused(optics: Any, given: dict[str, Any], said: str) -> None:
    with pytest.raises(InputError, match=said):
        Viewing(optics, **given)
