"""Tables of one's own: wide or long, any names, and whatever is assumed is noted; never anything but an InputError."""

from pathlib import Path

import pytest

from focalgradient import InputError
from focalgradient.statistics import quality, read_ratings, read_reports
from focalgradient.user_tables import read_thresholds
from focalgradient.user_tables.reports import holds_reports

LONG = "subject,fstop,focus,resp\nA,pinhole,near,1.0\nA,f5.6,near,1.4\nB ,0,far,0.9\nB,5.6,farthest,1.2\n"


def write(folder: Path, text: str) -> Path:
    path = folder / "own.csv"
    path.write_text(text, encoding="utf-8")
    return path


def test_long_with_names_of_its_own(tmp_path: Path) -> None:
    names = {"participant": "subject", "aperture": "fstop", "fixation": "focus", "rating": "resp"}
    own = read_ratings(write(tmp_path, LONG), names, focal_length_mm=28)
    assert own.table["participant_id"].tolist() == ["A", "A", "B", "B"]
    assert own.table["aperture"].tolist() == ["pinhole", "f/5.6", "pinhole", "f/5.6"]
    assert own.table["aperture_mm"].tolist() == pytest.approx([0, 5, 0, 5])
    assert own.table["fixation"].tolist() == ["nearest", "nearest", "farthest", "farthest"]
    assert own.table["trial"].tolist() == [1, 2, 1, 2]
    assert not own.table["catch"].any()
    said = " ".join(own.notes)
    for part in ("Spaces at the ends", "No catch-trial column", "Trials are numbered", "No scene column"):
        assert part in said


def test_trials_that_are_numbered_alike_are_numbered_anew(tmp_path: Path) -> None:
    rows = "1,1,0,near,1\n1,1,f11,near,2\n1,1,f11,near,2\n"
    own = read_ratings(write(tmp_path, f"subject,trial,aperture,focus,rating\n{rows}"))
    assert own.table["trial"].tolist() == [1, 2, 3]
    assert any("does not tell all trials apart" in note for note in own.notices)


def test_a_name_with_twice_the_trials_of_the_others_is_noted(tmp_path: Path) -> None:
    shown = [f"s{scene},{aperture},near" for scene in range(3) for aperture in ("0", "f11")]
    rows = [f"{name},{cells},{1 + number / 7:.3f}" for name in "ABCB" for number, cells in enumerate(shown, ord(name))]
    rows[-6:] = [f"{row}1" for row in rows[-6:]]
    own = read_ratings(write(tmp_path, "\n".join(["subject,scene,aperture,focus,rating", *rows])))
    assert "B has 12 trials, each other participant 6: give people of one name different names." in own.notices


def test_staircases_of_psychopy_are_levels_and_answers(tmp_path: Path) -> None:
    """Columns of a `MultiStairHandler` carry the name of their loop."""
    rows = "1,fovea,0.8,1\n1,fovea,0.5,0\n1,side,0.8,1\n"
    own = read_thresholds(write(tmp_path, f"participant,stairs.label,stairs.intensity,stairs.response\n{rows}"))
    assert own.table[["condition", "level", "correct"]].to_numpy().tolist() == [
        ["fovea", 0.8, 1],
        ["fovea", 0.5, 0],
        ["side", 0.8, 1],
    ]


JUDGED = {
    "participant,level,key_resp.keys,key_resp.corr": "1,0.8,f,1\n1,0.5,j,0\n",
    "Subject,Level,Stim.ACC,Stim.RT": "1,0.8,1,700\n1,0.5,0,900\n",  # E-Prime
    "observer,increment,target_interval,response_interval": "1,0.8,2,2\n1,0.5,1,2\n",
    "subject,StimLevel,NumPos,OutOfNum": "1,0.8,1,1\n1,0.5,0,1\n",  # Palamedes
}
"""Tables of one right and one wrong answer, by the names of their columns in other programs."""


