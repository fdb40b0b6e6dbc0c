"""Tables of users: either their cells are returned as the text says, or the file is refused in one sentence."""

from __future__ import annotations

import csv
import io
import json
import zipfile
from pathlib import Path

import openpyxl
import pandas as pd
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from focalgradient import InputError
from focalgradient.eye import read_zernike
from focalgradient.eye.target_motion import TargetMotion
from focalgradient.files.tables import TextTable, parse_table
from focalgradient.luminance import parse_luminance
from focalgradient.report.reading import explained_table
from focalgradient.statistics import read_ratings, read_thresholds
from focalgradient.user_tables.files import read_table

HEAD = "participant,aperture,fixation,scene,rating"
BODY = [
    f"S{who},{aperture},{fixation},{scene},{1 + 0.1 * who * (aperture != 'pinhole'):.2f}"
    for who in range(1, 5)
    for aperture in ("pinhole", "f/5.6")
    for fixation in ("near", "far")
    for scene in ("garden", "hall")
]
TABLE = "\n".join([HEAD, *BODY])


def saved(folder: Path, text: str | bytes, name: str = "own.csv") -> Path:
    path = folder / name
    path.write_bytes(text.encode() if isinstance(text, str) else text)
    return path


def test_each_container_gives_the_same_cells(tmp_path: Path) -> None:
    plain = read_ratings(saved(tmp_path, TABLE)).table.reset_index(drop=True)
    records = list(csv.DictReader(io.StringIO(TABLE)))
    typed = [row | {"rating": float(row["rating"])} for row in records]
    halves = [[row for row in typed if row["participant"] in half] for half in (("S1", "S2"), ("S3", "S4"))]
    semicolons = TABLE.replace(",", ";")
    written = {
        "tabs.tsv": TABLE.replace(",", "\t"),
        "named wrongly.tsv": TABLE,
        "sep.csv": "sep=;\n" + semicolons,
        "commas.csv": "\n".join([HEAD.replace(",", ";"), *(row.replace(",", ";").replace(".", ",") for row in BODY)]),
        "bars.csv": semicolons.replace(";", "|"),
        "comments.csv": "\n".join(["# of 2026", HEAD, *BODY, "# the end"]),
        "utf16.csv": semicolons.encode("utf-16"),
        "list.json": json.dumps(typed),
        "lines.jsonl": "\n".join(json.dumps(row) for row in typed),
        "jatos.txt": "\n".join(json.dumps(half) for half in halves),
        "trials.json": json.dumps({"version": 1, "trials": typed}),
        "columns.json": json.dumps({name: [row[name] for row in typed] for name in HEAD.split(",")}),
    }
    for name, text in written.items():
        found = read_ratings(saved(tmp_path, text, name)).table.reset_index(drop=True)
        assert found[HEAD.split(",")[1:3]].equals(plain[HEAD.split(",")[1:3]]), name
        assert found["rating"].tolist() == plain["rating"].tolist(), name


@pytest.mark.parametrize(
    ("cells", "delimiter", "sentence"),
    [
        (["1.5", "1,4"], ";", "row 3: rating is '1,4', .*: it is 1.4 or 14"),
        (["1,234.5", "2"], ";", "is '1,234.5', which is 1234.5"),
        (["1.234,5", "2"], ";", "is '1.234,5', which is 1234.5 or 1.2345"),
        (["1,234,567", "2"], ";", "without thousands separators"),
        (["1'234.5", "2"], ";", "without thousands separators"),
        (["1.050", "1.100"], ";", "row 2: rating is '1.050', which is 1.050 or 1050"),
        (["1,050", "1,100"], "\t", "row 2: rating is '1,050', which is 1.050 or 1050"),
    ],
)
def test_thousands_and_mixtures_are_refused(tmp_path: Path, cells: list[str], delimiter: str, sentence: str) -> None:
    rows = [["participant", "aperture", "fixation", "rating"], *(["S1", "f5.6", "near", cell] for cell in cells)]
    with pytest.raises(InputError, match=sentence):
        read_ratings(saved(tmp_path, "\n".join(delimiter.join(row) for row in rows)))


