"""Tables as programs of other laboratories write them: read as meant, or refused in one sentence with a remedy."""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from pathlib import Path

import pytest
from command_line import run

from focalgradient import InputError
from focalgradient.eye.target_motion import TargetMotion
from focalgradient.luminance import parse_luminance
from focalgradient.statistics import read_detection, read_ratings, read_reports
from focalgradient.user_tables.conditions import read_conditions

pytestmark = pytest.mark.usefixtures("unrendered")

HEAD = ("participant", "scene", "aperture", "fixation", "rating")
ROWS = [
    (f"p{who}", scene, aperture, fixation, f"{1 + 0.1 * who * (aperture != 'pinhole') + 0.03 * (scene == 'hall'):.2f}")
    for who in range(1, 5)
    for scene in ("garden", "hall")
    for aperture in ("pinhole", "f/5.6")
    for fixation in ("near", "far")
]
TRIALS = [dict(zip(HEAD, row, strict=True)) for row in ROWS]


def written(mark: str = ",", quoted: bool = False, head: tuple[str, ...] = HEAD) -> str:
    cells = [[f'"{cell}"' if quoted else cell for cell in row] for row in (head, *ROWS)]
    return "".join(mark.join(row) + "\n" for row in cells)


def numbered(text: str) -> str:
    head, *rows = text.splitlines()
    return "\n".join([head, *(f'"{number}" {row}' for number, row in enumerate(rows, start=1))])


def jspsych(part: Callable[[str], object]) -> str:
    trials = []
    for trial in TRIALS:
        rest = {name: trial[name] for name in HEAD[:-1]}
        trials += [{"participant": trial["participant"], "response": None}, rest | {"response": part(trial["rating"])}]
    return json.dumps(trials)


READ: dict[str, tuple[str | bytes, dict[str, str]]] = {
    "byte order mark and trailing commas": ("\ufeff" + written().replace("\n", ",\n"), {}),
    "titles above the header": ("Experiment 1,,,,\nCollected in May,,,,\n,,,,\n" + written(), {}),
    "a title of E-Merge": (("e-merged data\n\n" + written("\t")).encode("utf-16"), {}),
    "write.table of R": (numbered(written(" ", quoted=True)), {}),
    "write.table of R without names of rows": (written(" ", quoted=True), {}),
    "spaces behind commas": (written(", ", quoted=True), {}),
    "cells kept as text": ("\n".join(",".join(f'="{cell}"' for cell in row) for row in (HEAD, *ROWS)), {}),
    "a letter for the f-number": (written().replace("f/5.6", "ƒ/5.6"), {}),
    "parts of an answer in cells": (
        "\n".join(
            ",".join([*row[:-1], '"{""slider"": ' + row[-1] + ', ""sure"": 3}"' if number else "response"])
            for number, row in enumerate((HEAD, *ROWS))
        ),
        {"rating": "response.slider"},
    ),
    "parts of an answer": (jspsych(lambda rating: {"slider": float(rating), "sure": 3}), {"rating": "response.slider"}),
    "the one part of an answer": (
        "\n".join(
            "\t".join([*row[:-1], '{"Q0": ' + row[-1] + "}" if number else "response"])
            for number, row in enumerate((HEAD, *ROWS))
        ),
        {},
    ),
    "print of R": ("".join(f"{at or ' ':>3}  {'  '.join(row)}\n" for at, row in enumerate((HEAD, *ROWS))), {}),
    "lists one behind the other": (
        "".join(json.dumps([trial for trial in TRIALS if trial["participant"] == f"p{who}"]) for who in range(1, 5)),
        {},
    ),
    "a loop of practice": (
        written(head=(*HEAD, "practice.thisN")) + "p1,demo,pinhole,near,9,0\np2,demo,pinhole,far,9,1\n",
        {},
    ),
}


@pytest.mark.parametrize("name", READ)
def test_other_programs_tables_are_read_as_meant(tmp_path: Path, name: str) -> None:
    text, columns = READ[name]
    path = tmp_path / "own.txt"
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    if path.read_bytes().startswith(b"["):
        path = path.rename(tmp_path / "own.json")
    table = read_ratings(path, columns).table
    assert table["rating"].tolist() == [float(row[-1]) for row in ROWS]
    assert table["participant_id"].tolist() == [row[0] for row in ROWS]


REFUSED = {
    "Header Start": "\t*** Header Start ***\nLevelName: Session\n*** Header End ***\n".encode("utf-16"),
    "the one column": written(":"),
    "a quotation mark is not closed": written().replace("garden", '"big" garden', 1),
    r'response and depth: say which with columns=\{"rating": "depth"\}': "\n".join(
        ",".join((*row[:4], str(1 + number % 5) if number else "response", row[4] if number else "depth"))
        for number, row in enumerate((HEAD, *ROWS))
    ),
    "has the column rating twice": "\n".join(
        ",".join((*row, "9" if number else "Rating")) for number, row in enumerate((HEAD, *ROWS))
    ),
    "row 4: rating is 110, but .* 1.10 may have lost its decimal mark": written().replace(",1.10", ",110", 1),
    "a formula without its value": written().replace("1.00", "=1+0/100", 1),
    "dates of them": written().replace("f/5.6", "46178").replace("pinhole", "0"),
}


