"""A stereoscope: alignment by nonius lines, a picture for each eye, the gamma of each, one window and two screens."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from headless import PAGES, PROGRAMS, Headless, Running, design, headless, keep, psychopy_here, session

from focalgradient.dataset import validate
from focalgradient.display import Display
from focalgradient.errors import InputError
from focalgradient.lab import described_experiment, run
from focalgradient.lab.devices.stereoscope import Stereoscope, read_stereoscope, store_offset
from focalgradient.tasks import task_named


def test_settings_are_read_and_only_the_offset_is_rewritten(tmp_path: Path) -> None:
    path = tmp_path / "stereoscope.toml"
    path.write_text('# ours\nlayout = "screens"\nscreens = [1, 2]\nmirrored = true\n')
    assert read_stereoscope(path) == Stereoscope(layout="screens", screens=(1, 2), mirrored=True)
    for offset in ((3, -4), (0, 12)):
        store_offset(path, offset)
        assert read_stereoscope(path) == Stereoscope(layout="screens", screens=(1, 2), mirrored=True, offset_px=offset)
    assert path.read_text().count("offset_px") == 1
    assert "# ours" in path.read_text()


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ('layout = "mirrors"', "layout"),
        ("screens = [1, 1]", "screens"),
        ("offset_px = [1.5, 0]", "offset_px"),
        ('monitors = ["left"]', "monitors"),
        ("gamma = [2.2, 2.0]", "gamma"),
    ],
)
def test_wrong_settings_are_refused_by_name(text: str, said: str, tmp_path: Path) -> None:
    path = tmp_path / "stereoscope.toml"
    path.write_text(text)
    with pytest.raises(InputError, match=said):
        read_stereoscope(path)


@pytest.mark.parametrize(("width", "windowed", "part"), [(1366, False, 682), (1366, True, 682), (1024, False, 512)])
def test_an_eye_has_an_even_half(width: int, windowed: bool, part: int) -> None:
    assert Stereoscope().part((width, 768), windowed) == (part, 768)
    assert Stereoscope(layout="screens").part((width, 768), windowed=False) == (width, 768)


PAIR = """
import json, sys
import numpy as np
from focalgradient.display import Display
from focalgradient.lab.screen import Screen
from focalgradient.lab.devices.stereoscope import Stereoscope
from focalgradient.live import FocusSeries

chance = np.random.default_rng(1)
displays = (Display((512, 768), gamma=2.2), Display((512, 768), gamma=1.6))
light = [chance.uniform(0, 1, (120, 200)), chance.uniform(0, 1, (121, 201))]
found = {}
for name, setup in json.loads(sys.argv[1]).items():
    setup = Stereoscope(mirrored=setup["mirrored"], offset_px=tuple(setup["offset_px"]))
    screen = Screen(0, (1024, 768), displays[0], stereoscope=(setup, displays))

    def back():
        screen.window.getMovieFrame(buffer="back")
        shown = np.asarray(screen.window.movieFrames.pop().convert("RGB")).astype(int)
        screen.window.clearBuffer()
        return shown

    for _ in range(3):  # each flip resets the viewport
        screen.frame()
    pair = screen.pair(*light)
    pair.draw()
    shown = back()
    placed = []
    for eye, one in enumerate(light):
        want = displays[eye].encode(one)[:, :: -1 if setup.mirrored else 1]
        half = shown[:, 512 * eye : 512 * eye + 512, 0]
        rows, columns = np.nonzero(half)
        top, left = rows.min(), columns.min()
        placed.append([int(left), int(top)])
        height, width = want.shape
        found[f"{name} {eye}"] = int(np.abs(half[top : top + height, left : left + width] - want).max())
    found[f"{name} places"] = placed
    # The same series to both eyes, by each one's gamma.
    grey = FocusSeries((0.0,), (np.full((80, 80, 3), 0.25, np.float16),), np.ones((80, 80)), np.empty((0, 2)))
    screen.refocused(grey).draw()
    shown = back()
    found[f"{name} live"] = [int(shown[384 - setup.offset_px[1] * eye, 256 + 512 * eye, 0]) for eye in (0, 1)]
    screen.text("x", height=0.1).draw()
    shown = back()
    inked = [np.argwhere(shown[:, 512 * eye : 512 * eye + 512, 0] > 100) for eye in (0, 1)]
    found[f"{name} text"] = [int(one) for one in inked[1].min(0)[::-1] - inked[0].min(0)[::-1]]
    screen.close()