@pytest.mark.parametrize("head", JUDGED)
def test_right_and_wrong_answers_have_their_names_in_other_programs(head: str, tmp_path: Path) -> None:
    own = read_thresholds(write(tmp_path, f"{head}\n{JUDGED[head]}"))
    assert own.table[["level", "correct"]].to_numpy().tolist() == [[0.8, True], [0.5, False]]


def test_what_repeats_the_answer_or_marks_practice_is_no_condition(tmp_path: Path) -> None:
    rows = [
        f"1,{level},{hit},{1 - hit},{eye},{'yes' if level == 1 else 'no'}"
        for level in (1, 2, 3)
        for eye in "LR"
        for hit in (0, 1)
    ]
    own = read_thresholds(write(tmp_path, "\n".join(["subject,level,Correct,Incorrect,eye,practice", *rows])))
    assert 'practice says that 4 rows are practice: leave them out with where={"practice": "no"}.' in own.notices
    assert 'over all levels of eye (L, R): if it is a condition, give columns={"condition": "eye"}' in own.notices[-1]


def test_keys_of_the_right_answer_are_no_condition_and_groups_are_named(tmp_path: Path) -> None:
    rows = [f"{who},{lens},{level},{key},f" for who, lens in ("Aa", "Ba", "Cb") for level in (1, 2) for key in "fj"]
    own = read_thresholds(write(tmp_path, "\n".join(["subject,lens_group,level,correct_response,response", *rows])))
    assert own.table["correct"].tolist() == [1, 0] * 6
    said = " ".join(own.notices)
    assert 'lens_group (a, b) is not analysed: compare the groups with by=["lens_group"].' in said
    assert "condition" not in said


def test_a_word_for_a_missing_answer_is_no_step(tmp_path: Path) -> None:
    path = write(tmp_path, "subject,fstop,focus,resp\nA,0,near,flat\nA,f5.6,near,deep\nA,f8,near,k.A.\n")
    with pytest.raises(InputError, match=r'where it is missing, or state so with conditions=\{"k.A.": "NA"\}'):
        read_ratings(path, order=["flat", "deep"])
    assert len(read_ratings(path, order=["flat", "deep"], conditions={"k.A.": "NA"}).table) == 2


@pytest.mark.parametrize("answers", ["0,1,2,1", "-9,-8,8,9"])
def test_steps_may_be_0_or_negative(tmp_path: Path, answers: str) -> None:
    rows = [f"A,{aperture},near,{answer}" for aperture, answer in zip("0808", answers.split(","), strict=True)]
    path = write(tmp_path, "\n".join(["subject,aperture,focus,rating", *rows]))
    assert read_ratings(path, steps=True).table["rating"].tolist() == [float(answer) for answer in answers.split(",")]
    with pytest.raises(InputError, match=r"above 0: a ratio to the standard .*ordinal.* where answers are steps"):
        read_ratings(path)


def test_answers_in_words_with_their_numbers_name_the_remedy(tmp_path: Path) -> None:
    path = write(tmp_path, "subject,aperture,focus,rating\nA,0,near,1 (flat)\nA,8,near,5 (deep)\n")
    with pytest.raises(InputError, match="state the order of answers in words"):
        read_ratings(path)
    assert read_ratings(path, order=["1 (flat)", "5 (deep)"]).table["rating"].tolist() == [1, 2]


def test_words_of_a_heading_may_be_written_apart_or_together(tmp_path: Path) -> None:
    text = "Participant.ID,trialNumber,F-Number,Focus,Perceived Depth\nA,1,5.6,near,1.4\nA,2,0,near,1.0\n"
    assert read_ratings(write(tmp_path, text)).table["rating"].tolist() == [1.4, 1.0]
    levels = "Worker ID;Blur level (D);Is.Correct\nA;0,1;Correct\nA;0,4;Incorrect\n"
    assert read_thresholds(write(tmp_path, levels)).table["level"].tolist() == [0.1, 0.4]


