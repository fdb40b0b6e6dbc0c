"""The figures of the paper, live: the page of `docs/play` opened in browsers, beside NumPy and the package."""

from __future__ import annotations

import base64
import io
import json
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import browser
import firefox
import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image

from focalgradient import Lens
from focalgradient.depth.ratio import focal_disparity
from focalgradient.eye import Eye, Oscillation, band_light
from focalgradient.paper import paper_distance
from focalgradient.srgb import linear_to_srgb, srgb_to_linear

ROOT = Path(__file__).parents[1]
PLAY = ROOT / "docs" / "play"
CURRENT = "from pathlib import Path; import hatch_build; print(hatch_build.play_is_current(Path()))"
PAGE = PLAY / "index.html"
DATA: dict[str, Any] = json.loads(
    (PLAY / "data.js").read_text(encoding="utf-8").removeprefix("const PLAY =").rstrip("\n;")
)
SCENE = DATA["scene"]

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="elsewhere Chromium is not among what is set up")

FloatArray = NDArray[np.float64]


def picture(address: str) -> NDArray[np.uint8]:
    return np.asarray(Image.open(io.BytesIO(base64.b64decode(address.split(",")[1]))))


LIGHT = srgb_to_linear(picture(SCENE["png"])[..., 0] / 255)
VERGENCE = picture(SCENE["png"])[..., 1] / 255 * SCENE["vergence"]


def pcg(value: NDArray[np.uint32]) -> NDArray[np.uint32]:
    """Return O'Neill's RXS-M-XS hash of 32 bits."""
    with np.errstate(over="ignore"):
        state = value * np.uint32(747796405) + np.uint32(2891336453)
        word = ((state >> ((state >> np.uint32(28)) + np.uint32(4))) ^ state) * np.uint32(277803737)
    return (word >> np.uint32(22)) ^ word


def blurred(aperture: float, foci: tuple[float, float]) -> FloatArray:
    """Return the scene through a Gaussian of the package's blur radius, along rows and then along columns."""
    image = LIGHT.astype(float)
    for axis, focus in ((1, foci[0]), (0, foci[1])):
        sigma = DATA["k"] * aperture / 2 * np.abs(focus - VERGENCE) / SCENE["pixel_angle"]
        reach = 24
        total, weights = np.zeros_like(image), np.zeros_like(image)
        pad = [(reach, reach) if way == axis else (0, 0) for way in (0, 1)]
        wide, spread, far = (np.pad(each, pad, constant_values=np.nan) for each in (image, sigma, VERGENCE))
        for shift in range(-reach, reach + 1):
            part = tuple(
                slice(reach + shift, reach + shift + n) if way == axis else slice(None)
                for way, n in enumerate(image.shape)
            )
            sd = np.where(far[part] < VERGENCE, np.minimum(spread[part], sigma), spread[part])
            sd = np.maximum(sd, 0.1)
            norm = np.where(sd >= 0.6, np.sqrt(2 * np.pi) * sd, 1 + 2 * np.exp(-0.5 / sd**2))
            weight = np.nan_to_num(np.exp(-0.5 * shift**2 / sd**2) / norm)
            total += weight * np.nan_to_num(wide[part])
            weights += weight
        image = total / weights
    return image


@pytest.fixture(scope="module")
def chromium() -> Iterator[browser.Browser]:
    with browser.Browser() as started:
        yield started


@pytest.fixture(scope="module")
def other(tmp_path_factory: pytest.TempPathFactory) -> Iterator[firefox.Firefox]:
    if firefox.FIREFOX is None:
        pytest.skip("Firefox is not installed")
    with firefox.Firefox(tmp_path_factory.mktemp("firefox")) as started:
        started.open(PAGE)
        yield started


def opened(chromium: browser.Browser, size: tuple[int, int] = (1280, 900), **how: Any) -> browser.Browser:
    chromium.open(PAGE, size, **how)
    chromium.wait("typeof ready !== 'undefined'")
    chromium.js("ready.then(() => true)")
    return chromium


