"""Questions about depth ratings as ratios: depth effects, differences, single apertures, slopes and equivalence."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from itertools import combinations

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from focalgradient.statistics.bootstrap import BootstrapT, bootstrap_t
from focalgradient.statistics.cells import Cells, cells, paired_differences, slope_weights
from focalgradient.statistics.crossed import crossed_effect, over_subjects, own_means
from focalgradient.statistics.hypotheses import Equivalence, equivalence
from focalgradient.statistics.questions import HERE, SECONDARY, Analysis, Question, Test, less, tested
from focalgradient.statistics.records import Effect, NotComputed
from focalgradient.statistics.tables import fixations_of

__all__ = [
    "BOOTSTRAP",
    "DIFFERENCE",
    "EFFECT",
    "EQUIVALENT",
    "PINHOLE",
    "SLOPE",
    "LogRatios",
    "no_ratio",
    "rating_questions",
]

FloatArray = NDArray[np.float64]

EFFECT, DIFFERENCE, PINHOLE = "depth effect", "difference of the depth effects", "ratio to the pinhole"
SLOPE, EQUIVALENT, BOOTSTRAP = "slope on aperture", "equivalence to zero", "depth effect, bootstrap-t"
"""Names of the questions about ratios."""


@dataclass(frozen=True, slots=True, eq=False)
class LogRatios:
    """Log ratings of each fixation in cells, and the depth effects over them.

    Parameters
    ----------
    cells
        Cells of each fixation.
    apertures
        Names of the apertures, by their diameters in mm.
    effects
        Depth effects that are already computed, by fixation.
    """

    cells: Mapping[str, Cells]
    apertures: Mapping[float, str]
    effects: dict[str, Effect | NotComputed] = field(default_factory=dict)

    @classmethod
    def of(cls, table: pd.DataFrame) -> LogRatios:
        """Average a table of trials whose column `answer` is the log rating."""
        names = table.drop_duplicates("aperture_mm")
        return cls(
            {name: cells(table[table["fixation"] == name]) for name in fixations_of(table)},
            dict(zip(names["aperture_mm"].astype(float), names["aperture"].astype(str), strict=True)),
        )

    def level(self, fixation: str, mm: float) -> str:
        """Name a fixation with an aperture."""
        name = self.apertures[mm]
        unique = list(self.apertures.values()).count(name) == 1
        return f"{fixation}, {name}" if unique else f"{fixation}, {name} ({mm:g} mm)"

    def rises(self, fixation: str, aperture: int = -1) -> FloatArray | NotComputed:
        """Return log ratios of an aperture to the pinhole (subjects x scenes)."""
        missing = no_ratio(self.cells[fixation], fixation)
        return missing if missing.reason else self.cells[fixation].against_smallest(aperture)

    def effect(self, fixation: str) -> Effect | NotComputed:
        """Return the depth effect over subjects and scenes."""
        if fixation not in self.effects:
            self.effects[fixation] = tested(self.rises(fixation), crossed_effect)
        return self.effects[fixation]

    def difference(self, one: str, other: str) -> FloatArray | NotComputed:
        """Return differences of two depth effects within subject and scene; of the means if no scene has both."""
        first, second = self.rises(one), self.rises(other)
        if isinstance(first, NotComputed):
            return first
        if isinstance(second, NotComputed):
            return second
        return paired_differences(self.cells[one], first, self.cells[other], second)


def rating_questions(fixations: Sequence[str], bound: float) -> Analysis:
    """Return the questions about ratings on a ratio scale, asked of `LogRatios`.

    Parameters
    ----------
    fixations
        Objects in focus; the depth effect with the first is the primary outcome.
    bound
        Equivalence bound, a ratio.

    Examples
    --------
    >>> [question.name for question in rating_questions(["nearest"], 1.2).questions if question.role == "secondary"]
    ['ratio to the pinhole', 'slope on aperture', 'equivalence to zero']
    """
    pairs = list(combinations(fixations, 2))

    def against(data: LogRatios, test: Test) -> dict[str, Effect | NotComputed]:
        found: dict[str, Effect | NotComputed] = {}
        for fixation in fixations:
            amounts = data.cells[fixation].amounts
            for number in range(1, len(amounts) - 1):
                if not isinstance(rises := data.rises(fixation, number), NotComputed):
                    found[data.level(fixation, float(amounts[number]))] = test(rises)
        return found

    def differences(data: LogRatios, test: Test) -> dict[str, Effect | NotComputed]:
        return {less(*pair): tested(data.difference(*pair), test) for pair in pairs}

    def slope(data: LogRatios, fixation: str) -> Effect | NotComputed:
        own = data.cells[fixation]
        weights = slope_weights(own.amounts)
        return weights if isinstance(weights, NotComputed) else crossed_effect(own.contrast(weights))

    def equal(effect: Effect | NotComputed) -> Equivalence | NotComputed:
        return equivalence(effect, math.log(bound)) if isinstance(effect, Effect) else effect

    def resampled(data: LogRatios) -> BootstrapT | NotComputed:
        rises = data.rises(fixations[0])
        fixed = tested(rises, over_subjects)
        if isinstance(fixed, NotComputed) or isinstance(rises, NotComputed):
            return fixed  # type: ignore[return-value]
        return bootstrap_t(own_means(rises))

    log, apart = "log ratio", "differences" if len(pairs) > 1 else ""
    what = "depth effect at the largest aperture (ratio to the pinhole), {level} in focus"
    here = [
        Question(
            EFFECT + HERE,
            lambda data: {name: tested(data.rises(name), over_subjects) for name in fixations},
            "check",
            log,
            ratio=True,
        ),
        Question(PINHOLE + HERE, lambda data: against(data, over_subjects), "check", log, ratio=True),
    ]
    compared = [
        Question(
            DIFFERENCE,
            lambda data: differences(data, crossed_effect),
            "secondary",
            log,
            apart,
            "ratio of the depth effects, {pair}",
            True,
        ),
        Question(DIFFERENCE + HERE, lambda data: differences(data, over_subjects), "check", log, ratio=True),
    ]
    return Analysis(
        [
            Question(
                EFFECT,
                lambda data: {name: data.effect(name) for name in fixations},
                "primary",
                log,
                SECONDARY,
                what,
                True,
            ),
            *(compared if pairs else []),
            Question(PINHOLE, lambda data: against(data, crossed_effect), "secondary", log, SECONDARY, ratio=True),
            Question(
                SLOPE,
                lambda data: {name: slope(data, name) for name in fixations},
                "secondary",
                f"{log} per mm",
                SECONDARY,
            ),
            Question(
                EQUIVALENT,
                lambda data: {name: equal(data.effect(name)) for name in fixations},
                "secondary",
                log,
                ratio=True,
            ),
            *here,
            Question(BOOTSTRAP, lambda data: {fixations[0]: resampled(data)}, "check", log, ratio=True),
        ]
    )


def no_ratio(own: Cells, fixation: str) -> NotComputed:
    """Return the reason why there is no ratio to the pinhole; an empty reason if there is one."""
    if own.amounts[0] != 0:
        return NotComputed(f"The {fixation} object is fixated in no pinhole trial: there is no ratio to the pinhole.")
    return NotComputed("The pinhole is the only aperture." if len(own.amounts) < 2 else "")
