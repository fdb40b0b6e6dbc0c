"""Depth ratings: what was put in comes out, what cannot be told is said, bad tables are refused by row."""

import math
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import stats

from focalgradient import InputError
from focalgradient.statistics import DepthRatingResult, Effect, Interval, NotComputed, OwnRatings, depth_rating
from focalgradient.statistics.crossed import components, crossed_effect, moments, over_subjects, own_means
from focalgradient.statistics.means import holm, paired_effect, t_interval, welch, within_half_widths
from focalgradient.statistics.ordinal import ordinal_rating

APERTURES = {"pinhole": 0.0, "f/22": 2.0, "f/11": 4.0, "f/5.6": 8.0}


def ratings(subjects: int, near: float, far: float, *, differ: float = 0.1, noise: float = 0.15, seed: int = 1):
    """Ratings with a mean log rise `near` or `far` at the largest aperture."""
    rng = np.random.default_rng(seed)
    rows = [
        (f"{subject:02}", fixation, aperture, mm, scene, level + own * mm / 8 + rng.normal(0, noise))
        for subject in range(subjects)
        for level in [rng.normal(0, 0.2)]
        for fixation, rise in (("nearest", near), ("farthest", far))
        for own in [rng.normal(rise, differ)]
        for aperture, mm in APERTURES.items()
        for scene in ("room", "terrain", "room", "terrain")
    ]
    table = pd.DataFrame(rows, columns=["participant_id", "fixation", "aperture", "aperture_mm", "scene", "rating"])
    return table.assign(rating=np.exp(table["rating"]), trial=range(len(table)), catch=False)


def analyse(table: pd.DataFrame, **asked) -> DepthRatingResult:
    return depth_rating(table, **{"equivalence_bound": 1.2} | asked)


def test_a_rise_is_found_and_none_is_called_none() -> None:
    result = analyse(ratings(20, np.log(2.0), 0.0))
    near, far = result.fixations
    assert (result.trials, len(result.participants), result.largest_mm) == (640, 20, 8.0)
    assert near.slope.low < np.log(2) / 8 < near.slope.high
    assert near.rise.corrected_p == near.rise.p < 1e-6
    assert near.rise.ratio.low < 2 < near.rise.ratio.high
    assert not near.equivalence.equivalent
    assert far.equivalence.equivalent
    assert result.interaction.low < np.log(2) < result.interaction.high
    assert result.interaction.p < 1e-6
    last = result.means[3]
    assert (last.fixation, last.aperture, last.subjects) == ("nearest", "f/5.6", 20)
    assert last.ratio.low < 2 < last.ratio.high
    assert isinstance(result.ordinal, NotComputed)
    assert result.remarks == ()


def test_answers_in_one_step_or_perfectly_ordered_have_no_ordinal_slope() -> None:
    table = ratings(6, 0.0, 0.0)
    same = analyse(table.assign(rating=3), scale="ordinal").ordinal
    assert "All answers are the same" in same.rises[0].reason
    steps = table["aperture"].map({"pinhole": 1, "f/22": 2, "f/11": 3, "f/5.6": 4})
    assert isinstance(analyse(table.assign(rating=steps), scale="ordinal").ordinal.rises[0], NotComputed)


def test_what_cannot_be_tested_says_why() -> None:
    """One subject; no pinhole; the pinhole alone, or with one other aperture; equal answers."""
    one = analyse(ratings(1, 0.5, 0.0))
    assert one.means[3].ratio == Interval(pytest.approx(one.subject_means[3].ratio), None, None)
    names = ("slope", "rise", "rise_these_scenes", "equivalence")
    untested = [one.means[3].against_pinhole, one.interaction, *(getattr(one.fixations[0], name) for name in names)]
    assert all("two or more" in missing.reason for missing in untested)
    table = ratings(8, 0.6, 0.0)
    without = analyse(table.query("aperture != 'pinhole'"))
    assert without.fixations[0].slope.p < 0.05
    assert all("fixated in no pinhole trial" in mean.ratio.reason for mean in without.means)
    assert (without.scene_means, {mean.ratio for mean in without.subject_means}) == ((), {None})
    alone = analyse(table.query("aperture == 'pinhole'"))
    assert {each.rise.reason for each in alone.fixations} == {"The pinhole is the only aperture."}
    for each in analyse(table.query("aperture in ('pinhole', 'f/5.6')")).fixations:
        assert each.rise.estimate == pytest.approx(8 * each.slope.estimate)  # a line through two points
    equal = analyse(table.assign(rating=1.0))
    assert equal.means[3].ratio == Interval(1.0, 1.0, 1.0)
    assert "same value" in equal.fixations[0].rise.reason
    assert "same value" in equal.interaction.reason


