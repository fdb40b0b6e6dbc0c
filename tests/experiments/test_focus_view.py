"""What the shader of a focus series draws in a real window, pixel by pixel, against the mixture in NumPy."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pytest
from headless import headless, psychopy_here

PROGRAM = """
import json
import numpy as np
from psychopy import logging, visual
logging.console.setLevel(logging.CRITICAL)
from focalgradient.display import Display
from focalgradient.errors import InputError
from focalgradient.lab.focus_view import FocusView
from focalgradient.live import FocusSeries

window = visual.Window((320, 200), units="pix", color=-1, checkTiming=False, allowGUI=False)
random = np.random.default_rng(1)
found = {}

def shown(view):
    text = visual.TextStim(window, "x", pos=(150, 90))
    text.draw()
    view.draw()
    text.draw()  # PsychoPy draws on as before
    window.getMovieFrame(buffer="back")
    picture = np.asarray(window.movieFrames.pop().convert("RGB")).astype(int)
    window.clearBuffer()
    assert picture[:, 290:].max() > 100
    return picture

def series(shape, white, planes=4):
    light = [(white * random.uniform(0, 1, (*shape, 3)) ** 3).astype(np.float16) for _ in range(planes)]
    return FocusSeries(tuple(np.arange(planes) ** 1.5), tuple(light), np.ones(shape), np.full((planes - 1, 2), np.nan))

for name, white, gamma in (("sRGB", 1, "sRGB"), ("gamma", 1, 2.2), ("guns", 1, (1.8, 2.2, 2.4)), ("bright", 3, "sRGB")):
    display, made = Display(gamma=gamma), series((150, 261), white)
    view = FocusView(window, made, display)
    wanted = [0.0, 0.37, 1.0, 2.2, 5.1, 9.0, random.uniform(-1, 6, made.distance.shape)]
    worst = []
    for focus in wanted:
        view.focus = focus
        worst.append(int(np.abs(shown(view)[25:175, 30:291] - made.encoded(focus, display)).max()))
    found[name] = max(worst)
    view.close()

made = series((100, 100), 1)
view = FocusView(window, made, Display(), pos=(-40, 20))
spot = np.full((41, 41), 3.0)
spot[10:31, 10:31] = 0.5
view.focus = spot
view.place_map(70, 30)  # the middle of the map, on column 70 and row 30 of the picture
wide = np.full((100, 100), 3.0)
wide[20:41, 60:81] = 0.5
found["moved map"] = int(np.abs(shown(view)[30:130, 70:170] - made.encoded(wide)).max())
one = series((100, 100), 1, planes=1)
view = FocusView(window, one, Display())
found["one plane"] = int(np.abs(shown(view)[50:150, 110:210] - one.encoded(0.0)).max())
try:
    FocusView(window, made, Display(dither=True))
except InputError as error:
    found["dither"] = str(error)
print(json.dumps(found))
"""


@psychopy_here
@pytest.mark.slow
def test_the_shader_shows_the_mixture_to_the_8_bit_step(tmp_path: Path) -> None:
    with headless(tmp_path / "x") as screen:
        done = subprocess.run([sys.executable, "-c", PROGRAM], env=screen.environment, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    found = json.loads(done.stdout.splitlines()[-1])
    assert "dither=True" in found.pop("dither")
    assert set(found) == {"sRGB", "gamma", "guns", "bright", "moved map", "one plane"}
    assert all(apart <= 1 for apart in found.values()), found
