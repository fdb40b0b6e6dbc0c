"""Draws of people: as spread as asked for, each quantity from its own seed."""

import numpy as np
import pytest

from focalgradient.eye import chromatic_difference, draw_people

PEOPLE = draw_people(2000, seed=1)


def test_chromatic_spans_are_spread_as_measured() -> None:
    """1.54 +- 0.39 D between 450 and 650 nm: what the eyes themselves say."""
    spans = [p.eye.in_light(450).focus_vergence - p.eye.in_light(650).focus_vergence for p in PEOPLE[:500]]
    assert np.mean(spans) == pytest.approx(1.54, abs=0.06)
    assert np.std(spans) == pytest.approx(0.39, abs=0.04)
    (least,) = draw_people(1, 0, chromatic_span=(0.31, 0.0))  # about the least that is accepted
    assert least.eye.chromatic_scale == pytest.approx(0.31 / float(chromatic_difference(650, 450)))
    assert spans[0] == pytest.approx(PEOPLE[0].eye.chromatic_scale * float(chromatic_difference(650, 450)))


def test_pupils_and_microfluctuations() -> None:
    pupils = np.array([person.eye.pupil_diameter for person in PEOPLE])
    rms = np.array([person.fluctuation.rms for person in PEOPLE])
    beta = np.array([person.fluctuation.beta for person in PEOPLE])
    assert (pupils.mean(), pupils.std()) == pytest.approx((4e-3, 0.8e-3), rel=0.05)
    assert pupils.min() >= 1.5e-3
    assert 0.1 <= rms.min() < 0.11
    assert 0.48 < rms.max() <= 0.5
    assert 1.1 <= beta.min() < 1.12
    assert 1.48 < beta.max() <= 1.5
    assert np.abs(np.corrcoef([pupils, rms, beta, [p.eye.chromatic_scale for p in PEOPLE]]) - np.eye(4)).max() < 0.08


def test_the_first_of_many_are_those_of_few() -> None:
    assert draw_people(5, seed=1) == PEOPLE[:5]
    assert draw_people(5, seed=2) != PEOPLE[:5]
    assert len({person.fluctuation.seed for person in PEOPLE[:200]}) == 200


def test_one_quantity_leaves_the_others() -> None:
    other = draw_people(20, seed=1, pupil_diameter=(0.006, 0.0), rms=(0.2, 0.2))
    for changed, person in zip(other, PEOPLE, strict=False):
        assert changed.eye.pupil_diameter == 0.006
        assert changed.fluctuation.rms == pytest.approx(0.2)
        assert changed.eye.chromatic_scale == person.eye.chromatic_scale
        assert changed.fluctuation.beta == person.fluctuation.beta