def test_one_mark_is_chosen_for_the_whole_file() -> None:
    table = parse_table(b"a;b\n1,050;0,5\n2,100;x\n", "x.csv")
    assert table.with_points().rows == (("1.050", "0.5"), ("2.100", "x"))


def test_a_heading_states_the_unit_of_the_rest(tmp_path: Path) -> None:
    text = "\n".join([HEAD.replace("aperture", "pupil (cm)") + ",rt (ms)", *(f"{row},900" for row in BODY)])
    text = text.replace("f/5.6", "0.3").replace("pinhole", "0")
    own = read_ratings(saved(tmp_path, text), {"aperture_mm": "pupil (cm)"})
    assert sorted(own.table["aperture_mm"].unique()) == [0, 3]
    assert own.table["response_time"].unique() == pytest.approx([0.9])
    convert, other = "convert the column", 'name another column with columns={"rating": "NAME"}'
    for heading, remedy in (("rating (dB)", convert), ("log rating", convert), ("rating [ms]", other)):
        with pytest.raises(InputError, match=f"states the unit .*: {remedy}"):
            read_ratings(saved(tmp_path, "\n".join([HEAD.replace("rating", heading), *BODY])), {"rating": heading})


@pytest.mark.parametrize(
    ("heading", "columns"),
    [
        *(("log10_level", {}), ("log10 level", {}), ("level (log10)", {})),
        *(("log blur", {"log10_level": "log blur"}), ("intensity", {"log10_level": "intensity"})),
    ],
)
def test_logarithms_of_levels_are_undone(tmp_path: Path, heading: str, columns: dict[str, str]) -> None:
    rows = [f"S1,{level},{int(level > -0.8)}" for level in (-1.0, -0.5, -1.0, -0.5)]
    own = read_thresholds(saved(tmp_path, "\n".join([f"participant,{heading},correct", *rows])), columns)
    assert sorted(own.table["level"].unique()) == pytest.approx([0.1, 10**-0.5])
    assert f"  {heading} -> level: -1.0; -0.5" in explained_table(tmp_path / "own.csv", columns)


@pytest.mark.parametrize("heading", ["level (dB)", "log_contrast"])
def test_levels_in_decibels_or_an_unknown_logarithm_are_refused(tmp_path: Path, heading: str) -> None:
    rows = [f"S1,{level},1" for level in (0.5, 1.0, 2.0)]
    with pytest.raises(InputError, match=r"says that levels are in .*log10_level"):
        read_thresholds(saved(tmp_path, "\n".join([f"participant,{heading},correct", *rows])))


def test_rows_are_chosen_by_where(tmp_path: Path) -> None:
    rows = [f"{row},slider" for row in BODY] + [row.rpartition(",")[0] + ",f,key" for row in BODY]
    path = saved(tmp_path, "\n".join([f"{HEAD},trial_type", *rows]))
    with pytest.raises(InputError, match=r"rating is 'f', but must be a number.*where={.trial_type.: .slider.}"):
        read_ratings(path)
    assert len(read_ratings(path, where={"trial_type": ["slider"]}).table) == len(BODY)
    with pytest.raises(InputError, match="no row whose trial_type is sliders: it has slider, key"):
        read_ratings(path, where={"trial_type": ["sliders"]})


def test_start_and_end_of_each_trial_are_not_two_ratings(tmp_path: Path) -> None:
    rows = [f"{row},{kind}" for row in BODY for kind in ("start", "end")]
    rows = [row.replace(row.split(",")[4], "1.0") if row.endswith("start") else row for row in rows]
    text = "\n".join([f"{HEAD},event", *rows])
    assert 'choose with where={"event": "end"}' in " ".join(read_ratings(saved(tmp_path, text)).notices)
    numbered = "\n".join([f"trial,{HEAD},event", *(f"{number // 2 + 1},{row}" for number, row in enumerate(rows))])
    with pytest.raises(InputError, match=r"occurs in a row above with another answer.*where={.event.: .end.}"):
        read_ratings(saved(tmp_path, numbered))


