"""Several files of one experiment are one table; tables of separate experiments are pooled if the user says so."""

import json
import re
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
import pytest
from command_line import run, succeed

from focalgradient.errors import InputError
from focalgradient.user_tables import read_conditions, read_detection, read_ratings, read_reports, read_thresholds
from focalgradient.user_tables.files import read_table, text_table
from focalgradient.user_tables.imported import ImportedAnswers

pytestmark = pytest.mark.usefixtures("unrendered")

HEAD = "Sujet\tRendu\tScène\tEssai\trating\n"
PEOPLE = ("AB", "CD", "EF", "GH", "IJ", "KL", "MN", "OP")
LEVELS = {"aucun flou": 0.0, "flou uniforme": 2.0, "flou de profondeur": 12.0}
RATINGS = [(who, level, scene) for who in PEOPLE for level in LEVELS for scene in ("rue", "plage")]
BY = ["--by", "Rendu", "--columns", "participant=Sujet,scene=Scène,trial=Essai"]


def rows(seed: int = 7) -> list[str]:
    """Return a row for each of the ratings, which differ by level, with trial numbers by person."""
    drawn = np.random.default_rng(seed)
    values = [f"{50 + LEVELS[level] + drawn.normal(0, 3):.1f}".replace(".", ",") for _, level, _ in RATINGS]
    return [
        f"{who}\t{level}\t{scene}\t{at % 6 + 1}\t{value}\n"
        for at, ((who, level, scene), value) in enumerate(zip(RATINGS, values, strict=True))
    ]


def saved(folder: Path, *parts: Sequence[str], head: str = HEAD) -> list[str]:
    """Write each part to a file, and return the files."""
    folder.mkdir(exist_ok=True)
    paths = [folder / f"part{number}.txt" for number in range(len(parts))]
    for path, part in zip(paths, parts, strict=True):
        path.write_text(head + "".join(part), encoding="utf-8")
    return [str(path) for path in paths]


def report(out: Path, *words: str) -> tuple[str, str]:
    """Return the report as Markdown, and what the command printed."""
    said = succeed("report", *words, "--out", out).output
    return (out / "report.md").read_text(encoding="utf-8"), said


def estimates(out: Path) -> list[float]:
    return [result["estimate"] for result in json.loads((out / "results.json").read_text())["results"]]


def test_people_spread_over_two_files_are_one_table(tmp_path: Path) -> None:
    """Taken as two data sets they gave t(1), with the person in both files counted twice."""
    whole = rows()
    part = [row.replace("GH", "gh ") for row in whole[20:]]
    parts = report(tmp_path / "two", *saved(tmp_path / "data", whole[:20], part), *BY)
    alone = report(tmp_path / "one", *saved(tmp_path / "whole", whole), *BY)
    assert "t(7)" in parts[0]
    assert estimates(tmp_path / "two") == pytest.approx(estimates(tmp_path / "one"))
    said = "The 2 files were read as one table of 8 participants, of whom gh occurs in several"
    assert said in parts[0]
    assert f"{said}: for separate experiments use 'focalgradient report --separate'." in parts[1]
    assert "files were read" not in alone[1]


def test_separate_experiments_are_pooled_and_shared_names_stated(tmp_path: Path) -> None:
    first, second = rows(), [row.replace("AB\t", "XY\t") for row in rows(8)]
    text, said = report(tmp_path / "out", *saved(tmp_path / "data", first, second), *BY, "--separate")
    assert "# Meta-analysis of 2 data sets" in text
    note = "2 files taken as 2 data sets: they are separate experiments; taken for different people though in several"
    for shown in (text, said):
        assert f"{note} of them: CD, EF, GH, IJ, KL, MN, OP." in shown
    refused = run("report", *saved(tmp_path / "data", first), *BY, "--separate", "--out", tmp_path / "no")
    assert "--separate is for several tables" in refused.output


def test_other_columns_and_people_are_separate_data_sets_with_a_notice(tmp_path: Path) -> None:
    [first] = saved(tmp_path / "first", rows())
    other = [re.sub("^..", lambda name: f"{name[0]}2", row.replace("\n", "\tx\n")) for row in rows(8)]
    [second] = saved(tmp_path / "second", [*other], head=HEAD.replace("\n", "\tRemarque\n"))
    text, said = report(tmp_path / "out", first, second, *BY)
    assert "# Meta-analysis of 2 data sets" in text
    assert "their columns differ, and no participant occurs in two; give them the same columns if" in said


