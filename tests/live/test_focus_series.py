"""A focus series against blurring at each focus: the error of mixing, what is kept, and uniform defocus."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import focalgradient as fg
from focalgradient.display import Display
from focalgradient.errors import InputError
from focalgradient.live import FocusSeries, series, texels_of
from focalgradient.live.kept import INPUTS
from focalgradient.render import blur_picture

ANGLE = 1e-3
SIDE = 64


def picture(colours: bool = True) -> tuple[NDArray[np.float32], NDArray[np.float64]]:
    """A photograph's spectrum, with a black and white pattern, on a floor that recedes."""
    random = np.random.default_rng(4)
    waves = np.hypot(np.fft.fftfreq(SIDE)[:, None], np.fft.rfftfreq(SIDE))
    waves[0, 0] = 1
    noise = np.fft.irfft2(np.fft.rfft2(random.normal(size=(3, SIDE, SIDE))) / waves, (SIDE, SIDE))
    light = np.clip(0.25 * np.exp(0.7 * noise / noise.std()), 0, 1).transpose(1, 2, 0)
    vergence = np.linspace(0.4, 1.2, SIDE)[:, None] * np.ones(SIDE)
    light[16:44, 12:40] = np.where(np.add.outer(np.arange(28), np.arange(28)) // 5 % 2, 0.9, 0.02)[..., None]
    return light.astype(np.float32) if colours else light[..., 0].astype(np.float32), 1 / vergence


def lens(focus: float = 1.0) -> fg.Lens:
    return fg.Lens(0.04, 4.0, 1 / focus)  # 5 pixels of radius a dioptre


@pytest.fixture(scope="module")
def made() -> FocusSeries:
    return FocusSeries.of(*picture(), lens(), pixel_angle=ANGLE)


def test_at_any_focus_the_mixture_is_within_three_steps_of_blurring(made: FocusSeries) -> None:
    assert made.error[0] <= 1
    assert made.error[1] <= 3
    foci = np.random.default_rng(7).uniform(0.4, 1.2, 12).tolist()
    for focus in foci:
        blurred = Display().encode(blur_picture(*picture(), lens(focus), pixel_angle=ANGLE)).astype(int)
        apart = np.abs(made.encoded(focus) - blurred)
        assert np.median(apart) <= 1
        assert apart.max() <= 3


@pytest.mark.slow
@pytest.mark.filterwarnings("default:mixing two planes")
def test_where_outlines_jump_the_stated_error_is_the_true_one() -> None:
    light, far = picture()
    far[16:44, 12:40] = 0.6
    found = FocusSeries.of(light, far, lens(), pixel_angle=ANGLE)
    assert found.error[0] <= 1
    for focus in np.random.default_rng(8).uniform(0.4, 1.6, 12).tolist():
        blurred = Display().encode(blur_picture(light, far, lens(focus), pixel_angle=ANGLE)).astype(int)
        assert np.abs(found.encoded(focus) - blurred).max() <= 1 + 1.5 * max(found.error[1], 2)


def test_the_memory_is_stated_before_it_is_made() -> None:
    told: list[str] = []

    def stop(share: float, words: str) -> None:
        told.append(words)
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        FocusSeries.of(*picture(), lens(), pixel_angle=ANGLE, progress=stop)
    assert told[0].startswith("about ")
    assert told[0].endswith("MB as textures")


def test_a_map_of_focus_shows_at_each_pixel_the_picture_of_its_focus(made: FocusSeries) -> None:
    wanted = np.linspace(0.3, 1.4, SIDE) * np.ones((SIDE, 1))  # beyond the ends: the ends
    found = made.at(wanted)
    for column in (0, 20, 41, 63):
        np.testing.assert_allclose(found[:, column], made.at(wanted[0, column])[:, column], atol=1e-6)
    with pytest.raises(InputError, match="one for each pixel"):
        made.at(wanted[:, :3])


class Counted:
    """`blur_picture`, counted."""

    def __init__(self) -> None:
        self.whole = 0

    def __call__(self, light: Any, *rest: Any, **named: Any) -> Any:
        self.whole += light.shape[:2] == (SIDE, SIDE)
        return blur_picture(light, *rest, **named)


@pytest.mark.slow
def test_what_is_kept_is_not_made_again_and_what_was_cut_off_goes_on(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, made: FocusSeries
) -> None:
    count = Counted()
    monkeypatch.setattr(series, "blur_picture", count)
    monkeypatch.setattr(series, "TILE", 32)
    how: dict[str, Any] = {"pixel_angle": ANGLE, "folder": tmp_path / "kept"}

    def stop(share: float, words: str) -> None:
        if share > 0.5:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        FocusSeries.of(*picture(), lens(), progress=stop, **how)
    first = count.whole
    again = FocusSeries.of(*picture(), lens(), **how)
    assert 2 * len(made.planes) - 1 <= count.whole <= 2 * len(made.planes) + 1  # each once, with the last check of all
    assert first > count.whole / 3
    count.whole = 0
    read = FocusSeries.of(*picture(), lens(), **how)
    assert count.whole == 0
    for one in (again, read, FocusSeries.read(tmp_path / "kept")):
        assert one.vergences == made.vergences
        assert all((a == b).all() for a, b in zip(one.planes, made.planes, strict=True))
        assert one.error == made.error
        assert one.pixel_angle == ANGLE
    other = FocusSeries.of(*picture(), fg.Lens(0.04, 8.0, 1.0), **how)
    assert count.whole > len(other.planes)
    assert len(list((tmp_path / "kept").glob("focus-*"))) == len(other.planes)


def test_a_damaged_folder_is_refused(tmp_path: Path, made: FocusSeries) -> None:
    made.save(tmp_path)
    (tmp_path / "series.json").write_text(json.dumps({"focus_dioptre": [1.0, 0.5], "errors": [[0, 0]]}))
    with pytest.raises(InputError, match="make the series again"):
        FocusSeries.read(tmp_path)
    made.save(tmp_path)
    np.save(tmp_path / "distance.npy", np.ones((2, 2)))
    with pytest.raises(InputError, match="inconsistent with"):
        FocusSeries.read(tmp_path)
    assert not (tmp_path / INPUTS).exists()


def test_uniform_defocus_is_that_of_a_flat_picture() -> None:
    light = picture(colours=False)[0]
    eye = fg.Eye(0.004, 0.0)
    flat = FocusSeries.uniform(light, eye, pixel_angle=ANGLE, defocus=(-1.0, 1.0))
    assert flat.vergences[0] == -1
    assert flat.vergences[-1] == 1
    for defocus in (-0.7, 0.0, 0.31):
        # Defocus is positive beyond the plane of focus: the eye accommodates to what is nearer.
        expected = blur_picture(light, np.full(light.shape, 0.5), fg.Eye(0.004, 2.0 + defocus), pixel_angle=ANGLE)
        assert np.abs(flat.encoded(defocus) - Display().encode(expected).astype(int)).max() <= 3


@pytest.mark.slow
def test_an_eye_in_colour_is_in_focus_colour_by_colour() -> None:
    light = np.zeros((24, 24, 3), np.float32)
    light[:, 12:] = 0.8
    eye = fg.Eye(0.003, 1.0)
    how: dict[str, Any] = {"pixel_angle": ANGLE, "focus": (0.5, 1.0), "median_error": 9, "largest_error": 90}
    found = FocusSeries.of(light, np.ones((24, 24)), eye, wavelengths=3, **how)
    edge = found.at(1.0)[12, 8:16]
    assert float(np.ptp(edge, axis=1).max()) > 0.02  # a coloured fringe
    assert not found.within_white or texels_of(found).values.dtype == np.uint8


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"distance": np.ones((3, 3))}, "shape"),
        ({"picture": np.full((SIDE, SIDE), 1e6)}, "scale it down"),
        ({"focus": (2.0, 1.0)}, "farthest and the nearest"),
    ],
)
def test_what_cannot_be_a_series_is_refused(change: dict[str, Any], said: str) -> None:
    light, far = picture()
    given: dict[str, Any] = {"picture": light, "distance": far, "optics": lens(), "pixel_angle": ANGLE, **change}
    with pytest.raises(InputError, match=said):
        FocusSeries.of(given.pop("picture"), given.pop("distance"), given.pop("optics"), **given)


