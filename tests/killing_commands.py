"""Every long command killed at random moments, and given full disks: `python tests/killing_commands.py [TIMES]`.

Each command is killed TIMES times (30) by each of three signals, and stopped by each of several limits on the size of
a file, as by a full disk, and by a fault at each of the first moves of a finished file to its place. After each, what
stands under its own name is whole, a summary stands only beside all that it belongs to, a signal that can be caught
leaves no litter and says in one line what is so, no process is left, and in the end the same command finishes and
leaves no litter either. `--only NAME` tries one command.
"""

from __future__ import annotations

import argparse
import json
import random
import shutil
import signal
import subprocess
import sys
import tempfile
import time
import tomllib
from collections import Counter
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path

import cv2
import numpy as np
from PIL import Image

sys.path[:0] = [str(Path(__file__).parent), str(Path(__file__).parent / "fuzz")]

from recorded import record_necker, record_ratings  # noqa: E402

from focalgradient import Lens  # noqa: E402

SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGKILL)
CODES = {signal.SIGINT: 130, signal.SIGTERM: 143, signal.SIGKILL: -signal.SIGKILL}
LIMITS = (0, 100, 3000, 20_000)
"""Bytes that a file may have, in place of a full disk."""

OPTICS = (
    "--focal-length",
    "25",
    "--pixel-pitch",
    "8",
    "--f-number",
    "16",
    "--f-number",
    "5.6",
    "--focus-distance",
    "0.85",
)
FEW = ("--subjects", "3", "--experiments", "6", "--design", "rating.toml", "--workers", "2", "--out", "out")
SOME = ("--observers", "6", "--seed", "1", "--design", "necker.toml", "--workers", "2", "--out", "out")
SMALL = ("--gradient", "none", "--size", "256", "--edge", "3", "--speed", "0.5", "--out", "out")
PICTURES = ("--seed", "1", "--scenes", "1", "--size", "64", "--samples", "4", "--engine", "cast", "--out", "out")
PICTURES += ("--apertures", "4", "--pixel-pitch", "3000")
LENS = ("--f-number", "4", "--focal-length", "25", "--focus", "0.8", "--focus", "2", "--field", "6", "--out", "out")
VIEWS = """[camera]
focal_length_mm = 25
pixel_pitch_um = 8
[[view]]
image = "a.png"
f_number = 16
focus_distance_m = 0.85
[[view]]
image = "b.png"
f_number = 5.6
focus_distance_m = 0.85
"""
DESIGN = 'task = "necker"\nrepetitions = 1\nstrengths_mm = [4.0]\ndirections = ["right"]\ntrial_s = 20.0\n'
RATING = 'task = "depthrating"\nscenes = ["spheres-00", "spheres-01"]\nrepetitions = 1\n'

# Of each command: arguments, where it writes, the summary of the set there (none: it resumes).
COMMANDS: dict[str, tuple[tuple[str, ...], str, str | None]] = {
    "depth": (("depth", "a.png", "b.png", *OPTICS, "--focus-distance", "0.85", "--out", "out"), "out", "summary.json"),
    "calibrate": (("calibrate", "targets.toml", "--out", "out/camera.toml"), "out", "camera.toml"),
    "stream": (("stream", "a.avi", "--out", "out/d.avi", "--values", "out/d.npy", *OPTICS), "out", "d.json"),
    "eye": (("eye", "plane", "--out", "out"), "out", "summary.json"),
    "report": (("report", "data", "--out", "out"), "out", "report.html"),
    "power": (("power", "depth-rating", *FEW), "out", None),
    "power necker": (("power", "necker", *FEW[:5], "necker.toml", *FEW[6:]), "out", None),
    "simulate": (("simulate", "necker", *SOME), "out", None),
    "stimuli": (("stimuli", "necker", *SMALL), "out", None),
    "stimuli depth-rating": (("stimuli", "depth-rating", *PICTURES), "out", None),
    "frames": (("depth", "f0.toml", "f1.toml", "--workers", "2", "--out", "out"), "out", None),
    "blur": (("blur", "a.png", "far.npy", *LENS), "out", "summary.json"),
    "demo": (("demo", "--out", "out"), "out", None),
}


