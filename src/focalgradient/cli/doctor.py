"""``focalgradient doctor``: whether this computer can run the experiments, as a table for a laboratory's report."""

from __future__ import annotations

import json
import os
import platform
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

import click

from focalgradient.cli.program import json_option, show

__all__ = ["Check", "doctor", "table"]

SCREEN = [sys.executable, "-m", "focalgradient.lab.check_screen"]  # in a process of its own, which owns PsychoPy

WRITES = 50
SLOW = 0.02  # seconds to the disk that a participant would notice between trials
ROOM = 1 << 30  # bytes


@dataclass(frozen=True, slots=True)
class Check:
    """One line of the table.

    Parameters
    ----------
    name, measured
        What was looked at, and what was found.
    well
        Whether the experiments can be run with it.
    remedy
        What to do where they cannot.
    """

    name: str
    measured: str
    well: bool
    remedy: str = ""


@click.command(short_help="Check screen, keyboard and disk for the experiments.")
@click.option("--monitor", metavar="NAME", help="The screen's name in PsychoPy's Monitor Center.")
@click.option("--screen", type=click.IntRange(min=0), default=0, show_default=True, help="Number of the screen.")
@click.option(
    "--data",
    type=click.Path(path_type=Path),
    default=Path("data"),
    show_default=True,
    metavar="DIR",
    help="Folder that data will be written to.",
)
@click.option(
    "--seconds",
    type=click.FloatRange(min=0.1, max=600),
    default=10.0,
    show_default=True,
    help="How long to count dropped frames.",
)
@click.option("--windowed", is_flag=True, help="Look at a window, not at the whole screen.")
@json_option
def doctor(monitor: str | None, screen: int, data: Path, seconds: float, windowed: bool) -> None:
    """Look at what the experiments need: screen and frames, geometry, gamma, keyboard, disk, versions.

    Prints a table in Markdown, to be pasted into a report: green where all is well, red with a remedy where it is not.
    Exit code 1 where something is not.

    Needs a screen and the extra lab. Takes as long as --seconds, and some seconds more.

    \b
    Example:
      focalgradient doctor --monitor lab1 --data data
    """  # noqa: D301  click's mark against rewrapping is a real backspace
    options = ["--screen", str(screen), "--seconds", str(seconds)]
    options += ["--monitor", monitor] if monitor else []
    options += ["--windowed"] if windowed else []
    checks = [*_screen(options), *_disk(data), _versions()]
    show({"well": all(check.well for check in checks), "checks": [asdict(check) for check in checks]}, table(checks))
    if not all(check.well for check in checks):
        click.get_current_context().exit(1)


def table(checks: list[Check]) -> str:
    """Markdown, coloured for a terminal.

    >>> click.unstyle(table([Check("disk space", "0.2 GB", False, "make room")])).splitlines()[-1]
    '| WRONG | disk space | 0.2 GB | make room |'
    """
    rows = ["| | Check | Measured | What to do |", "|---|---|---|---|"]
    for check in checks:
        word = click.style("ok", fg="green") if check.well else click.style("WRONG", fg="red", bold=True)
        rows.append(f"| {word} | {check.name} | {check.measured} | {'' if check.well else check.remedy} |")
    return "\n".join(rows)


def _screen(options: list[str]) -> Iterator[Check]:
    """What only PsychoPy can tell."""
    run = subprocess.run([*SCREEN, *options], capture_output=True, text=True, encoding="utf-8")
    try:
        found = json.loads(run.stdout.strip().splitlines()[-1])
        checks = [Check(*(one[key] for key in ("check", "measured", "well", "remedy"))) for one in found]
    except (IndexError, ValueError, KeyError, TypeError):
        last = (run.stderr.strip().splitlines() or [f"it ended with {run.returncode}"])[-1]
        what, _, remedy = last.partition(": ")
        yield Check("screen", what, False, remedy.rstrip("."))
        return
    yield from checks


def _disk(data: Path) -> Iterator[Check]:
    """How long a line takes to be safe, and how much room there is."""
    base = next(folder for folder in (data.absolute(), *data.absolute().parents) if folder.exists())
    times = []
    try:
        with tempfile.NamedTemporaryFile(dir=base) as file:
            for _ in range(WRITES):
                start = time.perf_counter()
                file.write(b"x" * 500 + b"\n")
                file.flush()
                os.fsync(file.fileno())
                times.append(time.perf_counter() - start)
    except OSError as error:
        yield Check("disk", f"{base}: {error.strerror}", False, "give --data a folder that you may write in")
        return
    times.sort()
    median = times[len(times) // 2]
    text = f"{median * 1e3:.1f} ms to the disk, at worst {times[-1] * 1e3:.1f} ms"
    yield Check("safe writing", text, median < SLOW, "give --data a folder on a local disk")
    free = shutil.disk_usage(base).free
    yield Check("disk space", f"{free / 1e9:.1f} GB free", free >= ROOM, "make room, or give --data another disk")


def _versions() -> Check:
    found, missing = [], []
    for name in ("focalgradient", "psychopy", "psychtoolbox", "numpy"):
        try:
            found.append(f"{name} {version(name)}")
        except PackageNotFoundError:
            missing.append(name)
    found += [f"{name} missing" for name in missing] + [f"Python {platform.python_version()}", platform.platform()]
    return Check(
        "versions",
        ", ".join(found),
        not missing,
        "pip install 'focalgradient[lab]', on Python 3.11 or 3.12" if missing else "",
    )