@pytest.mark.parametrize(("other", "last"), [("rt", False), ("RT_ms", True)])
def test_other_measures_of_a_wide_table_are_no_scenes(tmp_path: Path, other: str, last: bool) -> None:
    names = [f"{fixation}_{aperture}_garden" for fixation in ("near", "far") for aperture in ("pinhole", "f5.6")]
    head = [f"{name}_{of}" if last else f"{of}_{name}" for of in ("rating", other) for name in names]
    rows = [f"S{who},1.0,1.4,1.0,1.1,{who},1,2,3" for who in range(1, 5)]
    own = read_ratings(saved(tmp_path, "\n".join([",".join(["participant", *head]), *rows])))
    assert len(own.table) == 16
    assert set(own.table["scene"]) == {"garden"}
    assert any(other in notice for notice in own.notices)


def test_two_unknown_measures_are_asked_for(tmp_path: Path) -> None:
    names = [f"{fixation}_{aperture}" for fixation in ("near", "far") for aperture in ("pinhole", "f5.6")]
    head = ",".join(["participant", *(f"{of}_{name}" for of in ("depth", "comfort") for name in names)])
    rows = [f"S{who},1.0,1.4,1.0,1.1,70,80,60,50" for who in range(1, 5)]
    path = saved(tmp_path, "\n".join([head, *rows]))
    with pytest.raises(InputError, match="say which measure is the rating"):
        read_ratings(path)
    assert read_ratings(path, {"rating": "depth_*"}).table["rating"].max() == 1.4


ZERNIKE = {
    "4;0,05\n12;0,12\n": {4: 0.05, 12: 0.12},
    "um\n1,02\n2,05\n": {0: 1.02, 1: 2.05},
    "4 0,05\n12 0,12\n": {4: 0.05, 12: 0.12},
    "n,m,coefficient (nm)\n4,0,50\n": {12: 0.05},
    "# coefficients in nm\n4 50\n": {4: 0.05},
    "index,coefficient [mm]\n4,0.0003\n": {4: 0.3},
    "OSA/ANSI index,µm\n4,0.2\n": {4: 0.2},
    "j,c (m)\n4,2e-7\n": {4: 0.2},
}


@pytest.mark.parametrize("text", ZERNIKE)
def test_coefficients_are_converted_as_their_heading_states(tmp_path: Path, text: str) -> None:
    values = read_zernike(saved(tmp_path, text))
    assert {index: value for index, value in enumerate(values) if value} == pytest.approx(ZERNIKE[text])


@pytest.mark.parametrize(
    "text",
    [
        *("Wyant index,um\n3,0.2\n", "Malacara,um\n4,0.2\n", "Noll,um\n4,0.2\n", "Born & Wolf index,um\n4,.2\n"),
        *("index,waves\n4,0.2\n", "index,coefficient (D)\n4,0.2\n", "1,02\n2,05\n", "index,λ\n4,0.2\n"),
        *("index,um\n4,1.234,5\n", "index;um\n4;0,05\n12;0.12\n", "index,um\n4,nan\n", "index,um\n4,inf\n"),
    ],
)
def test_other_orders_units_and_mixtures_of_coefficients_are_refused(tmp_path: Path, text: str) -> None:
    with pytest.raises(InputError) as error:
        read_zernike(saved(tmp_path, text))
    assert "\n" not in str(error.value)