def drawn(
    chromium: browser.Browser | firefox.Firefox,
    given: dict[str, Any],
    names: tuple[str, ...] = (),
    *,
    packed: bool = False,
) -> list[FloatArray]:
    """Draw on a canvas of its own, and return the named steps, H x W x 2 each."""
    if isinstance(chromium, browser.Browser) and not chromium.js(
        "location.protocol === 'file:' && innerWidth === 1280"
    ):
        opened(chromium)
    chromium.js(
        f"""(async () => {{
            window.tested = new TwoViews(document.createElement("canvas"), {{ packed: {str(packed).lower()} }});
            tested.load(await imageOf(PLAY.scene.png), PLAY.scene);
            tested.draw({json.dumps(given)}, PLAY.scene.pixel_angle);
        }})()"""
    )
    return [step(chromium, name) for name in names]


def step(chromium: browser.Browser | firefox.Firefox, name: str) -> FloatArray:
    values = np.frombuffer(base64.b64decode(chromium.js(f"tested.read({name!r})")), np.float32).astype(float)
    width, height = chromium.js(f"[tested.targets[{name!r}].width, tested.targets[{name!r}].height]")
    return values.reshape(height, width, 2)


def canvas(chromium: browser.Browser | firefox.Firefox) -> NDArray[np.int64]:
    return picture(chromium.js("tested.canvas.toDataURL('image/png')"))[..., 0].astype(int)


@pytest.mark.parametrize("packed", [False, True], ids=["floats", "packed"])
@pytest.mark.parametrize(
    "name", ["chromium", pytest.param("other", marks=pytest.mark.slow)], ids=["chromium", "firefox"]
)
def test_pixels_agree_with_numpy_to_one_step_of_8_bits(request: pytest.FixtureRequest, name: str, packed: bool) -> None:
    chromium = request.getfixturevalue(name)
    apertures, focus = [0.05 / 22, 0.05 / 8], [[1.6, 1.6], [1.2, 1.2]]  # astigmatic: across and upright
    drawn(chromium, {"apertures": apertures, "focus": focus, "tiles": [0, 1]}, packed=packed)
    shown = np.split(canvas(chromium), 2, axis=1)
    for n, aperture in enumerate(apertures):
        expected = np.rint(255 * linear_to_srgb(blurred(aperture, (focus[0][n], focus[1][n])))).astype(int)
        assert np.abs(shown[n] - expected).max() <= 1
        assert np.abs(expected - np.rint(255 * linear_to_srgb(LIGHT))).mean() > 0.5


def test_noise_and_bits_agree_with_numpy(chromium: browser.Browser) -> None:
    given = {"apertures": [0, 0], "focus": [0, 0], "tiles": [0, 1], "noise": 0.02, "bits": 5, "seed": 7}
    (views,) = drawn(chromium, given, ("views",))
    place = np.arange(LIGHT.size, dtype=np.uint32).reshape(LIGHT.shape)
    for n in (0, 1):
        first = pcg(place + pcg(np.array(14 + n, np.uint32)))
        second = pcg(first)
        halves = sum((key >> np.uint32(16)).astype(float) + (key & np.uint32(65535)) for key in (first, second))
        noisy = np.clip(LIGHT + 0.02 * np.sqrt(3) * (halves / 65536 - 2), 0, 1)
        expected = np.floor(31 * noisy + 0.5) / 31
        assert np.mean(np.abs(views[..., n] - expected) > 1e-4) < 1e-3  # a value at a step's edge may fall either way
        assert noisy.std() > LIGHT.std()
    assert abs(np.corrcoef((views - LIGHT[..., None]).reshape(-1, 2).T)[0, 1]) < 0.1


@pytest.mark.parametrize("noise", [pytest.param(0.0, marks=pytest.mark.slow), 0.01])
def test_the_ratio_is_the_focal_disparity_of_the_package(chromium: browser.Browser, noise: float) -> None:
    pair, focus = [0.05 / 64, 0.05 / 22.6], 1.75  # those of Fig. 5
    read = {"apertures": pair, "plane": focus, "side": 1, "reach": focus}
    given = {"apertures": pair, "focus": [focus, focus], "tiles": [*range(6)], "window": 6, "read": read}
    views, ratio = drawn(chromium, given | {"noise": noise, "seed": 1}, ("views", "ratio"))
    small, large = (np.ascontiguousarray(views[..., n], np.float32) for n in (0, 1))
    expected, valid = focal_disparity(small, large, noise=noise, window=6, absolute=True)
    assert np.mean((ratio[..., 1] > 0.5) == valid) > 0.999
    both = valid & (ratio[..., 1] > 0.5)
    assert both.mean() > (0.9 if noise == 0 else 0.3)
    assert np.abs(8 * ratio[..., 0] - expected)[both].max() < 0.004  # a step of 8 bits


