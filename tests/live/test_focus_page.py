"""What a page with WebGL draws of a focus series, pixel by pixel, against the mixture in NumPy."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any

import browser
import numpy as np
import pytest
from numpy.typing import NDArray

from focalgradient.display import Display
from focalgradient.live import FocusSeries, packed, page_script, page_shaders

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="elsewhere Chromium is not among what is set up")

SHAPE = (40, 61)
PAGE = """<!doctype html><canvas id="picture"></canvas><script>{script}
const SHADERS = {shaders}, FACTS = {facts}, views = {{}}, made = {{}};
async function begin() {{
  for (const [name, {{ gamma, series }}] of Object.entries(FACTS)) {{
    views[name] = new FocusView(document.createElement("canvas"), SHADERS, gamma);
    made[name] = await views[name].load(series);
  }}
  window.ready = true;
}}
function shown(name, focus) {{
  const view = views[name], gl = view.gl, size = view.canvas;
  if (focus.values) focus.values = Float32Array.from(focus.values);
  view.draw(made[name], focus);
  const pixels = new Uint8Array(4 * size.width * size.height);
  gl.readPixels(0, 0, size.width, size.height, gl.RGBA, gl.UNSIGNED_BYTE, pixels);
  return Array.from(pixels);
}}
begin().catch(error => {{ window.failed = String(error); }});
</script>"""


def series(white: float) -> FocusSeries:
    random = np.random.default_rng(3)
    planes = [(white * random.uniform(0, 1, (*SHAPE, 3)) ** 3).astype(np.float16) for _ in range(5)]
    return FocusSeries((-0.5, 0.0, 0.7, 1.5, 3.0), tuple(planes), np.ones(SHAPE), np.full((4, 2), np.nan))


CASES: dict[str, tuple[float, Display]] = {
    "8 bits": (1.0, Display()),
    "above white": (4.0, Display()),
    "gamma": (1.0, Display(gamma=2.2)),
}


@pytest.fixture(scope="module")
def page(tmp_path_factory: pytest.TempPathFactory) -> Any:
    folder = tmp_path_factory.mktemp("focus")
    facts = {
        name: {
            "gamma": None if display.gamma == "sRGB" else [display.gamma] * 3,
            "series": packed(series(white), srgb=display.gamma == "sRGB"),
        }
        for name, (white, display) in CASES.items()
    }
    path = folder / "page.html"
    path.write_text(
        PAGE.format(script=page_script(), shaders=json.dumps(page_shaders()), facts=json.dumps(facts)), "utf-8"
    )
    with browser.Browser() as chromium:
        chromium.open(Path(path), (400, 300))
        chromium.wait("window.ready || window.failed")
        assert chromium.js("window.failed || ''") == ""
        yield chromium


def shown(page: Any, name: str, focus: Any) -> NDArray[np.int64]:
    found = np.array(page.js(f"shown({json.dumps(name)}, {json.dumps(focus)})"))
    return found.reshape(*SHAPE, 4)[::-1, :, :3]


@pytest.mark.parametrize("name", CASES)
def test_the_page_shows_the_mixture_to_the_8_bit_step(page: Any, name: str) -> None:
    white, display = CASES[name]
    made = series(white)
    for focus in (-2.0, -0.5, -0.13, 0.0, 0.6, 1.5, 2.9, 7.0):
        assert np.abs(shown(page, name, focus) - made.encoded(focus, display)).max() <= 1, focus


def test_focus_varies_over_the_picture(page: Any) -> None:
    made = series(1.0)
    wanted = np.random.default_rng(5).uniform(-1, 4, SHAPE)
    given = {"values": wanted.ravel().tolist(), "width": SHAPE[1], "height": SHAPE[0]}
    assert np.abs(shown(page, "8 bits", given) - made.encoded(wanted)).max() <= 1
    spot = np.full((11, 11), 3.0)
    spot[3:8, 3:8] = 0.2
    given = {"values": spot.ravel().tolist(), "width": 11, "height": 11, "x": 20.5, "y": 30.5}
    wide = np.full(SHAPE, 3.0)
    wide[28:33, 18:23] = 0.2
    assert np.abs(shown(page, "8 bits", given) - made.encoded(wide)).max() <= 1
