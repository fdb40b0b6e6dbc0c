"""Eye trackers by name: each is started against what answers as its program does, and refused in words without it."""

from __future__ import annotations

import importlib.util
import json
import subprocess
import sys
from pathlib import Path

import pytest
from headless import SIZE, headless, psychopy_here
from stand_ins import Gazepoint, PupilCapture

from focalgradient.errors import InputError
from focalgradient.lab.devices import trackers
from focalgradient.lab.devices.trackers import TRACKERS, check_answers, tracker_settings

pytestmark = psychopy_here

HOST = "127.0.0.2"
"""Another address of this computer: at 127.0.0.1 Gazepoint's package takes the time of Windows for its own."""

PLACE = (0.75, 0.25)
"""Where the stand-ins look, from the screen's upper left corner."""

START = """
import json, sys, time
from focalgradient.display import Display
from focalgradient.lab import screen as module
from focalgradient.lab.gaze import open_gaze
from focalgradient.lab.devices.trackers import tracker_settings

chosen = tracker_settings("tracker", sys.argv[1])
screen = module.Screen(0, None, Display((1024, 768), 0.000265, 0.57))
gaze = open_gaze(screen, chosen)
try:
    if "pupil" in chosen[0]:
        gaze.calibrate()
    gaze.samples()
    begun = screen.now()
    time.sleep(0.6)
    samples, last, ended = gaze.samples(), gaze.sample(), screen.now()
    print("FOUND", json.dumps([begun, ended, samples, last]), flush=True)
finally:
    gaze.close()
    screen.close()
"""


Found = tuple[float, float, list[list[float]], list[float]]


def started(folder: Path, kind: str, settings: dict[str, object]) -> Found:
    """Begin and end of a recording, its samples, and the last one, of a tracker in a window of its own."""
    (folder / "tracker.json").write_text(json.dumps({TRACKERS[kind].iohub: settings}))
    with headless(folder / "x", SIZE) as screen:
        command = [sys.executable, "-c", START, str(folder / "tracker.json")]
        run = subprocess.run(command, env=screen.environment, capture_output=True, text=True, timeout=120, cwd=folder)
    line = next((line for line in run.stdout.splitlines() if line.startswith("FOUND ")), None)
    assert line, run.stderr[-2000:]
    begun, ended, samples, last = json.loads(line.removeprefix("FOUND "))
    return begun, ended, samples, last


def check_samples(found: Found, pupil: float) -> None:
    begun, ended, samples, last = found
    assert len(samples) > 20  # 36 at 60 Hz
    for x, y, time, size in samples:
        assert (x, y) == pytest.approx(((PLACE[0] - 0.5) * SIZE[0], (0.5 - PLACE[1]) * SIZE[1]), abs=1.5)
        assert size == pytest.approx(pupil)
        assert begun - 0.1 < time < ended + 0.1
    assert last[:2] == pytest.approx(samples[-1][:2])


@pytest.mark.slow
def test_gazepoint_starts_and_its_samples_have_place_time_and_pupil(tmp_path: Path) -> None:
    pytest.importorskip("psychopy_eyetracker_gazepoint")
    program = Gazepoint(HOST, PLACE)
    settings = {"network_settings": {"ip_address": HOST, "port": program.port}}
    check_samples(started(tmp_path, "gazepoint", settings), 20.5)
    assert [line for line in program.asked if "ENABLE_SEND_DATA" in line][
        -1
    ] == '<SET ID="ENABLE_SEND_DATA" STATE="0" />'


@pytest.mark.slow
def test_pupil_core_starts_is_calibrated_and_its_samples_have_place_time_and_pupil(tmp_path: Path) -> None:
    pytest.importorskip("psychopy_eyetracker_pupil_labs")  # its metadata do not allow it beside NumPy 2
    program = PupilCapture(HOST, (PLACE[0], 1 - PLACE[1]))  # whose places count from the lower left
    settings = {"runtime_settings": {"pupil_remote": {"ip_address": HOST, "port": program.port, "timeout_ms": 2000}}}
    check_samples(started(tmp_path, "pupil-core", settings), 40.0)
    assert {"SUB_PORT", "C", "R", "r"} <= {*program.asked}


@pytest.mark.slow
@pytest.mark.parametrize(
    ("kind", "sentence"),
    [
        ("gazepoint", "does not respond at 127.0.0.1:4242: start Gazepoint Control on the computer at that address"),
        ("pupil-core", "does not respond at 127.0.0.1:50020: start Pupil Capture with its plugin Network API"),
        ("eyelink", "does not respond at 100.1.1.1: switch the Host PC on, connect its cable"),
        ("tobii", "does not respond: switch it on, connect it, and see that Tobii Pro Eye Tracker Manager finds it"),
    ],
)
def test_without_the_device_one_sentence_has_its_remedy(
    kind: str, sentence: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """With its package there, whether or not it is installed here."""
    real = importlib.util.find_spec
    mine = {*TRACKERS[kind].needs}
    monkeypatch.setattr(trackers.importlib.util, "find_spec", lambda name: real("json") if name in mine else real(name))
    with pytest.raises(InputError) as error:
        check_answers(tracker_settings("tracker", kind)[0], object())
    assert sentence in str(error.value)
    assert "\n" not in str(error.value)


@pytest.mark.parametrize("kind", TRACKERS)
def test_without_its_package_one_sentence_says_how_it_is_installed(kind: str, monkeypatch: pytest.MonkeyPatch) -> None:
    real = importlib.util.find_spec
    mine = TRACKERS[kind].needs[-1]
    monkeypatch.setattr(trackers.importlib.util, "find_spec", lambda name: None if name == mine else real(name))
    with pytest.raises(InputError) as error:
        tracker_settings("tracker", kind)
    assert mine in str(error.value)
    assert "pip install" in str(error.value)


def test_a_name_that_is_none_and_an_address_that_is_none_are_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="must be gazepoint, eyelink, pupil-core, tobii or a JSON file"):
        tracker_settings("tracker", "eyelunk")
    pytest.importorskip("psychopy_eyetracker_gazepoint")
    file = tmp_path / "mine.json"
    file.write_text(json.dumps({TRACKERS["gazepoint"].iohub: {"network_settings": {"port": "x"}}}))
    with pytest.raises(InputError, match="port 'x', but they must be a text and a whole number"):
        tracker_settings("tracker", file)
