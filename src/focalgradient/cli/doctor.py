"""``focalgradient doctor``: checks whether this computer can run the experiments, as a table for a report."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from focalgradient.cli.options import positive
from focalgradient.cli.program import force_option, json_option, show, writable, write_set
from focalgradient.errors import InputError

if TYPE_CHECKING:
    from focalgradient.lab.computer import Check

__all__ = ["doctor", "table"]


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
def doctor(data: Path, luminance: Path | None, photometer: str | None, **options: Any) -> None:
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
    from focalgradient.lab.computer import check_disk, check_screen, check_versions

    if photometer is not None and luminance is None:
        raise InputError("--photometer needs a file for its measurements: give --luminance FILE.")
    light = [] if luminance is None else [*_luminance(luminance, photometer, options)]
    checks = [*check_screen(luminance=luminance, **options), *light, *check_disk(data), check_versions()]
    well = all(check.well for check in checks)
    show({"well": well, "checks": [asdict(check) for check in checks]}, table(checks))
    if not well:
        click.get_current_context().exit(1)


def _luminance(path: Path, photometer: str | None, options: dict[str, Any]) -> Iterator[Check]:
    """Read or measure a photometer's table, write its figure, and the table if it is new; return its checks."""
    from focalgradient.lab.computer import check_luminance, measure_luminance
    from focalgradient.luminance import parse_luminance, read_luminance
    from focalgradient.plotting.figures import as_file
    from focalgradient.plotting.luminance import luminance_figure

    drawn = path.with_name(f"{path.stem}-fit.png")
    files = {}
    if photometer is None:
        found = read_luminance(path)
        writable(path.parent, [drawn.name], [path])
    else:
        writable(path.parent, [path.name, drawn.name])
        text = measure_luminance(photometer, screen=options["screen"], windowed=options["windowed"])
        found, files[path.name] = parse_luminance(text, str(path)), text.encode()
    write_set(path.parent, {**files, drawn.name: as_file(luminance_figure(found), "png")}, drawn.name)
    return check_luminance(found, drawn, options["monitor"])


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