def test_notices_of_each_data_set_stand_in_the_pooled_report(tmp_path: Path) -> None:
    """They were dropped: the command printed "Done" alone."""
    first = rows()
    first[0] = re.sub(r"\d+,\d+", "", first[0])
    _, said = report(tmp_path / "out", *saved(tmp_path / "data", first, rows(8)), *BY, "--separate")
    assert "part0.txt: 1 row was left out, without a rating (participants AB)." in said


def test_trial_numbers_that_begin_again_in_each_file_count_within_it() -> None:
    """Sessions in two files, of a person who made only some trials again: not two answers to one trial."""
    head = "subject,aperture_mm,trial,rating\n"
    first = [f"{who},{mm},{mm},1.{mm}\n" for who in "ABCDEFGH" for mm in (1, 2, 4)]
    tables = [text_table(head + "".join(first), "a.csv"), text_table(f"{head}H,1,1,1.7\nH,2,2,1.6\n", "b.csv")]
    own = read_conditions(tables)
    assert own.table["trial"].tolist()[-5:] == [1, 2, 3, 4, 5]
    assert "Trial numbers count within files." in own.notes
    with pytest.raises(InputError, match="occurs in a row above with another answer"):
        read_conditions(text_table(head + "".join([*first, "H,1,1,1.7\nH,2,2,1.6\n"])))


@pytest.mark.parametrize(
    ("read", "head", "row"),
    [
        (read_thresholds, "subject,session,level,correct,rt", "{who},1,{even},1,0.{at}"),
        (read_detection, "subject,session,signal,response,rt", "{who},1,{even},1,0.{at}"),
        (read_reports, "subject,session,trial,percept,gradient,duration", "{who},1,{at},rigid,none,{even}1"),
    ],
)
def test_copies_count_once(read: Callable[..., ImportedAnswers], head: str, row: str) -> None:
    """PsychoPy and browsers write copies of a file; trials of tables without ratings counted twice without a word."""
    people = ["".join(f"{row.format(who=who, even=at % 2, at=at)}\n" for at in range(2, 32)) for who in "ABC"]
    if read is read_thresholds:
        people = [rows.replace(",1,0,", ",1,2,") for rows in people]
    files = [text_table(f"{head}\n{rows}", f"{name}.csv") for name, rows in zip("abc", people, strict=True)]
    own = read([*files, text_table(f"{head}\n{people[1]}", "b_1.csv")])
    assert len(own.table) == len(read(files).table) == 90
    assert "Copies of files, whose rows all equal those of another, were dropped: b_1.csv." in own.notices
    own = read(text_table("".join([head, "\n", *people, people[1]])))
    assert len(own.table) == 90
    assert "Participant B, session 1 appears twice with identical answers; rows 92 to 121 were dropped." in own.notices
    assert len(read([*files, text_table(f"{head}\n{people[1].replace('B,1', 'B,2')}", "d.csv")]).table) == 120


def test_small_files_that_agree_are_no_copies() -> None:
    """Two people without names in their files, or sessions of few counts, may well have the same answers."""
    few = "level,correct,trials\n1,5,10\n2,8,10\n3,9,10\n4,10,10\n"
    assert len(read_thresholds([text_table(few, "anna.csv"), text_table(few, "ben.csv")]).table) == 80
    assert len(read_thresholds([text_table(few, "anna.csv"), text_table(few, "anna (1).csv")]).table) == 40


def test_explaining_marks_what_is_missing(tmp_path: Path) -> None:
    """It printed an error about columns, and nothing that was recognised."""
    head = "Vpn\tÖffnung\tBlick\tUrteil1\n"
    parts = [[f"VP{who}\tLoch\tvorn\t0,{who}{at}\n" for at in range(15)] for who in (1, 2)]
    shown = run("report", *saved(tmp_path / "data", *parts, head=head), "--explain")
    assert shown.exit_code != 0
    assert "part0.txt and 1 more: 30 rows, taken for depth ratings\n" in shown.output
    assert "  Vpn -> participant_id: VP1; VP2\n" in shown.output
    remedy = "name it with --columns aperture=NAME, or other conditions with --by NAME"
    assert f"  (no column) -> aperture: {remedy}\n" in shown.output
    assert "  (no column) -> rating: name it with --columns rating=NAME\n" in shown.output
    assert "-> participant:" not in shown.output
    assert re.search(r"Error: the table of \S+ and 1 more has no columns for aperture, rating", shown.output)