print(json.dumps(found))
"""


@psychopy_here
@pytest.mark.slow
def test_each_eye_has_its_picture_its_gamma_and_its_place_to_the_pixel(tmp_path: Path) -> None:
    setups = {
        "straight": {"mirrored": False, "offset_px": [0, 0]},
        "moved": {"mirrored": False, "offset_px": [5, 2]},
        "mirrored": {"mirrored": True, "offset_px": [5, -3]},
    }
    with headless(tmp_path / "x") as screen:
        command = [sys.executable, "-c", PAIR, json.dumps(setups)]
        done = subprocess.run(command, env=screen.environment, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    found = json.loads(done.stdout.splitlines()[-1])
    places = {name: np.array(found[f"{name} places"]) for name in setups}
    for name, setup in setups.items():
        assert found[f"{name} 0"] == found[f"{name} 1"] == 0, "exact to the 8-bit step"
        offset: Any = setup["offset_px"]
        across, up = offset
        seen = [-across if setup["mirrored"] else across, -up]  # the picture's rows go down
        assert found[f"{name} text"] == seen
        assert np.all(places[name][0] == places["straight"][0])
        assert np.abs(places[name][1] - places["straight"][1] - seen).max() <= setup["mirrored"]  # 201 px: odd
        wanted = [round(255 * 0.25 ** (1 / gamma)) for gamma in (2.2, 1.6)]
        assert np.abs(np.array(found[f"{name} live"]) - wanted).max() <= 1
    assert places["straight"][0].tolist() == [256 - 100, 384 - 60]
    assert Display(gamma=2.2).encode(np.array(0.25)) != Display(gamma=1.6).encode(np.array(0.25))


def drawn(screen: Headless, eye: int) -> np.ndarray:
    """Rows and columns of an eye's half near its middle that are black, as far as the nonius lines reach."""
    half = screen.pixels()[384 - 92 : 384 + 92, 512 * eye + 256 - 92 : 512 * eye + 256 + 92, 0]
    return np.argwhere(half < 60) - 92


@psychopy_here
@pytest.mark.slow
def test_alignment_by_keys_is_stored_and_recorded(tmp_path: Path) -> None:
    settings = tmp_path / "stereoscope.toml"
    settings.write_text('layout = "halves"\noffset_px = [4, 0]\n')
    short = {"language": "de", "ask": [], "repetitions": 1, "practice_trials": 0, "depths_cm": [2.0]}
    given = session(tmp_path, design("stereoblur", **short))
    with headless(tmp_path / "x") as screen:
        running = Running(screen, "from-file", str(PROGRAMS / "stereo_blur.py"), *given, "--stereoscope", settings)
        events: list[str] = []
        for event in running.events():
            events.append(event)
            keep(screen, f"stereo-{event.strip('?')}-{events.count(event)}")
            if event == "align":
                before = [drawn(screen, eye).mean(0) for eye in (0, 1)]
                screen.keys("Left", "Left", "Left", "Up", "Up", "Up", "Down")
                screen.xdotool("sleep", "0.3")
                after = [drawn(screen, eye).mean(0) for eye in (0, 1)]
                assert np.all(after[0] == before[0])
                assert np.allclose(after[1] - before[1], [-2, -3], atol=0.01)  # up, left
                screen.keys("Return")
            elif event == "question":
                screen.keys("Left")
                screen.xdotool("sleep", "0.1")
                screen.keys("Return")
            elif event == "picture":
                pixels = screen.pixels()[100:600].astype(int)
                assert min(pixels[:, :512].std(), pixels[:, 512:].std()) > 10
                assert np.all(pixels[..., 0] == pixels[..., 1]), "grey to each eye, no anaglyph"
                assert not np.array_equal(pixels[:, :512], pixels[:, 512:])
            elif event == "instructions":
                between = screen.pixels()[100:600, 504:520]  # where the halves meet
                assert np.ptp(between) == 0, "text reaches over the border of an eye's half"
                screen.keys("space")
            elif event in PAGES:
                screen.keys("space")
        assert running.end() == 0, running.errors
    assert events.count("picture") == 3
    assert read_stereoscope(settings).offset_px == (1, 2)
    task_named(str(PROGRAMS / "stereo_blur.py"))
    assert validate(tmp_path / "data").problems == ()
    (sidecar,) = (tmp_path / "data").rglob("*_beh.json")
    stated = json.loads(sidecar.read_text())["Sittings"][0]["Apparatus"]["stereoscope"]
    assert (stated["offset_px"], stated["layout"], stated["gamma"]) == (
        [1, 2],
        "halves",
        {"left": "sRGB", "right": "sRGB"},
    )


@psychopy_here
@pytest.mark.parametrize("more", [["--pointer"], ["--stereoscope", "missing.toml"]])
def test_what_does_not_go_with_a_stereoscope_is_refused_before_the_window(
    more: list[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("stereoscope.toml").write_text("mirrored = true\n")
    given = ["--uncalibrated", "--participant", "01", "--stereoscope", "stereoscope.toml", *more]
    assert run(described_experiment(task_named(str(PROGRAMS / "stereo_blur.py"))), given) == 2
    said = capsys.readouterr().err
    assert said.count("\n") == 1
    assert more[-1] in said
