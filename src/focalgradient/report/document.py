"""A document of headings, paragraphs, tables and figures, written as one HTML page or as Markdown."""

from __future__ import annotations

import base64
import html
import re
from collections.abc import Sequence
from dataclasses import dataclass

__all__ = ["Block", "Figure", "Heading", "Notice", "Paragraph", "Table", "as_html", "as_markdown"]


@dataclass(frozen=True, slots=True)
class Heading:
    """A heading of level 2 or 3."""

    text: str
    level: int = 2


@dataclass(frozen=True, slots=True)
class Paragraph:
    """A paragraph of plain text."""

    text: str


@dataclass(frozen=True, slots=True)
class Notice:
    """What a reader must not miss."""

    text: str


@dataclass(frozen=True, slots=True)
class Table:
    """Cells as text, under a caption; `notes` follow it, `csv` names the file with all its digits.

    A `folded` table is closed in HTML until it is opened, and only named in Markdown.
    """

    caption: str
    header: Sequence[str]
    rows: Sequence[Sequence[str]]
    notes: Sequence[str] = ()
    csv: str | None = None
    folded: bool = False


@dataclass(frozen=True, slots=True)
class Figure:
    """A picture, as PNG, that lies beside Markdown under `name` and is held within HTML."""

    name: str
    png: bytes
    caption: str


Block = Heading | Paragraph | Notice | Table | Figure


def as_html(title: str, blocks: Sequence[Block]) -> str:
    """One page that holds its pictures and needs nothing from elsewhere.

    Examples
    --------
    >>> "<h2>A &lt; B</h2>" in as_html("An example", [Heading("A < B")])
    True
    """
    return f"""<!doctype html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<title>{html.escape(title)}</title>
<style>{_CSS}</style>
</head>
<body>
<h1>{html.escape(title)}</h1>
{"".join(_html(block) for block in blocks)}</body>
</html>
"""


def as_markdown(title: str, blocks: Sequence[Block]) -> str:
    """The same as Markdown.

    Examples
    --------
    >>> as_markdown("An example", [Table("Few", ["N"], [["3"]])]).splitlines()[2:]
    ['**Few**', '', '| N |', '| --- |', '| 3 |']
    """
    return "\n\n".join([f"# {_plain(title)}", *map(_markdown, blocks)]) + "\n"


def _html(block: Block) -> str:
    match block:
        case Heading(text, level):
            return f"<h{level}>{html.escape(text)}</h{level}>\n"
        case Paragraph(text):
            return f"<p>{html.escape(text)}</p>\n"
        case Notice(text):
            return f'<p class="notice">{html.escape(text)}</p>\n'
        case Figure(_, png, caption):
            source = base64.b64encode(png).decode("ascii")
            text = html.escape(caption)
            image = f'<img src="data:image/png;base64,{source}" alt="{text}">'
            return f"<figure>{image}<figcaption>{text}</figcaption></figure>\n"
        case Table(caption, header, rows, notes, csv, folded):
            heads = "".join(f"<th>{html.escape(cell)}</th>" for cell in header)
            body = "".join(
                "<tr>" + "".join(f"<td>{html.escape(cell)}</td>" for cell in row) + "</tr>\n" for row in rows
            )
            under = "".join(f'<p class="note">{html.escape(note)}</p>\n' for note in _notes(notes, csv))
            head = f"<thead><tr>{heads}</tr></thead>\n<tbody>\n{body}</tbody></table></div>\n{under}"
            if folded:
                summary = f"<summary>{html.escape(caption)} ({len(rows)} rows)</summary>"
                return f'<details>{summary}\n<div class="wide"><table>\n{head}</details>\n'
            return f'<div class="wide"><table><caption>{html.escape(caption)}</caption>\n{head}'


def _markdown(block: Block) -> str:
    match block:
        case Heading(text, level):
            return f"{'#' * level} {_plain(text)}"
        case Paragraph(text):
            return _plain(text)
        case Notice(text):
            return f"> **{_plain(text)}**"
        case Figure(name, _, caption):
            return f"![{_plain(caption)}]({name})\n\n*{_plain(caption)}*"
        case Table(caption, header, rows, notes, csv, folded):
            under = "".join(f"\n\n{_plain(note)}" for note in _notes(notes, csv))
            if folded:
                return f"**{_plain(caption)}** ({len(rows)} rows){under}"
            lines = [list(map(_plain, header)), ["---"] * len(header), *(list(map(_plain, row)) for row in rows)]
            return f"**{_plain(caption)}**\n\n" + "\n".join("| " + " | ".join(line) + " |" for line in lines) + under


_MARKS = str.maketrans({mark: f"\\{mark}" for mark in "\\`*[]|#"} | {"<": "&lt;", ">": "&gt;", "\n": " ", "\r": " "})


def _plain(text: str) -> str:
    """Text that Markdown, and HTML within it, shows as it stands: nothing in a data set can become markup."""
    return re.sub(r"&(?=[#\w]+;)", "&amp;", text).translate(_MARKS)


def _notes(notes: Sequence[str], csv: str | None) -> list[str]:
    return [*notes, *([] if csv is None else [f"As a file: {csv}."])]


_CSS = """
:root { color-scheme: light; }
body { font: 16px/1.55 Charter, "Bitstream Charter", "Iowan Old Style", Cambria, Georgia, serif; color: #1d1d1f;
  background: #fff; max-width: 58rem; margin: 3rem auto 5rem; padding: 0 1.25rem; }
p, figcaption { max-width: 46rem; } h1 { font-size: 2rem; line-height: 1.15; font-weight: 600; margin: 0 0 1rem; }
h2 { font-size: 1.4rem; font-weight: 600; border-top: 1px solid #dcdcdc; padding-top: 1.4rem; margin: 2.6rem 0 .8rem; }
h3 { font-size: 1.1rem; font-weight: 600; margin: 1.8rem 0 .5rem; }
.notice { border-left: 4px solid #d55e00; background: #fdf3ec; padding: .6rem .9rem; font-weight: 600; }
figure { margin: 1rem 0 1.4rem; } img { max-width: min(100%, 46rem); height: auto; display: block; }
figcaption { font-size: .9rem; color: #444; margin-top: .5rem; }
.wide { overflow-x: auto; }
table { border-collapse: collapse; width: 100%; font: .8rem/1.4 system-ui, "Segoe UI", Helvetica, Arial, sans-serif;
  font-variant-numeric: tabular-nums; margin-top: 1.2rem; }
caption { text-align: left; font-weight: 600; padding-bottom: .3rem; }
th { text-align: left; font-weight: 600; border-bottom: 1px solid #888; padding: .28rem .6rem .28rem 0;
  vertical-align: bottom; }
td { border-bottom: 1px solid #e6e6e6; padding: .28rem .6rem .28rem 0; vertical-align: top; }
details { margin-top: 1.2rem; } summary { cursor: pointer; font: 600 .8rem/1.4 system-ui, sans-serif; }
.note { font-size: .82rem; color: #555; margin: .3rem 0; overflow-wrap: anywhere; }
@media print { body { margin: 0 auto; max-width: none; font-size: 10pt; } tr, figure { break-inside: avoid; } }
"""