def test_a_wrong_name_of_a_column_leads_to_the_right_one(tmp_path: Path) -> None:
    """Taken for ratings for one wrong name, a table of thresholds had its right names refused."""
    [file] = saved(tmp_path / "data", ["A\t1\t2\t2\n"], head="vp\tstufe\ttreffer\tanzahl\n")
    for names, right in (("level_D=stufe,correct=treffer", "level"), ("level=stufe,n_correct=treffer", "correct")):
        shown = run("report", file, "--columns", f"participant=vp,{names}", "--explain")
        assert re.search(
            f"Error: columns: (level_D|n_correct) is not known: use {right} = the file's name", shown.output
        )


def test_explaining_names_conditions_and_counts_what_it_leaves_out(tmp_path: Path) -> None:
    """The condition was "not used", and ", " joined values with decimal commas; only the first rows were looked at."""
    shown = run("report", *saved(tmp_path / "data", rows()), *BY, "--explain")
    lines = shown.output.splitlines()
    assert f"  Sujet -> participant_id: {'; '.join(PEOPLE)}" in lines
    assert f"  Rendu -> condition (by): {'; '.join(LEVELS)}" in lines
    [ratings] = [line for line in lines if line.startswith("  rating ->")]
    assert re.fullmatch(r"  rating -> rating: (\d\d,\d; ){9}\d\d,\d and \d\d more", ratings)


def test_a_report_of_several_files_has_the_name_of_their_folder(tmp_path: Path) -> None:
    """It had that of the first participant."""
    whole = rows()
    files = saved(tmp_path / "Messreihe", *(whole[first : first + 6] for first in range(0, 48, 6)))
    text, _ = report(tmp_path / "out", *files, *BY)
    assert text.startswith("# Messreihe\n")


def test_a_note_on_each_file_stands_once_with_their_number(tmp_path: Path) -> None:
    files = saved(tmp_path / "data", *(rows()[first : first + 6] for first in (0, 6, 12)))
    for file in files:
        Path(file).write_text(Path(file).read_text("utf-8"), encoding="cp1252")
    notes = read_table(files).notes
    assert notes == ("part0.txt is not UTF-8: its letters were read as Windows-1252. This applies to 3 files.",)


def test_a_word_without_a_number_may_be_a_missing_answer() -> None:
    table = text_table("subject,aperture_mm,rating\nA,2,k.A.\nA,8,1.4\n")
    with pytest.raises(InputError, match=r"rating is 'k\.A\.', but must be a number, like 1\.4: leave it empty, or NA"):
        read_conditions(table)
    with pytest.raises(InputError, match=r"like 1\.4\.$"):
        read_conditions(text_table("subject,aperture_mm,rating\nA,2,1.4.2\nA,8,1.4\n"))


def test_the_reference_does_not_depend_on_the_order_of_rows() -> None:
    """The level of the first row was the reference, and two sessions had no result in common."""
    cells = [f"A,{level},1.{at}" for at, level in enumerate(("strong", "f/2", "slight", "f/11", "12 D", "2 D"))]
    levels = [
        read_conditions(text_table("\n".join(["subject,light,rating", *order])), by=["light"]).conditions["light"]
        for order in (cells, cells[::-1])
    ]
    assert levels[0] == levels[1] == ["f/11", "f/2", "2 D", "12 D", "slight", "strong"]


def test_the_reference_can_be_stated() -> None:
    table = text_table("subject,light,a=b,rating\nA,none,1,1.1\nA,strong,2,1.2\nA,slight,1,1.3\n")
    assert read_conditions(table, by=["light=Slight"]).conditions == {"light": ["slight", "none", "strong"]}
    assert read_conditions(table, by=["a=b"]).conditions == {"a=b": [1.0, 2.0]}
    assert read_conditions(table, by=["a=b=2"]).conditions == {"a=b": ["2", "1"]}
    with pytest.raises(InputError, match="no level is dim: give one of none, slight, strong as the reference"):
        read_conditions(table, by=["light=dim"])
    with pytest.raises(InputError, match="no column dark"):
        read_conditions(table, by=["dark=dim"])


