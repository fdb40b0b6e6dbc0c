"""Orders by Latin squares, in blocks and under constraints; procedures that choose levels."""

from __future__ import annotations

import dataclasses
import math
from collections import Counter
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Literal

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from focalgradient.dataset import Response, read_dataset, validate
from focalgradient.design import (
    ConstantStimuli,
    Counterbalanced,
    Quest,
    Staircase,
    Trial,
    answers_of,
    balanced_latin_square,
    weighted_staircase,
)
from focalgradient.design.adaptive import reversals
from focalgradient.errors import InputError
from focalgradient.observers import simulate
from focalgradient.tasks import Task, register


@pytest.mark.parametrize("count", range(1, 12))
def test_a_square_balances_places_and_neighbours(count: int) -> None:
    rows = balanced_latin_square(count)
    assert len(rows) == count * (1 + count % 2)
    assert all({*row} == {*range(count)} for row in rows)
    assert len({(place, one): 0 for row in rows for place, one in enumerate(row)}) == count**2
    assert {*Counter(pair for row in rows for pair in pairwise(row)).values()} <= {len(rows) // count}


@dataclass(frozen=True, slots=True, kw_only=True)
class ShapeTrial(Trial):
    shape: str
    size: int
    level: float | None = None


class ShapeDesign(Counterbalanced):
    task: str = "shapes"

    def trials(self, participant, session=None):
        return self.ordered(participant, session, [ShapeTrial(shape=a, size=b) for a in "abcd" for b in (1, 2, 3)])


def test_a_test_run_of_a_task_of_ones_own_shows_each_condition_once() -> None:
    design = ShapeDesign(repetitions=5, practice_trials=2)
    assert [len(shown.trials("pilot")) for shown in (design, design.pilot())] == [62, 14]


@settings(max_examples=25, deadline=None)
@given(
    run=st.integers(1, 3),
    apart=st.integers(0, 2),
    repetitions=st.integers(1, 6),
    participant=st.integers(1, 400),
    blocked=st.sampled_from([(), ("shape",)]),
)
def test_constraints_hold_over_the_whole_list(run, apart, repetitions, participant, blocked) -> None:
    apart = min(apart, 1) if blocked else apart  # at the ends of blocks of three sizes two are not always possible
    limits = {"size": run} if blocked else {"shape": run}
    far = {"size": apart} if blocked else {"shape": apart}
    design = ShapeDesign(repetitions=repetitions, runs=limits, distances=far, blocked=blocked)
    trials = design.trials(f"{participant:02}")
    assert trials == design.trials(str(participant))
    assert {*Counter(one.condition for one in trials).values()} == {repetitions}
    (name,) = limits
    levels = [getattr(one, name) for one in trials]
    assert all(len({*levels[at : at + run + 1]}) > 1 for at in range(len(levels) - run))
    assert all(level not in levels[at + 1 : at + 1 + apart] for at, level in enumerate(levels))
    if blocked:
        assert len([None for one, other in pairwise(trials) if one.shape != other.shape]) == 3


def test_blocks_and_conditions_follow_the_squares_over_participants() -> None:
    orders = [
        [*dict.fromkeys(one.shape for one in ShapeDesign(blocked=("shape",)).trials(str(n)))] for n in range(1, 5)
    ]
    assert Counter(pair for order in orders for pair in pairwise(order)) == {
        (one, other): 1 for one in "abcd" for other in "abcd" if one != other
    }
    nested = ShapeDesign(blocked=("size", "shape"))
    assert len({tuple(one.condition for one in nested.trials(str(n))) for n in range(1, 25)}) == 24
    square = ShapeDesign(condition_order="latin-square", repetitions=12)
    trials = square.trials("05")
    assert {*Counter((at % 12, one.condition) for at, one in enumerate(trials)).values()} == {1}


@pytest.mark.parametrize(
    ("procedure", "share"),
    [
        (Staircase(1.0, 0.01, 10.0), 0.7071),
        (Staircase(1.0, 0.01, 10.0, down=3), 0.7937),
        (weighted_staircase(0.75, 1.0, 0.01, 10.0, steps=(0.1, 0.05)), 0.75),
    ],
)
def test_a_staircase_converges_where_it_should(procedure: Staircase, share: float) -> None:
    random, rights = np.random.default_rng(1), []
    for _ in range(20):
        answers: list[tuple[float, bool]] = []
        for _ in range(200):
            level = procedure.level(answers)
            answers.append((level, bool(random.random() < 0.5 + 0.5 * (1 - np.exp(-((level / 0.3) ** 2))))))
        rights += [right for _, right in answers[50:]]
    assert np.mean(rights) == pytest.approx(share, abs=0.02)  # the share itself: no level is compared with a formula


def test_a_staircase_is_walked_as_by_hand() -> None:
    # Two right: down; one wrong: up. Steps of 4 until the first reversal, then 2, then 1.
    walk = "RR RR W W RR RR W RW RR"
    answers = [(0.0, answer == "R") for answer in walk.replace(" ", "")]
    given = {"start": 20.0, "least": 0.5, "most": 30.0, "steps": (4.0, 2.0, 1.0), "ratios": False}
    plain = Staircase(**given)
    levels = [plain.level(answers[:number]) for number in range(len(answers) + 1)]
    assert levels == [20, 20, 16, 16, 12, 14, 16, 16, 15, 15, 14, 15, 15, 16, 16, 15]
    assert reversals(plain, answers) == [12, 16, 14, 16]
    assert (plain.threshold(answers), plain.threshold(answers, last=2)) == (14.5, 15)
    assert math.isnan(plain.threshold(answers[:5]))
    twice = Staircase(**given, up=2)
    assert twice.level([(0.0, False), (0.0, True), (0.0, False)]) == 20
    assert twice.level([(0.0, False), (0.0, False)]) == 24
    for right, end in ((True, 0.5), (False, 30.0)):
        assert plain.level([(0.0, right)] * 100) == end
    ratios = Staircase(100.0, 1.0, 1000.0, steps=(1.0, 0.5), down=1)
    turned = [(0.0, True), (0.0, False), (0.0, True)]  # 100, 10, 10 sqrt(10), 10
    assert reversals(ratios, turned) == pytest.approx([10, 10**1.5])
    assert ratios.threshold(turned) == pytest.approx(10**1.25)


def test_constant_stimuli_show_each_level_equally_often() -> None:
    chosen = ConstantStimuli((0.1, 0.2, 0.4), (7, "01"))
    levels = [chosen.level([(0.1, True)] * number) for number in range(30)]
    assert Counter(levels) == {0.1: 10, 0.2: 10, 0.4: 10}
    assert len({tuple(levels[at : at + 3]) for at in range(0, 30, 3)}) > 1


@dataclass(frozen=True, slots=True, kw_only=True)
class BlurTrial(Trial):
    staircase: Literal["down", "weighted", "quest", "constant"]
    level: float | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class BlurAnswer(Response):
    level: float = dataclasses.field(metadata={"about": "Blur added.", "units": "arcmin", "least": 0})
    correct: bool


class BlurDesign(Counterbalanced):
    task: str = "interleaved"
    repetitions: int = 40

    def trials(self, participant, session=None):
        kinds = ("down", "weighted", "quest", "constant")
        return self.ordered(participant, session, [BlurTrial(staircase=kind) for kind in kinds])


LEVELS = tuple(0.05 * 2 ** (n / 4) for n in range(25))
PROCEDURES = {
    "down": Staircase(1.0, 0.05, 3.2),
    "weighted": weighted_staircase(0.75, 1.0, 0.05, 3.2, steps=(0.2, 0.1, 0.05)),
    "quest": Quest(LEVELS),
    "constant": ConstantStimuli(LEVELS[8::4]),
}


@register
class Interleaved(Task):
    """Four interleaved procedures on one threshold."""

    name = "interleaved"
    title = "Interleaved procedures"
    design, trial, answer = BlurDesign, BlurTrial, BlurAnswer

    def adapted(self, design, trial, recorded):
        answers = answers_of(recorded, staircase=trial.staircase)
        return dataclasses.replace(trial, level=PROCEDURES[trial.staircase].level(answers))

    def simulated(self, design, trial, observer, chance):
        right = bool(chance.random() < 0.5 + 0.49 * (1 - np.exp(-((trial.level / 0.4) ** 3))))
        return BlurAnswer(onset=0.0, response_time=0.5, level=trial.level, correct=right)


def test_a_field_that_no_trial_has_is_refused_by_name() -> None:
    trials = [{"phase": "main", "catch": False, "level": 0.5, "correct": True}]
    for named, field in (({"level": "blur"}, "blur"), ({"right": "hit"}, "hit"), ({"stair": "down"}, "stair")):
        with pytest.raises(InputError, match=f"no field '{field}'"):
            answers_of(trials, **named)


def test_interleaved_procedures_are_recorded_checked_and_find_the_threshold(tmp_path: Path) -> None:
    simulate(BlurDesign(), tmp_path / "data", observers=3, seed=3)
    assert validate(tmp_path / "data").problems == ()
    table = read_dataset(tmp_path / "data").tables["interleaved"]
    assert [*table].count("level") == 1
    for kind in ("down", "weighted", "quest"):
        late = table[(table["staircase"] == kind) & (table["trial"] > 80)]["level"]
        assert np.exp(np.log(late).mean()) == pytest.approx(0.4, rel=0.25)
    counts = table[table["staircase"] == "constant"]["level"].value_counts()
    assert counts.max() - counts.min() <= 4


def test_practice_shows_every_condition_once_before_any_again() -> None:
    for participant in ("01", "02", "k7"):
        trials = ShapeDesign(practice_trials=24).trials(participant)[:24]
        assert {*Counter(one.condition for one in trials[:12]).values()} == {1}
        assert {*Counter(one.condition for one in trials).values()} == {2}


@pytest.mark.parametrize("blocked", [("shape",), ("size",), ("size", "shape")])
def test_every_row_of_conditions_meets_every_order_of_blocks(blocked) -> None:
    design = ShapeDesign(blocked=blocked, condition_order="latin-square")
    rest = 12 // {1: 4 if blocked == ("shape",) else 3, 2: 12}[len(blocked)]
    orders = Counter()
    blocks, rows = {("shape",): (4, 6), ("size",): (6, 4), ("size", "shape"): (24, 2)}[blocked]
    for number in range(blocks * rows):
        trials = design.trials(str(number + 1))
        placed = tuple(dict.fromkeys(tuple(getattr(one, name) for name in blocked) for one in trials))
        orders[placed, tuple(one.condition for one in trials[:rest])] += 1
    assert {*orders.values()} == ({1} if rest > 1 else {2})
