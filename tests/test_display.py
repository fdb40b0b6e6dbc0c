"""What a display shows: light to values and back, visual angle, and what its pixels can carry."""

import math
import re
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from focalgradient import InputError
from focalgradient.display import Display
from focalgradient.photographs import srgb_to_linear

DISPLAYS = [Display(), Display(gamma=2.2), Display(gamma=1.0), Display(dither=True), Display(gamma=2.4, dither=True)]


@pytest.mark.parametrize("display", DISPLAYS, ids=str)
def test_every_value_is_shown_as_itself(display: Display) -> None:
    values = np.arange(256)
    light = display.decode(values)
    assert light[0] == 0
    assert light[255] == pytest.approx(1, abs=1e-12)
    assert np.array_equal(display.encode(light, seed=3), values)
    if display.gamma == "sRGB":  # as of photographs
        assert np.allclose(light, srgb_to_linear(values / 255), atol=1e-15)


@given(st.floats(0, 1), st.sampled_from(["sRGB", 1.0, 1.8, 2.2]))
def test_the_value_shown_is_the_nearest(light: float, gamma: float) -> None:
    display = Display(gamma=gamma)
    value = int(display.encode(light))
    low, high = display.decode([max(value - 1, 0), min(value + 1, 255)])
    assert low <= light + 1e-12
    assert high >= light - 1e-12


def test_guns_of_successive_pictures_are_dithered_independently() -> None:
    display, light = Display(gamma=(2.0, 2.0, 2.0), dither=True), np.full((64, 64), 0.3)
    guns = [display.encode(light, seed)[..., gun].tobytes() for seed in range(4) for gun in range(3)]
    assert len(set(guns)) == 12


def test_dithering_is_right_on_average_and_mixes_neighbours_only() -> None:
    display = Display(dither=True)
    light = np.full(100_000, 0.2138)  # between values 127 and 128
    values = display.encode(light, seed=1)
    assert set(values.tolist()) == {127, 128}
    plain = Display().decode(Display().encode(light)).mean()
    step = np.diff(display.decode([127, 128]))[0]
    assert abs(display.decode(values).mean() - 0.2138) < 4 * step / 2 / math.sqrt(light.size) < abs(plain - 0.2138)
    assert np.array_equal(values, display.encode(light, seed=1))
    assert not np.array_equal(values, display.encode(light, seed=2))


def test_pixels_per_degree_and_the_steps_that_no_eye_sees() -> None:
    display = Display(pixel_pitch=0.3e-3, distance=0.8)
    angle = math.degrees(math.atan(0.3e-3 / 0.8 * 1e-3)) * 1e3  # of a thousandth of a pixel at the middle
    assert display.pixels_per_degree == pytest.approx(1 / angle, rel=1e-9)
    assert display.arcmin(display.pixels_per_degree) == pytest.approx(60)
    far = Display(distance=2.0)  # 0.48 arcmin a pixel
    with pytest.raises(InputError, match=r"0 to 1.5 px, is 0.71 arcmin at the viewing distance of 2 m.*0.93"):
        far.check_steps([0.0, 1.5])
    far.check_steps([0.0, 2.0])


@pytest.mark.parametrize("distance", [0.57, 2.0])  # the pixels set the limit; the eye does
@pytest.mark.parametrize("kept", [math.inf, 16.0])
def test_the_largest_f_number_that_would_do_is_named(distance: float, kept: float) -> None:
    display = Display(distance=distance)
    with pytest.raises(InputError, match=r"f/\d+ after .* is the largest f-number after") as refused:
        display.check_f_numbers([kept, 15.0 if kept == 16 else 200.0], diameter=60.0)
    found = re.search(r"at this size f/([\d.]+) is", str(refused.value))
    assert found is not None
    largest = float(found[1])
    display.check_f_numbers([kept, largest], diameter=60.0)
    with pytest.raises(InputError):
        display.check_f_numbers([kept, largest + 0.2], diameter=60.0)


def test_guns_of_unequal_gamma_show_the_light_that_is_meant() -> None:
    guns = (1.9, 2.2, 2.5)
    display = Display(gamma=guns)
    light = np.random.default_rng(1).uniform(0.05, 1, (20, 30, 3))
    values = display.encode(light)
    for at, gamma in enumerate(guns):
        assert (values[..., at] == Display(gamma=gamma).encode(light[..., at])).all()
        shown = (values[..., at] / 255) ** gamma  # what the gun does with them
        assert np.abs(shown - light[..., at]).max() < 0.006
    assert np.abs(display.decode(values) - light).max() < 0.006
    grey = display.encode(light[..., 0])
    assert grey.shape == (20, 30, 3)
    assert np.ptp(display.decode(grey), axis=-1).max() < 0.012  # as grey as 8 bits can be
    with pytest.raises(InputError, match="no axis of 3 colours"):
        display.decode(np.arange(256))
    with pytest.raises(InputError, match="must be a number or 3 numbers or"):
        Display(gamma=(2.0, 2.2))  # type: ignore[arg-type]


def test_a_display_is_read_from_its_file(tmp_path: Path) -> None:
    file = tmp_path / "display.toml"
    file.write_text("size_px = [1280, 1024]\npixel_pitch_um = 300\ndistance_m = 0.6\ngamma = 2.2\n")
    assert Display.read(file) == Display((1280, 1024), 300e-6, 0.6, 2.2)
    for text, said in (
        ("pixel_pitch = 300\n", "has the key 'pixel_pitch', but a display may have only"),
        ("pixel_pitch_um = 1\ndistance_m = 0.6\n", "finer than any display's"),
    ):
        file.write_text(text)
        with pytest.raises(InputError, match=said):
            Display.read(file)