def test_a_course_is_converted_as_its_headings_state(tmp_path: Path) -> None:
    for text in (
        "time,dioptres\n0,2\n2,4\n",
        "t (ms);distance (cm)\n0;50\n2000;25\n",
        "time_s\tdistance_m\n0\t0,5\n2\t0,25\n",
    ):
        course = TargetMotion.read(saved(tmp_path, text))
        assert (course.at(0.0), course.at(2.0)) == pytest.approx((2, 4))
    for text in ("time,distance\n0,2\n2,4\n", "time (h),D\n0,2\n2,4\n", "time,D\n0,nan\n1,2\n"):
        with pytest.raises(InputError):
            TargetMotion.read(saved(tmp_path, text))


def test_a_photometers_table_may_have_semicolons_and_units() -> None:
    levels = range(0, 256, 51)
    text = "Level;Grey (cd/m2)\n" + "".join(f"{level};{level / 2.55:.1f}\n".replace(".", ",") for level in levels)
    assert parse_luminance(text, "table").grey.white == pytest.approx(100, rel=1e-3)
    with pytest.raises(InputError, match="grey is in fl, but must be in cd/m2"):
        parse_luminance(text.replace("cd/m2", "fL"), "table")
    with pytest.raises(InputError, match=r"row 3: Grey .* is 'nan'"):
        parse_luminance(text.replace("20,0", "nan"), "table")


CELL = st.one_of(
    st.sampled_from(["", "A", "1.5", "1,5", "nan", "inf", "1e5", "-3", "0", "f/5.6", "5.6.2026", "1.234,5", "é", "#x"]),
    st.floats(allow_nan=False, allow_infinity=False, width=32).map(repr),
    st.text(st.characters(codec="utf-8", exclude_characters="\0\r\n"), max_size=6),
)


@given(st.lists(st.lists(CELL, min_size=3, max_size=3), min_size=1, max_size=5), st.sampled_from(",;\t|"))
@settings(max_examples=150, deadline=None)
def test_cells_are_as_written_or_the_table_is_refused(rows: list[list[str]], delimiter: str) -> None:
    text = io.StringIO()
    writer = csv.writer(text, delimiter=delimiter, lineterminator="\n")
    writer.writerow(["first", "second", "third"])
    writer.writerows(rows)
    try:
        table = parse_table(text.getvalue().encode(), "x.csv")
    except InputError as error:
        assert "\n" not in str(error)  # noqa: PT017  either outcome will do
        return
    kept = [row for row in rows if any(cell.strip() for cell in row) and not _comment(row)]
    assert table.header == ("first", "second", "third")
    assert [list(row) for row in table.rows] == kept
    _points_are_the_numbers_written(table)


def _comment(row: list[str]) -> bool:
    return row[0].lstrip().startswith(("#", "%")) and not any(cell.strip() for cell in row[1:])


def _points_are_the_numbers_written(table: TextTable) -> None:
    try:
        changed = table.with_points()
    except InputError as error:
        assert "\n" not in str(error)  # noqa: PT017
        return
    for before, after in zip(table.rows, changed.rows, strict=True):
        assert all(a == b or a == b.replace(",", ".") for a, b in zip(after, before, strict=True))
    if changed is not table:
        assert not any("." in cell and cell.replace(".", "", 1).isdigit() for row in table.rows for cell in row)


def test_names_of_the_first_columns_may_stand_in_the_second_row(tmp_path: Path) -> None:
    """As in a spreadsheet whose spanning names stand over the conditions alone; each row is of another scene."""
    names, ratings = ",,near,,far,\nsubject,scene,pinhole,f/5.6,pinhole,f/5.6\n", "1.0,1.4,0.9,1.2\n"
    own = read_ratings(saved(tmp_path, f"{names}A,yard,{ratings}A,road,{ratings}"))
    assert own.table["rating"].tolist() == [1.0, 1.4, 0.9, 1.2] * 2
    assert set(own.table["scene"]) == {"yard", "road"}
    assert not any("repetitions" in notice for notice in own.notices)
    own = read_ratings(saved(tmp_path, f"{names}A,yard,{ratings}A,yard,1.1,1.2,1.3,1.0\n"))
    assert any("repetitions by one person: A" in notice for notice in own.notices)