def prepare(folder: Path) -> None:
    """What the commands are given."""
    noise = np.random.default_rng(1).standard_normal((96, 96))
    texture = np.clip(0.5 + 0.15 * cv2.GaussianBlur(noise, (0, 0), 1.2) / 0.23, 0.02, 0.98)
    soft = cv2.GaussianBlur(texture, (0, 0), 1.2)
    for name, image in (("a.png", texture), ("b.png", soft)):
        cv2.imwrite(str(folder / name), np.rint(65535 * image).astype(np.uint16))
    writer = cv2.VideoWriter(str(folder / "a.avi"), cv2.CAP_FFMPEG, cv2.VideoWriter.fourcc(*"MJPG"), 10, (96, 96))
    for number in range(40):
        frame = np.rint(255 * (soft if number % 2 else texture)).astype(np.uint8)
        writer.write(cv2.cvtColor(frame, cv2.COLOR_GRAY2BGR))
    writer.release()
    lines = ["[camera]", "focal_length_mm = 25", "pixel_pitch_um = 8"]
    lens = Lens(0.025, 8, 0.35)
    for distance in (0.5, 0.7, 1.1, 2.0):
        sigma = 0.5 * float(lens.blur_radius(distance)) * lens.sensor_distance / 8e-6
        square = np.full((128, 160), 0.75)
        square[35:90, 38:105] = 0.06
        cv2.imwrite(
            str(folder / f"{distance}.png"), np.rint(65535 * cv2.GaussianBlur(square, (0, 0), sigma)).astype("u2")
        )
        lines += ["[[view]]", f'image = "{distance}.png"', f"distance_m = {distance}", "f_number = 8"]
    (folder / "targets.toml").write_text("\n".join(lines))
    for name in ("f0.toml", "f1.toml"):
        (folder / name).write_text(VIEWS)
    np.save(folder / "far.npy", np.where(np.arange(96) < 48, 0.8, 2.0) * np.ones((96, 1)))
    (folder / "necker.toml").write_text(DESIGN)
    (folder / "rating.toml").write_text(RATING)
    record_necker(record_ratings(folder / "data", 3), 3)


FAULTS = (1, 2, 3)
"""Which move of a finished file to its place fails."""

LIMIT_S = 300
"""Seconds that one run may take."""

FAULT = """
import errno, itertools
from focalgradient.files import writing
calls, real = itertools.count(1), writing.move
def move(source, place):
    if next(calls) == {number}:
        raise OSError(errno.EIO, "a fault", str(place))
    real(source, place)
writing.move = move
"""


def command(args: tuple[str, ...], limit: int | None = None, fault: int | None = None) -> list[str]:
    begin = "from focalgradient.cli import main; main()"
    if fault is not None:
        begin = f"{FAULT.format(number=fault)}\n{begin}"
    if limit is not None:
        begin = f"import resource; resource.setrlimit(resource.RLIMIT_FSIZE, ({limit}, {limit})); {begin}"
    return [sys.executable, "-c", begin, *args]


def readable(path: Path) -> None:
    """Fail where a file is not whole."""
    kind = path.suffix
    if kind == ".json":
        json.loads(path.read_bytes())
    elif kind == ".toml":
        tomllib.loads(path.read_text())
    elif kind in (".npz", ".npy"):
        found = np.load(path)
        for name in getattr(found, "files", ()):
            found[name]
    elif kind == ".png":
        with Image.open(path) as image:
            image.load()
    elif kind == ".pdf":
        assert path.read_bytes().rstrip().endswith(b"%%EOF"), path
    elif kind in (".csv", ".tsv", ".html", ".md"):
        assert path.read_bytes().endswith(b"\n") or path.read_text().rstrip().endswith("</html>"), path
    elif kind in (".avi", ".mp4"):
        assert cv2.VideoCapture(str(path)).read()[0], path


def files(out: Path) -> set[str]:
    return {path.relative_to(out).as_posix() for path in out.rglob("*") if path.is_file()} if out.exists() else set()


def litter(folder: Path) -> list[str]:
    return [str(path) for path in folder.rglob(".focalgradient-*")]


def check(folder: Path, out: Path, summary: str | None, names: set[str]) -> None:
    """Outputs are absent or whole."""
    found = {name for name in files(out) if "/.focalgradient-" not in f"/{name}"}
    for name in found:
        readable(out / name)
    if summary is not None:
        assert found <= names, found - names
        assert summary not in found or found == names, f"{summary} without {names - found}"


def children(process: int) -> set[int]:
    """Processes that descend from one."""
    found = {process}
    for _ in range(4):
        for stat in Path("/proc").glob("[0-9]*/stat"):
            try:
                fields = stat.read_text().rpartition(")")[2].split()
            except OSError:
                continue
            if int(fields[1]) in found and fields[0] != "Z":
                found.add(int(stat.parent.name))
    return found - {process}


