"""Random damages of tables: each value that is read is the one that its cell says, or the file is refused.

What a cell says is decided here by Python's csv module, the dialect in which the table was written, and a few lines.
"""

from __future__ import annotations

import csv
import io
import json
import re
import unicodedata
from pathlib import Path
from random import Random

import pandas as pd
import pytest

from focalgradient import InputError
from focalgradient.statistics import OwnRatings, read_ratings

HEAD = ["participant", "scene", "aperture", "fixation", "rating", "rt"]
CONDITIONS = [
    (scene, aperture, end)
    for scene in ("garden", "hall")
    for aperture in ("pinhole", "f/5.6")
    for end in ("near", "far")
]
EMPTY = {"", "na", "n/a", "nan", "null", "none", ".", "-", "#n/a", "<na>"}
SHARP = {"pinhole", "none", "inf"}
F_NUMBER = re.compile(r"(?:f?\s*/?|1:)\s*(\d+(?:\.\d+)?)")

CELLS = (
    *(
        *("", "NA", "n/a", "NaN", "-", "999", "-99", "1,050", "1.050", "1'050", "1.050,5", "1 050", "0,9", ".9"),
        *("9e-1", "1e999"),
    ),
    *(
        *("nan", "inf", "5. Jun", "2026-06-05", "45383", "95%", "1.2 s", "1:2", "-1.2", "−1.2", "+1.2", "0x1", "'1.2"),
        "$1.2",
    ),
    *(
        *("Mean", "mean", "TRUE", "=A1", "#DIV/0!", "1.2.3", "1_0", "１.2", "1.2\n1.3", '"', "a;b", "p1", "near"),
        *(" 1.2 ", "\u00a01.2", "2026"),
    ),
)
"""Cells that people, spreadsheets and programs leave in tables."""


def grid(random: Random) -> list[list[str]]:
    """Ratings of three people, two decimals or three, with a decimal point."""
    digits = random.choice([1, 2, 3])
    return [
        [f"p{who}", *shown, f"{random.uniform(0.6, 2.4):.{digits}f}", f"{random.uniform(0.5, 4):.3f}"]
        for who in range(1, 4)
        for shown in CONDITIONS
    ]


def damage_cells(random: Random, head: list[str], rows: list[list[str]]) -> None:
    """Change one to three cells, rows or columns in place."""
    for _ in range(random.randint(1, 3)):
        kind, at, column = random.randrange(12), random.randrange(len(rows)), random.randrange(len(head))
        row = rows[at]
        if kind < 5:
            row[min(column if kind else 4, len(row) - 1)] = random.choice(CELLS)
        elif kind == 5:
            rows.insert(random.randrange(len(rows)), [*row])
        elif kind == 6:
            del rows[at]
        elif kind == 7:
            row[random.randrange(len(row)) :] = []
        elif kind == 8:
            row.append(random.choice(["", "x", "1.2"]))
        elif kind == 9:
            other = random.randrange(len(row) or 1) if row else 0
            if row and column < len(row):
                row[column], row[other] = row[other], row[column]
        elif kind == 10:
            head[column] = random.choice(
                [head[column].upper(), f" {head[column]}", "", "rating", "note", f"{head[column]} (ms)"]
            )
        else:
            rows.append(random.choice([["Mean", "", "", "", "1.2", ""], ["# end"], [""] * 6, [*head], ["total"]]))


def damage_text(random: Random, text: str) -> str:
    """Insert, remove, repeat or replace some characters."""
    for _ in range(random.randint(1, 3)):
        at = random.randrange(len(text) or 1)
        to = min(len(text), at + random.randint(0, 4))
        text = text[:at] + random.choice(["", text[at:to] * 2, *',;\t."\n1 #-é\u00a0']) + text[to:]
    return text