def test_scenes_have_the_mean_ratio_to_the_pinhole_with_its_t_interval() -> None:
    table = ratings(7, 0.6, 0.1)
    table.loc[table["scene"] == "room", "rating"] **= 1.5
    found = {(mean.scene, mean.fixation, mean.aperture_mm): mean.ratio for mean in analyse(table).scene_means}
    logs = np.log(table["rating"]).groupby([table[name] for name in ("scene", "fixation", "aperture_mm")])
    assert set(found) == set(logs.groups)
    for (scene, fixation, mm), ratio in found.items():
        own = table[(table["scene"] == scene) & (table["fixation"] == fixation)]
        each = np.log(own["rating"]).groupby([own["participant_id"], own["aperture_mm"]]).mean().unstack()
        changes = each[mm] - each[0.0]
        assert ratio.estimate == pytest.approx(np.exp(changes.mean()))
        if mm:
            ends = stats.ttest_1samp(changes, 0.0).confidence_interval()
            assert (ratio.low, ratio.high) == pytest.approx((np.exp(ends.low), np.exp(ends.high)))


def test_lost_trials_cost_only_what_needs_them() -> None:
    table = ratings(8, 0.5, 0.0)
    table = table[~((table["participant_id"] == "03") & (table["aperture"] == "f/11"))]
    result = analyse(table)
    assert result.fixations[0].rise.subjects == 8
    assert result.fixations[0].slope.subjects == 7
    assert [mean.subjects for mean in result.means[:4]] == [8, 8, 7, 8]
    assert sum("03" in remark for remark in result.remarks) == 1


def test_scenes_that_go_with_apertures_are_not_corrected_for() -> None:
    result = analyse(ratings(6, 0.5, 0.0).assign(scene=lambda table: table["aperture"]))
    assert isinstance(result.fixations[0].slope, Effect)
    assert "confounded" in result.remarks[0]


def test_catch_trials_are_left_out() -> None:
    table = ratings(6, 0.5, 0.0)
    catch = table.assign(trial=table["trial"] + 10_000, catch=True, rating=9.0)
    assert analyse(pd.concat([table, catch], ignore_index=True)) == analyse(table)
    with pytest.raises(InputError, match="All trials are catch trials"):
        analyse(catch)


def test_neither_order_nor_unit_of_ratings_matters() -> None:
    table = ratings(6, 0.5, 0.0)
    result, other = analyse(table), analyse(table.assign(rating=7 * table["rating"]).sample(frac=1, random_state=1))
    for one, two in zip(result.fixations, other.fixations, strict=True):
        assert one.slope.p == pytest.approx(two.slope.p, rel=1e-4)
        assert one.rise.p == pytest.approx(two.rise.p, rel=1e-8)
    lows = [mean.ratio.low for mean in other.means]
    assert [mean.ratio.low for mean in result.means] == pytest.approx(lows, rel=1e-9)


