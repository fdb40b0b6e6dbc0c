"""``focalgradient doctor``: checks whether this computer can run the experiments, as a table for a report."""

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

from focalgradient.cli.options import positive
from focalgradient.cli.program import force_option, json_option, show, writable, write_set
from focalgradient.errors import InputError
from focalgradient.files import printable

__all__ = ["Check", "doctor", "table"]

SCREEN = [sys.executable, "-m", "focalgradient.lab.check_screen"]  # in a separate process, which runs PsychoPy

PHOTOMETER = [sys.executable, "-m", "focalgradient.lab.photometer"]

WRITES = 50
SLOW = 0.02  # time in s of a disk write that participants would notice
ROOM = 1 << 30  # bytes


@dataclass(frozen=True, slots=True)
class Check:
    """One row of the table.

    Parameters
    ----------
    name, measured
        What was checked, and the result.
    well
        Whether the experiments can be run with it.
    remedy
        Remedy if they cannot.
    limit
        Acceptance limit; "" if there is none.
    """

    name: str
    measured: str
    well: bool
    remedy: str = ""
    limit: str = ""


@click.command(short_help="Check screen, keyboard and disk for the experiments.")
@click.option("--monitor", metavar="NAME", help="Name of the screen in PsychoPy's Monitor Center.")
@click.option("--screen", type=click.IntRange(min=0), default=0, show_default=True, help="Number of the screen.")
@click.option(
    "--data",
    type=click.Path(path_type=Path),
    default=Path("data"),
    show_default=True,
    metavar="DIR",
    help="Folder to which data will be written.",
)
@click.option(
    "--seconds",
    type=float,
    default=10.0,
    show_default=True,
    callback=positive(" of seconds", least=0.1, most=600),
    help="Duration of counting dropped frames, in seconds: 0.1 to 600.",
)
@click.option("--windowed", is_flag=True, help="Check a window instead of the whole screen.")
@click.option(
    "--luminance",
    type=click.Path(path_type=Path),
    metavar="FILE",
    help="Photometer measurements (CSV: level, red, green, blue, grey in cd/m2): fitted, plotted as FILE-fit.png, "
    "and stored for the experiments with --monitor.",
)
@click.option(
    "--photometer",
    metavar="NAME:PORT",
    help="Measure with a photometer, such as LS100:/dev/ttyUSB0, and write the FILE of --luminance.",
)
@click.option(
    "--markers",
    type=click.Path(path_type=Path),
    metavar="FILE",
    help="Python file with mark(), as for run: test pulses of code 60 are sent and timed.",
)
@click.option(
    "--triggers",
    multiple=True,
    metavar="PORT",
    help="Trigger port, as for run (parallel:..., serial:..., lsl, file:PATH): test pulses are sent and timed.",
)
@click.option(
    "--codes",
    type=click.Path(path_type=Path),
    metavar="FILE",
    help="TOML file with custom event codes, as for run.",
)
@click.option("--card", is_flag=True, help="Measure the screen's size with a bank card held against it.")
@force_option
@json_option
def doctor(
    monitor: str | None,
    screen: int,
    data: Path,
    seconds: float,
    windowed: bool,
    luminance: Path | None,
    photometer: str | None,
    markers: Path | None,
    triggers: tuple[str, ...],
    codes: Path | None,
    card: bool,
) -> None:
    """Check what the experiments need: screen and frames, size, gamma, keyboard, triggers, clock, disk, versions.

    Prints a table in Markdown for a report: passed checks in green, failed ones in red with a remedy. Exit code 1: a
    check failed.

    Needs a screen and the extra lab. Takes a few seconds longer than --seconds.

    \b
    Example:
      focalgradient doctor --monitor lab1 --data data
      focalgradient doctor --monitor lab1 --luminance photometer.csv --card
      focalgradient doctor --monitor lab1 --luminance photometer.csv --photometer LS100:/dev/ttyUSB0
    """  # noqa: D301  click's mark against rewrapping is a real backspace
    options = ["--screen", str(screen), "--seconds", str(seconds)]
    options += ["--monitor", monitor] if monitor else []
    options += ["--windowed"] if windowed else []
    options += ["--markers", str(markers)] if markers else []
    for port in triggers:
        options += ["--triggers", port]
    options += ["--codes", str(codes)] if codes else []
    options += ["--card"] if card else []
    light: list[Check] = []
    measured: str | None = None
    if photometer is not None:
        if luminance is None:
            raise InputError("--photometer needs a file for its measurements: give --luminance FILE.")
        measured = _measured(luminance, [photometer, "--screen", str(screen), *(["--windowed"] if windowed else [])])
    if luminance is not None:
        light = [*_luminance(luminance, monitor, measured)]
        options += ["--luminance", str(luminance)]
    checks = [*_screen(options), *light, *_disk(data), _versions()]
    show({"well": all(check.well for check in checks), "checks": [asdict(check) for check in checks]}, table(checks))
    if not all(check.well for check in checks):
        click.get_current_context().exit(1)


