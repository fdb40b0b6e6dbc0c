"""A screen that only the computer sees, keys pressed on it, and a small set of pictures: for the experiments."""

from __future__ import annotations

import hashlib
import json
import os
import platform
import signal
import struct
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image

psychopy_here = pytest.mark.skipif(
    (sys.platform, platform.machine()) != ("linux", "x86_64") or sys.version_info >= (3, 13),
    reason="elsewhere PsychoPy is not among the pinned packages",
)

PROGRAMS = Path(__file__).parents[2] / "experiments"
SIZE = (1024, 768)
APERTURES = ("pinhole", "f/22", "f/11", "f/5.6")

LONGEST = 480.0

LOOK = os.environ.get("FOCALGRADIENT_SCREENSHOTS")
"""A folder to keep what each screen looked like in."""

PAGES = frozenset({"instructions", "ready", "example", "break", "feedback", "thanks", "debriefing"})
"""Events of pages that the space bar leaves."""

HOOK = """
def mark(code, name, seconds):
    print("event", code, name, seconds, flush=True)
"""


def design(task: str, **settings: Any) -> str:
    """A design as TOML; of experiment 1 a short one, but for the settings given."""
    short = {"scenes": ["spheres-01"], "apertures": ["pinhole", "f/5.6"], "repetitions": 1, "longest_run": 4}
    short |= dict.fromkeys(("catch_trials", "practice_trials", "standard_every", "break_every"), 0)
    short |= dict.fromkeys(("mark_s", "picture_s", "standard_s", "blank_s", "pause_s"), 0.1)
    settings = {"task": task, **(short if task == "depthrating" else {}), **settings}
    return "".join(f"{name} = {json.dumps(value)}\n" for name, value in settings.items())


def session(folder: Path, text: str) -> list[object]:
    """Options of a session of participant 01 in a folder, by this design, with the pictures of the folder's set."""
    (folder / "design.toml").write_text(text)
    pictures = ["--stimuli", folder / "set"] if (folder / "set").exists() else []
    given = ["--data", folder / "data", "--uncalibrated", "--participant", "01", "--design", folder / "design.toml"]
    return [*given, *pictures]