BAD = [
    ({"rating": -1.0}, r"^Row 5 \(participant 00, trial 5\): rating is -1.0, but must be a number above 0"),
    ({"aperture": "f22"}, 'Row 5 .*aperture is f22, but must be "pinhole" or "f/" and a number'),
    ({"aperture_mm": 3.0}, "Row 5 .*aperture_mm is 3.0, but must be the same"),
    ({"trial": 4}, "Row 5 .*trial is 4, but that trial occurs in a row above"),
    ({"catch": "yes"}, "Row 5 .*catch is yes, but must be true or false"),
    ({"kind": "simulated"}, "Row 5 .*kind is simulated, .*analyse people and simulated observers apart"),
    ({"scene": None}, "Row 5 .*scene is (None|nan), but every row must name its scene"),
    ({"trial": np.nan}, "Row 5 .*trial is nan, but every row must have its trial's number"),
]


@pytest.mark.parametrize(("change", "sentence"), BAD)
def test_bad_rows_are_named(change: dict[str, object], sentence: str) -> None:
    table = ratings(3, 0.5, 0.0).assign(kind="human").astype({"catch": object})
    (column, value), *_ = change.items()
    table.loc[5, column] = value
    with pytest.raises(InputError, match=sentence):
        analyse(table)


def test_bad_tables() -> None:
    table = ratings(3, 0.5, 0.0)
    with pytest.raises(InputError, match="no column scene, rating: it needs participant_id"):
        analyse(table.drop(columns=["rating", "scene"]))
    with pytest.raises(InputError, match="has no rows"):
        analyse(table.iloc[:0])
    with pytest.raises(InputError, match="is a list, but must be a pandas DataFrame"):
        analyse([])
    with pytest.raises(InputError, match="is an OwnRatings, but must be a pandas DataFrame: give its table"):
        analyse(OwnRatings(table, ()))
    with pytest.raises(InputError, match=r"equivalence_bound is 0\.9, but must be a ratio above 1"):
        analyse(table, equivalence_bound=0.9)


@given(st.lists(st.tuples(st.floats(-5, 5), st.floats(-5, 5)), min_size=3, max_size=12), st.floats(-9, 9))
@settings(max_examples=30, deadline=None)
def test_within_subject_intervals_of_two_conditions_are_the_paired_test(pairs, shift) -> None:
    """For two conditions the width is that of the paired difference over sqrt(2), whatever each subject's level."""
    cells = np.array(pairs)
    widths = within_half_widths(cells + shift * np.arange(len(cells))[:, None])
    test = paired_effect(cells[:, 1] - cells[:, 0], "")
    half = 0.0 if isinstance(test, NotComputed) else (test.high - test.low) / 2
    assert widths == pytest.approx([half / np.sqrt(2)] * 2, abs=1e-9)


def test_intervals_of_few_skewed_subjects_cover_what_they_say() -> None:
    """Four subjects; 1500 draws measure a coverage of .95 to .6 %."""
    rng = np.random.default_rng(1)
    intervals = [t_interval(rng.gamma(4, size=4) - 4) for _ in range(1500)]
    assert 0.93 < np.mean([each.low < 0 < each.high for each in intervals]) < 0.97


@pytest.mark.parametrize(("subjects", "scenes"), [(4, 5), (4, 12), (10, 12), (20, 12)])
def test_scenes_that_differ_do_not_make_an_effect(subjects: int, scenes: int) -> None:
    """At random subjects and scenes .05 of nothing is found, or less; of these scenes a test finds far more."""
    rng = np.random.default_rng(subjects)
    cells = rng.normal(0, 0.05, (4000, subjects, 1)) + rng.normal(0, 0.1, (4000, 1, scenes))
    found = moments(cells + rng.normal(0, 0.3, (4000, subjects, scenes)))
    p = 2 * stats.t.sf(np.abs(found.mean / found.standard_error), found.df)
    assert 0.02 < (p < 0.05).mean() < 0.062
    own = stats.ttest_1samp((cells + rng.normal(0, 0.3, cells.shape)).mean(axis=2), 0, axis=1).pvalue
    assert (own < 0.05).mean() > 0.06


def test_gaps_are_filled_by_subject_and_scene() -> None:
    """What is additive is filled exactly, so that nothing changes but the degrees of freedom."""
    table = np.add.outer(np.arange(6.0), np.array([0.3, 0.1, 0.5, 0.2, 0.9])) + 1
    gappy = table.copy()
    gappy[1, 2] = gappy[4, 0] = np.nan
    whole, filled = crossed_effect(table), crossed_effect(gappy)
    assert filled.estimate == pytest.approx(whole.estimate)
    assert "2 of 30 cells" in filled.remarks[0]


