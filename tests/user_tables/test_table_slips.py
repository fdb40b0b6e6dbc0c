"""Slips in tables of one's own: noted with their rows for the top of the report, or refused; sound tables are not."""

from __future__ import annotations

import csv
import math
from collections.abc import Iterable
from pathlib import Path

import numpy as np
import pytest

from focalgradient import InputError
from focalgradient.report.reading import explained_table
from focalgradient.statistics import OwnRatings, quality, read_ratings, read_reports
from focalgradient.user_tables import read_conditions

pytestmark = pytest.mark.usefixtures("unrendered")

APERTURES = (("pinhole", 0.0), ("f/22", 2.27), ("f/11", 4.55), ("f/5.6", 8.93))
HEAD = ["participant", "scene", "aperture", "fixation", "rating"]
Row = list[str]


def rows(people: Iterable[str] = ("P01", "P02", "P03", "P10"), seed: int = 1, places: int = 2) -> list[Row]:
    rng = np.random.default_rng(seed)
    return [
        [who, scene, name, fixation, f"{math.exp(0.3 * mm / 8.93 + rng.normal(0, 0.2)):.{places}f}"]
        for who in people
        for scene in ("room", "tree")
        for fixation in ("near", "far")
        for name, mm in APERTURES
    ]


def read(folder: Path, own: list[Row], head: Row | None = None, **settings: object) -> OwnRatings:
    path = folder / "own.csv"
    with path.open("w", newline="", encoding="utf-8") as file:
        csv.writer(file).writerows([head or HEAD, *own])
    return read_ratings(path, **settings)  # type: ignore[arg-type]


def people(own: OwnRatings) -> list[str]:
    return sorted(own.table["participant_id"].unique())


def test_a_plain_table_needs_no_notice(tmp_path: Path) -> None:
    own = read(tmp_path, rows())
    assert own.notices == own.problems == ()
    assert people(own) == ["P01", "P02", "P03", "P10"]


@pytest.mark.parametrize("other", ["p01", "P01\u00a0", "P\u200b-1", "sub-Ｐ01", "Р01"])
def test_spellings_of_one_name_are_one_person(tmp_path: Path, other: str) -> None:
    own = rows()
    for row in own[4:10]:
        row[0] = other
    found = read(tmp_path, own)
    assert people(found) == ["P01", "P02", "P03", "P10"]
    (said,) = found.notices
    assert "rows 6 to 11" in said
    assert "Spellings of one participant were united" in said


@pytest.mark.parametrize("names", [("S1", "S10", "S11"), ("1-1", "11", "1-11"), ("Anna", "Anne", "Ann")])
def test_different_names_are_different_people(tmp_path: Path, names: tuple[str, ...]) -> None:
    found = read(tmp_path, rows(names))
    assert people(found) == sorted(names)
    assert found.notices == ()


def test_rows_of_summaries_are_left_out(tmp_path: Path) -> None:
    """Of people and of scenes; spreads beside means."""
    names = ("mean:", "Gesamtergebnis", "Среднее", "P01 Total", "SD")
    own = [*rows(), *([name, *row[1:]] for name in names for row in rows(["x"], 5))]
    own += [[row[0], "Average", *row[2:]] for row in rows()]
    found = read(tmp_path, own)
    assert people(found) == ["P01", "P02", "P03", "P10"]
    assert set(found.table["scene"]) == {"room", "tree"}
    assert "Rows of summaries were left out" in found.notices[0]
    assert "rows 66 to 145" in found.notices[0]


def test_people_called_max_and_a_scene_called_mean_alone_stay(tmp_path: Path) -> None:
    found = read(tmp_path, rows(["Max", "SD", "Anna"]))
    assert people(found) == ["Anna", "Max", "SD"]
    assert "is taken for the name of a participant" in found.notices[0]
    own = [[row[0], "mean", *row[2:]] for row in rows() if row[1] == "room"]
    assert set(read(tmp_path, own).table["scene"]) == {"mean"}