FILES: dict[str, Callable[[int, str], tuple[str, str]]] = {
    "names in another case": lambda who, text: (f"{who}.csv", text.replace("rating", "Rating") if who == 2 else text),
    "other delimiters and decimal marks": lambda who, text: (
        f"{who}.csv",
        text.replace(",", ";").replace(".", ",").replace("f/5,6", "f/5.6") if who == 2 else text,
    ),
    "one name in folders of their own": lambda who, text: (f"study_result_{who}/data.txt", text),
}


@pytest.mark.parametrize("name", FILES)
def test_files_of_one_participant_each_are_read_as_one_table(tmp_path: Path, name: str) -> None:
    head, *rows = written().splitlines()
    paths = []
    for who in range(1, 5):
        text = "\n".join([head, *(row for row in rows if row.startswith(f"p{who},"))])
        file, text = FILES[name](who, text)
        paths.append(tmp_path / file)
        paths[-1].parent.mkdir(exist_ok=True)
        paths[-1].write_text(text)
    assert read_ratings(paths).table["rating"].tolist() == [float(row[-1]) for row in ROWS]
    nameless = [re.sub("(?m)^[^,;]*[,;]", "", path.read_text()) for path in paths]
    for path, text in zip(paths, nameless, strict=True):
        path.write_text(text)
    assert read_ratings(paths).table["participant_id"].nunique() == 4


def test_a_file_with_another_unit_stops_the_others(tmp_path: Path) -> None:
    for name, heading in (("a.csv", "rating"), ("b.csv", "rating (%)")):
        (tmp_path / name).write_text(written(head=(*HEAD[:4], heading)).replace("p1", name[0]))
    with pytest.raises(InputError, match=r"b.csv has no column rating, which other files have"):
        read_ratings([tmp_path / "a.csv", tmp_path / "b.csv"])


@pytest.mark.parametrize("code", ["65535", "-32768", "9999.9", "3.4028235e+38"])
def test_codes_of_missing_values_are_named_in_every_kind_of_table(tmp_path: Path, code: str) -> None:
    path = tmp_path / "own.csv"
    path.write_text(written().replace("1.10", code, 1))
    own = read_ratings(path)
    assert len(own.table) == len(ROWS) - 1
    assert f"{code} in the column of ratings was taken for a missing value" in " ".join(own.notices)
    path.write_text(f"subject,blur_D,rating\nA,0,1\nA,1,1.2\nA,{code},1.3\n")
    assert dict(read_conditions(path, by=["blur_D"]).conditions) == {"blur_D": [0, 1]}
    path.write_text(f"subject,trial,blur,seen,dur\nA,1,sharp,rigid,6\nA,2,sharp,rigid,{code}\n")
    with pytest.raises(InputError, match=r"row 3: duration is .* which marks a missing value"):
        read_reports(path)
    path.write_text(f"time,dioptres\n0,1\n1,{code}\n2,3\n")
    with pytest.raises(InputError, match=r"row 3: dioptres is .* which marks a missing value"):
        TargetMotion.read(path)
    if not code.startswith("-"):
        rows = "".join(f"{level},{code if level == 102 else level / 2.55}\n" for level in range(0, 256, 51))
        with pytest.raises(InputError, match=r"row 4: grey is .* which marks a missing value"):
            parse_luminance("level,grey\n" + rows, "table")


def test_people_of_one_name_or_of_another_unit_are_noticed(tmp_path: Path) -> None:
    path = tmp_path / "own.csv"
    again = "".join(",".join((*row[:4], f"{float(row[4]) + 0.2:.2f}")) + "\n" for row in ROWS if row[0] == "p1")
    path.write_text(written() + again)
    assert "Rows in several places of the table count as of one person: p1." in read_ratings(path).notices
    path.write_text(re.sub(r"(?m)^(p2,.*),(\d)\.(\d\d)$", r"\1,\2\3", written()))
    assert "The ratings of p2 are 94 times those of the others" in " ".join(read_ratings(path).notices)
    header, *rows = written().splitlines()
    seconds = [
        f"{row},{(1 + 0.0371234 * at) * (1000 if row.startswith('p2,') else 1):.4f}" for at, row in enumerate(rows)
    ]
    path.write_text("\n".join([f"{header},rt", *seconds]))
    assert "The response times of p2 are" in " ".join(read_ratings(path).notices)
    path.write_text(written().replace("p1,", "5.7E+23,").replace("p2,", "5.7E+23,"))
    with pytest.raises(InputError, match=r"row 2: the participant is 5.7E\+23, to which a spreadsheet"):
        read_ratings(path)


