"""``focalgradient doctor``: checks whether this computer can run the experiments, as a table for a report."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import click

from focalgradient.cli.generate import Folder, Made, command
from focalgradient.cli.program import show, writable, write_set
from focalgradient.errors import InputError
from focalgradient.luminance import parse_luminance, read_luminance

if TYPE_CHECKING:
    from focalgradient.lab.computer import Check

__all__ = ["doctor", "table"]


@command("Check screen, keyboard and disk for the experiments.")
def doctor(
    *,
    asked: Annotated[Any, Made("focalgradient.lab.options:CheckOptions")],
    data: Folder = Path("data"),
    photometer: Annotated[str | None, "NAME:PORT"] = None,
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

    Parameters
    ----------
    data
        Folder to which data will be written.
    photometer
        Measure with a photometer, such as LS100:/dev/ttyUSB0, and write the FILE of --luminance.
    """  # noqa: D301  click's mark against rewrapping is a real backspace
    from focalgradient.lab.computer import check_disk, check_screen, check_versions, measure_luminance

    measured, light, luminance = None, [], asked.luminance
    if photometer is not None:
        if luminance is None:
            raise InputError("--photometer needs a file for its measurements: give --luminance FILE.")
        writable(luminance.parent, [luminance.name, _drawing(luminance).name])
        measured = measure_luminance(photometer, screen=asked.screen, windowed=asked.windowed)
    if luminance is not None:
        light = [*_luminance(luminance, measured, asked.monitor)]
    window = check_screen(asked)
    checks = [*window, *light, *check_disk(data), check_versions()]
    well = all(check.well for check in checks)
    show({"well": well, "checks": [asdict(check) for check in checks]}, table(checks))
    if not well:
        click.get_current_context().exit(1)


def _drawing(path: Path) -> Path:
    return path.with_name(f"{path.stem}-fit.png")


def _luminance(path: Path, measured: str | None, monitor: str | None) -> Iterator[Check]:
    """Fit and plot a photometer's table, which is written too if it is newly measured; return its checks."""
    from focalgradient.lab.computer import check_luminance
    from focalgradient.plotting.figures import as_file
    from focalgradient.plotting.luminance import luminance_figure

    drawn, written = _drawing(path), {}
    if measured is None:
        found = read_luminance(path)
        writable(drawn.parent, [drawn.name], [path])
    else:
        found, written = parse_luminance(measured, str(path)), {path.name: measured.encode()}
    write_set(drawn.parent, {**written, drawn.name: as_file(luminance_figure(found), "png")}, drawn.name, None)
    return check_luminance(found, drawn, monitor)


def table(checks: Sequence[Check]) -> str:
    """Return the checks as a Markdown table, coloured for a terminal.

    >>> from focalgradient.lab.computer import Check
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