def test_few_scenes_are_taken_as_they_are() -> None:
    rng = np.random.default_rng(3)
    table = rng.normal(0.2, 0.3, (8, 12))
    assert "Satterthwaite" in crossed_effect(table[:, :5]).method
    assert crossed_effect(table[:, :4]) == over_subjects(table[:, :4])
    apart = np.full((4, 8), np.nan)
    apart[:2, :4], apart[2:, 4:] = rng.normal(size=(2, 4)), rng.normal(size=(2, 4))
    assert "Satterthwaite" in crossed_effect(apart).method  # half the subjects saw other scenes than the rest
    assert "these scenes" in crossed_effect(np.where(np.eye(6, dtype=bool), table[:6, :6], np.nan)).method


def test_means_of_subjects_with_gaps_are_of_all_scenes_where_shared_scenes_link_them() -> None:
    """Additive cells are filled exactly; subjects without a link keep their own scenes."""
    table = np.add.outer(np.arange(4.0), np.array([0.3, 0.1, 0.5, 0.2]))
    gappy = np.where(np.eye(4, dtype=bool), np.nan, table)
    assert own_means(gappy) == pytest.approx(table.mean(axis=1))
    apart = table.copy()
    apart[:2, 2:] = apart[2:, :2] = np.nan
    assert own_means(apart).tolist() == pytest.approx([0.2, 1.2, 2.35, 3.35])


@pytest.mark.parametrize("sizes", [(2, 3), (4, 9)])
def test_groups_of_unequal_variance_are_compared_as_scipy_does(sizes: tuple[int, int]) -> None:
    rng = np.random.default_rng(sum(sizes))
    one, other = rng.normal(0.5, 0.2, sizes[0]), rng.normal(0, 1, sizes[1])
    found, wanted = welch(one, other), stats.ttest_ind(one, other, equal_var=False)
    assert isinstance(found, Effect)
    assert (found.statistic, found.df, found.p) == pytest.approx((wanted.statistic, wanted.df, wanted.pvalue))
    ends = wanted.confidence_interval()
    assert (found.low, found.high) == pytest.approx((ends.low, ends.high))
    assert found.subjects == sum(sizes)
    assert "there are 1 and" in welch(one[:1], other).reason
    assert [f"A group has {count} subjects" in str(found.remarks) for count in (2, 4)] == [sizes[0] == 2, False]


def test_groups_have_cohens_d_with_the_interval_of_steiger_and_fouladi() -> None:
    """The first is cohens_d(mpg ~ am, data = mtcars) of R's effectsize: -1.48; without effect d is 0."""
    manual = [21.0, 21.0, 22.8, 32.4, 30.4, 33.9, 27.3, 26.0, 30.4, 15.8, 19.7, 15.0, 21.4]
    automatic = [21.4, 18.7, 18.1, 14.3, 24.4, 22.8, 19.2, 17.8, 16.4, 17.3, 15.2, 10.4, 10.4, 14.7, 21.5, 15.5]
    found = welch(np.array([*automatic, 15.2, 13.3, 19.2]), np.array(manual))
    assert isinstance(found, Effect)
    assert found.d.estimate == pytest.approx(-1.48, abs=0.005)
    one = np.arange(6.0)
    for shift in (0.0, 1.5):
        found = welch(one + shift, one)
        shares = [stats.nct.cdf(found.statistic, 10, end * np.sqrt(3)) for end in (found.d.low, found.d.high)]
        assert (found.d.estimate, *shares) == pytest.approx((shift / np.sqrt(3.5), 0.975, 0.025))


