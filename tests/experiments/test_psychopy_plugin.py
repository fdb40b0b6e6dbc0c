"""The plugin for PsychoPy, from its wheel: Coder, Builder's components, and an experiment that the Builder compiled."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import zipfile
from collections.abc import Iterator
from importlib.util import find_spec
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import cv2
import numpy as np
import pytest
from headless import LOOK, Headless, headless, psychopy_here
from PIL import Image

PLUGIN = Path(__file__).parents[2] / "plugins" / "psychopy"

CODER = """
import json
import time
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
import cv2
import numpy as np
from psychopy import logging, monitors, plugins, visual
logging.console.setLevel(logging.CRITICAL)
plugins.activatePlugins()
from focalgradient.display import Display
from focalgradient.errors import InputError
from focalgradient import Lens
from focalgradient.render import blur_picture
from focalgradient.srgb import srgb_to_linear
from headless import Headless

monitor = monitors.Monitor("of the test", width=30.0, distance=57.0)
monitor.setSizePix((400, 300))
found = {}

def window(**how):
    return visual.Window((400, 300), monitor=monitor, color=-1, checkTiming=False, allowGUI=False, **how)

def shown(win):
    win.getMovieFrame(buffer="back")
    picture = np.asarray(win.movieFrames.pop().convert("RGB")).astype(int)
    win.clearBuffer()
    return picture

def apart(one, other):
    return int(np.abs(one - np.asarray(other, int)).max())

win = window(units="height")
random = np.random.default_rng(1)
values = cv2.resize(random.integers(0, 256, (30, 40, 3), dtype=np.uint8), (161, 120))
metres = np.where(np.arange(161) < 80, 0.7, 1.6) * np.ones((120, 1))
degree = 57.0 * np.tan(np.radians(1)) * 400 / 30
stim = visual.FocalGradientStim(win, values, metres, pupilMM=4, focus=0.8, pos=(1, -0.5), name="picture")
left, top = round((400 - 161) / 2 + 1e-6 + degree), round((300 - 120) / 2 + 0.5 * degree)
place = np.s_[top : top + 120, left : left + 161]
light = srgb_to_linear(values / 255)
angle = 0.30 / 400 / 0.57
for dioptres in (0.8, 1.1, 1.4):
    stim.setFocus(dioptres, log=False)
    stim.draw()
    seen = shown(win)
    found[f"series {dioptres}"] = apart(seen[place], stim.series.encoded(dioptres))
    outside = seen.copy()
    outside[place] = 0
    found[f"outside {dioptres}"] = int(outside.max())
    # The picture blurred anew, by no series: within the series' bound of 3 steps, and a step of rounding.
    blurred = blur_picture(light, metres, Lens(0.02, 5.0, 1 / dioptres), pixel_angle=angle)
    found[f"blurred {dioptres}"] = apart(seen[place], Display().encode(blurred)) - 3
log = logging.LogFile("beyond.txt", level=logging.WARNING)
stim.setFocus(1 / 0.7 + 0.1, log=False)
logging.flush()
found["focus beyond the planes not logged"] = 2 * int("lies beyond the planes" not in Path("beyond.txt").read_text())
stim.focus = 1 / 0.7
stim.draw()
found["sharp where in focus"] = apart(shown(win)[place][:, :40], values[:, :40])

stim.setAutoDraw(True)
stim.setFocus(0.9)
win.flip()
time.sleep(0.2)
screen = np.asarray(Headless.pixels(SimpleNamespace(folder=Path("."))), int)
found["autodraw"] = min(
    apart(screen[y : y + 300, x : x + 400][place], stim.series.encoded(0.9)) for x, y in ((312, 234), (0, 0))
)
stim.setAutoDraw(False)
win.flip()
stim.pos = (0, 0)
stim.focus = np.full((120, 161), 1.2)
stim.draw()
found["map"] = apart(shown(win)[90:210, 120:281], stim.series.encoded(1.2))
stim.setPupilMM(2)
stim.setFocus(1.4)
stim.draw()
found["pupil"] = apart(shown(win)[90:210, 120:281], stim.series.encoded(1.4))

half = visual.FocalGradientStim(win, "picture.png", "distance.npy", size=2.0)
half.draw()
found["sized"] = apart(shown(win).max(axis=(0, 2)).nonzero()[0].size, round(2 * degree))
half.series.save("kept")
again = visual.FocalGradientStim(win, "kept")
again.draw()
picture = shown(win)
half.draw()
found["folder"] = apart(picture, shown(win))
found["pupil of a folder stated"] = 2 * int("pupilMM" in str(again) or "pupilMM" not in str(half))
log = logging.LogFile("unset.txt", level=logging.WARNING)
unset = visual.FocalGradientStim(win, "kept", focus=9.0)
logging.flush()
found["focus logged before it is drawn"] = 2 * int("lies beyond the planes" in Path("unset.txt").read_text())
unset.draw()
win.clearBuffer()
logging.flush()
found["focus not logged when drawn"] = 2 * int("lies beyond the planes" not in Path("unset.txt").read_text())
log = logging.LogFile("angle.txt", level=logging.WARNING)
visual.FocalGradientStim(win, "kept").prepare()
logging.flush()
found["same angle logged"] = 2 * int("degrees wide" in Path("angle.txt").read_text())
replace(half.series, pixel_angle=2 * angle).save("wide")
visual.FocalGradientStim(win, "wide").prepare()
logging.flush()
found["another angle not logged"] = 2 * int("wrong by a factor of 0.5" not in Path("angle.txt").read_text())

