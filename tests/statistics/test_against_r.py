"""Every estimate against R's: see the scripts in `reference`, which name the packages."""

import os
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from focalgradient.statistics import DepthRatingResult, NeckerResult, compare_pictures, depth_rating, necker, reml
from focalgradient.statistics.crossed import components, crossed_effect
from focalgradient.statistics.cumulative import cumulative_fit
from focalgradient.statistics.means import holm, student_effect
from focalgradient.statistics.ordinal import design_matrix

REFERENCE = Path(__file__).parent / "reference"
BY_R = pd.read_csv(REFERENCE / "reference.csv").groupby("name")["value"].apply(np.array)
CROSSED = pd.read_csv(REFERENCE / "crossed_reference.csv").groupby("name")["value"].apply(np.array)
COMPARED = pd.read_csv(REFERENCE / "comparisons_reference.csv").groupby("name")["value"].apply(np.array)
NUMBER = {"nearest": 0, "farthest": 1}


def table(name: str) -> pd.DataFrame:
    return pd.read_csv(REFERENCE / name, dtype={"participant_id": str}, keep_default_na=False)


@pytest.fixture(scope="module")
def ratings() -> DepthRatingResult:
    return depth_rating(table("depth_rating.csv"), equivalence_bound=1.2)


@pytest.fixture(scope="module")
def cube() -> NeckerResult:
    return necker(table("necker.csv"))


@pytest.fixture(scope="module")
def many_scenes() -> DepthRatingResult:
    return depth_rating(table("crossed.csv"), equivalence_bound=1.2)


@pytest.mark.parametrize("fixation", NUMBER)
@pytest.mark.parametrize("what", ["rise", "slope"])
def test_subjects_and_scenes_crossed_are_lmertests(many_scenes: DepthRatingResult, fixation: str, what: str) -> None:
    found = getattr(many_scenes.fixations[NUMBER[fixation]], what)
    estimate, error, df, t, p, *_ = CROSSED[f"{what}_{fixation}"]
    assert found.estimate == pytest.approx(estimate, rel=1e-8)
    assert (found.standard_error, found.df, found.statistic) == pytest.approx((error, df, t), rel=1e-6)
    assert found.p == pytest.approx(p, rel=1e-6)


def test_interaction_is_lmertests(many_scenes: DepthRatingResult) -> None:
    found = many_scenes.interaction
    estimate, error, df, _, p, *_ = CROSSED["interaction"]
    assert (found.estimate, found.standard_error, found.df, found.p) == pytest.approx(
        (estimate, error, df, p), rel=1e-6
    )


@pytest.mark.parametrize("fixation", NUMBER)
def test_variance_components_are_lmers(many_scenes: DepthRatingResult, fixation: str) -> None:
    found = many_scenes.fixations[NUMBER[fixation]].components
    wanted = CROSSED[f"rise_{fixation}"][7:]
    assert (found.subjects, found.scenes, found.residual) == pytest.approx(wanted, rel=1e-6)


@pytest.mark.parametrize("fixation", NUMBER)
def test_for_these_scenes_it_is_the_t_test_of_the_subjects(many_scenes: DepthRatingResult, fixation: str) -> None:
    found = many_scenes.fixations[NUMBER[fixation]].rise_these_scenes
    assert (found.estimate, found.low, found.high, found.p) == pytest.approx(CROSSED[f"these_{fixation}"], rel=1e-8)


def test_lost_cells_are_fitted_as_by_lmertest() -> None:
    cells = table("crossed_lost.csv").pivot(index="participant_id", columns="scene", values="value")
    found = crossed_effect(cells)
    estimate, error, df, *_ = CROSSED["lost"]
    assert found.estimate == pytest.approx(estimate, abs=1e-5 * error)
    assert (found.standard_error, found.df) == pytest.approx((error, df), rel=1e-4)
    parts = components(cells, "value")
    assert (parts.subjects, parts.scenes, parts.residual) == pytest.approx(CROSSED["lost"][7:], rel=1e-4)


INCOMPLETE = Path(os.environ.get("REML_TABLES", REFERENCE))
"""Folder of tables with gaps; `incomplete.R` makes as many as wanted."""


def incomplete_tables() -> list[tuple[pd.Series, pd.DataFrame]]:
    by_r = pd.read_csv(INCOMPLETE / "incomplete_reference.csv").set_index("set")
    rows = pd.read_csv(INCOMPLETE / "incomplete.csv").groupby("set")
    return [(by_r.loc[name], cells.pivot(index="subject", columns="scene", values="value")) for name, cells in rows]