def test_the_rise_is_measured_where_the_line_misses_it() -> None:
    """A curve that saturates: the straight line rises less than the ratings, whose rise is measured directly."""
    table = ratings(12, 0.0, 0.0, differ=0.0)
    table["rating"] *= np.exp(0.5 * (1 - np.exp(-table["aperture_mm"])) * (table["fixation"] == "nearest"))
    near = analyse(table).fixations[0]
    assert near.rise.ratio.low < np.exp(0.5) < near.rise.ratio.high
    assert 8 * near.slope.estimate < near.rise.low


def test_residuals_are_those_of_least_squares_on_subjects_and_scenes() -> None:
    rng = np.random.default_rng(12)
    cells = rng.normal(0, 0.3, (6, 5)) + rng.normal(0, 1, (6, 1)) + rng.normal(0, 1, 5)
    subject, scene = (place.ravel() for place in np.indices(cells.shape))
    design = np.column_stack([subject[:, None] == np.arange(6), scene[:, None] == np.arange(1, 5)]).astype(float)
    left = cells.ravel() - design @ np.linalg.lstsq(design, cells.ravel(), rcond=None)[0]
    found = components(cells, "log_ratio")
    assert found.residual == pytest.approx(math.sqrt(left @ left / (30 - 10)))
    assert (found.shapiro_w, found.shapiro_p) == pytest.approx(tuple(stats.shapiro(left)))
    assert found.largest == pytest.approx(np.abs(left).max() / found.residual)


def test_the_primary_effect_is_not_corrected_and_secondary_comparisons_are_one_family() -> None:
    """Near effect, equivalence and difference stand alone; far effect, middle apertures and slopes are corrected."""
    result = analyse(ratings(8, 0.4, 0.1))
    near, far = result.fixations
    assert near.rise.p_holm is None
    assert result.interaction.p_holm is None
    between = [mean.against_pinhole for mean in result.means if mean.aperture in ("f/22", "f/11")]
    secondary = [far.rise, *between, near.slope, far.slope]
    assert [test.p_holm for test in secondary] == pytest.approx(list(holm([test.p for test in secondary])))
    largest = [mean.against_pinhole for mean in result.means if mean.aperture == "f/5.6"]
    assert largest == [near.rise, far.rise]
    assert all(test.p_holm is None for test in (near.rise_these_scenes, far.rise_these_scenes))
    assert isinstance(far.bootstrap, NotComputed)


def test_the_effect_size_is_of_the_variance_components() -> None:
    """True d .6 of 300 tables: the estimate is right on the mean, and the interval covers in 95 %."""
    rng = np.random.default_rng(3)
    shape = 300, 8, 12
    tables = 0.24 + rng.normal(0, 0.2, (300, 8, 1)) + rng.normal(0, 0.1, (300, 1, 12)) + rng.normal(0, 0.33, shape)
    true = 0.24 / math.sqrt(0.2**2 + 0.1**2 + 0.33**2)
    sizes = [crossed_effect(table).d for table in tables]
    assert np.mean([size.estimate for size in sizes]) == pytest.approx(true, abs=0.06)
    assert 0.92 < np.mean([size.low < true < size.high for size in sizes]) < 0.99
    effects = [crossed_effect(table - shift) for table in tables[:60] for shift in (0.0, 0.1, 0.2)]
    assert [effect.p < 0.05 for effect in effects] == [not effect.d.low <= 0 <= effect.d.high for effect in effects]
    gappy = np.where(rng.random(shape[1:]) < 0.3, np.nan, tables[0])
    assert crossed_effect(gappy).d.estimate == pytest.approx(sizes[0].estimate, abs=0.25)


def test_two_fixations_at_the_floor_differ_by_one_test() -> None:
    """The interaction is the pair; only three and more fixations have a table of pairs."""
    table = ratings(6, np.log(2.5), 0.0)
    found = ordinal_rating(table.assign(rating=1 + (table["rating"] > 1.3)), [])
    assert found.by_people
    assert found.differences == {}
    near, far = found.rises
    assert found.interaction.estimate == pytest.approx(near.estimate - far.estimate)
    assert found.these_scenes == (near, replace(far, p_holm=None), found.interaction)