def test_each_word_for_true_and_false_is_read(tmp_path: Path) -> None:
    words = {"true": True, "1": True, "YES": True, "False": False, "0": False, "no": False, "": False, "n/a": False}
    rows = [f"A,0,near,{1 + number / 10},{word}" for number, word in enumerate(words)]
    own = read_ratings(write(tmp_path, "\n".join(["subject,aperture,focus,rating,catch", *rows])))
    assert own.table["catch"].tolist() == list(words.values())


def test_common_f_numbers_are_read_without_a_stroke(tmp_path: Path) -> None:
    """The full stops from f/0.7, and the fastest lenses; numbers between two stops may be diameters."""
    full = ["0.7", "1", "1.4", "2", "2.8", "4", "5.6", "8", "11", "16", "22", "32", "45", "64", "90", "128"]
    fast = ["0.8", "0.85", "0.9", "0.95", "1.1", "1.2", "1.25", "1.3", "1.5", "1.6", "1.7", "1.8", "1.9"]
    rows = [f"A,{number},near,1" for number in [*full, *fast]]
    own = read_ratings(write(tmp_path, "\n".join(["subject,aperture,focus,rating", *rows])))
    assert own.table["aperture"].tolist() == [f"f/{number}" for number in [*full, *fast]]
    for between in ("0.6", "2.1", "3.1", "6.8", "12", "17", "70"):
        with pytest.raises(InputError, match="no lens has as its f-number, " + between):
            read_ratings(write(tmp_path, f"subject,aperture,focus,rating\nA,{between},near,1\n"))


def test_wide(tmp_path: Path) -> None:
    text = "id\tscene\tnear_pinhole\tnear_f5.6\tfar f/5.6\n1\troom\t1\t1.5\t1.1\n2\troom\t1\tNaN\t\n"
    own = read_ratings(write(tmp_path, text))
    cells = own.table[["participant_id", "scene", "fixation", "aperture", "rating"]].to_numpy().tolist()
    assert cells == [
        ["1", "room", "nearest", "pinhole", 1.0],
        ["1", "room", "nearest", "f/5.6", 1.5],
        ["1", "room", "farthest", "f/5.6", 1.1],
        ["2", "room", "nearest", "pinhole", 1.0],
    ]
    assert any("2 cells were left out, without a rating (participants 2)" in note for note in own.notices)


@pytest.mark.parametrize(
    ("text", "column", "cells"),
    [
        ("participant;near f5,6;near sharp\n1;1,4;1,0\n", "aperture", ["f/5.6", "pinhole"]),
        ("participant;near f0,95;near f1;near sharp\n1;1,4;1,3;1,0\n", "aperture", ["f/0.95", "f/1", "pinhole"]),
        (
            "subject,room_near_pinhole,room_near_f5.6,tree_near_pinhole\n1,1,1.5,1.1\n",
            "scene",
            ["room", "room", "tree"],
        ),
    ],
)
def test_wide_headings(tmp_path: Path, text: str, column: str, cells: list[str]) -> None:
    own = read_ratings(write(tmp_path, text))
    assert own.table[column].tolist() == cells
    assert not own.problems


def test_a_wide_column_whose_aperture_is_not_understood_is_a_problem(tmp_path: Path) -> None:
    """It was left out with a note at the report's end, and the rise was not tested."""
    path = write(tmp_path, "participant;near f5,6;near pin\n1;1,4;1,0\n")
    own = read_ratings(path)
    assert own.table["aperture"].tolist() == ["f/5.6"]
    assert "skipped: near pin" in own.problems[0]
    assert "conditions" in own.problems[0]
    named = read_ratings(path, conditions={"pin": "pinhole"})
    assert named.table["aperture"].tolist() == ["f/5.6", "pinhole"]
    assert not named.problems


