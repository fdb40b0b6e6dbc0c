"""Bayesian models of the ratings: they agree with the t-test where both must, hold their priors, and say what lacks."""

import importlib.util
import math

import numpy as np
import pandas as pd
import pytest

from focalgradient.errors import InputError
from focalgradient.report import make_report
from focalgradient.statistics import NotComputed, bayes
from focalgradient.statistics.bayes import bayes_depth_rating, posterior_of_rises
from focalgradient.statistics.crossed import crossed_effect
from focalgradient.statistics.posteriors import RATIO_PRIORS

INSTALLED = all(importlib.util.find_spec(name) for name in ("bambi", "pymc", "arviz"))
needs_extra = pytest.mark.skipif(not INSTALLED, reason="the extra bayes is not installed")


def ratings(subjects=6, scenes=5, near=0.4, far=0.0, seed=1):
    rng = np.random.default_rng(seed)
    rows = []
    for who in range(subjects):
        for scene in range(scenes):
            for fixation, rise in (("nearest", near), ("farthest", far)):
                own = rise + rng.normal(0, 0.05)
                for name, mm in (("pinhole", 0.0), ("f/11", 4.5), ("f/5.6", 9.0)):
                    rating = math.exp(own * mm / 9 + rng.normal(0, 0.15))
                    rows.append((f"s{who}", len(rows), f"c{scene}", name, mm, fixation, rating, False))
    names = ["participant_id", "trial", "scene", "aperture", "aperture_mm", "fixation", "rating", "catch"]
    return pd.DataFrame(rows, columns=names)


def test_without_the_extra_the_remedy_is_named(monkeypatch):
    monkeypatch.setattr("importlib.util.find_spec", lambda name: None)
    with pytest.raises(InputError, match=r"needs bambi, pymc, arviz, .*: pip install 'focalgradient\[bayes\]'"):
        bayes_depth_rating(ratings(), bound=1.2)


@pytest.mark.parametrize("bound", [1.0, 0.5, math.inf, math.nan, "1.2"])
def test_a_bound_must_be_a_ratio_above_1(bound):
    with pytest.raises(InputError, match="must be a ratio above 1"):
        bayes_depth_rating(ratings(), bound=bound)


def test_priors_are_densities_and_draw_what_they_say():
    at = np.linspace(-5, 5, 100_001)
    rng = np.random.default_rng(1)
    for prior in RATIO_PRIORS.values():
        assert prior.density(at).sum() * (at[1] - at[0]) == pytest.approx(1, abs=1e-3)
        drawn = np.array([prior.draw(rng) for _ in range(4000)])
        assert math.sqrt((drawn**2).mean()) == pytest.approx(prior.sd, rel=0.05)
        assert (drawn > 0).all() == prior.half


@needs_extra
@pytest.mark.slow
@pytest.mark.filterwarnings("default")
def test_with_much_data_the_posterior_is_that_of_the_t_test():
    table = ratings(subjects=14, scenes=8)
    wide = table.assign(log=np.log(table.rating)).pivot_table(
        index=["participant_id", "scene"], columns=["fixation", "aperture_mm"], values="log"
    )
    rises = (wide["nearest", 9.0] - wide["nearest", 0.0]).rename("log_ratio").reset_index()
    rises.columns = ["participant_id", "scene", "log_ratio"]
    found = posterior_of_rises(rises, "nearest", 1.2, draws=500, tune=500, chains=2)
    cells = rises.pivot(index="participant_id", columns="scene", values="log_ratio").to_numpy()
    test = crossed_effect(cells)
    assert found.median == pytest.approx(test.estimate, abs=0.02)
    assert (found.low, found.high) == pytest.approx((test.low, test.high), abs=0.03)
    assert found.above > 0.99
    assert found.within < 0.01
    assert found.r_hat < 1.02
    assert isinstance(posterior_of_rises(rises[rises.participant_id == "s0"], "nearest", 1.2), NotComputed)


@needs_extra
@pytest.mark.slow
@pytest.mark.filterwarnings("default")
def test_the_report_holds_findings_figure_tables_and_methods(tmp_path, monkeypatch):
    for name, value in {"DRAWS": 200, "TUNE": 300, "ORDINAL_DRAWS": 50, "ORDINAL_TUNE": 150, "CHAINS": 2}.items():
        monkeypatch.setattr(bayes, name, value)  # enough to see that everything is there
    for scale in ("ratio", "ordinal"):
        shares = []
        table = ratings(subjects=4, scenes=3)
        if scale == "ordinal":
            table["rating"] = np.clip(np.rint(3 + 3 * np.log(table["rating"])), 1, 5)
        table.to_csv(tmp_path / "own.csv", index=False)
        made = make_report(
            tmp_path / "own.csv",
            scale=scale,
            bound=1.3,
            bayes=True,
            progress=lambda share, _, into=shares: into.append(share),
        )
        page = made.files["report.md"].decode()
        assert "Bayesian analysis" in page
        assert "within a factor of 1.30 of 1 with" in page
        assert "bambi" in page
        assert {"depth_rating_bayes.png", "depth_rating_bayes.csv", "depth_rating_priors.csv"} <= set(made.files)
        assert shares[-1] == pytest.approx(1, abs=0.1)
        digits = made.files["depth_rating_bayes.csv"].decode().splitlines()
        assert [line.split(",")[0] for line in digits] == ["rise", "nearest", "farthest", "difference"]
