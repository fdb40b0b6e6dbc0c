"""Document model of headings, paragraphs, tables and figures, rendered as one HTML page or as Markdown."""

from __future__ import annotations

import base64
import html
import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from string import Template

__all__ = [
    "FURTHER",
    "Anchored",
    "Block",
    "Details",
    "Figure",
    "Heading",
    "Links",
    "Notice",
    "Paragraph",
    "Table",
    "as_html",
    "as_markdown",
    "typeset",
]


@dataclass(frozen=True, slots=True)
class Heading:
    """Heading of level 2 or 3."""

    text: str
    level: int = 2


@dataclass(frozen=True, slots=True)
class Paragraph:
    """Paragraph of plain text."""

    text: str


@dataclass(frozen=True, slots=True)
class Links:
    """Links to `Anchored` paragraphs of the same page, with introductory text `before`."""

    before: str
    to: Sequence[tuple[str, str]]


@dataclass(frozen=True, slots=True)
class Anchored:
    """Paragraph with a bold title, the target of `Links` by `anchor`."""

    anchor: str
    title: str
    text: str


@dataclass(frozen=True, slots=True)
class Notice:
    """Highlighted notice."""

    text: str


@dataclass(frozen=True, slots=True)
class Table:
    """Table of text cells with caption and notes; `csv` names the file with full precision.

    A `folded` table is collapsed in HTML, and only mentioned in Markdown.
    """

    caption: str
    header: Sequence[str]
    rows: Sequence[Sequence[str]]
    notes: Sequence[str] = ()
    csv: str | None = None
    folded: bool = False


@dataclass(frozen=True, slots=True)
class Figure:
    """PNG picture, embedded in HTML, and stored as `name` next to Markdown."""

    name: str
    png: bytes
    caption: str


@dataclass(frozen=True, slots=True)
class Details:
    """Blocks that are folded under a summary, in HTML and Markdown."""

    summary: str
    blocks: Sequence[Block]


FURTHER = "Checks and further tables"
"""Summary of the folded tables and figures of a section."""

Block = Heading | Paragraph | Links | Anchored | Notice | Table | Figure | Details


def as_html(title: str, blocks: Sequence[Block]) -> str:
    """Render a self-contained HTML page with embedded pictures.

    Examples
    --------
    >>> "<h2>A &lt; B</h2>" in as_html("An example", [Heading("A < B")])
    True
    """
    page = Template(Path(__file__).with_name("page.html").read_text(encoding="utf-8"))
    return page.substitute(title=html.escape(title), body="".join(map(_html, blocks)))