def test_wide_with_several_rows_of_a_subject_can_be_judged(tmp_path: Path) -> None:
    """Each rating has a place of its own: rules that look at single ratings find it."""
    rows = [f"{who},s{scene},1.0,{1.2 + 0.1 * scene},1.0,1.1" for who in range(4) for scene in range(5)]
    text = "\n".join(["subject,scene,near_pinhole,near_5.6,far_pinhole,far f5_6", *rows])
    own = read_ratings(write(tmp_path, text))
    assert sorted(set(own.table["aperture"])) == ["f/5.6", "pinhole"]
    kept, found = quality(own.table)
    assert len(kept) == found.trials_before == 4 * 5 * 4
    assert own.table.index.is_unique


def test_diameters_alone_name_the_apertures(tmp_path: Path) -> None:
    text = "subject,aperture_mm,focus,resp,age\nA,0,near,1.0,33\nA,8.93,near,1.4,33\n"
    own = read_ratings(write(tmp_path, text))
    assert own.table["aperture"].tolist() == ["pinhole", "f/5.6"]
    assert own.table["aperture_mm"].tolist() == [0, 8.93]
    assert "Columns that were not used: age." in own.notes


REPORTS = """subject;trial;blur;mm;seen;start;dur
A ;1;ohne;;starr;0;6,0
A ;1;ohne;;weich;6;4,0
A ;2;weich;4;starr;0;3,0
A ;2;weich;4;weich;3,0;7,0
"""
NAMES = {"participant": "subject", "gradient": "blur", "percept": "seen", "strength": "mm"}
MEANT = {"ohne": "none", "starr": "rigid", "weich": "nonrigid"}


def test_reports_on_the_cube(tmp_path: Path) -> None:
    own = read_reports(write(tmp_path, REPORTS), NAMES, MEANT)
    names = ["participant_id", "gradient", "strength", "percept", "onset", "duration", "censored", "trial_duration"]
    assert own.table[names].to_numpy().tolist() == [
        ["A", "none", 0.0, "rigid", 0.0, 6.0, False, 10.0],
        ["A", "none", 0.0, "nonrigid", 6.0, 4.0, True, 10.0],
        ["A", "nonrigid", 4.0, "rigid", 0.0, 3.0, False, 10.0],
        ["A", "nonrigid", 4.0, "nonrigid", 3.0, 7.0, True, 10.0],
    ]
    assert any("all trials are treated as of 10 s" in note for note in own.notes)


def test_reports_are_recognised_by_any_of_their_names(tmp_path: Path) -> None:
    head, times = "subject,trial,blur,seen,onset (ms),", "A,1,none,rigid,0,{}\nA,1,none,nonrigid,9000,{}\n"
    for last, ends in (("duration (ms)", (9000, 21000)), ("offset (ms)", (9000, 30000))):
        path = write(tmp_path, f"{head}{last}\n{times.format(*ends)}")
        assert holds_reports(path)
        assert read_reports(path).table["duration"].tolist() == [9, 21]
    assert not holds_reports(write(tmp_path, "subject,trial,blur,seen,duration,response\nA,1,none,rigid,9,1.2\n"))


@pytest.mark.parametrize("left_out", ["trial", "start", "mm", "end"])
def test_reports_with_a_column_less_say_the_same(tmp_path: Path, left_out: str) -> None:
    whole = read_reports(write(tmp_path, REPORTS), NAMES, MEANT).table
    if left_out == "end":
        rows = ["A;ohne;;starr;0;6", "A;ohne;;weich;6;10", "A;weich;4;starr;0;3", "A;weich;4;weich;3;10"]
        text = "\n".join(["subject;blur;mm;seen;start;end", *rows])
    else:
        text = REPORTS.replace(" ;", ";")
        gone = text.split("\n")[0].split(";").index(left_out)
        cut = [[cell for place, cell in enumerate(line.split(";")) if place != gone] for line in text.split()]
        text = "\n".join(";".join(line) for line in cut)
    names = {ours: theirs for ours, theirs in NAMES.items() if theirs != left_out}
    own = read_reports(write(tmp_path, text), names, MEANT).table
    for column in ("percept", "onset", "duration", "trial"):
        assert own[column].astype(str).tolist() == whole[column].astype(str).tolist(), column


