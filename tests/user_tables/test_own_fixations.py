"""More than two fixations: the same numbers as of each alone, every pair compared, and what is drawn and said."""

import numpy as np
import pandas as pd
import pytest

from focalgradient.errors import InputError
from focalgradient.plotting.subjects import depth_rating_figure, ordinal_figure
from focalgradient.report.tables import EFFECTS
from focalgradient.statistics import Effect, NotComputed, compare_pictures, depth_rating, read_ratings
from focalgradient.user_tables.files import text_table

NAMES = ("gate", "house", "tree")
RISES = {"gate": 0.1, "house": 0.05, "tree": 0.0}


@pytest.fixture(scope="module")
def table() -> pd.DataFrame:
    chance = np.random.default_rng(0)
    conditions = [
        (name, scene, aperture, mm)
        for name in NAMES
        for scene in "abcdef"
        for aperture, mm in (("pinhole", 0.0), ("f/11", 4.5), ("f/5.6", 8.9))
    ]
    rows = []
    for who in range(8):
        for trial, (name, scene, aperture, mm) in enumerate(conditions, start=1):
            log = RISES[name] * mm + 0.15 * chance.normal()
            rows.append((f"sub-{who}", trial, scene, aperture, mm, name, float(np.exp(log)), False))
    columns = ["participant_id", "trial", "scene", "aperture", "aperture_mm", "fixation", "rating", "catch"]
    return pd.DataFrame(rows, columns=columns)


def test_each_fixation_is_as_alone_and_every_pair_is_compared(table: pd.DataFrame) -> None:
    found = depth_rating(table, equivalence_bound=1.2)
    assert tuple(each.fixation for each in found.fixations) == NAMES
    for each in found.fixations:
        (alone,) = depth_rating(table[table["fixation"] == each.fixation], equivalence_bound=1.2).fixations
        assert (each.rise.estimate, each.rise.p) == (alone.rise.estimate, alone.rise.p)
        assert each.rise.estimate == pytest.approx(8.9 * RISES[each.fixation], abs=0.1)
    assert set(found.differences) == {("gate", "house"), ("gate", "tree"), ("house", "tree")}
    assert isinstance(found.interaction, NotComputed)
    difference, _ = found.differences["gate", "tree"]
    assert difference.estimate == pytest.approx(0.89, abs=0.1)
    # The first depth effect is primary; the three differences are one family, the other depth effects in another.
    assert found.fixations[0].rise.p_holm is None
    differences = [test for test, _ in found.differences.values() if isinstance(test, Effect)]
    assert min(test.p_holm for test in differences) == pytest.approx(3 * min(test.p for test in differences))
    assert all(each.rise.p_holm >= each.rise.p for each in found.fixations[1:])
    said = " ".join(found.answers.sentences(*EFFECTS))
    assert "“gate” in focus" in said
    assert "The depth effects of “gate” and “tree” differed" in said
    depth_rating_figure(found, simulated=False)


def test_two_of_ones_own_are_one_pair(table: pd.DataFrame) -> None:
    two = table[table["fixation"] != "tree"]
    found = depth_rating(two, equivalence_bound=1.2)
    named = two.assign(fixation=two["fixation"].map({"gate": "nearest", "house": "farthest"}))
    known = depth_rating(named, equivalence_bound=1.2)
    assert found.differences["gate", "house"][0] == known.interaction


def test_a_pinhole_without_a_fixation_is_refused_with_the_remedy() -> None:
    rows = [f"A,{at},{focus},1.2" for focus in ("near", "far") for at in ("f/2", "f/8")]
    table = text_table("\n".join(["subject,aperture,fixation,rating", *rows, "A,sharp,none,1.0"]))
    with pytest.raises(InputError, match="fixation is 'none', but the pinhole is the reference of each"):
        read_ratings(table)


@pytest.mark.slow
def test_steps_and_comparisons_have_any_number_too(table: pd.DataFrame) -> None:
    steps = table.assign(rating=np.clip(np.round(3 + 2 * np.log(table["rating"])), 1, 7))
    found = depth_rating(steps, equivalence_bound=1.2, scale="ordinal")
    assert set(found.ordinal.differences) == {("gate", "house"), ("gate", "tree"), ("house", "tree")}
    first = found.ordinal.rises[0]
    pair = found.ordinal.differences["gate", "tree"]
    assert pair.estimate == pytest.approx(first.estimate - found.ordinal.rises[2].estimate, rel=1e-6)
    ordinal_figure(found, simulated=False)
    compared = compare_pictures(steps.assign(rating=steps["rating"] - 4), "bipolar")
    assert set(compared.differences) == set(found.ordinal.differences)
    chosen = compare_pictures(steps.assign(rating=(steps["rating"] > 3).astype(float)), "choice")
    assert chosen.fixations == NAMES


def test_a_table_of_ones_own_names_them_in_its_conditions(table: pd.DataFrame, tmp_path) -> None:
    path = tmp_path / "ratings.csv"
    table.drop(columns=["catch", "aperture_mm"]).to_csv(path, index=False)
    with pytest.raises(InputError, match=r"fixation is 'gate'.*fixation is 'tree'.*must be near or far"):
        read_ratings(path)
    own = read_ratings(path, conditions={name: name for name in NAMES})
    assert set(own.table["fixation"]) == {*NAMES}
