"""``focalgradient report``: a data set analysed, with figures, tables, methods and provenance."""

from __future__ import annotations

from pathlib import Path

import click

from focalgradient.cli.options import positive
from focalgradient.cli.program import writable
from focalgradient.files import replace_set

__all__ = ["report"]


@click.command(short_help="Analyse a data set and write its report.")
@click.argument("folder", metavar="DATASET", type=click.Path(path_type=Path))
@click.option("--out", required=True, type=click.Path(path_type=Path), metavar="DIR", help="Folder for the report.")
@click.option(
    "--bound",
    type=float,
    metavar="RATIO",
    callback=positive(),
    help="Smallest rise of a rating at the largest aperture that would matter, stated in advance.  [default: 1.2]",
)
@click.option("--ordinal", is_flag=True, help="Ratings are steps of a scale, whole numbers, and no ratios.")
def report(folder: Path, out: Path, bound: float | None, ordinal: bool) -> None:
    """Analyse the data set in DATASET, of people or of simulated observers.

    Writes report.html (one page, with all pictures), report.md, the figures (PNG, PDF) and every table (CSV) into the
    folder --out. What can be analysed is; what cannot is said there, and here.

    \b
    Example:
      focalgradient report data --out report --bound 1.2
    """  # noqa: D301  click's mark against rewrapping is a real backspace
    from focalgradient.report import BOUND, make_report

    writable(out, ["report.html", "report.md"])
    made = make_report(
        folder,
        bound=BOUND if bound is None else bound,
        bound_stated=bound is not None,
        scale="ordinal" if ordinal else "ratio",
    )
    replace_set(out, made.files, "report.html")
    for problem in made.problems:
        click.echo(f"Problem: {' '.join(problem.split())}", err=True)
    click.echo(f"Done: open {out / 'report.html'}")