def gone(processes: set[int]) -> bool:
    until = time.monotonic() + 15
    while any(Path(f"/proc/{process}/cmdline").exists() for process in processes):
        if time.monotonic() > until:
            return False
        time.sleep(0.1)
    return True


def kill(folder: Path, args: tuple[str, ...], way: signal.Signals, delay: float) -> str:
    """Run, and kill after some seconds: "finished" or "killed"."""
    run = subprocess.Popen(command(args), cwd=folder, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    time.sleep(delay)
    workers = children(run.pid)
    run.send_signal(way)
    try:
        _, said = run.communicate(timeout=LIMIT_S)
    finally:
        run.kill()
    assert gone(workers), f"processes are left: {workers}"
    if run.returncode == 0:
        return "finished"
    early = run.returncode == -way  # before the program had begun
    assert run.returncode == CODES[way] or early, (run.returncode, said[-1500:])
    if way != signal.SIGKILL and not early:
        assert "Traceback" not in said, said[-1500:]
        assert said.strip().splitlines()[-1].startswith("Interrupted: ") or not said.strip(), said[-500:]
        assert not litter(folder), litter(folder)
    return "killed before it began" if early and way != signal.SIGKILL else "killed"


def finished(folder: Path, what: list[str]) -> subprocess.CompletedProcess[str]:
    """Run to its end."""
    return subprocess.run(what, cwd=folder, capture_output=True, text=True, timeout=LIMIT_S, check=False)


def fill(folder: Path, args: tuple[str, ...], limit: int) -> str:
    """Run where no file may have more than so many bytes."""
    run = finished(folder, command(args, limit))
    assert run.returncode in (0, 2), (run.returncode, run.stderr[-1500:])
    assert "Traceback" not in run.stderr, run.stderr[-1500:]
    assert not litter(folder), litter(folder)
    return "finished" if run.returncode == 0 else "refused on a full disk"


def break_a_move(folder: Path, args: tuple[str, ...], number: int) -> str:
    """Run where a move of a finished file fails."""
    run = finished(folder, command(args, fault=number))
    assert run.returncode in (0, 2), (run.returncode, run.stderr[-1500:])
    assert "Traceback" not in run.stderr, run.stderr[-1500:]
    assert not litter(folder), litter(folder)
    return "finished" if run.returncode == 0 else "refused at a fault"


def torment(
    name: str,
    times: int,
    chance: random.Random,
    base: Path,
    signals: Sequence[signal.Signals] = SIGNALS,
    limits: Sequence[int] = LIMITS,
    faults: Sequence[int] = FAULTS,
) -> Counter[str]:
    """Try one command in a copy of the folder `base`: each of the signals so many times, the others once each."""
    args, where, summary = COMMANDS[name]
    counts: Counter[str] = Counter()
    folder = Path(shutil.copytree(base, base.parent / name))
    out = folder / where
    start = time.perf_counter()
    done = finished(folder, command(args))
    lasts = time.perf_counter() - start
    assert done.returncode == 0, done.stderr
    names = files(out)
    trials: list[Callable[[], str]] = [
        *(partial(kill, folder, args, way, chance.uniform(0.2, 1.1) * lasts) for way in signals for _ in range(times)),
        *(partial(fill, folder, args, limit) for limit in limits),
        *(partial(break_a_move, folder, args, number) for number in faults),
    ]
    chance.shuffle(trials)
    for trial in trials:
        if summary is None or chance.random() < 0.5:
            shutil.rmtree(out, ignore_errors=True)  # half of the sets replace an older one
        counts[trial()] += 1
        check(folder, out, summary, names)
    done = finished(folder, command(args))
    assert done.returncode == 0, done.stderr
    assert files(out) == names, files(out) ^ names
    check(folder, out, summary, names)
    assert not litter(folder), litter(folder)
    print(f"{name}: {dict(counts)}; {lasts:.1f} s each", flush=True)
    return counts


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("times", type=int, nargs="?", default=30)
    parser.add_argument("--only", choices=list(COMMANDS))
    parser.add_argument("--seed", type=int, default=1)
    given = parser.parse_args()
    failed = 0
    with tempfile.TemporaryDirectory() as home:
        base = Path(home, "base")
        base.mkdir()
        prepare(base)
        for name in [given.only] if given.only else COMMANDS:
            try:
                torment(name, given.times, random.Random(f"{given.seed} {name}"), base)
            except AssertionError as error:
                failed += 1
                print(f"{name}: FAILED: {error}", flush=True)
    return bool(failed)


if __name__ == "__main__":
    sys.exit(main())