def said(cell: str, mark: str) -> float | None:
    """The number that a cell says: with the decimal mark, and the other one between groups of three digits."""
    text = cell.replace("−", "-").replace("１", "1").replace("\u00a0", " ").strip()
    other = {",": ".", ".": ","}[mark]
    if re.fullmatch(rf"[+-]?\d{{1,3}}(?:{re.escape(other)}\d{{3}})+(?:{re.escape(mark)}\d+)?", text):
        text = text.replace(other, "")
    text = text.replace(mark, ".")
    return float(text) if re.fullmatch(r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?", text) else None


def plain(cell: str) -> str:
    """Return a name in Unicode's compatibility form, in lower case."""
    return " ".join(unicodedata.normalize("NFKC", cell.strip('" ')).replace("−", "-").split()).casefold()


def aperture_said(cell: str) -> str:
    """The aperture that a cell says."""
    text = cell.casefold().replace(",", ".").replace("１", "1").replace("\u00a0", "")
    number = F_NUMBER.fullmatch(text)
    return f"f/{float(number[1]):g}" if number and float(number[1]) else "pinhole" if text in SHARP or number else text


def check(own: OwnRatings, head: list[str], rows: dict[int, list[str]], mark: str) -> None:
    """Compare each row that was read with the cells of its row in the file."""
    names = [name.strip().casefold() for name in head]
    at = {name: names.index(name) for name in HEAD[:5] if name in names}
    for label, read in own.table.iterrows():
        cells = rows[label[1]]
        cells = [*cells, *[""] * (len(head) - len(cells))]
        for name, column in at.items():
            cell = cells[column].strip()
            if name == "rating":
                assert said(cell, mark) == pytest.approx(read["rating"], rel=1e-12), (cell, read["rating"])
            elif name == "aperture":
                assert aperture_said(cell) == read["aperture"], (cell, read["aperture"])
            elif name == "fixation":
                assert read["fixation"].startswith(cell.casefold()), (cell, read["fixation"])
            elif name == "scene":
                assert plain(read["scene"]) == plain(cell), (cell, read["scene"])
            elif "were united" not in " ".join(own.notices):
                assert plain(read["participant_id"]) == plain(cell), (cell, read["participant_id"])
        if "rt" in names and not pd.isna(read.get("response_time")):
            time = said(cells[names.index("rt")], mark)
            assert time == pytest.approx(read["response_time"], rel=1e-12), (cells, read["response_time"])
    left_out = len(rows) - len(own.table)
    answers = [cells[at["rating"]].strip().casefold() for cells in rows.values() if len(cells) > at["rating"]]
    if left_out > sum(answer in EMPTY for answer in answers) + sum(
        len(cells) <= at["rating"] for cells in rows.values()
    ):
        assert re.search("left out|skipped|missing value", " ".join([*own.notes, *own.notices])), (
            "rows were lost without a word"
        )


def attempt(folder: Path, seed: int) -> str:
    """Damage a table, write it in some dialect, and read it: "read" or "refused"."""
    random = Random(seed)
    head, rows = [*HEAD], grid(random)
    kind = random.choice(["csv", "csv", "csv", "text", "text", "json", "lines"])
    if kind != "text" or random.random() < 0.3:
        damage_cells(random, head, rows)
    delimiter, mark = random.choice([(",", "."), (";", "."), (";", ","), ("\t", "."), ("\t", ","), ("|", ".")])
    if kind in ("json", "lines"):
        records = [dict(zip(head, row, strict=False)) for row in rows]
        text = json.dumps(records) if kind == "json" else "\n".join(map(json.dumps, records))
        keys = list(dict.fromkeys(key for record in records for key in record))
        head, mark = keys, "."
        found = {number: [record.get(key, "") for key in keys] for number, record in enumerate(records, start=1)}
    else:
        if mark == ",":
            rows = [[re.sub(r"^(\d+)\.(\d+)$", r"\1,\2", cell) for cell in row] for row in rows]
        out = io.StringIO()
        quoting = random.choice([csv.QUOTE_MINIMAL, csv.QUOTE_ALL])
        csv.writer(out, delimiter=delimiter, lineterminator="\n", quoting=quoting).writerows([head, *rows])
        text = damage_text(random, out.getvalue()) if kind == "text" else out.getvalue()
        lines = list(csv.reader(io.StringIO(text, newline=""), delimiter=delimiter))
        start = next((at for at, line in enumerate(lines) if sum(map(bool, map(str.strip, line))) > 1), 0)
        head = lines[start] if lines else []
        found = {
            number: line
            for number, line in enumerate(lines, start=1)
            if number > start + 1 and any(map(str.strip, line))
        }
    path = folder / f"own.{'json' if kind in ('json', 'lines') else 'csv'}"
    encoding = random.choice(["utf-8", "utf-8", "utf-8-sig", "utf-16", "utf-16-le"])
    path.write_bytes(text.replace("\n", random.choice(["\n", "\r\n"])).encode(encoding))
    try:
        own = read_ratings(path)
    except InputError as error:
        assert "\n" not in str(error)  # noqa: PT017  either outcome will do
        return "refused"
    check(own, head, found, mark)
    return "read"


@pytest.mark.parametrize("block", range(60))
@pytest.mark.fast_cases(1)
def test_damaged_tables_say_what_is_read(tmp_path: Path, block: int) -> None:
    done = []
    for seed in range(50 * block, 50 * block + 50):
        try:
            done.append(attempt(tmp_path, seed))
        except Exception as error:
            error.add_note(f"seed {seed}: {(next(tmp_path.iterdir())).read_bytes()[:1500]!r}")
            raise
    assert 5 < done.count("read") < 45