def test_light_above_white_is_kept_in_half_floats() -> None:
    bright = FocusSeries((0.0, 1.0), (np.full((2, 2), 4, np.float16),) * 2, np.ones((2, 2)), np.zeros((1, 2)))
    assert texels_of(bright).values.dtype == np.float16
    assert bright.texture_bytes == 2 * 4 * 8
    assert (texels_of(bright).values[0, 0, 0, :3] / texels_of(bright).gain).tolist() == [4, 4, 4]


@pytest.mark.slow
def test_planes_of_an_eye_are_not_crowded_by_its_tabulated_blurs() -> None:
    light, far = picture(colours=False)
    found = FocusSeries.of(light, far, fg.Eye(0.004, 1.0), pixel_angle=4e-4)  # 5 pixels of radius a dioptre
    assert found.error[1] <= 3
    assert len(found.planes) <= 1 + 8 * 0.8 * 5  # with tables 0.25 px apart: hundreds, and larger errors


def test_the_number_of_planes_is_limited_and_the_error_reached_is_stated(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(series, "MAX_INTERVALS", 4)
    with pytest.warns(fg.errors.FocalGradientWarning, match="more than 5 planes: set largest_error"):
        found = FocusSeries.of(*picture(colours=False), lens(), pixel_angle=ANGLE)
    assert len(found.planes) == 5
    assert found.error[1] > 3
