"""Every equation and figure of the paper has one home, and the table in `docs/paper.md` says where."""

import re
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).parents[1]
TABLE = (ROOT / "docs" / "paper.md").read_text(encoding="utf-8")


def rows(kind: str) -> Iterator[tuple[str, str, str]]:
    """(name, home, test) of each row whose first cell starts so."""
    for line in TABLE.splitlines():
        cells = [cell.strip() for cell in line.strip("|").split("|")]
        if line.startswith("|") and cells[0].startswith(kind):
            yield cells[0], cells[2].strip("`"), cells[3].strip("`")


def test_all_are_there() -> None:
    assert [name for name, *_ in rows("Eq.")] == [f"Eq. {number}" for number in range(1, 17)]
    assert [name for name, *_ in rows("Fig.")] == [f"Fig. {number}" for number in range(1, 7)]
    assert [name.split(", ")[1] for name, *_ in rows("appendix")] == ["k", "Lommel", "Gaussian", "sampling"]


def test_a_search_of_the_package_finds_each_equation_and_no_other() -> None:
    files = (file.read_text(encoding="utf-8") for file in (ROOT / "src").rglob("*.py"))
    assert {found for text in files for found in re.findall(r"Eq\. \d+", text)} == {name for name, *_ in rows("Eq.")}