@pytest.mark.parametrize("more", [["--explain"], ["--out", "never"]])
def test_a_reference_that_does_not_occur_is_refused_in_terms_of_the_option(tmp_path: Path, more: list[str]) -> None:
    shown = run("report", *saved(tmp_path / "data", rows()), "--by", "Rendu=flou", *more)
    assert "--by states Rendu=flou, but no level is flou: give one of aucun flou, flou de profondeur" in shown.output


@pytest.mark.parametrize("form", ["{}_session{}.csv", "{} Block-{}.csv", "{}/run{}.csv"])
def test_sessions_in_files_of_their_own_are_of_one_participant(tmp_path: Path, form: str) -> None:
    """A test over files would count each person twice: their t would be larger by 1.4 and more."""
    paths = [tmp_path / form.format(who, session) for who in ("P01", "P02", "P03") for session in (1, 2)]
    for at, path in enumerate(paths):
        path.parent.mkdir(exist_ok=True)
        path.write_text(f"trial,aperture,fixation,rating\n1,0,near,1.{at}\n2,5.6,near,1.5{at}\n")
    own = read_ratings(paths)
    assert sorted(own.table["participant_id"].unique()) == ["P01", "P02", "P03"]
    assert any("the files are of the participants P01, P02, P03, by their names" in note for note in own.notices)


def test_people_without_the_condition_are_named(tmp_path: Path) -> None:
    lines = [f"P{who},{who if who != 2 else ''},{1 + who / 10 + trial / 100}" for who in range(4) for trial in range(3)]
    path = tmp_path / "ages.csv"
    path.write_text("\n".join(["participant,age,rating", *lines]))
    own = read_conditions(path, by=["age"])
    assert "Participants without any age were left out: P2." in own.notices


def test_people_numbered_anew_in_each_group_are_noted(tmp_path: Path) -> None:
    path = tmp_path / "groups.csv"
    rows = [f"{{}},{group},0,near,1.{who}\n" for group in "AB" for who in range(3)]
    head = "participant,Group,aperture,fixation,rating\n"
    for names, noted in (((1, 2, 3, 1, 2, 3), True), ((1, 2, 3, 4, 5, 6), False), ((1, 2, 3, 1, 2, 6), False)):
        path.write_text(head + "".join(row.format(name) for row, name in zip(rows, names, strict=True)))
        said = [note for note in read_ratings(path).notices if "several levels of Group" in note]
        assert len(said) == noted


@pytest.mark.parametrize(
    ("named", "noted"), [((1, 2, 3), "Every participant is"), ((1, 4, 5), "1 is"), ((4, 5, 6), "")]
)
def test_people_numbered_anew_in_the_file_of_each_group_are_noted(named: Sequence[int], noted: str) -> None:
    """Fourteen people were seven, whose groups were compared by a paired t without a word."""
    files = [
        text_table("subject,school,rating\n" + "".join(f"{who},{school},1.{who}\n" for who in names), f"{school}.csv")
        for school, names in (("A", (1, 2, 3)), ("B", named))
    ]
    own = read_conditions(files, by=["school"])
    said = [note for note in own.notices if "in several levels of school, and each was taken for one person" in note]
    assert [note.partition(" in several")[0] for note in said] == [noted] * bool(noted)


def test_sidecars_that_say_simulated_are_heard(tmp_path: Path) -> None:
    """A table of a data set, given alone, was reported as one of people."""
    for name, simulated in (("a", True), ("b", False)):
        text = f"subject,aperture,fixation,rating\n{name},pinhole,near,1\n{name},f/4,near,2\n"
        (tmp_path / f"{name}.tsv").write_text(text.replace(",", "\t"))
        (tmp_path / f"{name}.json").write_text(json.dumps({"Simulated": simulated}))
    assert {*read_ratings(tmp_path / "a.tsv").table["kind"]} == {"simulated"}
    assert {*read_ratings(tmp_path / "b.tsv").table["kind"]} == {"human"}
    with pytest.raises(InputError, match="analyse people and simulated observers apart"):
        read_ratings([tmp_path / "a.tsv", tmp_path / "b.tsv"])
