"""Figures as data, and their output as files and as a report.

The script of a figure has a function `make(*, full, progress) -> Shown`, which it passes to `alone` when run by itself.
`progress` is called with the completed fraction, 0 to 1; `full` requests more data and takes longer.
"""

from __future__ import annotations

import argparse
import base64
import html
import io
import json
import math
import platform
import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np
from claims import Answer
from matplotlib.figure import Figure

from focalgradient.plotting import style

__all__ = ["Progress", "Shown", "alone", "images", "numbers_json", "report_html"]

Progress = Callable[[float], object]


@dataclass(frozen=True, slots=True)
class Shown:
    """Figure with its description.

    Parameters
    ----------
    title
        Heading in the report.
    caption
        Description and interpretation, as paragraphs of plain text.
    figure
        Figure to be drawn.
    summary
        Main measured numbers, a table in the report. The names contain the units.
    plotted
        Every number drawn as a curve or as points.
    table
        Comma-separated values to be stored with the figure; empty if there are none.
    """

    title: str
    caption: tuple[str, ...]
    figure: Figure
    summary: Mapping[str, Any]
    plotted: Mapping[str, Any]
    table: str = ""


def images(shown: Shown) -> dict[str, bytes]:
    """Return the contents of PNG and PDF file, identical in every run, and the table as CSV."""
    files = {"csv": shown.table.encode()} if shown.table else {}
    for kind, stamp in (("png", "Software"), ("pdf", "CreationDate")):
        buffer = io.BytesIO()
        with style():
            shown.figure.savefig(buffer, format=kind, dpi=200, metadata={stamp: None})
        files[kind] = buffer.getvalue()
    return files


def numbers_json(figures: Mapping[str, Shown]) -> str:
    """Return every figure's texts and numbers, by name, as strict JSON: non-finite numbers are null."""
    numbers = {
        name: {"title": shown.title, "caption": shown.caption, "summary": shown.summary, "plotted": shown.plotted}
        for name, shown in figures.items()
    }
    return json.dumps(_plain(numbers), indent=1, allow_nan=False) + "\n"


def report_html(
    figures: Mapping[str, Shown], pngs: Mapping[str, bytes], remark: str, claims: Sequence[Answer] = ()
) -> str:
    """Return a self-contained page: the paper's claims with results, then every figure and its measurements."""
    contents = "".join(f'<li><a href="#{name}">{html.escape(s.title)}</a></li>' for name, s in figures.items())
    sections = "".join(_section(name, shown, pngs[name]) for name, shown in figures.items())
    made_with = ", ".join(f"{name} {version(name)}" for name in ("focalgradient", "numpy", "scipy", "matplotlib"))
    return f"""<!doctype html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<title>Depth from the focal gradient: figures</title>
<style>{_CSS}</style>
</head>
<body>
<header>
<h1>Depth from the focal gradient</h1>
<p class="lead">{html.escape(remark)}</p>
</header>
{_claims_table(claims, figures)}
<nav><h2>Figures</h2><ol>{contents}</ol></nav>
{sections}
<footer>
<p>Made with {html.escape(made_with)} and Python {platform.python_version()}. The numbers behind every figure are in
numbers.json beside this page, and every figure is there as PNG and PDF.</p>
<p>A. P. Pentland, A new sense for depth of field, IEEE Transactions on Pattern Analysis and Machine Intelligence,
PAMI-9(4), 523–531, 1987.</p>
</footer>
</body>
</html>
"""