def as_markdown(title: str, blocks: Sequence[Block]) -> str:
    """Render Markdown.

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
            return f"<p>{typeset(text)}</p>\n"
        case Links(before, to):
            links = ", ".join(f'<a href="#{anchor}">{html.escape(text)}</a>' for anchor, text in to)
            return f'<p class="note">{html.escape(before)} {links}.</p>\n'
        case Anchored(anchor, title, text):
            return f'<p id="{anchor}"><b>{html.escape(title)}.</b> {typeset(text)}</p>\n'
        case Notice(text):
            return f'<p class="notice">{typeset(text)}</p>\n'
        case Details(summary, blocks):
            inside = "".join(map(_html, blocks))
            return f"<details><summary>{html.escape(summary)}</summary>\n{inside}</details>\n"
        case Figure(_, png, caption):
            source = base64.b64encode(png).decode("ascii")
            text = html.escape(caption)
            wide = ' class="panels"' if _is_wide(png) else ""
            image = f'<img{wide} src="data:image/png;base64,{source}" alt="{text}">'
            return f"<figure>{image}<figcaption>{typeset(caption)}</figcaption></figure>\n"
        case Table(caption, header, rows, notes, csv, folded):
            heads = "".join(f"<th>{typeset(cell)}</th>" for cell in header)
            body = "".join("<tr>" + "".join(f"<td>{typeset(cell)}</td>" for cell in row) + "</tr>\n" for row in rows)
            under = "".join(f'<p class="note">{typeset(note)}</p>\n' for note in _notes(notes, csv))
            head = f"<thead><tr>{heads}</tr></thead>\n<tbody>\n{body}</tbody></table></div>\n{under}"
            if folded:
                summary = f"<summary>{html.escape(caption)} ({len(rows)} rows)</summary>"
                return f'<details>{summary}\n<div class="wide"><table>\n{head}</details>\n'
            return f'<p class="caption">{typeset(caption)}</p>\n<div class="wide"><table>\n{head}'


def _is_wide(png: bytes) -> bool:
    """Return whether a picture is so wide that a phone must scroll it."""
    width, height = (int.from_bytes(png[at : at + 4], "big") for at in (16, 20))
    return width > 1.5 * height


def _markdown(block: Block) -> str:
    match block:
        case Heading(text, level):
            return f"{'#' * level} {_plain(text)}"
        case Paragraph(text):
            return _plain(text)
        case Links(before, to):
            return _plain(f"{before} {', '.join(text for _, text in to)}.")
        case Anchored(_, title, text):
            return f"**{_plain(title)}.** {_plain(text)}"
        case Notice(text):
            return f"> **{_plain(text)}**"
        case Details(summary, blocks):
            inside = "\n\n".join(map(_markdown, blocks))
            return f"<details>\n<summary>{_plain(summary)}</summary>\n\n{inside}\n\n</details>"
        case Figure(name, _, caption):
            return f"![{_plain(caption)}]({name})\n\n*{_plain(caption)}*"
        case Table(caption, header, rows, notes, csv, folded):
            under = "".join(f"\n\n{_plain(note)}" for note in _notes(notes, csv))
            if folded:
                return f"**{_plain(caption)}** ({len(rows)} rows){under}"
            cells = [[_plain(cell) for cell in row] for row in (header, *rows)]
            lines = [cells[0], ["---"] * len(header), *cells[1:]]
            return f"**{_plain(caption)}**\n\n" + "\n".join("| " + " | ".join(line) + " |" for line in lines) + under


_SYMBOL = re.compile(
    r"(?<![\w.*])(?:(?:d_z|p_Holm)|(?:t|F|z|W|Q)(?=\()|(?:p|t|d|N|M|W)(?=[ \N{NO-BREAK SPACE}](?:=|<|&lt;|\())"
    r"|^(?:p|d|N|t)$|\bt(?=-tests?\b)|p(?= values?\b))"
)
"""Statistical symbols set in italics by the APA manual: before values, in table headings, in text."""


def typeset(text: str) -> str:
    """Escape text for HTML, with statistical symbols in italics.

    >>> typeset("t(7) = 5.00, p < .001 (d_z = 1.2)")
    '<i>t</i>(7) = 5.00, <i>p</i> &lt; .001 (<i>d</i><sub>z</sub> = 1.2)'
    """

    def mark(found: re.Match[str]) -> str:
        symbol, _, index = found.group().partition("_")
        return f"<i>{symbol}</i>{f'<sub>{index}</sub>' if index else ''}"

    return _SYMBOL.sub(mark, html.escape(_spaced(text)))


def _spaced(text: str) -> str:
    r"""Put a no-break space between a number and a percent sign.

    >>> _spaced("80% and 95 %")
    '80\xa0% and 95\xa0%'
    """
    return re.sub(r"(?<=\d) ?%", "\N{NO-BREAK SPACE}%", text)


_MARKS = str.maketrans({mark: f"\\{mark}" for mark in "\\`*[]|#"} | {"<": "&lt;", ">": "&gt;", "\n": " ", "\r": " "})


def _plain(text: str) -> str:
    """Escape text for Markdown (and HTML within it), so that nothing in a data set can become markup."""
    escaped = re.sub(r"&(?=[#\w]+;)", "&amp;", _spaced(text)).translate(_MARKS)
    return re.sub(r"\b([dp])_(z|Holm)\b", r"*\1*<sub>\2</sub>", escaped)


def _notes(notes: Sequence[str], csv: str | None) -> list[str]:
    return [*notes, *([] if csv is None else [f"As a file: {csv}."])]
