"""The internal check: pairs whose depth is estimated, and a false-alarm rate that is the one asked for."""

from dataclasses import replace
from typing import Any

import blurred
import numpy as np
import pytest
from blurred import lens
from scipy import stats

from focalgradient import View, recover_depth
from focalgradient.depth.spectra.check import check_views


def wall(*arguments: Any, **options: Any) -> list[View]:
    """A part of the wall, of 152 x 192 pixels."""
    return [replace(view, image=view.image[:152, :192]) for view in blurred.wall(*arguments, **options)]


LENSES = [lens(16), lens(8), lens(5.6)]
LIMITS = {"near": 0.85, "far": 2.0, "psf": "gaussian", "noise": 0.01}
INSIDE = np.s_[44:-40:8, 44:-40:8]  # the middle of each block


@pytest.fixture(scope="module")
def views() -> list[View]:
    return wall(LENSES, 1.2, psf="gaussian")


def test_every_pair_tells_the_depth_and_all_together_more() -> None:
    check = check_views(blurred.wall(LENSES, 1.2, psf="gaussian"), **LIMITS)
    assert [pair.views for pair in check.pairs] == [(1, 2), (1, 3), (2, 3)]
    assert check.freedom == 1
    for pair in check.pairs:
        error = (pair.vergence - 1 / 1.2)[INSIDE]
        assert abs(error.mean()) < 0.01 * (1 / 0.85 - 1 / 1.2)
        assert 0.87 <= np.mean(np.abs(error) <= 2 * pair.vergence_sd[INSIDE]) <= 0.995
        assert np.median(check.joint_sd[INSIDE]) < np.median(pair.vergence_sd[INSIDE])
    assert 0.87 <= np.mean(np.abs(check.joint - 1 / 1.2)[INSIDE] <= 2 * check.joint_sd[INSIDE]) <= 0.995


def test_false_alarms_are_as_many_as_asked_for() -> None:
    """Of what agrees, a tenth and a hundredth is rejected; the statistic follows chi-square."""
    walls = [blurred.wall(LENSES, 1.3, psf="gaussian", seed=seed) for seed in range(2)]
    statistic = np.concatenate([check_views(one, **LIMITS).statistic[INSIDE] for one in walls]).ravel()
    assert statistic.mean() == pytest.approx(1.0, abs=0.3)
    assert 0.04 <= np.mean(statistic > stats.chi2.isf(0.1, 1)) <= 0.16
    assert np.mean(statistic > stats.chi2.isf(0.01, 1)) <= 0.03


@pytest.mark.filterwarnings("ignore:the blur is not quite")
def test_an_error_of_the_blur_adds_its_share_of_the_defocus_to_the_uncertainty() -> None:
    """Discs taken for Gaussians: the variance beyond that of noise is (tau times the defocus) squared."""
    discs = wall(LENSES, 1.2, psf="disc")
    depth = recover_depth(discs, method="spectra", **LIMITS)
    noise = check_views(discs, **LIMITS).joint_sd
    assert depth.details["tau"] > 0.01
    of_model = np.sqrt(depth.vergence_sd**2 - noise**2)[INSIDE]
    focus = 1 / LENSES[-1].focus_distance
    assert of_model == pytest.approx(depth.details["tau"] * np.abs(depth.vergence - focus)[INSIDE], rel=0.02)


@pytest.mark.filterwarnings("ignore:.*valid, most likely")
def test_contradiction_is_found_and_rejected(views: list[View]) -> None:
    """The third view is of a wall nearer by a third: no depth explains all three."""
    other = wall(LENSES, 1.5, psf="gaussian")[2]
    mixed = [*views[:2], replace(other, optics=LENSES[2])]
    check = check_views(mixed, **LIMITS)
    assert check.agrees[INSIDE].mean() < 0.05
    apart = check.pairs[1].vergence - check.pairs[0].vergence
    assert np.abs(apart[INSIDE]).mean() > 0.05
    assert recover_depth(mixed, method="spectra", **LIMITS).valid.mean() < 0.05


def test_two_views_cannot_disagree(views: list[View]) -> None:
    check = check_views(views[::2], **LIMITS)
    assert check.freedom == 0
    assert check.agrees[INSIDE].all()
    assert np.abs(check.statistic[INSIDE]).max() < 1e-3