def _claims_table(claims: Sequence[Answer], figures: Mapping[str, Shown]) -> str:
    """Return the claims, each with its result, a link to its figure, and the command that makes it."""
    if not claims:
        return ""
    rows = []
    for one in claims:
        link = f'<a href="#{one.figure}">{html.escape(one.figure)}</a>' if one.figure in figures else "–"
        cells = (one.section, one.claim, one.measured, one.verdict)
        rows.append(
            "<tr>"
            + "".join(f"<td>{html.escape(cell)}</td>" for cell in cells)
            + f"<td>{link}</td><td><code>{html.escape(one.command)}</code></td></tr>"
        )
    heads = "".join(f"<th>{head}</th>" for head in ("Section", "Claim", "Measured", "Verdict", "Figure", "Command"))
    return f"""<section id="claims" class="claims">
<h2>The paper’s claims, answered</h2>
<div class="wide"><table><thead><tr>{heads}</tr></thead><tbody>{"".join(rows)}</tbody></table></div>
</section>"""


def alone(name: str, make: Callable[..., Shown], **more: tuple[Callable[[str], Any], str]) -> None:
    """Run the script of one figure: write the figure and its numbers, and print the measurements.

    Each of `more` is an option of this script: function that parses its value, and help text.
    """
    parser = argparse.ArgumentParser(description=f"Make {name} alone.")
    parser.add_argument("--out", type=Path, default=Path("results"), help="folder for the figure (default: results)")
    parser.add_argument("--full", action="store_true", help="more data; takes longer")
    for option, (reads, words) in more.items():
        parser.add_argument(f"--{option}", type=reads, help=words)
    options = parser.parse_args()
    given = {option: value for option in more if (value := getattr(options, option)) is not None}
    try:
        shown = make(full=options.full, progress=_percent(), **given)
    except KeyboardInterrupt:
        sys.exit(130)
    options.out.mkdir(parents=True, exist_ok=True)
    for kind, content in images(shown).items():
        (options.out / f"{name}.{kind}").write_bytes(content)
    (options.out / f"{name}.json").write_text(numbers_json({name: shown}), encoding="utf-8")
    for label, value in rows_of(shown.summary):
        print(f"{label}: {value}")


def _percent() -> Progress:
    """Return a progress callback that prints each new percent, if the output is a terminal."""
    last = [-1]

    def say(share: float) -> None:
        if (percent := int(100 * share)) > last[0] and sys.stderr.isatty():
            last[0] = percent
            print(f"\r{percent} %", end="\n" if percent == 100 else "", file=sys.stderr, flush=True)

    return say


def _section(name: str, shown: Shown, png: bytes) -> str:
    rows = "".join(
        f"<tr><th>{html.escape(label)}</th><td>{html.escape(value)}</td></tr>"
        for label, value in rows_of(shown.summary)
    )
    text = "".join(f"<p>{html.escape(paragraph)}</p>" for paragraph in shown.caption)
    picture = base64.b64encode(png).decode("ascii")
    return f"""<section id="{name}">
<h2>{html.escape(shown.title)}</h2>
<figure><img src="data:image/png;base64,{picture}" alt="{html.escape(shown.title)}"></figure>
{text}
<div class="wide"><table><caption>Measured values</caption>{rows}</table></div>
</section>
"""


def rows_of(summary: Mapping[str, Any]) -> list[tuple[str, str]]:
    """Convert a summary to table rows of label and value; each entry of a nested mapping has its own row."""
    rows: list[tuple[str, str]] = []
    for name, value in summary.items():
        if isinstance(value, Mapping):
            rows += [(_label(name, str(key)), _short(item)) for key, item in value.items()]
        else:
            rows.append((_label(name), _p(value) if name.startswith("p_") else _short(value)))
    return rows


def _p(value: float | None) -> str:
    """Format a p value, with no more digits than are accurate."""
    return "< 0.0001" if value is not None and value < 1e-4 else _short(value)


UNITS = {
    **{unit: unit for unit in ("m", "mm", "cm", "px", "arcmin", "ms", "s", "D")},
    "percent": "%",
    "dioptres": "D",
}


def _label(name: str, entry: str = "") -> str:
    """Format a number's name as words, then the `entry` of it, with its unit in brackets."""
    words, _, unit = name.rpartition("_")
    label = (words if unit in UNITS else name).replace("_", " ")
    label += f", {entry}" if entry else ""
    return f"{label} ({UNITS[unit]})" if unit in UNITS else label