cube = visual.NeckerStim(win, "rigid", strengthMM=4, phase=0.1, size=4, lineWidthDeg=0.3)
cube.draw()
height, width = cube.pixels.shape
seen = shown(win)
found["cube"] = apart(seen[150 - height // 2 :][:height, 200 - width // 2 :][:, :width, 0], cube.pixels)
np.save("cube.npy", seen)
cube.setPhase(0.2, log=False)
cube.draw()
found["cube turns"] = 2 * int(apart(shown(win), seen) < 100)
cube.phase = 0.35  # the picture repeats after a quarter turn
cube.draw()
found["cube repeats"] = apart(shown(win), seen)

refused = {}
for name, make in {
    "depth": lambda: visual.FocalGradientStim(win, values),
    "shape": lambda: visual.FocalGradientStim(win, values, np.ones((3, 3))),
    "focus": lambda: stim.setFocus("near"),
    "pupil": lambda: visual.FocalGradientStim(win, values, 1.0, pupilMM=-1),
    "gradient": lambda: cube.setGradient("soft"),
    "direction": lambda: visual.NeckerStim(win, direction="up"),
    "size": lambda: visual.NeckerStim(win, size=-1),
}.items():
    try:
        make()
    except InputError as error:
        refused[name] = str(error)

# One window for each eye, as before a mirror stereoscope; and the buffer of an eye. This screen has no second one.
other = window()
eyes = [visual.FocalGradientStim(one, values, metres, focus=focus) for one, focus in ((win, 0.8), (other, 1.2))]
for eye in eyes:
    eye.draw()
for eye, focus in zip(eyes, (0.8, 1.2)):
    eye.win.backend.setCurrent()
    found[f"eye {focus}"] = apart(shown(eye.win)[90:210, 120:281], eye.series.encoded(focus))
try:
    eyes[0].draw(other)
except InputError as error:
    refused["window"] = str(error)
other.close()
win.backend.setCurrent()
win.setBuffer("left")
eyes[0].draw()
found["left buffer"] = apart(shown(win)[90:210, 120:281], eyes[0].series.encoded(0.8))
win.close()

linear = window()
linear.useNativeGamma = False  # as a monitor with gamma sets it; this screen has no table for it
stim = visual.FocalGradientStim(linear, values, 1.0, focus=1.0)
stim.draw()
found["linearised"] = apart(shown(linear)[90:210, 120:281], np.rint(255 * light))
linear.close()

monitor.setWidth(None)
bare = window()
try:
    visual.NeckerStim(bare)
except InputError as error:
    refused["monitor"] = str(error)
print(json.dumps([found, refused]))
"""

LEFT_OUT = """
import sys
from unittest.mock import MagicMock

for name in {names}:  # what `tool.uv.override-dependencies` leaves out of PsychoPy, and a compiled experiment imports
    sys.modules[name] = MagicMock()
"""


BUILD = """
import sys
from psychopy import experiment, plugins
plugins.activatePlugins()
from psychopy.experiment.components import getAllComponents
from psychopy.experiment.components.code import CodeComponent
from psychopy.experiment.loops import TrialHandler

kinds = getAllComponents(fetchIcons=False)
made = experiment.Experiment()
made.settings.params["Show info dlg"].val = False
made.settings.params["Full-screen window"].val = False
made.settings.params["Window size (pixels)"].val = "(640, 480)"
made.settings.params["Units"].val = "height"
made.settings.params["Monitor"].val = "of the test"
made.settings.params["color"].val = "$[-1, -1, -1]"
made.settings.params["Save log file"].val = False
routine = made.addRoutine("trial")
made.flow.addRoutine(routine, 0)
loop = TrialHandler(made, name="trials", conditionsFile="conditions.csv", nReps=1, loopType="sequential")
made.flow.addLoop(loop, 0, 1)
picture = kinds["FocalGradientComponent"](
    made, "trial", name="picture", image="$file", distance="$depth", focus="$0.7 + t", folder="", stopVal=2.0,
    pos="(-3, 0)",
)
picture.params["image"].updates = picture.params["distance"].updates = "set every repeat"
picture.params["focus"].updates = "set every frame"
cube = kinds["NeckerComponent"](made, "trial", name="cube", edgeDeg=3, stopVal=2.0, pos="(5, 0)")
look = CodeComponent(made, "trial", name="look")
look.params["Each Frame"].val = (
    "if frameN == 5:\\n"
    "    print('frame', picture.focus, cube.phase, cube.status, flush=True)\\n"
    "if frameN == 12:\\n"
    "    import shutil; shutil.copy('Xvfb_screen0', f'seen-{trials.thisN}/Xvfb_screen0')\\n"
)
routine += [picture, cube, look]
made.saveToXML("made.psyexp")

read = experiment.Experiment()
read.loadFromXML("made.psyexp")
code = read.writeScript(target="PsychoPy")
open("compiled.py", "w", encoding="utf-8").write(code)
"""


@pytest.fixture(scope="module")
def plugin(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Headless]:
    """A screen, and a Python that has the plugin's wheel: nothing is fetched."""
    folder = tmp_path_factory.mktemp("plugin")
    pip = [sys.executable, "-m", "pip", "--disable-pip-version-check", "wheel", "-q", "--no-deps", "--no-index"]
    subprocess.run([*pip, "--no-build-isolation", "-w", folder, PLUGIN], check=True)
    with zipfile.ZipFile(next(folder.glob("*.whl"))) as wheel:
        wheel.extractall(folder / "site")
    with headless(folder / "x", (1024, 768)) as screen:
        paths = [str(folder / "site"), str(Path(__file__).parent), *filter(None, [os.environ.get("PYTHONPATH")])]
        missing = [name for name in ("soundfile", "sounddevice", "esprima") if find_spec(name) is None]
        (folder / "site" / "sitecustomize.py").write_text(LEFT_OUT.format(names=missing))
        screen.environment["PYTHONPATH"] = os.pathsep.join(paths)
        random = np.random.default_rng(2)
        values = cv2.resize(random.integers(0, 256, (30, 40, 3), dtype=np.uint8), (160, 120))
        cv2.imwrite(str(screen.folder / "picture.png"), values)
        np.save(screen.folder / "distance.npy", np.where(np.arange(160) < 80, 0.7, 1.4) * np.ones((120, 1)))
        np.save(screen.folder / "flat.npy", np.ones((120, 160)))
        yield screen


def ran(screen: Headless, *command: str | Path) -> str:
    done = subprocess.run(
        [sys.executable, *command], env=screen.environment, cwd=screen.folder, capture_output=True, text=True
    )
    assert done.returncode == 0, done.stdout[-2000:] + done.stderr[-3000:]
    return done.stdout


@psychopy_here
@pytest.mark.slow
def test_coder_shows_the_stimulus_to_the_8_bit_step(plugin: Headless) -> None:
    found, refused = json.loads(ran(plugin, "-c", CODER).splitlines()[-1])
    assert {name: value for name, value in found.items() if value > 1} == {}
    assert len(found) == 28
    expected = {
        "depth": "depth is missing",
        "shape": "(3, 3)",
        "focus": "'near'",
        "pupil": "pupilMM is -1",
        "gradient": "'soft'",
        "direction": "'up'",
        "size": "size",
        "window": "another window",
        "monitor": "Monitor Center",
    }
    assert set(refused) == set(expected)
    assert all(expected[name] in said for name, said in refused.items()), refused


@psychopy_here
@pytest.mark.slow
def test_a_compiled_experiment_runs(plugin: Headless) -> None:
    (plugin.folder / "conditions.csv").write_text("file,depth\npicture.png,distance.npy\npicture.png,flat.npy\n")
    monitor = "from psychopy import monitors; m = monitors.Monitor('of the test', width=30, distance=57);"
    ran(plugin, "-c", f"{monitor} m.setSizePix((640, 480)); m.save()")
    ran(plugin, "-c", BUILD)
    for number in (0, 1):
        (plugin.folder / f"seen-{number}").mkdir()
    compiled = (plugin.folder / "compiled.py").read_text()
    assert "picture.setFocus(0.7 + t, log=False)" in compiled
    assert "if picture.prepare():" in compiled
    said = ran(plugin, "compiled.py")
    rows: list[Any] = [line.split()[1:] for line in said.splitlines() if line.startswith("frame")]
    assert len(rows) == 2
    for focus, phase, _ in rows:
        assert 0.7 < float(focus) < 2.7
        assert float(phase) == pytest.approx((float(focus) - 0.7) * 0.125, rel=0.2)
    for number in (0, 1):
        seen = Headless.pixels(SimpleNamespace(folder=plugin.folder / f"seen-{number}"))  # type: ignore[arg-type]
        if LOOK:
            Image.fromarray(seen).save(Path(LOOK, f"builder-{number}.png"))
        window = seen[(768 - 480) // 2 :][:480, (1024 - 640) // 2 :][:, :640]
        assert window[190:290, 180:240].std() > 20  # the picture, 3 degrees to the left
        assert window[:, 400:].max() > 100  # the cube