def test_incomplete_tables_are_fitted_as_by_lmertest() -> None:
    """Cells lost by chance, blocks of 4 of 12 scenes, scenes nested in subjects; some without variance of a term."""
    tables = incomplete_tables()
    assert len(tables) >= 42
    assert sum(by_r.singular for by_r, _ in tables) >= 10
    for by_r, cells in tables:
        fitted = reml.fit(cells)
        assert fitted.mean == pytest.approx(by_r.mean_, rel=1e-4, abs=1e-4 * by_r.error)
        assert fitted.standard_error == pytest.approx(by_r.error, rel=1e-4)
        assert fitted.df == pytest.approx(by_r.df, rel=0.01)
        t = student_effect(fitted.mean, fitted.standard_error, len(cells), "", df=fitted.df)
        assert t.p == pytest.approx(by_r.p, rel=1e-4, abs=1e-6)


def test_rounding_and_order_do_not_change_a_fit() -> None:
    """Noise of 1e-12, the order of subjects and scenes, and the layout of the array in memory."""
    random = np.random.default_rng(1)
    for _, table in incomplete_tables()[::2]:
        cells = table.to_numpy()
        fitted = reml.fit(cells)
        rows, columns = random.permutation(len(cells)), random.permutation(cells.shape[1])
        noisy = cells * (1 + 1e-12 * random.standard_normal(cells.shape))
        for other in (noisy, cells[rows][:, columns], np.asfortranarray(cells), cells[::-1, ::-1]):
            again = reml.fit(other)
            for name in ("mean", "standard_error", "df", "subjects", "scenes", "residual"):
                wanted = getattr(fitted, name)
                assert getattr(again, name) == pytest.approx(wanted, rel=1e-6, abs=1e-9 * fitted.residual), name


def test_a_table_with_a_minimum_beside_a_boundary_is_fitted_as_by_lmertest() -> None:
    """A search over standard deviations stopped where scenes have no variance, or not, with the last digit."""
    ratings = pd.read_csv(REFERENCE / "beside_a_boundary.csv")
    cells = ratings.pivot(index="subject", columns="scene", values="value").to_numpy()
    for factor in (1, 1 + 1e-14, 1 - 1e-15):
        effect = crossed_effect(cells * factor)
        assert (effect.df, effect.standard_error, effect.p) == pytest.approx((3.773, 0.04762, 0.4537), rel=2e-4)


@pytest.mark.parametrize("fixation", NUMBER)
def test_ratios_to_the_pinhole(ratings: DepthRatingResult, fixation: str) -> None:
    means = [mean for mean in ratings.means if mean.fixation == fixation and mean.aperture != "pinhole"]
    assert [mean.aperture for mean in means] == ["f/22", "f/11", "f/5.6"]
    assert [mean.ratio.estimate for mean in means] == pytest.approx(BY_R[f"ratio_{fixation}"], rel=1e-8)
    tests = [mean.against_pinhole for mean in means]
    assert [test.p for test in tests] == pytest.approx(BY_R[f"pinhole_p_{fixation}"], rel=1e-8)
    assert [test.dz for test in tests] == pytest.approx(BY_R[f"pinhole_dz_{fixation}"], rel=1e-8)
    by_t = np.exp([tests[-1].low, tests[-1].high])
    assert by_t == pytest.approx(BY_R[f"pinhole_interval_{fixation}"], rel=1e-8)


@pytest.mark.parametrize("fixation", NUMBER)
def test_equivalence(ratings: DepthRatingResult, fixation: str) -> None:
    each = ratings.fixations[NUMBER[fixation]]
    found = each.equivalence
    assert (found.p_below, found.p_above) == pytest.approx(BY_R[f"tost_{fixation}"], rel=1e-8)
    assert found.equivalent == (BY_R[f"tost_{fixation}"].max() < 0.05)
    assert found.equivalent == (-found.bound < found.low and found.high < found.bound)
    assert each.rise.low < found.low < found.high < each.rise.high


def test_interaction_of_few_scenes(ratings: DepthRatingResult) -> None:
    found = ratings.interaction
    assert (found.estimate, found.low, found.high, found.p, found.dz) == pytest.approx(BY_R["interaction"], rel=1e-8)


def test_correction_of_many_tests(ratings: DepthRatingResult) -> None:
    single = np.concatenate([BY_R["pinhole_p_nearest"], BY_R["pinhole_p_farthest"]])
    assert holm(single) == pytest.approx(BY_R["holm"], rel=1e-8)


def test_within_subject_intervals(ratings: DepthRatingResult) -> None:
    assert [mean.rating.estimate for mean in ratings.means] == pytest.approx(BY_R["cell_means"], rel=1e-8)
    widths = [np.log(mean.rating.high / mean.rating.low) / 2 for mean in ratings.means]
    assert widths == pytest.approx(BY_R["cousineau_morey"], rel=1e-8)


