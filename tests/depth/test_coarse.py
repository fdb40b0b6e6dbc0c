"""Coarse detail of compressed views: the halved problem, the rule by which its depth joins, and what it gains."""

from __future__ import annotations

import numpy as np
import pytest
from judged import covered, said
from numpy.typing import NDArray
from sheets import TILE, natural, views

from focalgradient import recover_depth
from focalgradient.depth.equalise import estimate as equalise_estimate
from focalgradient.depth.equalise.coarse import CONTINUED, joined
from focalgradient.depth.search import Estimate

SIDE = 200
NOTHING = np.zeros((SIDE, SIDE), np.float32)


def estimate_of(vergence: float, sd: float, valid: NDArray[np.bool_]) -> Estimate:
    size = valid.shape
    values = np.full(size, vergence, np.float32), np.full(size, sd, np.float32)
    return Estimate(*values, valid, [0.01, 0.01], details={"split_band": {"tau": 0.02}})


def test_both_are_weighted_by_precision_and_their_errors_are_correlated() -> None:
    every = np.ones((SIDE, SIDE), np.bool_)
    found = joined(estimate_of(1.0, 0.02, every), estimate_of(1.03, 0.04, every[::2, ::2]), NOTHING, 8.0)
    assert found.vergence == pytest.approx(0.8 * 1.0 + 0.2 * 1.03)
    # 0.8 x 0.02 and 0.2 x 0.04 with a correlation of 0.7, and the spread of the two, 0.03 x root of 0.8 x 0.2.
    by_errors = 0.016**2 + 0.008**2 + 2 * 0.7 * 0.016 * 0.008
    assert found.vergence_sd == pytest.approx(np.sqrt(by_errors + 0.012**2), rel=1e-5)
    assert found.valid.all()
    assert found.details["coarse_detail"] == {"share_joined": 1.0, "share_added": 0.0, "tau": 0.02}


@pytest.mark.parametrize(("vergence", "is_added"), [(1 + 0.9 * CONTINUED, True), (1 + 1.1 * CONTINUED, False)])
def test_coarse_detail_alone_must_continue_what_is_around_it(vergence: float, is_added: bool) -> None:
    fine, coarse = np.zeros((SIDE, SIDE), np.bool_), np.ones((SIDE // 2, SIDE // 2), np.bool_)
    fine[:, :100] = True
    one, other = estimate_of(1.0, 0.02, fine), estimate_of(1.0, 0.02, coarse)
    other.vergence[:, 50:] = vergence
    found = joined(one, other, NOTHING, 8.0)
    assert found.valid[:, 104:110].all() == is_added
    assert found.valid[:, 104:110].any() == is_added
    assert not found.valid[:, 190:].any()  # nothing is known around
    assert (found.vergence[:, 104:110] == pytest.approx(vergence)) == is_added
    if is_added:  # the difference from what is around is part of the uncertainty
        assert found.vergence_sd[100, 106] == pytest.approx(np.hypot(0.02, vergence - 1), rel=1e-3)


def test_coarse_detail_is_used_alone_where_fine_detail_contradicts() -> None:
    depth = recover_depth(views(natural(np.random.default_rng(11)), 1.4, 75), near=0.85)
    assert depth.valid.mean() > 0.9
    assert covered(depth, 1.4) > 0.93
    assert depth.details["coarse_detail"]["share_joined"] == 0


@pytest.mark.slow
def test_a_compressed_sheet_gains_and_an_uncompressed_one_is_as_before(monkeypatch: pytest.MonkeyPatch) -> None:
    sheet = np.where(np.arange(TILE) < TILE // 2, natural(np.random.default_rng(11)), 0.7)

    def recovered(quality: int | None) -> tuple[float, float, dict[str, object]]:
        depth, _ = said(views(sheet, 0.88, quality), near=0.85)
        return float(depth.valid.mean()), covered(depth, 0.88), dict(depth.details)

    valid, within, details = recovered(75)
    plain = recovered(None)
    assert "coarse_detail" in details
    assert "coarse_detail" not in plain[2]
    monkeypatch.setattr(equalise_estimate, "halved", lambda problem: None)
    before, _, by_fine = recovered(75)
    assert "coarse_detail" not in by_fine
    assert valid > before + 0.05
    assert within > 0.9
    assert recovered(None)[:2] == plain[:2]
