"""Checks of whether this computer can run the experiments: screen and keyboard, luminance, disk, versions.

PsychoPy runs in separate processes, so that its failure is a failed check.
"""

from __future__ import annotations

import json
import os
import platform
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, fields
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from subprocess import CompletedProcess

from focalgradient.errors import InputError
from focalgradient.files import existing, printable
from focalgradient.lab.options import CheckOptions, MeterOptions
from focalgradient.luminance import ADDITIVE, DEVIATION, UNEQUAL, Luminance

__all__ = ["Check", "check_disk", "check_luminance", "check_screen", "check_versions", "measure_luminance"]

SCREEN, PHOTOMETER = (
    [sys.executable, "-m", f"focalgradient.lab.{name}"] for name in ("check_screen", "devices.photometer")
)
"""Commands of the programs that run PsychoPy."""

WRITES = 50
"""Number of timed disk writes."""

SLOW = 0.02
"""Time in s of a disk write that participants would notice."""

ROOM = 1 << 30
"""Minimum free disk space in bytes."""


@dataclass(frozen=True, slots=True)
class Check:
    """Result of one check.

    Parameters
    ----------
    name, measured
        Name of the check, and the result.
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


def _run(program: Sequence[str], options: CheckOptions | MeterOptions) -> tuple[CompletedProcess[str], str]:
    """Run a program with options; return its output, and the last line of its errors."""
    words = list[str]()
    for one in fields(options):
        value, name = getattr(options, one.name), f"--{one.name}"
        given = value if isinstance(value, tuple) else () if value in (None, False) else (value,)
        words += [word for part in given for word in ([name] if part is True else [name, str(part)])]
    run = subprocess.run([*program, *words], capture_output=True, text=True, encoding="utf-8")
    return run, (run.stderr.strip().splitlines() or [f"it ended with {run.returncode}"])[-1]


def measure_luminance(photometer: str, *, screen: int = 0, windowed: bool = False) -> str:
    """Measure the screen's luminance at 16 levels of each gun and of grey; the experimenter starts it with ENTER.

    Parameters
    ----------
    photometer
        Photometer and its port, such as "LS100:/dev/ttyUSB0".
    screen, windowed
        Number of the screen, and whether a window is measured instead of the whole screen.

    Returns
    -------
    str
        The table as CSV, for `focalgradient.luminance.parse_luminance`.

    Raises
    ------
    InputError
        If the photometer is unknown or does not respond, or the measurement was stopped.
    """
    run, last = _run(PHOTOMETER, MeterOptions(device=photometer, screen=screen, windowed=windowed))
    if run.returncode == 0 and "level," in run.stdout:
        return run.stdout[run.stdout.index("level,") :]
    raise InputError(last if run.returncode == 2 else f"the photometer's program failed ({last}): run it again.")


def check_luminance(found: Luminance, drawn: Path, monitor: str | None = None) -> Iterator[Check]:
    """Yield checks of a photometer's table: gamma, deviation from the fit, equality and additivity of the guns.

    Parameters
    ----------
    found
        Table with its fitted curves.
    drawn
        File with the figure of it, named in the result.
    monitor
        Screen in PsychoPy's Monitor Center with which `check_screen` stores it.

    Examples
    --------
    >>> import numpy as np
    >>> from focalgradient.luminance import fit_luminance
    >>> levels = np.arange(0, 256, 51.0)
    >>> found = fit_luminance(levels, {"grey": 90 * (levels / 255) ** 2.2})
    >>> [(one.name, one.well) for one in check_luminance(found, Path("fit.png"))]
    [('luminance', True), ('fit of luminance', True)]
    """
    curves = ", ".join(f"{gun} {curve.gamma:.2f}" for gun, curve in found.curves.items())
    text = (
        f"gamma: {curves}; white {found.grey.white:.1f}, black {found.grey.black:.2f} cd/m2; drawn: {printable(drawn)}"
    )
    text += f"; stored with {monitor}" if monitor else "; not stored: give --monitor"
    is_usual = 1 <= round(found.grey.gamma, 2) <= 4
    yield Check("luminance", text, is_usual, "see the drawing, and measure again", "gamma 1 to 4")
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


def check_screen(options: CheckOptions) -> list[Check]:
    """Check screen, keyboard, clock and trigger ports in a PsychoPy window; one failed check if none can be opened."""
    run, last = _run(SCREEN, options)
    try:
        return [Check(**one) for one in json.loads(run.stdout.strip().splitlines()[-1])]
    except (IndexError, ValueError, TypeError):
        what, _, remedy = last.partition(": ")
        return [Check("keyboard" if "keyboard" in what else "screen", what, False, remedy.rstrip("."))]


def check_disk(data: Path) -> list[Check]:
    """Check the time of a safe write to the folder `data`, or its nearest existing ancestor, and the free disk space.

    >>> [one.name for one in check_disk(Path(tempfile.gettempdir(), "none"))]
    ['safe writing', 'disk space']
    """
    base, times = existing(data), []
    try:
        with tempfile.NamedTemporaryFile(dir=base) as file:
            for _ in range(WRITES):
                start = time.perf_counter()
                file.write(b"x" * 500 + b"\n")
                file.flush()
                os.fsync(file.fileno())
                times.append(time.perf_counter() - start)
    except OSError as error:
        return [Check("disk", f"{base}: {error.strerror}", False, "give --data a folder that you may write in")]
    times.sort()
    median, free = times[len(times) // 2], shutil.disk_usage(base).free
    text = f"{median * 1e3:.1f} ms per write, {times[-1] * 1e3:.1f} ms at most"
    remedies = "give --data a folder on a local disk", "make room, or give --data another disk"
    return [
        Check("safe writing", text, median < SLOW, remedies[0], f"{1e3 * SLOW:g} ms"),
        Check("disk space", f"{free / 1e9:.1f} GB free", free >= ROOM, remedies[1], f"{ROOM / 1e9:.1f} GB"),
    ]


def check_versions() -> Check:
    """Check that PsychoPy is installed; the result states its version, those of Python and NumPy, and the system."""
    found, missing = [], []
    for name in ("focalgradient", "psychopy", "psychtoolbox", "numpy"):
        try:
            found.append(f"{name} {version(name)}")
        except PackageNotFoundError:
            missing.append(name)
    found += [f"{name} missing" for name in missing] + [f"Python {platform.python_version()}", platform.platform()]
    remedy = "pip install 'focalgradient[lab]', on Python 3.11 or 3.12" if missing else ""
    return Check("versions", ", ".join(found), not missing, remedy)