@pytest.mark.parametrize(
    ("name", "columns", "nodes"),
    [pytest.param("clmm_intercept", 1, 15, marks=pytest.mark.slow), ("clmm_slope_laplace", 2, 1)],
)
def test_cumulative_link_mixed_model_is_clmms(name: str, columns: int, nodes: int) -> None:
    """With R's own nodes: 15 for a random intercept, and Laplace's approximation (one) with a random slope."""
    rows = table("ordinal.csv")
    design = design_matrix(rows["aperture_mm"].to_numpy(), rows["scene"].to_numpy(dtype=object))
    subject = pd.factorize(rows["participant_id"])[0]
    design[:, 1] /= 10
    fit = cumulative_fit(rows["rating"].to_numpy() - 1, design[:, 1:], design[:, :columns], subject, nodes)
    estimate, error, log_likelihood = BY_R[name]
    assert fit.fixed[0] / 10 == pytest.approx(estimate, abs=1e-3 * error)
    assert fit.standard_errors[0] / 10 == pytest.approx(error, rel=1e-3)
    assert fit.log_likelihood == pytest.approx(log_likelihood, abs=1e-5)


def test_ordinal_slope_is_near_clmms() -> None:
    """Laplace's approximation, all that R can do with a random slope, is off by a hundredth of the error."""
    found = depth_rating(table("ordinal.csv").assign(catch=False), equivalence_bound=1.2, scale="ordinal")
    estimate, error, _ = BY_R["clmm_slope_laplace"]
    assert found.ordinal.slopes[0].estimate == pytest.approx(estimate, abs=0.01 * error)
    assert found.ordinal.slopes[0].standard_error == pytest.approx(error, rel=0.02)


def test_shares_of_time(cube: NeckerResult) -> None:
    order = ["none", "rigid", "nonrigid"]
    for gradient, share, whole in zip(order, BY_R["share_nonrigid"], BY_R["time_nonrigid"], strict=True):
        own = [each.nonrigid for each in cube.subject_shares if each.gradient == gradient]
        assert np.mean(own) == pytest.approx(share, rel=1e-8)
        (found,) = (each for each in cube.shares if (each.gradient, each.percept) == (gradient, "nonrigid"))
        assert found.time.estimate == pytest.approx(whole, abs=1e-5)  # R's clock was rounded to the millisecond


@pytest.mark.parametrize("gradient", ["rigid", "nonrigid"])
def test_effect_of_a_gradient(cube: NeckerResult, gradient: str) -> None:
    (found,) = (effect.odds_of_time for effect in cube.effects if effect.gradient == gradient)
    assert found.df == 7
    assert (found.estimate, found.low, found.high, found.p) == pytest.approx(BY_R[f"odds_{gradient}"], rel=1e-7)


def test_durations(cube: NeckerResult) -> None:
    """Likelihoods agree to a millionth; what they are flat in, less."""
    for found in cube.dominance:
        for family, fit in (("gamma", found.gamma), ("lognormal", found.lognormal)):
            first, second, log_likelihood = BY_R[f"{family}_{found.gradient}_{found.percept}"]
            shape, scale = (first, second) if family == "gamma" else (second, np.exp(first))
            assert (fit.shape, fit.scale) == pytest.approx((shape, scale), rel=1e-3)
            assert fit.log_likelihood == pytest.approx(log_likelihood, abs=1e-5)
        assert found.better == max(("gamma", "lognormal"), key=lambda name: getattr(found, name).log_likelihood)


@pytest.fixture(scope="module")
def compared() -> pd.DataFrame:
    return table("comparisons.csv")


@pytest.mark.parametrize("fixation", NUMBER)
@pytest.mark.parametrize(("kind", "answers"), [("bipolar", "steps"), ("choice", "choice")])
def test_two_pictures_compared_by_steps_or_choices(
    compared: pd.DataFrame, kind: str, answers: str, fixation: str
) -> None:
    found = compare_pictures(compared.assign(rating=compared[answers]), kind)
    slope, both = found.slopes[NUMBER[fixation]], found.interaction
    assert (slope.estimate, slope.low, slope.high, slope.p) == pytest.approx(
        COMPARED[f"{kind}_slope_{fixation}"], rel=1e-8
    )
    largest = found.against_reference[NUMBER[fixation]]
    assert (largest.estimate, largest.p) == pytest.approx(COMPARED[f"{answers}_largest_{fixation}"], rel=1e-8)
    if kind == "bipolar":
        assert (both.estimate, both.low, both.high, both.p) == pytest.approx(COMPARED["bipolar_interaction"], rel=1e-8)
