"""Tables analysed by conditions: nothing is pooled without a word, and own names count as in other tables."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from focalgradient import InputError
from focalgradient.report import make_report
from focalgradient.report.conditions import conditions_of_table
from focalgradient.report.reading import RATINGS, explained_table, kind_of
from focalgradient.statistics import Effect, Rules
from focalgradient.statistics.conditions import subject_effects
from focalgradient.statistics.rating_conditions import rating_tests
from focalgradient.user_tables import read_conditions, read_ratings, read_thresholds
from focalgradient.user_tables.conditions import ORDINAL, STEPS
from focalgradient.user_tables.files import UserTable, chosen_rows, read_table, text_table

pytestmark = pytest.mark.usefixtures("unrendered")


def thresholds(second: str) -> UserTable:
    cells = [f"s{who},{'ab'[who % 2]},{place},{level},1" for who in range(4) for place in "xy" for level in (1, 2)]
    return text_table("\n".join([f"subject,group,{second},level,correct", *cells]))


def test_groups_are_not_compared_over_another_condition() -> None:
    """Two eccentricities were pooled in the thresholds of each group, and the report said "Done" alone."""
    remedy = r'group and condition \(x, y\), .*: choose one with where=\{"condition": "x"\}'
    with pytest.raises(InputError, match=remedy):
        read_thresholds(thresholds("condition"), by=["group"])
    own = read_thresholds(thresholds("condition"), by=["group"], where={"condition": "y"})
    assert len(own.table) == 8
    assert not own.notices
    [notice] = read_thresholds(thresholds("place"), by=["group"]).notices
    assert notice.startswith("Each threshold is over all levels of place (x, y)")
    assert notice.endswith('choose a level with where={"place": "x"}.')
    assert not read_thresholds(thresholds("place"), by=["place"]).notices


LOCH = "Vp;Blende;Urteil\n" + "".join(f"{who};{level};1,{who}\n" for who in "123" for level in ("8", "Loch", "2,8"))


@pytest.mark.parametrize(
    ("columns", "by"),
    [({"aperture": "Blende"}, []), ({"aperture": "Blende"}, ["aperture"]), ({}, ["Blende"]), ({}, ["Blende=Loch"])],
)
def test_own_names_of_apertures_count_for_conditions(columns: dict[str, str], by: list[str]) -> None:
    """Meanings were ignored, and the reference was 8 or 2.8 instead of the pinhole."""
    own = read_conditions(text_table(LOCH), columns, by=by, conditions={"Loch": "pinhole"})
    assert own.conditions == {"Blende": ["pinhole", "f/8", "f/2.8"]}
    assert own.table["Blende"].tolist() == ["f/8", "pinhole", "f/2.8"] * 3
    assert not any("taken for names" in notice for notice in own.notices)


def test_the_largest_f_number_is_the_reference_and_the_note_names_the_option() -> None:
    without = text_table("\n".join(row for row in LOCH.splitlines() if "Loch" not in row))
    assert read_conditions(without, {"aperture": "Blende"}).conditions == {"Blende": ["f/8", "f/2.8"]}
    notices = read_conditions(text_table(LOCH), by=["Blende"], conditions={"Lohc": "pinhole"}).notices
    assert "The conditions name words that do not occur in Blende: Lohc." in notices
    assert any('conditions={"NAME": "f/5.6"} for apertures' in notice for notice in notices)


HEAD = "participant,group,near_pinhole,near_f5.6,far_pinhole,far_f5.6\n"
WIDE = HEAD + "".join(f"p{who},{'ab'[who % 2]},1.0{who},1.3{who},1.0{who},1.1{who}\n" for who in range(6))


def test_wide_tables_are_analysed_by_conditions() -> None:
    """The command asked for a column of ratings."""
    own = read_conditions(text_table(WIDE), by=["aperture", "group"])
    assert own.conditions == {"aperture": ["pinhole", "f/5.6"], "group": ["a", "b"]}
    assert len(own.exported) == 24
    assert own.table["rating"].tolist()[:4] == [1.0, 1.3, 1.0, 1.1]
    lines = [*explained_table(text_table(WIDE), by=["group"])]
    assert "  far_f5.6 -> rating (one column a condition): 1.10; 1.11; 1.12; 1.13; 1.14; 1.15" in lines
    assert not any("not used" in line and "group" in line for line in lines)


def test_a_group_that_is_not_analysed_is_noted() -> None:
    """Only the provenance named the column."""
    options = 'columns={"rating": "near_*"} by=["aperture", "group"]'
    expected = f"group (a, b) is not analysed: compare the groups with {options}."
    assert expected in read_ratings(text_table(WIDE)).notices
    assert not any("not analysed" in notice for notice in read_conditions(text_table(WIDE), by=["group"]).notices)


def test_groups_are_compared_by_the_near_effect_and_with_the_callers_words() -> None:
    """The remedy named the control, the far effect, and left the meanings of words out."""
    rows = [
        f"{who},{'ab'[who % 2]},{end},{aperture},1.{who}"
        for who in range(4)
        for end in ("far", "near")
        for aperture in ("open", "pinhole")
    ]
    table = text_table("\n".join(["participant,group,fixation,aperture,rating", *rows]))
    assert (
        'group (a, b) is not analysed: compare the groups with where={"fixation": "near"} '
        'conditions={"open": "f/5.6"} by=["aperture", "group"].'
    ) in read_ratings(table, conditions={"open": "f/5.6"}).notices
    [notice] = read_conditions(table, by=["aperture"]).notices[1:]
    assert notice.startswith("Ratings are means over fixation (far, near): if it is a condition, add by=")


STRENGTHS = {"none": 1.0, "weak": 1.2, "strong": 1.8}
GAPS = [
    f"p{who},{'ab'[who % 2]},{kind},{1 + who / 10},{factor * (1 + who / 10)}"
    for who in range(12)
    for kind, factor in STRENGTHS.items()
    if (who % 2 == 0 or who in (1, 3) or kind != "strong")  # most of group b lack the strongest
    and (who, kind) != (4, "none")
]


def test_conditions_that_a_group_lacks_are_not_taken_for_its_effect() -> None:
    """Without an effect of the group a difference of 14 % was found (p .008): its means were of weaker conditions."""
    own = read_conditions(text_table("\n".join(["subject,group,blur,own,rating", *GAPS])), by=["blur", "group"])
    own = replace(own, conditions={"blur": ["none", "weak", "strong"], "group": ["a", "b"]})
    group = next(test for test in rating_tests(own) if test.factor == "group" and test.answer == "rating")
    people = {name: [np.log(1 + who / 10) for who in range(12) if "ab"[who % 2] == name] for name in "ab"}
    assert isinstance(group.effect, Effect)
    assert group.effect.estimate == pytest.approx(np.mean(people["b"]) - np.mean(people["a"]))
    assert group.effect.standard_error == pytest.approx(np.sqrt(sum(np.var(v, ddof=1) / 6 for v in people.values())))
    assert group.effect.subjects == 12


def test_conditions_that_a_person_lacks_do_not_change_the_effect_within(tmp_path: Path) -> None:
    rows = [
        f"p{who},{eye},{size},{size * (2.0 if eye == 'two' else 1.0) * (1 + who / 10)}"
        for who in range(6)
        for eye in ("one", "two")
        for size in (1, 2, 4)
        if (who, eye, size) not in ((0, "one", 4), (1, "two", 1), (2, "two", 4))
    ]
    path = tmp_path / "own.csv"
    path.write_text("\n".join(["subject,eye,size,rating", *rows]))
    own = read_conditions(read_table(path), by=["eye", "size=factor"])
    for test in rating_tests(own)[:3]:
        assert test.points is not None
        effects = subject_effects(test.points, test)
        assert len(effects) == 6
        assert effects.to_numpy() == pytest.approx(np.log({"two": 2.0, "2": 2.0, "4": 4.0}[str(test.level)]))
    text = make_report(path, by=["eye", "size=factor"]).files["report.md"].decode()
    assert "missing for p0, p1, p2 (3 of the 6 subjects): means" in text
    assert "slopes" not in text


def test_conditions_of_a_wide_table_are_chosen_by_its_columns() -> None:
    table = text_table("Vp,near_pinhole,near_f/4,far_pinhole,far_f/4\nA,1,1.4,1,1.1\nB,1,1.3,1,1\n")
    notice = next(text for text in read_conditions(table, by=["aperture"]).notices if "means over" in text)
    assert notice.endswith('add by=["fixation"], or choose a level with columns={"rating": "far_*"}.')
    chosen = read_conditions(table, {"rating": "far_*"}, by=["aperture"]).table
    assert chosen["rating"].tolist() == [1, 1.1, 1, 1]


def test_the_stem_given_as_a_condition_decides_where_a_level_is_also_the_name_of_an_aperture() -> None:
    table = text_table("subject,near_sharp,near_medium,near_strong\nA,1,1.4,1.6\nB,1,1.3,1.7\n")
    own = read_conditions(table, {"rating": "near_*"}, ["near"])
    assert {name: set(levels) for name, levels in own.conditions.items()} == {"near": {"sharp", "medium", "strong"}}
    with pytest.raises(InputError, match=r"aperture has the one level .* skipped: near_medium, near_strong"):
        read_conditions(table, by=["aperture"])


def test_columns_of_a_wide_table_are_levels_of_their_stem() -> None:
    """Ratings by conditions without apertures asked for the option that was given."""
    table = text_table("subject,group,depth_low,depth_high\nA,x,1.1,1.4\nB,x,1.0,1.3\nC,y,1.2,1.5\n")
    for by in (["group"], ["group", "depth=low"]):
        own = read_conditions(table, {"rating": "depth_*"}, by)
        assert {name: set(levels) for name, levels in own.conditions.items()} == {
            "depth": {"low", "high"},
            "group": {"x", "y"},
        }
        assert own.table["rating"].tolist() == [1.1, 1.4, 1.0, 1.3, 1.2, 1.5]
    numbered = text_table("subject,group,depth 0,depth 2\nA,x,1.1,1.4\nB,x,1.0,1.3\n")
    assert read_conditions(numbered, by=["depth=factor"]).conditions == {"depth": ["0", "2"]}
    with pytest.raises(InputError, match=r"no columns? for rating"):
        read_conditions(numbered, by=["group"])
    for first, second in (("-0.5", "0.5"), ("depth_-0.5", "depth_0.5"), ("depth (-0.5)", "depth (0.5)")):
        signed = text_table(f"subject,{first},{second}\nA,1.1,1.4\nB,1.0,1.3\n")
        assert read_conditions(signed, by=["depth"]).conditions == {"depth": [-0.5, 0.5]}
    with pytest.raises(InputError, match=r'compare these columns as they are with by=\["depth"\]'):
        read_ratings(table, {"rating": "depth_*"})
    with pytest.raises(InputError, match=r"no columns relief_\*: it has subject"):
        read_conditions(table, {"rating": "relief_*"}, ["group"])


def test_columns_that_are_empty_in_the_chosen_rows_do_not_choose_the_analysis(tmp_path: Path) -> None:
    """Levels of threshold trials made sliders of the same session "no row with level"."""
    trials: list[dict[str, object]] = [
        {"subject": "A", "trial_type": "blur", "level_D": 0.1, "interval": 1, "response": 1, "pupil_mm": 4},
        {"subject": "A", "trial_type": "slider", "aperture": "f/4", "fixation": "near", "response": 1.4},
    ]
    path = tmp_path / "own.json"
    path.write_text(json.dumps(trials))
    table = read_table(path)
    assert kind_of(table).what == "answers at levels"
    assert kind_of(chosen_rows(table, {"trial_type": "slider"})).what == RATINGS
    assert next(explained_table(path, where={"trial_type": "slider"})).endswith("1 depth ratings")
    assert "pupil" not in str(read_ratings(path, where={"trial_type": "slider"}).exported.columns)  # and are not read


def test_a_report_says_that_steps_are_averaged_as_numbers(tmp_path: Path) -> None:
    rows = [f"{who},{eyes},{word}" for who in "ABCD" for eyes, word in (("one", "flat"), ("two", "deep"))]
    path = tmp_path / "own.csv"
    path.write_text("\n".join(["subject,eyes,rating", *rows, "E,one,flat", "E,two,flat"]))
    made = make_report(path, by=["eyes"], order=["flat", "deep"])
    assert STEPS in made.notices
    assert STEPS in made.files["report.md"].decode().partition("## Methods")[2]


def test_steps_by_apertures_have_an_ordinal_model_with_a_fixation(tmp_path: Path) -> None:
    random, middles = np.random.default_rng(1), {"pinhole": 2, "f/8": 3, "f/2.8": 4}
    shown = [(who, aperture) for who in "ABCDEF" for aperture in 4 * list(middles)]
    rows = [f"{who},{at},{max(1, round(random.normal(middles[at])))}" for who, at in shown]
    path = tmp_path / "own.csv"
    path.write_text("\n".join(["subject,aperture,rating", *rows]))
    assert ORDINAL in make_report(path, scale="ordinal").notices
    path.write_text("\n".join(["subject,aperture,rating,fixation", *(f"{row},nearest" for row in rows)]))
    assert "depth_rating_thresholds.csv" in make_report(path, scale="ordinal").files


def test_two_names_of_one_condition_are_no_two_conditions() -> None:
    head, *rows = thresholds("condition").cells.to_csv(index=False).splitlines()
    table = text_table("\n".join([f"{head},cond", *(f"{row},{'12'[',x,' in row]}" for row in rows)]))
    assert not read_thresholds(table).notices


def noted(rows: list[str], word: str, **given: object) -> list[str]:
    own = read_conditions(text_table("\n".join(rows)), **given)  # type: ignore[arg-type]
    return [notice for notice in [*own.notices, *conditions_of_table(own, Rules()).notices] if word in notice]


ORDER = "practice or fatigue"


def test_conditions_in_one_order_are_noted() -> None:
    """Of tables in which everyone had the second condition later, .6 had an effect by practice alone."""
    head = "subject,session,trial,eye,rating"
    rows = [f"p{who},{1 + (trial > 4)},{trial},{'LR'[trial > 4]},1.{who}" for who in range(4) for trial in range(1, 9)]
    [notice] = noted([head, *rows], ORDER, by=["eye"])
    assert (
        notice == "Each session has one level of eye, so that its effect cannot be separated from practice or fatigue."
    )
    blocks = [",".join(row.split(",")[::2]) + f",{row.split(',')[3]}" for row in rows]
    [notice] = noted(["subject,trial,rating,eye", *blocks], ORDER, by=["eye"])
    assert notice.startswith("All subjects answered at the levels of eye in one order (L, R)")
    other = [row.replace("L", "x").replace("R", "L").replace("x", "R") if row.startswith("p1") else row for row in rows]
    assert not noted([head, *other], ORDER, by=["eye"])
    far = [f"p{who},{end},{at},1.{who},{trial}" for who in range(3) for trial, (end, at) in enumerate(ENDS)]
    table = text_table("\n".join(["subject,focus,aperture,rating,trial", *far]))
    assert sum(ORDER in notice for notice in read_ratings(table).notices) == 1


ENDS = [("near", "f/5.6"), ("near", "0"), ("far", "f/5.6"), ("far", "0")]


def test_slopes_of_people_who_lack_levels_are_noted() -> None:
    """Of tables with a curved effect, of which one group lacked the end, .52 had an effect of the group on slopes."""
    rows = [f"p{who},{mm},1.{mm}{who}" for who in range(6) for mm in (1, 2, 4, 8) if mm < 8 or who % 2]
    [notice] = noted(["subject,mm,rating", *rows], "missing", by=["mm"])
    assert "mm are missing for p0, p2, p4 (3 of the 6 subjects): their slopes are over other levels" in notice


def test_apertures_of_different_scenes_are_noted() -> None:
    """Of tables without an effect, of which each scene had one aperture, .4 to .5 had one."""
    rows = [
        f"p{who},s{(scene + 3 * (focus == 'far')) % 6},{focus},{('0', 'f/11', 'f/5.6')[scene % 3]},1.{who}"
        for who in range(4)
        for focus in ("near", "far")
        for scene in range(6)
    ]
    table = text_table("\n".join(["subject,scene,focus,aperture,rating", *rows]))
    apertures = "No scene was shown at two apertures: depth effects cannot be separated from those of scenes."
    assert [notice for notice in read_ratings(table).notices if "No scene" in notice] == [apertures]
    crossed = text_table("\n".join(["subject,scene,focus,aperture,rating", *rows]).replace("f/11", "0"))
    assert not any("two fixations" in notice for notice in read_ratings(crossed).notices)


def test_rows_chosen_by_their_answers_are_noted() -> None:
    rows = [f"p{who},{eye},{rating}" for who in range(4) for eye in "LR" for rating in (1, 2, 3)]
    table = text_table("\n".join(["subject,eye,rating", *rows]))
    [notice] = [
        one for one in read_conditions(table, where={"rating": ["2", "3"]}, by=["eye"]).notices if "Rows" in one
    ]
    assert notice.startswith("Rows were chosen by rating, the answers themselves")
    chosen = chosen_rows(table, {"eye": ["L", "R"], "Rating": ["2", "3"]})  # as a report does
    assert notice in read_conditions(chosen, by=["eye"]).notices
    assert not any("chosen by" in one for one in read_conditions(table, where={"eye": ["L", "R"]}, by=["eye"]).notices)


def test_choices_by_side_need_no_fixation(tmp_path: Path) -> None:
    """A picture of any aperture beside a reference: the side chosen is that of the picture, or not."""
    rows = [f"{who},{mm},{side},{side if mm > 3 else 'R'}" for who in "AB" for mm in (2, 5, 8) for side in "LR"]
    table = "\n".join(["subject,aperture_mm,shown,response", *rows])
    with pytest.raises(InputError, match=r'where shown says which of two was the picture.*"interval": "shown"'):
        read_conditions(text_table(table))
    own = read_conditions(text_table(table), {"interval": "shown"})
    assert own.table.groupby("aperture_mm")["rating"].mean().to_dict() == {2: 0.5, 5: 1, 8: 1}
    assert "choices of the picture (1)" in " ".join(own.notices)
    assert not own.log


def test_grids_of_surveys_are_levels_and_each_row_is_a_person() -> None:
    """LimeSurvey codes each question of a grid; of several grids none is chosen."""
    head = "startlanguage. Start language," + ",".join(f"Depth[B{x}]. How deep? [Blur {x}]" for x in (0, 2))
    own = read_conditions(text_table(f"{head}\nen,1,4\nde,2,3\n"), by=["blur"])
    assert own.conditions == {"blur": [0, 2]}
    signed = text_table("subject,Deep? [blur: -0.5],Deep? [blur: 0.5]\nA,1,4\nB,2,3\n")
    assert read_conditions(signed, by=["blur"]).conditions == {"blur": [-0.5, 0.5]}
    assert own.table["participant_id"].nunique() == 2
    assert "each row is treated as one participant" in " ".join(own.notices)
    with pytest.raises(InputError, match="has no columns for participant, rating"):
        read_conditions(text_table(f"{head},Order[B0]. Which? [Blur 0]\nen,1,4,1\nde,2,3,1\n"), by=["blur"])


def test_wide_columns_are_found_by_their_mark_and_beside_groups() -> None:
    """The mark went through the kinds of tables, and one of them took it for a column's name."""
    table = text_table("Vp,group,depth_0,depth_2\nA,x,1,4\nB,x,2,3\nC,y,2,5\nD,y,1,5\n")
    for columns in ({"participant": "Vp", "rating": "depth_*"}, {"participant": "Vp"}):
        by = ["depth", "group=y"]
        assert kind_of(table, columns, by).schema.required[-1] == "rating"
        assert read_conditions(table, columns, by).conditions == {"depth": [0, 2], "group": ["y", "x"]}