def test_levels_that_a_spreadsheet_damaged_are_no_names(tmp_path: Path) -> None:
    path = tmp_path / "own.csv"
    text = "subject,blur,rating\n" + "".join(f"{who},{blur},1.{who}\n" for who in (1, 2) for blur in ("0", "X", "2"))
    for numbers in ("02", ("f/22", "f/4")):
        damaged = text.replace("X", "1. Jun").replace(",0,", f",{numbers[0]},").replace(",2,", f",{numbers[1]},")
        path.write_text(damaged)
        with pytest.raises(
            InputError, match=r"blur is '1. Jun', but other levels are not dates: a spreadsheet program"
        ):
            read_conditions(path, by=["blur"])
    path.write_text(text.replace("X", "1 D"))
    assert "The levels of blur are not all numbers (0, 1 D, 2)" in " ".join(read_conditions(path, by=["blur"]).notices)
    assert not read_conditions(path, by=["blur=factor"]).notices


WORDS = {"1": "strongly disagree", "2": "disagree", "3": "none", "4": "agree, mostly"}


@pytest.mark.parametrize("by", [[], ["--by", "aperture"]])
def test_answers_in_words_need_their_order(tmp_path: Path, by: list[str]) -> None:
    path = tmp_path / "own.csv"
    rows = [(*row[:4], WORDS[str(1 + at % 4)]) for at, row in enumerate(ROWS)]
    path.write_text("\n".join("\t".join(row) for row in (HEAD, *rows)))
    shown = run("report", path, "--explain", *by)
    assert "rating is 'strongly disagree', but must be a number" in shown.output
    assert "state the order of answers in words, from the least, with --order WORD,WORD" in shown.output
    order = [word for step in WORDS.values() for word in ("--order", step)]
    shown = run("report", path, "--explain", *by, *order)
    assert "Steps of ratings: strongly disagree = 1, disagree = 2, none = 3, agree, mostly = 4." in shown.output
    own = read_conditions(path, by=["aperture"], order=[*WORDS.values()])
    assert own.table["rating"].tolist() == [1 + at % 4 for at in range(len(ROWS))]
    shown = run("report", path, "--explain", *by, "--order", "disagree,none")
    assert "which is not among the steps in order (disagree, none)" in shown.output


def test_confidence_in_words_needs_its_order(tmp_path: Path) -> None:
    path = tmp_path / "own.csv"
    path.write_text("subject,signal,response,confidence\nA,1,yes,sure\nA,0,no,unsure\nB,0,no,sure\n")
    with pytest.raises(InputError, match="state the order"):
        read_detection(path)
    assert read_detection(path, order=["unsure", "sure"]).table["confidence"].tolist() == [2, 1, 2]


@pytest.mark.parametrize("words", REFUSED)
def test_what_other_programs_damaged_is_refused_with_a_remedy(tmp_path: Path, words: str) -> None:
    content = REFUSED[words]
    path = tmp_path / "own.csv"
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    with pytest.raises(InputError, match="E-Prime's log" if words == "Header Start" else words) as error:
        read_ratings(path)
    assert "\n" not in str(error.value)


def test_named_rows_of_practice_are_noticed(tmp_path: Path) -> None:
    path = tmp_path / "own.csv"
    rows = [",".join((*row, "practice" if number % 8 == 0 else "main")) for number, row in enumerate(ROWS)]
    path.write_text("\n".join([",".join((*HEAD, "phase")), *rows]))
    assert (
        'phase says that 4 rows are practice: leave them out with where={"phase": "main"}.'
        in read_ratings(path).notices
    )
    path.write_text(path.read_text().replace("phase", "excluded").replace("practice", "1").replace("main", "0"))
    assert (
        'excluded (1, 0) was not used: choose rows with where={"excluded": "0"} where it marks rows.'
        in read_ratings(path).notices
    )
    assert len(read_ratings(path, where={"excluded": "0"}).table) == len(ROWS) - 4


def test_numbers_that_may_be_codes_are_noticed_and_can_be_levels(tmp_path: Path) -> None:
    """As products of a tasting are coded 1 to 4."""
    rows = [f"p{who},{code},{1 + 0.1 * who + 0.3 * (code == 2):.2f}" for who in range(5) for code in (1, 2, 3)]
    path = tmp_path / "own.csv"
    path.write_text("\n".join(["subject,product,rating", *rows]))
    own = read_conditions(path, by=["product"])
    assert dict(own.conditions) == {"product": [1.0, 2.0, 3.0]}
    assert 'taken for amounts: if they are codes, give by=["product=factor"]' in " ".join(own.notices)
    own = read_conditions(path, by=["product=factor"])
    assert dict(own.conditions) == {"product": ["1", "2", "3"]}
    assert not own.notices