def test_names_in_two_rows_are_joined(tmp_path: Path) -> None:
    spanning = "id,near,,far,\n,pinhole,f/5.6,pinhole,f/5.6\nA,1.0,1.4,0.9,1.2\nB,1.1,1.5,1.0,1.3\n"
    own = read_ratings(saved(tmp_path, spanning))
    cells = own.table[["participant_id", "fixation", "aperture", "rating"]].values.tolist()
    assert cells[:4] == [
        ["A", "nearest", "pinhole", 1.0],
        ["A", "nearest", "f/5.6", 1.4],
        ["A", "farthest", "pinhole", 0.9],
        ["A", "farthest", "f/5.6", 1.2],
    ]
    assert any("are in two rows, of which 2 is the second: id, near pinhole" in note for note in own.notes)
    units = f"{HEAD},rt\n,,,,,[ms]\n" + "".join(f"{line},{800 + number}\n" for number, line in enumerate(BODY))
    assert read_ratings(saved(tmp_path, units)).table["response_time"].iloc[0] == pytest.approx(0.8)
    rows = "id,sex,aperture,fixation,rating\nA,m,pinhole,near,1\nB,f,f/4,near,1.2\n"
    assert len(read_ratings(saved(tmp_path, rows)).table) == 2


@pytest.mark.parametrize("written", ["1:5.6", "1 : 5,6", "f:5.6", "F5.6", "f/5.6"])
def test_f_numbers_as_engraved_on_lenses(tmp_path: Path, written: str) -> None:
    text = TABLE.replace("f/5.6", f'"{written}"')
    assert set(read_ratings(saved(tmp_path, text)).table["aperture"]) == {"pinhole", "f/5.6"}


def archive(*parts: str) -> bytes:
    content = io.BytesIO()
    with zipfile.ZipFile(content, "w") as written:
        for part in parts:
            written.writestr(part, "x")
    return content.getvalue()


FOREIGN = {
    "is a picture": b"\x89PNG\r\n",
    "is an old Excel": b"\xd0\xcf\x11\xe0\xa1\xb1",
    "is an HDF5 file": b"\x89HDF\r\n",
    "is a web page": b"<!DOCTYPE html><html>",
    "is an R data file": b"RDX3\nX\n",
    "is JSON, but is damaged": b'{"a": [1, 2}',
    "is not text in a known encoding": b"participant\0rating",
    "a JASP file": archive("manifest.json", "analyses.json", "data.bin", "index.html"),
    "a document, not a workbook": archive("[Content_Types].xml", "word/document.xml"),
    "a SAS file": bytes(12) + b"\xc2\xea\x81\x60" + bytes(100),
    "is JSON with NaN, .* write null for missing values": '[{"participant": "A", "rating": NaN}]',
    "ends within row 32, after 2 of 5 cells": "\n".join([HEAD, *BODY[:-2]]) + "\nS4,f/",
    "states the unit inch, but aperture_mm must be in mm": TABLE.replace(",aperture,", ",aperture (inch),"),
    "is '2026-05-01', .* a date": "\n".join([HEAD, *BODY, BODY[-1].rpartition(",")[0] + ",2026-05-01"]),
    "may have taken 1.050 for 1,050": "\n".join([HEAD, *BODY, BODY[-1].rpartition(",")[0] + ",1050"]),
    **{
        f"is '{cell}'.* a spreadsheet program may have made a date of it": TABLE.replace("f/5.6", cell)
        for cell in ("2026-06-05", "Jun-05", "f/46178", "6/5/2026")
    },
}


def test_a_sheet_of_remarks_is_no_table(tmp_path: Path) -> None:
    with pd.ExcelWriter(tmp_path / "own.xlsx") as book:
        pd.DataFrame({"Remarks": ["May 2026"]}).to_excel(book, sheet_name="README", index=False)
        pd.DataFrame({"subject": ["A"], "rating": [1.5]}).to_excel(book, sheet_name="data", index=False)
    table = read_table(tmp_path / "own.xlsx")
    assert table.cells.to_numpy().tolist() == [["A", "1.5"]]
    assert "only data has several columns, and was read" in " ".join(table.notes)


