"""Existing files of users with the names of a command's results, and files in unwanted formats."""

from __future__ import annotations

import contextlib
import io
import re
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from importlib.metadata import metadata
from pathlib import Path

import cv2
import numpy as np
from reruns import Lines
from scipy import ndimage

import focalgradient

__all__ = ["register"]

FOREIGN = b'{"mine": "notes of somebody else"}\n'
LENS = ("--f-number", "4", "--focal-length", "25", "--focus", "0.8", "--field", "6")
VIEWS = "[camera]\nfocal_length_mm = 25\npixel_pitch_um = 8\n" + "".join(
    f'[[view]]\nimage = "{name}.png"\nf_number = {stop}\nfocus_distance_m = 0.85\n'
    for name, stop in (("a", 16), ("b", 4))
)
FORMATS = (".bmp", ".webp", ".ppm", ".jp2", ".ras")
COMMAND = (sys.executable, "-c", "from focalgradient.cli import main; main()")

RUNS: dict[str, tuple[tuple[str, ...], tuple[str, ...]]] = {
    "depth": (("depth", "views.toml", "--out", "."), ("summary.json", "depth.png", "depth.npz")),
    "report": (("report", "ratings.csv", "--out", "."), ("report.html", "report.md", "rules.toml")),
    "blur": (("blur", "a.png", "far.npy", *LENS, "--out", "."), ("summary.json", "blurred-0.8m.png", "distance.npy")),
    "eye": (("eye", "plane", "--out", "."), ("summary.json", "views.png", "oscillation.mp4")),
    "power": (("power", "necker", "--subjects", "3", "--experiments", "2", "--out", "."), ("power.csv", "power.png")),
    "stream": (("stream", "a.avi", "--out", "d.avi", "--values", "v.npy"), ("d.avi", "d.json", "v.npy")),
    "stream --values": (("stream", "a.avi", "--out", "d.avi", "--values", "video.mkv"), ("video.mkv",)),
    "calibrate": (("calibrate", "targets.toml", "--out", "views.toml"), ("views.toml",)),
    "calibrate --sheet": (("calibrate", "--sheet", "A4", "--out", "sheet.pdf"), ("sheet.pdf",)),
}
"""Commands, and names of their results that are occupied by a user's file."""


@contextlib.contextmanager
def _folder() -> Iterator[Path]:
    """Yield a working folder with inputs of the commands."""
    with tempfile.TemporaryDirectory() as name, contextlib.chdir(name):
        for picture in "ab":
            rng = np.random.default_rng(1)
            wide = ndimage.gaussian_filter(rng.random((96, 96)), 1.0 if picture == "a" else 2.5)
            cv2.imwrite(f"{picture}.png", (255 * np.clip(wide, 0, 1)).astype(np.uint8))
        np.save("far.npy", np.full((96, 96), 1.5))
        Path("views.toml").write_text(VIEWS)
        targets = VIEWS.replace("focus_distance_m = 0.85", "distance_m = 1.0")
        Path("targets.toml").write_text(targets)
        Path("ratings.csv").write_text("participant,aperture,fixation,rating\n1,pinhole,nearest,1\n1,f/4,nearest,2\n")
        writer = cv2.VideoWriter("a.avi", cv2.VideoWriter.fourcc(*"MJPG"), 10, (96, 96))
        for number in range(8):
            writer.write(np.asarray(cv2.imread("ab"[number % 2] + ".png")))
        writer.release()
        yield Path(name)


def _replaced() -> str:
    replaced, tried = [], 0
    for name, (words, places) in RUNS.items():
        for place in places:
            with _folder():
                Path(place).write_bytes(FOREIGN if place != "views.toml" else VIEWS.encode())
                before = Path(place).read_bytes()
                subprocess.run([*COMMAND, *words], capture_output=True, timeout=300)
                tried += 1
                if Path(place).read_bytes() != before:
                    replaced.append(f"{name}: {place}")
    return f"{len(replaced)} of {tried} replaced" + (f" ({', '.join(replaced)})" if replaced else "")


def _interrupted() -> str:
    """Interrupt a demo after 6 s, while it renders its pictures."""
    with tempfile.TemporaryDirectory() as name:
        run = subprocess.Popen([*COMMAND, "demo", "--out", f"{name}/demo"], stderr=subprocess.PIPE, text=True)
        time.sleep(6.0)
        run.send_signal(signal.SIGINT)
        said = run.communicate()[1].strip()
        left = [entry.name for entry in Path(name).rglob("*")]
    return f"'{said.splitlines()[-1] if said else 'finished'}', {len(left)} files left"


def _formats() -> str:
    from focalgradient.photographs import read_photograph

    read = []
    with tempfile.TemporaryDirectory() as name, contextlib.redirect_stderr(io.StringIO()):
        for kind in FORMATS:
            path = Path(name, "a.png")
            pixels = np.random.default_rng(1).integers(20, 200, (32, 32, 3), np.uint8)
            path.write_bytes(cv2.imencode(kind, pixels)[1].tobytes())
            with contextlib.suppress(focalgradient.InputError):
                read_photograph(path)
                read.append(kind)
    return f"{len(read)} of {len(FORMATS)} read" + (f" ({', '.join(read)})" if read else "")


def _licences() -> str:
    """List extras with GPL packages, and whether README states this in their line."""
    readme = (Path(__file__).parents[1] / "README.md").read_text()
    found = []
    for extra, package in (("lab", "psychopy"), ("thresholds", "psignifit")):
        licence = str(metadata(package)["License"] or metadata(package)["License-Expression"])
        is_said = re.search(rf"`{extra}` \([^)]*GPL", readme) is not None
        found.append(f"{package} ({licence.strip()[:24]}): {'said' if is_said else 'not said'}")
    return "; ".join(found)


def register(table: Lines) -> None:
    """Add the lines to a table."""
    lines: list[tuple[str, str, str, Callable[[], str]]] = [
        ("1.10.1", "foreign files under the names of results", "19 of 20 replaced", _replaced),
        ("1.10.2", "`demo` interrupted", "'Interrupted: nothing was written.', 2 files left", _interrupted),
        ("1.11.1", "licences of extras in README", "psignifit: said; psychopy: not said", _licences),
        ("1.11.2", "images of other formats named a.png", f"6 of {len(FORMATS)} read", _formats),
    ]
    for number, what, before, measure in lines:
        table.line(number, what, before)(measure)