@pytest.mark.fast_cases(2)
@pytest.mark.parametrize(("distance", "number"), [(0.45, 8), (1.35, 5.6), (3.0, 11)])
def test_both_distances_of_a_blur_are_those_of_eq_1(chromium: browser.Browser, distance: float, number: float) -> None:
    drawn(chromium, {"tiles": [0]})
    lens = Lens(focal_length=0.05, f_number=number, focus_distance=0.6)
    sigma = chromium.js(f"blurRadius(0.05, {number}, 0.6, {distance})")
    assert sigma == pytest.approx(float(lens.blur_radius(distance)) * lens.sensor_distance, rel=1e-9)
    found = chromium.js(f"(({{ near, far }}) => [near, far])(distancesOfBlur(0.05, {number}, 0.6, {sigma}))")
    optics = {"focal_length": 0.05, "sensor_distance": lens.sensor_distance, "paper_f_number": 2 * number}
    expected = [float(paper_distance(sigma, side=side, **optics)) for side in ("nearer", "beyond")]
    assert found == pytest.approx(expected, rel=1e-9)
    assert distance == pytest.approx(found[int(distance > 0.6)], rel=1e-6)


def test_the_eye_is_focused_as_the_package_has_it(chromium: browser.Browser) -> None:
    drawn(chromium, {"tiles": [0]})
    given = {"sphere": -2, "cylinder": -0.75, "axis": 180, "accommodation": 0.5}
    (across, s), (upright, _) = chromium.js(f"eyeFocus({json.dumps(given)})")
    shift = DATA["chromatic"]["L+M"]
    for focus, sphere in ((across, "-2.00"), (upright, "-2.75")):
        eye = Eye(refraction=sphere, response=0.5, pupil_diameter=0.004)
        assert focus + shift == pytest.approx(eye.focus_vergence, abs=0.002)
    apart = [band_light(band, "D65").difference() for band in ("L+M", "S")]
    assert s - across == pytest.approx(apart[0] - apart[1], abs=1e-3)
    times = [0.0, 0.1, 0.125, 0.3]
    assert [chromium.js(f"oscillation(0.25, {t})") for t in times] == pytest.approx(Oscillation().at(times).tolist())


@pytest.mark.slow
def test_no_request_leaves_and_nothing_is_stored_when_eight_pictures_are_rated(chromium: browser.Browser) -> None:
    opened(chromium, (390, 844), phone=True)
    for n in range(8):
        chromium.js(f"panels[3].slider.set({0.5 + 0.025 * n})")
        chromium.js("panels[3].button.click()")
    drawn_curves = chromium.js("document.querySelector('#rating svg').textContent")
    assert drawn_curves.count("simulated") == 2
    texts = "[...document.querySelectorAll('#rating svg text')]"
    boxes = chromium.js(f"{texts}.map(text => JSON.stringify(text.getBoundingClientRect()))")
    for n, first in enumerate(map(json.loads, boxes)):
        for second in map(json.loads, boxes[:n]):
            assert (
                first["left"] >= second["right"]
                or second["left"] >= first["right"]
                or (first["top"] >= second["bottom"] - 2 or second["top"] >= first["bottom"] - 2)
            )
    assert "simulated observers" in chromium.js("panels[3].said.textContent")
    answers = chromium.js("panels[3].answers")
    assert {fixation: set(answers[fixation]) for fixation in answers} == {
        end: {"pinhole", "f/22", "f/11", "f/5.6"} for end in ("nearest", "farthest")
    }
    assert chromium.js("[localStorage.length, sessionStorage.length, document.cookie]") == [0, 0, ""]
    asked = [e["params"]["request"]["url"] for e in chromium.events if e["method"] == "Network.requestWillBeSent"]
    assert len(asked) >= 10
    assert {url.split(":")[0] for url in asked} <= {"file", "data", "blob"}
    failed = [e for e in chromium.events if e["method"] in ("Runtime.exceptionThrown", "Log.entryAdded")]
    assert not failed


def test_the_bundle_is_of_the_present_sources() -> None:
    made = subprocess.run([sys.executable, "-c", CURRENT], cwd=ROOT, capture_output=True, text=True, check=True)
    assert made.stdout == "True\n", "run 'python hatch_build.py', and commit docs/play/play.js"
