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


def picture(channels: int = 3) -> DepthPicture:
    random = np.random.default_rng(3)
    light = random.uniform(0, 1, (32, 48, channels)).astype(np.float32).squeeze()
    metres = np.where(np.arange(48) < 24, 1.0, 2.0) * np.ones((32, 1))
    return DepthPicture("room", picture_of(light, "linear"), metres, 0.0, ANGLE)


def test_the_number_of_wavelengths_includes_the_screen() -> None:
    """A screen that is out of focus needs as many as a surface there."""
    shown, eye = replace(picture(), metres=np.ones((32, 48))), Eye(0.005, 1.0)
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
