"""Adaptive procedures that choose the level of the next trial: staircases, QUEST+, constant stimuli.

Each is a function of the answers so far, so that an interrupted session continues unchanged. To interleave several
procedures, give each the answers to its own trials (`answers_of`).
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from statistics import fmean
from typing import Any

from focalgradient.design.draws import Draws
from focalgradient.design.procedure import Procedure
from focalgradient.errors import InputError

__all__ = ["Answers", "ConstantStimuli", "Quest", "Staircase", "answers_of", "reversals", "weighted_staircase"]

Answers = Sequence[tuple[float, bool]]
"""Level of each trial so far, and whether its answer was correct."""


def answers_of(
    recorded: Sequence[Mapping[str, Any]], *, level: str = "level", right: str = "correct", **condition: Any
) -> list[tuple[float, bool]]:
    """Return the answers used by a procedure: those of main trials (without catch trials) in one condition.

    Parameters
    ----------
    recorded
        Trials with their answers, as in `Sitting.recorded`.
    level, right
        Names of the fields for the level and for the correctness of the answer.
    condition
        Values that other fields must have, such as ``staircase="near"`` for interleaved staircases.

    Raises
    ------
    InputError
        If trials and answers have no field `level`, `right` or one of `condition`.

    Examples
    --------
    >>> shown = {"phase": "main", "catch": False, "level": 0.5, "correct": True}
    >>> answers_of([shown | {"side": "left"}, shown | {"side": "right"}], side="left")
    [(0.5, True)]
    """
    trials = [trial for trial in recorded if trial["phase"] == "main" and not trial["catch"]]
    given = [f'{parameter}="NAME"' for parameter in ("level", "right")] + ["NAME=VALUE"] * len(condition)
    for name, call in zip([level, right, *condition], given, strict=True):
        if any(name not in trial for trial in trials):
            raise InputError(
                f"answers_of finds no field {name!r} in trial and answer: give the field's name, "
                f"answers_of(recorded, {call})."
            )
    return [
        (float(trial[level]), bool(trial[right]))
        for trial in trials
        if all(trial[name] == wanted for name, wanted in condition.items())
    ]


@dataclass(frozen=True, slots=True)
class Staircase:
    """Staircase that steps down after `down` consecutive correct answers, and up after `up` wrong ones.

    It converges to 70.7 % correct with ``down=2``, and to 79.4 % with 3 (Levitt 1971, J. Acoust. Soc. Am. 49:467).

    Parameters
    ----------
    start, least, most
        First level, and range of the levels; above 0 if `ratios`.
    steps
        Sizes of steps down, the next one after each reversal: in log10 units if `ratios`, otherwise in units of the
        level.
    down, up
        Numbers of consecutive correct and wrong answers that trigger a step.
    up_ratio
        Size of a step up relative to a step down.
    ratios
        Whether steps are ratios of levels.

    Raises
    ------
    InputError
        If the range is empty, the start is outside it, or a step or number is not positive.

    Examples
    --------
    >>> stairs = Staircase(1.0, 0.01, 10.0, steps=(0.3, 0.1))
    >>> stairs.level([]), round(stairs.level([(1.0, True), (1.0, True)]), 3)
    (1.0, 0.501)
    """

    start: float
    least: float
    most: float
    steps: tuple[float, ...] = (0.3, 0.15, 0.075)
    down: int = 2
    up: int = 1
    up_ratio: float = 1.0
    ratios: bool = True

    def __post_init__(self) -> None:
        if not (self.least <= self.start <= self.most and (self.least > 0 or not self.ratios)):
            raise InputError(
                f"start is {self.start:g}, but must be from {self.least:g} (least) to {self.most:g} (most)"
                f"{', all above 0' if self.ratios else ''}."
            )
        if not self.steps or min(*self.steps, self.up_ratio) <= 0 or min(self.down, self.up) < 1:
            raise InputError("steps, up_ratio, down and up must be positive: give one step or more.")

    def level(self, answers: Answers) -> float:
        """Return the level of the next trial."""
        return self._walk(answers)[0]

    def threshold(self, answers: Answers, last: int = 6) -> float:
        """Return the mean level of the last reversals (geometric if steps are ratios); NaN with fewer than two."""
        turned = self._walk(answers)[1][-last:]
        if len(turned) < 2:
            return math.nan
        return 10 ** fmean(map(math.log10, turned)) if self.ratios else fmean(turned)

    def _walk(self, answers: Answers) -> tuple[float, list[float]]:
        level, right, wrong, way, turned = self.start, 0, 0, 0, list[float]()
        for _, correct in answers:
            right, wrong = (right + 1, 0) if correct else (0, wrong + 1)
            to = -1 if right == self.down else 1 if wrong == self.up else 0
            if not to:
                continue
            if way and to != way:
                turned.append(level)
            right, wrong, way = 0, 0, to
            step = self.steps[min(len(turned), len(self.steps) - 1)] * (1.0 if to < 0 else self.up_ratio)
            moved = level * 10 ** (to * step) if self.ratios else level + to * step
            level = min(max(moved, self.least), self.most)
        return level, turned


def reversals(staircase: Staircase, answers: Answers) -> list[float]:
    """Return the levels at which a staircase reversed.

    >>> turned = reversals(Staircase(1.0, 0.01, 10.0, down=1), [(1.0, True), (0.5, False), (0.7, True)])
    >>> [round(level, 3) for level in turned]
    [0.501, 0.708]
    """
    return staircase._walk(answers)[1]


def weighted_staircase(share: float, start: float, least: float, most: float, **others: Any) -> Staircase:
    """Return a weighted up-down staircase: a step after every answer (Kaernbach 1991, Percept. Psychophys. 49:227).

    It converges to the proportion correct `share`: steps up are share / (1 - share) times steps down.

    >>> weighted_staircase(0.75, 1.0, 0.01, 10.0).up_ratio
    3.0
    """
    if not 0 < share < 1:
        raise InputError(f"share is {share:g}, but must lie between 0 and 1.")
    return Staircase(start, least, most, down=1, up=1, up_ratio=share / (1 - share), **others)


@dataclass(frozen=True, slots=True)
class ConstantStimuli:
    """Method of constant stimuli: every level equally often, in a new random order in each round.

    Parameters
    ----------
    levels
        Levels.
    draws
        Names of the random stream, such as seed and participant.

    Examples
    --------
    >>> chosen = ConstantStimuli((0.1, 0.2, 0.4), (1987, "01"))
    >>> sorted(chosen.level([(0.0, True)] * number) for number in range(3))
    [0.1, 0.2, 0.4]
    """

    levels: tuple[float, ...]
    draws: tuple[Any, ...] = ()

    def level(self, answers: Answers) -> float:
        """Return the level of the next trial."""
        number, place = divmod(len(answers), len(self.levels))
        return Draws("constant stimuli", *self.draws, number).shuffled(self.levels)[place]


@dataclass(frozen=True, slots=True)
class Quest:
    """QUEST+ procedure over given levels, for two-interval tasks (library questplus; extra ``thresholds``).

    Parameters
    ----------
    levels
        Levels, positive and increasing.

    Raises
    ------
    InputError
        If questplus is not installed.
    """

    levels: tuple[float, ...]

    def level(self, answers: Answers) -> float:
        """Return the level of the next trial; `answers` are all those so far."""
        key = (self.levels, tuple(answers))
        if key not in _CHOSEN:
            before = _CHOSEN.pop((self.levels, key[1][:-1]), None)
            procedure = Procedure(self) if before is None else before[1]
            while len(_CHOSEN) >= MOST_CHOSEN:
                _CHOSEN.pop(next(iter(_CHOSEN)))
            procedure.learn(answers)
            _CHOSEN[key] = procedure.level(), procedure
        return _CHOSEN[key][0]


MOST_CHOSEN = 200
"""Maximum number of procedures that are kept: more than the participants that one server has at once."""

_CHOSEN: dict[tuple[tuple[float, ...], tuple[tuple[float, bool], ...]], tuple[float, Procedure]] = {}
"""Levels chosen by QUEST+, by levels and answers, with the procedures, which each learn one more answer."""