def test_a_header_in_the_middle_is_left_out(tmp_path: Path) -> None:
    own = rows()
    own.insert(32, [name.upper() for name in HEAD])
    found = read(tmp_path, own)
    assert len(found.table) == 64
    assert found.notices == ("Repeated header skipped: row 34.",)


def test_a_block_pasted_twice_counts_once(tmp_path: Path) -> None:
    own = rows()
    found = read(tmp_path, [*own, *own[16:32]])
    assert len(found.table) == 64
    assert "P02 appears twice" in found.notices[0]
    assert "rows 66 to 81" in found.notices[0]


def test_the_answers_of_one_under_another_name_count_once(tmp_path: Path) -> None:
    own = rows()
    found = read(tmp_path, [*own, *(["P11", *row[1:]] for row in own[16:32])])
    assert people(found) == ["P01", "P02", "P03", "P10"]
    assert "P02, P11 have the same answer in every row" in found.notices[0]


@pytest.mark.parametrize(("scenes", "repetitions"), [(0.0, 1), (0.3, 2)])
def test_steady_people_who_see_no_effect_are_not_copies(tmp_path: Path, scenes: float, repetitions: int) -> None:
    """Five of twelve answer alike, since blur does nothing for them and they round to .1."""
    rng = np.random.default_rng(1)
    levels = {f"s{number}": rng.normal(0, scenes) for number in range(6)}
    own = [
        [f"P{who:02}", scene, name, fixation, f"{math.exp(level + (who > 4) * 0.03 * mm + rng.normal(0, 0.02)):.1f}"]
        for who in range(12)
        for scene, level in levels.items()
        for fixation in ("near", "far")
        for name, mm in APERTURES
        for _ in range(repetitions)
    ]
    found = read(tmp_path, own)
    assert len(people(found)) == 12
    assert len(found.table) == len(own)
    assert found.notices == ()


def test_positions_of_a_slider_are_answers_and_their_scale_is_noted(tmp_path: Path) -> None:
    """They were taken for ratios without a word; 99 is an answer among them."""
    own = [[*row[:4], str(60 + number % 41)] for number, row in enumerate(rows())]
    own[3][4] = "99"
    found = read(tmp_path, own)
    assert len(found.table) == 64
    [said] = found.notices
    assert "whole numbers from 60 to 100, as places on a line are: they were taken for ratios" in said
    assert 'Give scale="ordinal" and by=["aperture"] where differences' in said
    path = tmp_path / "own.csv"
    noted = [
        any("places on a line" in notice for notice in read_conditions(path, by=["aperture"], steps=steps).notices)
        for steps in (False, True)
    ]
    assert noted == [True, False]
    assert read(tmp_path, [[*row[:4], f"{row[4]}5"] for row in own]).notices == ()


def test_whole_numbers_are_noted_but_where_they_are_declared_steps(tmp_path: Path) -> None:
    own = [[*row[:4], str(1 + number % 7)] for number, row in enumerate(rows())]
    assert "whole numbers from 1 to 7" in read(tmp_path, own).notices[0]
    assert read(tmp_path, own, steps=True).notices == ()


def test_diameters_named_apertures_are_refused_or_noted(tmp_path: Path) -> None:
    own = [[*row[:2], str(dict(APERTURES)[row[2]]), *row[3:]] for row in rows()]
    with pytest.raises(
        InputError, match=r"no lens has as its f-number, 2\.27, 4\.55, 8\.93: name the column aperture_mm"
    ):
        read(tmp_path, own)
    named = {"aperture_mm": "aperture"}
    assert sorted(read(tmp_path, own, columns=named).table["aperture_mm"].unique()) == [0, 2.27, 4.55, 8.93]
    doubtful = [[*row[:2], {"2.27": "2", "4.55": "4", "8.93": "8"}.get(row[2], "0"), *row[3:]] for row in own]
    assert "2, 4, 8 in the column of apertures were taken for f-numbers" in read(tmp_path, doubtful).notices[0]
    assert read(tmp_path, doubtful, ["participant", "scene", "f_number", "fixation", "rating"]).notices == ()


