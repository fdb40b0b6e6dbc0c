"""The page that shows Eq. 1 live, built by its script and opened in a browser."""

from __future__ import annotations

import base64
import importlib.util
import re
import sys
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType
from typing import Any

import browser
import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from focalgradient import Lens
from focalgradient.display import Display
from focalgradient.paper import paper_distance
from focalgradient.photographs import srgb_to_linear
from focalgradient.render import blur_picture

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="elsewhere Chromium is not among what is set up")

SIZE = (240, 160)
ANGLE = 1.5e-3


def builder() -> ModuleType:
    spec = importlib.util.spec_from_file_location("blur_page", Path(__file__).parents[1] / "docs" / "blur_page.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def picture() -> tuple[NDArray[np.float32], NDArray[np.float64]]:
    """Coloured texture on three cards at 0.7, 1.1 and 2 m, before a wall at 4 m."""
    width, height = SIZE
    random = np.random.default_rng(3)
    texture = cv2.GaussianBlur(random.normal(0, 1, (height, width, 3)).astype(np.float32), (0, 0), 1.2)
    metres = np.full((height, width), 4.0)
    light = np.clip(0.25 + 0.25 * texture, 0.02, 0.9).astype(np.float32)
    for (left, top, wide, tall), distance, colour in (
        ((150, 20, 60, 70), 2.0, (0.7, 0.5, 0.4)),
        ((90, 50, 50, 70), 1.1, (0.3, 0.6, 0.4)),
        ((20, 70, 60, 60), 0.7, (0.4, 0.4, 0.8)),
    ):
        part = (slice(top, top + tall), slice(left, left + wide))
        metres[part] = distance
        light[part] = np.clip(light[part] * 0.7 + np.float32(0.3) * np.float32(colour), 0, 0.9)
    light[30:60, 20:70] = 0.05  # a dark place, far away, where the point of light is seen alone
    # What the page holds: 8 bits.
    return np.asarray(srgb_to_linear(Display().encode(light) / 255), np.float32), metres


@pytest.fixture(scope="module")
def shown(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[browser.Browser, Path]]:
    folder = tmp_path_factory.mktemp("page")
    light, metres = picture()
    path = folder / "blur.html"
    path.write_text(builder().page(light, metres, ANGLE, "The picture was made for a test."))
    with browser.Browser() as chromium:
        yield chromium, path


def settle(chromium: browser.Browser, **state: float | bool) -> None:
    """Set what is shown, and wait until it is drawn in full."""
    given = ", ".join(f"{name}: {str(value).lower()}" for name, value in state.items())
    chromium.js(f"Object.assign(blurPage.state, {{{given}}}); blurPage.change()")
    chromium.wait("blurPage.settled()")


def canvas(chromium: browser.Browser) -> NDArray[np.float64]:
    """The canvas in linear light, H x W x 3."""
    data = chromium.js("document.getElementById('picture').toDataURL('image/png').split(',')[1]")
    decoded = cv2.imdecode(np.frombuffer(base64.b64decode(data), np.uint8), cv2.IMREAD_COLOR)
    assert decoded is not None
    return srgb_to_linear(decoded[..., ::-1] / 255)


def opened(shown: tuple[browser.Browser, Path], **how: Any) -> browser.Browser:
    chromium, path = shown
    chromium.open(path, how.pop("size", (1280, 860)), **how)
    chromium.wait("window.blurPage && blurPage.settled()")
    return chromium


def lens(chromium: browser.Browser, focus: float) -> Lens:
    return Lens(0.05, chromium.js("blurPage.stops[blurPage.state.stop]"), 1 / focus)


@pytest.mark.slow
@pytest.mark.parametrize("focus", [0.3, 0.9, 1.4])
def test_the_canvas_shows_what_blur_makes_of_the_picture(shown: tuple[browser.Browser, Path], focus: float) -> None:
    chromium = opened(shown)
    settle(chromium, focus=focus, stop=0, lamp=False)
    light, metres = picture()
    optics = lens(chromium, focus)
    expected = blur_picture(light, metres, optics, pixel_angle=ANGLE)
    error = canvas(chromium) - expected
    assert optics.blur_radius(metres).max() / ANGLE > 3
    rms, mean = np.sqrt((error**2).mean()) / expected.mean(), error.mean() / expected.mean()
    print(f"against blur: RMS {rms:.2%} and mean {mean:.2%} of the mean light")
    assert rms < 0.015
    assert abs(mean) < 0.002


@pytest.mark.slow
@pytest.mark.parametrize(("distance", "focus"), [(0.75, 1.0), (3.0, 1.0), (3.0, 1.4), (1.2, 0.3)])
def test_the_disc_of_the_point_of_light_has_the_radius_of_eq_1(
    shown: tuple[browser.Browser, Path], distance: float, focus: float
) -> None:
    chromium = opened(shown)
    where = {"x": 45, "y": 45, "stop": 0, "focus": focus, "vergence": 1 / distance}
    settle(chromium, **where, lamp=False)
    without = canvas(chromium)
    settle(chromium, **where, lamp=True)
    disc = (canvas(chromium) - without).mean(axis=2)
    assert canvas(chromium)[disc > 0.1].max() < 1  # nothing is cut off
    y, x = np.indices(disc.shape)
    moment = (disc * ((y - 45) ** 2 + (x - 45) ** 2)).sum() / disc.sum()  # r^2 / 2 for a uniform disc
    radius = np.sqrt(2 * moment)
    optics = lens(chromium, focus)
    # The radius in the picture, taken to the sensor, gives the distance by Eq. 1.
    sigma = radius * ANGLE * optics.sensor_distance
    side = "beyond" if 1 / distance < focus else "nearer"
    found = paper_distance(
        sigma,
        focal_length=0.05,
        sensor_distance=optics.sensor_distance,
        paper_f_number=2 * optics.f_number,
        side=side,  # type: ignore[arg-type]
    )
    expected = float(optics.blur_radius(distance)) / ANGLE
    assert radius == pytest.approx(expected, rel=0.02)
    assert 1 / float(found) == pytest.approx(1 / distance, abs=0.02 * abs(1 / distance - focus))
    told = chromium.js("document.getElementById('D').textContent")
    assert float(told.removesuffix(" m")) == pytest.approx(distance, rel=0.005)
    told = chromium.js("document.getElementById('sigma').textContent")
    assert 1e-6 * float(told.removesuffix(" µm")) == pytest.approx(
        expected * ANGLE * optics.sensor_distance, abs=0.6e-6
    )


@pytest.mark.slow
def test_it_asks_nothing_of_the_network_and_reports_no_error(shown: tuple[browser.Browser, Path]) -> None:
    chromium = opened(shown)
    asked = {
        event["params"]["request"]["url"]
        for event in chromium.events
        if event.get("method") == "Network.requestWillBeSent"
    }
    assert {url.split(":")[0] for url in asked} <= {"file", "blob", "data"}
    troubles = ("Log.entryAdded", "Runtime.exceptionThrown", "Runtime.consoleAPICalled")
    assert not [event for event in chromium.events if event.get("method") in troubles]
    assert not re.findall(r"(?:src|href)=|https?://|url\(", shown[1].read_text())