@pytest.mark.parametrize("words", FOREIGN)
def test_foreign_and_damaged_files_are_named(tmp_path: Path, words: str) -> None:
    with pytest.raises(InputError, match=words) as error:
        read_ratings(saved(tmp_path, FOREIGN[words]))
    assert "\n" not in str(error.value)


@pytest.mark.parametrize("orient", ["columns", "index", "split", "records"])
def test_json_of_pandas_is_read(orient: str) -> None:
    frame = pd.read_csv(io.StringIO(TABLE))
    table = parse_table(frame.to_json(orient=orient).encode(), "x.json")
    assert list(table.header) == HEAD.split(",")
    assert [float(row[4]) for row in table.rows] == frame["rating"].tolist()


def test_times_that_cannot_be_are_not_used(tmp_path: Path) -> None:
    """Negative ones, and those of a thousandth of the usual, as where 1.168 ms was written for 1,168 ms."""
    rows = [f"{line},{-1 if number % 5 == 0 else 1.5}" for number, line in enumerate(BODY)]
    own = read_ratings(saved(tmp_path, "\n".join([f"{HEAD},rt", *rows])))
    assert own.table["response_time"].dropna().unique().tolist() == [1.5]
    assert "-1 in the column of response_times was taken for a missing" in " ".join(own.notices)
    rows = [f"{line},1.{100 + number}" for number, line in enumerate(BODY)]
    own = read_ratings(saved(tmp_path, "\n".join([f"{HEAD},rt_ms", *rows])))
    assert "response_time" not in own.table
    assert any("rt_ms was not used: the median of response_time is 0.0011" in notice for notice in own.notices)


def test_how_each_column_is_read_is_explained(tmp_path: Path) -> None:
    lines = list(explained_table(saved(tmp_path, "\n".join([f"{HEAD},rt (ms)", *(f"{row},800" for row in BODY)]))))
    assert "taken for 32 depth ratings" in lines[0]
    assert "  rt (ms) -> response_time, times 0.001: 800" in lines
    assert "  scene -> scene: garden; hall" in lines


def test_names_of_merged_cells_and_units_below_names_are_read(tmp_path: Path) -> None:
    """A workbook has no cells right of the last merged one; a unit that the name states is not added to it."""
    sheet = openpyxl.Workbook().active
    for row in (["id", "near", None, "far", None], [None, *["pinhole", "f/5.6"] * 2], ["A", 1.0, 1.4, 1.0, 1.1]):
        sheet.append(row)
    sheet.merge_cells("D1:E1")
    sheet.parent.save(tmp_path / "merged.xlsx")
    assert read_ratings(tmp_path / "merged.xlsx").table["rating"].to_list() == [1.0, 1.4, 1.0, 1.1]
    units = parse_table(b"id,blur_D,size,rating\n,D,deg,\nA,0,1,1.0\nA,1,1,1.4\n", "units.csv")
    assert units.header == ("id", "blur_D", "size (deg)", "rating")


def test_labels_of_the_ends_of_a_scale_are_left_out(tmp_path: Path) -> None:
    """As forms export them; a date that a spreadsheet program made of a number stays refused."""
    text = f"{HEAD}\nA,pinhole,near,s,1 (flat)\nA,f/4,near,s,5 - very deep\nB,pinhole,near,s,2\nB,f/4,near,s,4\n"
    own = read_ratings(saved(tmp_path, text), steps=True)
    assert own.table["rating"].to_list() == [1, 5, 2, 4]
    assert any("without their labels: 1 (flat), 5 - very deep" in note for note in own.notes)
    with pytest.raises(InputError, match="5-Jun"):
        read_ratings(saved(tmp_path, text.replace("5 - very deep", "5-Jun")))