class Headless:
    """An X server without a screen: what it shows is read from the memory that it draws in."""

    def __init__(self, folder: Path, size: tuple[int, int] = SIZE):
        self.folder = folder
        self.running: list[Running] = []
        folder.mkdir(parents=True)
        (folder / "home").mkdir()
        (folder / "markers.py").write_text(HOOK)
        read, write = os.pipe()
        self._server = subprocess.Popen(
            [*f"Xvfb -displayfd {write} -screen 0 {size[0]}x{size[1]}x24 -nolisten tcp -fbdir".split(), str(folder)],
            pass_fds=[write],
            stderr=subprocess.PIPE,
        )
        os.close(write)
        with os.fdopen(read) as pipe:
            number = pipe.readline().strip()
        assert number, "Xvfb did not start"
        self.environment = {
            **{key: value for key, value in os.environ.items() if not key.startswith(("XDG_", "PYTEST"))},
            "DISPLAY": f":{number}",
            "HOME": str(folder / "home"),
            "PYTHONUNBUFFERED": "1",
        }

    def close(self) -> None:
        for one in self.running:
            one.stop()
        self._server.terminate()
        self._server.communicate()

    def keys(self, *keys: str) -> None:
        """Press and release keys, one after the other."""
        self.xdotool("key", "--delay", "8", *keys)

    def press(self, key: str) -> None:
        self.xdotool("keydown", key)

    def release(self, key: str) -> None:
        self.xdotool("keyup", key)

    def click(self, x: int, y: int) -> None:
        """With the mouse, in pixels from the upper left."""
        self.xdotool("mousemove", str(x), str(y), "sleep", "0.05", "mousedown", "1", "sleep", "0.1", "mouseup", "1")

    def xdotool(self, *words: str) -> None:
        """Run xdotool on this screen."""
        subprocess.run(["xdotool", *words], env=self.environment, check=True)

    def pixels(self) -> NDArray[np.uint8]:
        """What the screen shows, H x W x 3."""
        content = (self.folder / "Xvfb_screen0").read_bytes()
        header = struct.unpack(">25I", content[:100])
        start, height, line, colours = header[0], header[5], header[12], header[19]
        data = np.frombuffer(content, np.uint8, height * line, start + 12 * colours).reshape(height, line // 4, 4)
        return data[:, : header[4], 2::-1]


@contextmanager
def headless(folder: Path, size: tuple[int, int] = SIZE) -> Iterator[Headless]:
    """An X server that is gone afterwards."""
    server = Headless(folder, size)
    try:
        yield server
    finally:
        server.close()


def keep(screen: Headless, name: str) -> None:
    """Keep what the screen shows, where that was asked for."""
    if LOOK:
        time.sleep(0.08)  # until what was drawn is shown
        Image.fromarray(screen.pixels()).save(Path(LOOK, f"{name}.png"))


class Running:
    """An experiment that runs, by its own program or by `focalgradient run`, and says its events."""

    def __init__(self, screen: Headless, program: str, *options: object):
        self.screen = screen
        self.hub: list[str] = []
        self.printed: list[str] = []
        file = PROGRAMS / f"{program}.py"
        command_line = ["-c", "from focalgradient.cli import main; main()", "run"]
        start = [str(file)] if file.exists() else [*command_line, *([] if program == "from-file" else [program])]
        command = [sys.executable, *start, *map(str, options)]
        command += ["--markers", str(screen.folder / "markers.py")]
        self._said = screen.folder / "errors.txt"
        with self._said.open("w") as errors:
            self.process = subprocess.Popen(
                command,
                env=screen.environment,
                stdout=subprocess.PIPE,
                stderr=errors,
                text=True,
                cwd=screen.folder,
                start_new_session=True,
            )
        # With all that it has started, as ioHub's own process, which would keep the pipe open.
        self._watch = threading.Timer(LONGEST, os.killpg, (self.process.pid, signal.SIGKILL))
        self._watch.daemon = True
        self._watch.start()
        screen.running.append(self)

    def events(self) -> Iterator[str]:
        """Names of the events, as they come."""
        assert self.process.stdout is not None
        for line in self.process.stdout:
            if line.startswith("event "):
                yield line.split()[2]
            elif line.startswith("hub "):
                self.hub.append(line[4:].strip())
            else:
                self.printed.append(line.strip())

    def answer(self, *question: str, code: int = 0, **meet: Callable[[], object]) -> list[str]:
        """Take part to the end: press these keys at questions, or call what meets an event; return all events."""
        came: list[str] = []
        for event in self.events():
            came.append(event)
            keep(self.screen, f"{self.screen.folder.parent.name}-{event.strip('?')}-{came.count(event)}")
            if event in meet:
                meet[event]()
            elif event == "question":
                self.screen.keys(*question)
            elif event in PAGES:
                self.screen.keys("space")
        assert self.end() == code, self.errors
        return came

    @property
    def errors(self) -> str:
        """What it has said on standard error."""
        return self._said.read_text()

    def journal(self) -> Path:
        """The one journal below the folder that it runs in."""
        return next(self.screen.folder.parent.rglob("sourcedata/**/*.jsonl"))

    def end(self) -> int:
        """Wait for the end, and let go."""
        self.process.communicate()
        self._watch.cancel()
        return self.process.returncode

    def stop(self) -> None:
        """End what a test that failed has left running: its pipe would be reported in another test."""
        if self.process.returncode is None:
            with suppress(ProcessLookupError):
                os.killpg(self.process.pid, signal.SIGKILL)
            self.end()


def make_set(folder: Path, scenes: Sequence[str], size: tuple[int, int] = (160, 121), **display: Any) -> None:
    """Make a set of pictures of noise, with all that a manifest says."""
    chance = np.random.default_rng(1)
    files: dict[str, str] = {}
    pictures: list[dict[str, Any]] = []
    width, height = size

    def wrote(name: str) -> str:
        files[name] = hashlib.sha256((folder / name).read_bytes()).hexdigest()
        return name

    for scene in scenes:
        (folder / scene).mkdir(parents=True)
        for aperture in APERTURES:
            for fixation in ("nearest", "farthest"):
                stem = f"{scene}/{aperture.replace('/', '')}" + ("" if aperture == "pinhole" else f"-{fixation}")
                if f"{stem}.png" not in files:
                    pixels = chance.integers(0, 256, (height, width, 3), dtype=np.uint8)
                    Image.fromarray(pixels).save(folder / f"{stem}.png")
                    np.save(folder / f"{stem}.npy", (pixels / 255).astype(np.float32))
                pictures.append(
                    {
                        "scene": scene,
                        "aperture": aperture,
                        "fixation": fixation,
                        "png": wrote(f"{stem}.png"),
                        "linear": wrote(f"{stem}.npy"),
                        "focus_m": 1.0,
                        "aperture_mm": 0.0 if aperture == "pinhole" else 50 / float(aperture[2:]),
                        "blur_px": [0.0, 3.0],
                        "blur_arcmin": [0.0, 3.0],
                    }
                )
        np.save(folder / scene / "depth.npy", np.ones((height, width), np.float32))
        wrote(f"{scene}/depth.npy")
    ends = {
        "nearest": {"name": "nearest", "distance_m": 1.0, "position_px": [40.0, 90.0]},
        "farthest": {"name": "farthest", "distance_m": 3.0, "position_px": [120.0, 30.0]},
    }
    manifest = {
        "set": "depth-rating",
        "seed": 1,
        "versions": {},
        "parameters": {"focal_length_mm": 50},
        "display": {
            "kind": "sRGB",
            "gamma": "sRGB",
            "white_cd_m2": 100.0,
            "distance_m": 0.57,
            "pixel_pitch_mm": 0.265,
            "pixels_per_degree": 37.5,
            "size_px": [1024, 768],
            "size_deg": [27.0, 20.0],
            "dither": False,
            **display,
        },
        "scenes": {scene: {"seed": 1, "depth": f"{scene}/depth.npy", **ends} for scene in scenes},
        "pictures": pictures,
        "controls": {},
        "files": files,
    }
    (folder / "manifest.json").write_text(json.dumps(manifest))
