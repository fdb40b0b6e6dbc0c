"""Eyes that are not known exactly: what is marginalised widens the uncertainty, and a person's aberration is learnt."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from focalgradient import View, recover_depth
from focalgradient.eye import Cones, Eye, EyePrior, Oscillation, eye_views, learn_chromatic_scale, recover_eye_depth

PIXEL = np.radians(1 / 60)
EYE = Eye(0.004, 1.0)


def fixation(eye: Eye, vergence: float, kind: str = "both", side: int = 112, seed: int = 0) -> list[View]:
    moments = [eye] if kind == "bands" else eye.through((0.125, 0.375), Oscillation())
    cones = [Cones.of(one, "L+M") for one in moments]
    if kind != "moments":
        cones += [Cones.of(one, "S", finest_cpd=10) for one in moments]
    return [one.view for one in eye_views(1 / vergence, cones, (side, side), PIXEL, noise=0.01, seed=seed)]


def test_what_is_uncertain_of_an_eye_is_part_of_the_uncertainty() -> None:
    views = fixation(EYE, 1.5, "moments", side=80)
    plain, known = recover_depth(views), recover_eye_depth(views, EyePrior(chromatic_scale_sd=0.0))
    assert np.array_equal(plain.valid, known.valid)
    assert known.vergence == pytest.approx(plain.vergence)
    assert known.vergence_sd == pytest.approx(plain.vergence_sd, rel=1e-5)
    focus = recover_eye_depth(views, EyePrior(chromatic_scale_sd=0.0, focus_sd=0.1))
    assert focus.vergence_sd[focus.valid] == pytest.approx(np.hypot(known.vergence_sd, 0.1)[focus.valid], rel=1e-4)
    prior = EyePrior(chromatic_scale_sd=0.0, illuminants=("D65", "A"))
    assert [weight for *_, weight in prior.eyes()] == [0.5, 0.5]
    light = recover_eye_depth(views, prior)
    # Light A moves the focus of the L and M cones by 0.1 D.
    assert np.median(light.vergence_sd) > np.median(known.vergence_sd) + 0.03
    assert light.details["eye"]["illuminants"] == ["D65", "A"]


def test_people_are_less_certain_than_a_person_and_a_wrong_eye_is_covered() -> None:
    """An eye of 0.8 times the mean aberration: by the mean eye's depth is 0.1 D off."""
    views = fixation(replace(EYE, chromatic_scale=0.8), 1.5, "bands", side=96)
    mean, people = (recover_eye_depth(views, EyePrior(chromatic_scale_sd=sd)) for sd in (0.0, 0.25))
    off = np.abs(mean.vergence - 1.5)[mean.valid]
    assert np.median(off) > 0.05
    assert np.mean(off <= 2 * mean.vergence_sd[mean.valid]) < 0.5
    inside = np.abs(people.vergence - 1.5) <= 2 * people.vergence_sd
    assert people.valid.mean() > 0.5
    assert inside[people.valid].mean() > 0.9


def test_one_fixation_halves_what_is_unknown_of_a_persons_aberration() -> None:
    learnt = learn_chromatic_scale([fixation(replace(EYE, chromatic_scale=0.8), 1.6, side=80)])
    assert learnt.chromatic_scale == pytest.approx(0.8, abs=learnt.chromatic_scale_sd)
    assert learnt.chromatic_scale_sd < 0.6 * EyePrior().chromatic_scale_sd


@pytest.mark.slow
@pytest.mark.parametrize("scale", [0.8, 1.25])
def test_a_persons_aberration_is_learnt_from_fixations(scale: float) -> None:
    eye = replace(EYE, chromatic_scale=scale)
    learnt = learn_chromatic_scale([fixation(eye, vergence, seed=number) for number, vergence in enumerate((1.6, 0.6))])
    assert learnt.chromatic_scale == pytest.approx(scale, abs=2.5 * learnt.chromatic_scale_sd)
    assert learnt.chromatic_scale_sd < 0.12
    # With it two wavebands alone are right again.
    depth = recover_eye_depth(fixation(eye, 1.5, "bands", seed=7), learnt)
    assert np.median(depth.vergence[depth.valid]) == pytest.approx(1.5, abs=0.05)