def test_cells_and_headings_may_state_millimetres(tmp_path: Path) -> None:
    own = [[*row[:2], f"{dict(APERTURES)[row[2]]} mm", *row[3:]] for row in rows()]
    assert sorted(read(tmp_path, own).table["aperture_mm"].unique()) == [0, 2.27, 4.55, 8.93]
    own[5][2] = "f/8"
    with pytest.raises(InputError, match="in millimetres in some rows, but as 'f/8' in others"):
        read(tmp_path, own)
    plain = [[*row[:2], str(dict(APERTURES)[row[2]]), *row[3:]] for row in rows()]
    for head in ("aperture (mm)", "diameter_mm", "diameter"):
        found = read(tmp_path, plain, ["participant", "scene", head, "fixation", "rating"])
        assert sorted(found.table["aperture_mm"].unique()) == [0, 2.27, 4.55, 8.93]


def test_times_in_milliseconds_are_refused_or_converted(tmp_path: Path) -> None:
    own = [[*row, str(800 + 10 * number)] for number, row in enumerate(rows())]
    found = read(tmp_path, own, [*HEAD, "rt"])  # nobody asked for times
    assert "response_time" not in found.table
    assert "The column rt was not used: the median of response_time is 1115" in found.notices[0]
    with pytest.raises(InputError, match="the median of response_time is 1115, but must be a time in seconds"):
        read(tmp_path, own, [*HEAD, "rt"], columns={"response_time": "rt"})
    found = read(tmp_path, own, [*HEAD, "rt_ms"])
    assert found.table["response_time"].max() == pytest.approx(1.43)
    assert "rt_ms was multiplied by 0.001, for the unit" in found.notices[0]
    jspsych = [[*row, "html-slider-response", "12"] for row in own]
    found = read(tmp_path, jspsych, [*HEAD, "rt", "trial_type", "time_elapsed"])
    assert found.table["response_time"].max() == pytest.approx(1.43)
    assert "rt was multiplied by 0.001, for the unit that jsPsych writes" in found.notices[0]


def test_all_words_that_are_not_understood_are_in_one_message(tmp_path: Path) -> None:
    named = {"pinhole": "zu", "f/22": "halb"}
    own = [
        [row[0], row[1], named.get(row[2], row[2]), {"near": "vorn", "far": "hinten"}[row[3]], row[4]] for row in rows()
    ]
    with pytest.raises(InputError) as caught:
        read(tmp_path, own)
    for word in ("'zu'", "'halb'", "'vorn'", "'hinten'"):
        assert word in str(caught.value)
    words = {"ZU": "pinhole", "halb ": "f/22", "Vorn": "near", "hinten": "far"}
    assert read(tmp_path, own, conditions=words).notices == ()


def test_conditions_that_lead_nowhere_are_noted_or_refused(tmp_path: Path) -> None:
    own = [[*row[:3], {"near": "vorn", "far": "hinten"}[row[3]], row[4]] for row in rows()]
    found = read(tmp_path, own, conditions={"vorn": "near", "hinten": "hinten2"})
    assert "“hinten2” is taken for a fixation of its own, neither near nor far" in found.notices[0]
    with pytest.raises(InputError, match="vorn is given as hinten, which is itself given as vorn"):
        read(tmp_path, own, conditions={"vorn": "hinten", "hinten": "vorn"})
    found = read(tmp_path, own, conditions={"vorn": "near", "hinten": "far", "mitte": "far"})
    assert found.notices == ("The conditions name words that do not occur in the table: mitte.",)
    with pytest.raises(InputError, match=r"no column vp for participant.*colour is not known"):
        read(tmp_path, own, columns={"participant": "vp", "colour": "x"})
    with pytest.raises(InputError, match="rating is given for scene, but for another column, too"):
        read(tmp_path, own, columns={"rating": "rating", "scene": "rating"})