@pytest.mark.parametrize("conditions", [1, 2, 3])
def test_a_trial_has_one_condition_and_a_number_that_comes_back_is_another_trial(
    tmp_path: Path, conditions: int
) -> None:
    head = "subject,trial,gradient,strength,percept,onset,duration"
    shown = ["none,0", "rigid,2", "nonrigid,4"][:conditions]
    rows = [f"A,1,{each},{seen}" for each in shown for seen in ("rigid,0,4", "nonrigid,4,6")]
    own = read_reports(write(tmp_path, "\n".join([head, *rows])))
    assert own.table["trial"].nunique() == conditions
    assert own.table.groupby("trial")["duration"].sum().tolist() == [10.0] * conditions
    said = "Trials of different conditions have one number: they count as trials of their own."
    assert (said in own.notes) == (conditions > 1)


def test_reports_of_no_duration_are_left_out_and_counted(tmp_path: Path) -> None:
    head = "subject,trial,gradient,percept,onset,end"
    rows = [f"A,1,none,{seen}" for seen in ("rigid,0,4", "none,4,4", "nonrigid,4,9")]
    own = read_reports(write(tmp_path, "\n".join([head, *rows])))
    assert own.table["duration"].tolist() == [4.0, 5.0]
    assert "Reports that lasted no time were left out: 1." in own.notes
    with pytest.raises(InputError, match="holds no report that lasted"):
        read_reports(write(tmp_path, "\n".join([head, rows[1]])))


BAD_REPORTS = {
    "percept": (REPORTS.replace(";weich;6;", ";wackelt;6;"), "row 3: percept is 'wackelt'.*conditions="),
    "overlap": (REPORTS.replace("6;4,0", "4;6,0"), "row 3: the report begins before another"),
    "no percept": ("subject,blur\nA,none\n", "no column seen for percept"),
}


BAD = {
    "nothing": ("", "own.csv is empty"),
    "percent": ("subject,aperture,focus,rating\n1,0,near,30%\n", r"'30%', but .*below the heading 'rating \(%\)'"),
    "no participant": ("a,aperture,focus,rating\n1,0,near,1\n", r"participant \(its columns are a, aperture, focus"),
    "no names": (
        "Name,Stop,Mark\n1,0,1\n",
        r"participant, aperture, rating \(its columns are Name, Stop, Mark\): name them with columns="
        r'\{"participant": "NAME", "aperture": "NAME", "rating": "NAME"\}, or give each',
    ),
    "wide without fixation": ("subject,f/8,f/4\n1,1,1\n", "no column for fixation .*add one that says near or far"),
    "twice": ("subject,subject,aperture,focus,rating\n1,2,0,near,1\n", "the column subject twice, with different"),
    "negative": ("subject,aperture,focus,rating\n1,0,near,-1\n", "row 2 .*rating is -1.0"),
    "repeated": (
        "subject,trial,aperture,focus,rating\n1,1,0,near,1\n1,2,0,near,1\n1,2,0,near,1\n",
        "row 4: a row above is the same in every cell",
    ),
    "no such lens": ("subject,aperture,focus,rating\n1,f/0.01,near,1\n", "row 2: aperture is 'f/0.01', but no lens"),
    "all empty": ("subject,aperture,focus,rating\n1,0,near,\n", "holds no rating"),
    "too long": ("subject,aperture,focus,rating\n1,0,near,1,2,3\n", "row 2: there are 6 cells, but must be 4"),
}


@pytest.mark.parametrize("name", [*BAD, *BAD_REPORTS])
def test_what_is_wrong_is_named(tmp_path: Path, name: str) -> None:
    text, sentence = (BAD | BAD_REPORTS)[name]
    with pytest.raises(InputError, match=sentence):
        read_reports(write(tmp_path, text), NAMES, MEANT) if name in BAD_REPORTS else read_ratings(
            write(tmp_path, text)
        )