ROUNDING = 1e-9
"""Absolute value below which a number counts as rounding error, in any unit."""

SUPERSCRIPT = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")


def _short(value: Any) -> str:
    """Format a number with four significant digits; other values unchanged.

    >>> _short([1.353e-14, 0.25, 3.93838e-05])
    '0, 0.25, 3.938 × 10⁻⁵'
    """
    plain = _plain(value)
    if isinstance(plain, list):
        return ", ".join(map(_short, plain))
    if isinstance(plain, bool):
        return "yes" if plain else "no"
    if not isinstance(plain, float):
        return "not defined" if plain is None else str(plain)
    digits, _, power = f"{0.0 if abs(plain) < ROUNDING else plain:.4g}".partition("e")
    return digits + (f" × 10{str(int(power)).translate(SUPERSCRIPT)}" if power else "")


def _plain(value: Any) -> Any:
    """Convert a value for JSON: arrays to lists, numbers to six digits, non-finite numbers to None."""
    match value:
        case Mapping():
            return {str(key): _plain(item) for key, item in value.items()}
        case np.ndarray():
            return _plain(value.tolist())
        case list() | tuple():
            return [_plain(item) for item in value]
        case bool() | np.bool_():
            return bool(value)
        case float() | np.floating():
            return float(f"{value:.6g}") if math.isfinite(value) else None
        case np.integer():
            return int(value)
        case _:
            return value


_CSS = """
:root { color-scheme: light; }
body { font: 16px/1.55 Charter, "Bitstream Charter", "Iowan Old Style", Cambria, Georgia, serif; color: #1d1d1f;
  background: #fff; max-width: 47rem; margin: 3rem auto 5rem; padding: 0 1.25rem; text-wrap: pretty; }
h1 { font-size: 2.1rem; line-height: 1.15; font-weight: 600; margin: 0 0 .6rem; }
h2 { font-size: 1.35rem; line-height: 1.25; font-weight: 600; margin: 0 0 1rem; }
.lead { font-size: 1.1rem; color: #444; }
ol { padding-left: 1.3rem; } ol a { color: #0b5a8f; text-decoration: none; } ol a:hover { text-decoration: underline; }
section { border-top: 1px solid #dcdcdc; padding-top: 1.6rem; margin-top: 3rem; }
figure { margin: 0 0 1.2rem; } img { width: 100%; height: auto; display: block; }
table { border-collapse: collapse; width: 100%; font: .82rem/1.4 system-ui, "Segoe UI", Helvetica, Arial, sans-serif;
  font-variant-numeric: tabular-nums; margin-top: 1.2rem; }
caption { text-align: left; font-weight: 600; padding-bottom: .3rem; }
th, td { border-top: 1px solid #e6e6e6; padding: .28rem .4rem .28rem 0; text-align: left; font-weight: 400; }
td { text-align: right; padding-right: 0; white-space: nowrap; }
footer { border-top: 1px solid #dcdcdc; margin-top: 3rem; padding-top: 1rem; font-size: .85rem; color: #555; }
nav { margin-top: 2.5rem; }
.wide { overflow-x: auto; }
.claims .wide { width: calc(100vw - 3rem); max-width: 76rem; margin-left: 50%; transform: translateX(-50%); }
.claims th { font-weight: 600; } .claims td, .claims th { text-align: left; white-space: normal; vertical-align: top;
  padding-right: .8rem; } .claims td:nth-child(4) { font-weight: 600; } .claims code { white-space: nowrap; }
@media print {
  .claims .wide { width: 100%; margin-left: 0; transform: none; }
  body { margin: 0 auto; max-width: none; font-size: 10.5pt; } ol { display: none; }
  section { break-inside: avoid; } h2 { break-after: avoid; }
}
"""