def test_words_may_mark_catch_trials_and_missing_answers(tmp_path: Path) -> None:
    own, head = [[*row, "main"] for row in rows()], [*HEAD, "catch"]
    own[0][4], own[1][5] = "keine Antwort", "Check"
    words = {"main": "0", "check": "1", "keine antwort": "NA"}
    for found in (read(tmp_path, own, head, conditions=words), read_conditions(tmp_path / "own.csv", conditions=words)):
        assert (len(found.table), found.table["catch"].sum()) == (63, 1)
        assert found.notices[0] == "1 row was left out, without a rating (participants P01)."
        assert "words that do not occur" not in " ".join(found.notices)
    with pytest.raises(InputError, match=r"catch is 'Check', but must be 1 or 0 .*with conditions=\{\"NAME\": \"1\"\}"):
        read(tmp_path, own, head, conditions={"keine Antwort": "NA"})
    with pytest.raises(InputError, match=r"missing, or state so with conditions=\{\"keine Antwort\": \"NA\"\}"):
        read(tmp_path, own, head)


@pytest.mark.parametrize(
    ("standard", "said", "kept"),
    [(1, "", 4), (10, "divided by 10, the", 4), (100, "divided by 100, the", 4), (40, "is 38, where 1 is right", 0)],
)
def test_catch_trials_tell_the_standard(tmp_path: Path, standard: int, said: str, kept: int) -> None:
    """Ratings in percent failed every catch trial, and everybody was excluded without a word."""
    own = [[*row[:4], f"{standard * float(row[4]):.3f}", "0"] for row in rows()]
    own += [[row[0], "standard", "pinhole", "near", str(0.95 * standard), "1"] for row in own[::16] for _ in range(3)]
    found = read(tmp_path, own, [*HEAD, "catch"])
    assert [said in notice for notice in found.notices][:1] == [True] * bool(said)
    table, judged = quality(found.table)
    assert judged.subjects_after == table["participant_id"].nunique() == kept


def test_words_of_conditions_leave_catch_trials_as_they_are(tmp_path: Path) -> None:
    own = [[*row[:2], row[2].replace("pinhole", "1"), *row[3:], str(int(row[0] == "P02"))] for row in rows()]
    assert read(tmp_path, own, [*HEAD, "catch"], conditions={"1": "pinhole"}).table["catch"].sum() == 16


def test_a_table_without_a_pinhole_leads_to_its_apertures(tmp_path: Path) -> None:
    """The remedy was another column, though the apertures can be compared."""
    found = read(tmp_path, [row for row in rows() if row[2] != "pinhole"])
    [said] = found.notices
    assert 'by=["aperture=f/22"], or take f/22 for the pinhole with conditions={"f/22": "pinhole"}.' in said
    assert read(tmp_path, rows()).notices == ()


def test_names_of_pictures_are_no_scenes(tmp_path: Path) -> None:
    """jsPsych always writes a column `stimulus`: with a scene for each condition nothing could be tested."""
    one = [row for row in rows() if row[1] == "room"]
    pictures = [[row[0], f"{row[2]}-{row[3]}.png", *row[2:]] for row in one]
    head = ["participant", "stimulus", *HEAD[2:]]
    found = read(tmp_path, pictures, head)
    assert set(found.table["scene"]) == {"all"}
    assert any('was not used as the scene: name it with columns={"scene": "stimulus"}' in say for say in found.notices)
    by = read_conditions(tmp_path / "own.csv", by=["aperture", "fixation"])
    assert "scene" not in by.table
    assert not any("means over" in say for say in by.notices)
    groups = [[*row, "phone" if row[0] < "P03" else "laptop"] for row in pictures]
    read(tmp_path, groups, [*head, "device"])
    assert "scene" not in read_conditions(tmp_path / "own.csv", by=["aperture", "fixation", "device"]).table
    lines = list(explained_table(tmp_path / "own.csv", by=["aperture", "fixation", "device"]))
    assert any(line.startswith("  stimulus -> not used") for line in lines)
    named = read(tmp_path, pictures, head, columns={"scene": "stimulus"})
    assert named.table["scene"].nunique() == 8
    assert read(tmp_path, rows(), head).table["scene"].nunique() == 2