def table(checks: list[Check]) -> str:
    """Return the checks as a Markdown table, coloured for a terminal.

    >>> click.unstyle(table([Check("disk space", "0.2 GB", False, "make room")])).splitlines()[-1]
    '| WRONG | disk space | 0.2 GB |  | make room |'
    """
    rows = ["| | Check | Measured | Limit | What to do |", "|---|---|---|---|---|"]
    for check in checks:
        word = click.style("ok", fg="green") if check.well else click.style("WRONG", fg="red", bold=True)
        rows.append(
            f"| {word} | {check.name} | {check.measured} | {check.limit} | {'' if check.well else check.remedy} |"
        )
    return "\n".join(rows)


def _measured(path: Path, options: list[str]) -> str:
    """Measure luminances with a photometer; return the table, which is later written to `path`."""
    writable(path.parent, [path.name, _drawing(path).name])
    run = subprocess.run([*PHOTOMETER, *options], capture_output=True, text=True, encoding="utf-8")
    if run.returncode == 0 and "level," in run.stdout:
        return run.stdout[run.stdout.index("level,") :]
    last = (run.stderr.strip().splitlines() or [f"it ended with {run.returncode}"])[-1]
    raise InputError(last if run.returncode == 2 else f"the photometer's program failed ({last}): run it again.")


def _drawing(path: Path) -> Path:
    return path.with_name(f"{path.stem}-fit.png")


def _luminance(path: Path, monitor: str | None, measured: str | None) -> Iterator[Check]:
    """Fit and plot photometer measurements, which are written first if new; yield checks of the screen."""
    from focalgradient.luminance import ADDITIVE, DEVIATION, UNEQUAL, read_luminance
    from focalgradient.plotting.figures import as_file
    from focalgradient.plotting.luminance import luminance_figure

    drawn, written = _drawing(path), {}
    if measured is None:
        found = read_luminance(path)
        writable(drawn.parent, [drawn.name], [path])
    else:
        with tempfile.TemporaryDirectory() as folder:
            Path(folder, "measured.csv").write_text(measured, "utf-8")
            found = read_luminance(Path(folder, "measured.csv"))
        written = {path.name: measured.encode()}
    write_set(drawn.parent, {**written, drawn.name: as_file(luminance_figure(found), "png")}, drawn.name)
    curves = ", ".join(f"{gun} {curve.gamma:.2f}" for gun, curve in found.curves.items())
    text = (
        f"gamma: {curves}; white {found.grey.white:.1f}, black {found.grey.black:.2f} cd/m2; drawn: {printable(drawn)}"
    )
    text += f"; stored with {monitor}" if monitor else "; not stored: give --monitor"
    yield Check(
        "luminance", text, 1 <= round(found.grey.gamma, 2) <= 4, "see the drawing, and measure again", "gamma 1 to 4"
    )
    worst = max(curve.deviation for curve in found.curves.values())
    remedy = "the screen does not follow a gamma curve: switch its picture modes off, and measure again"
    yield Check("fit of luminance", f"deviates by {worst:.1%} of white", worst <= DEVIATION, remedy, f"{DEVIATION:.0%}")
    if len(found.curves) > 1:
        remedy = "greys are not neutral: reset the screen's colours to their defaults, and measure again"
        yield Check("guns", f"gammas differ by {found.unequal:.2f}", found.unequal <= UNEQUAL, remedy, f"{UNEQUAL:g}")
    if found.additivity is not None:
        remedy = "the channels are not independent: switch the screen's picture modes off, and measure again"
        text = f"sum of red, green and blue deviates by {found.additivity:+.1%} from grey"
        yield Check("additivity", text, abs(found.additivity) <= ADDITIVE, remedy, f"{ADDITIVE:.0%}")


def _screen(options: list[str]) -> Iterator[Check]:
    """Run the checks that need PsychoPy, in a separate process."""
    run = subprocess.run([*SCREEN, *options], capture_output=True, text=True, encoding="utf-8")
    try:
        found = json.loads(run.stdout.strip().splitlines()[-1])
        checks = [Check(*(one[key] for key in ("check", "measured", "well", "remedy", "limit"))) for one in found]
    except (IndexError, ValueError, KeyError, TypeError):
        last = (run.stderr.strip().splitlines() or [f"it ended with {run.returncode}"])[-1]
        what, _, remedy = last.partition(": ")
        yield Check("screen", what, False, remedy.rstrip("."))
        return
    yield from checks


def _disk(data: Path) -> Iterator[Check]:
    """Check the time of a safe write, and the free disk space."""
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
    text = f"{median * 1e3:.1f} ms per write, {times[-1] * 1e3:.1f} ms at most"
    yield Check("safe writing", text, median < SLOW, "give --data a folder on a local disk", f"{1e3 * SLOW:g} ms")
    free = shutil.disk_usage(base).free
    yield Check(
        "disk space",
        f"{free / 1e9:.1f} GB free",
        free >= ROOM,
        "make room, or give --data another disk",
        f"{ROOM / 1e9:.1f} GB",
    )


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