def test_numbers_of_trials_may_count_within_blocks(tmp_path: Path) -> None:
    """The remedy was a choice of rows, where blocks have numbers of their own."""
    numbered = [[*row, str(1 + at % 16 // 8), str(1 + at % 8)] for at, row in enumerate(rows())]
    found = read(tmp_path, numbered, [*HEAD, "block", "trial"])
    assert "Trial numbers count within block." in found.notes
    assert not any("does not tell" in say for say in found.notices)


def test_a_stated_scale_is_not_asked_for_by_explaining(tmp_path: Path) -> None:
    read(tmp_path, [[*row[:4], str(1 + at % 5)] for at, row in enumerate(rows())])
    said = [list(explained_table(tmp_path / "own.csv", steps=steps)) for steps in (False, True)]
    assert [any("scale=" in line for line in lines) for lines in said] == [True, False]


def test_known_words_may_change_places(tmp_path: Path) -> None:
    """Labels that were mixed up are put right; only a meaning that is no known word itself must not be a word."""
    swapped = {"near": "far", "far": "near", "f/22": "pinhole", "pinhole": "f/22"}
    plain, found = read(tmp_path, rows()), read(tmp_path, rows(), conditions=swapped)
    other = {"nearest": "farthest", "farthest": "nearest", **swapped}
    for name in ("fixation", "aperture"):
        assert found.table[name].tolist() == [other.get(cell, cell) for cell in plain.table[name]]


def test_one_trial_with_two_answers_is_refused(tmp_path: Path) -> None:
    blocks = [[*row, str(number % 8 + 1)] for number, row in enumerate(rows())]  # counted anew in each block
    assert len(read(tmp_path, blocks, [*HEAD, "trial"]).table) == 64
    own = [[*row, str(number % 16 + 1)] for number, row in enumerate(rows())]
    read(tmp_path, own, [*HEAD, "trial"])
    own.append([*own[5][:4], "3.21", own[5][5]])
    with pytest.raises(
        InputError, match="row 66: trial 6 of participant P01 occurs in a row above with another answer"
    ):
        read(tmp_path, own, [*HEAD, "trial"])


CUBE = ["A,1,none,rigid,6000", "A,1,none,nonrigid,4000", "A,2,nonrigid,nonrigid,9000", "A,2,nonrigid,rigid,1000"]


def test_reports_in_milliseconds_and_unknown_words(tmp_path: Path) -> None:
    path = tmp_path / "own.csv"
    path.write_text("\n".join(["subject,trial,gradient,percept,dur", *CUBE]))
    with pytest.raises(InputError, match="the median of duration is 5000, but must be a time in seconds"):
        read_reports(path)
    path.write_text("\n".join(["subject,trial,gradient,percept,duration_ms", *CUBE]))
    found = read_reports(path)
    assert found.table["duration"].tolist() == [6, 4, 9, 1]
    assert "duration_ms was multiplied by 0.001" in found.notices[0]
    path.write_text("\n".join(["subject,trial,gradient,percept,dur", "A,1,ohne,starr,6", "a ,1,ohne,weich,4"]))
    with pytest.raises(InputError, match=r"'starr'.*'weich'.*'ohne'"):
        read_reports(path)
    found = read_reports(path, conditions={"Ohne": "none", "starr": "rigid", "weich": "nonrigid"})
    assert found.table["participant_id"].nunique() == 1
