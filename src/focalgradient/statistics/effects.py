"""Selection of the analysis by response scale."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import replace
from functools import partial
from typing import Any

import pandas as pd

from focalgradient.analyses import Analysis, Choices, Slopes, analysis_named
from focalgradient.progress import Progress
from focalgradient.statistics.comparisons import ComparisonResult, compare_pictures
from focalgradient.statistics.criteria import BOUND, OF_RATINGS, Rules
from focalgradient.statistics.exclusions import quality
from focalgradient.statistics.factors import factor_questions
from focalgradient.statistics.ordinal import ordinal_rating
from focalgradient.statistics.questions import Analysis as Questions
from focalgradient.statistics.rating_questions import rating_questions
from focalgradient.statistics.ratings import DepthRatingResult, depth_rating
from focalgradient.statistics.slope_questions import confidence_questions, slope_questions
from focalgradient.statistics.step_questions import step_questions
from focalgradient.statistics.wording import many
from focalgradient.user_tables.tidy import in_order, main_trials

__all__ = ["BOUND", "analyse", "has_confidence", "questions_of"]


def analyse(
    table: pd.DataFrame,
    analysis: Analysis | str,
    *,
    bound: float = BOUND,
    progress: Progress | None = None,
) -> DepthRatingResult | ComparisonResult:
    """Analyse answers by the analysis of their response scale.

    Parameters
    ----------
    table
        As for `focalgradient.user_tables.tidy.rating_table`.
    analysis
        Analysis, or its name: "ratio", "ordinal", "bipolar" or "choice".
    bound
        Equivalence bound, for ratios: see `depth_rating`.
    progress
        See `depth_rating`.

    Raises
    ------
    InputError
        As for `depth_rating` and `compare_pictures`.
    """
    statistic = analysis_named(analysis)
    if isinstance(statistic, Slopes | Choices):
        return compare_pictures(table, statistic)
    return depth_rating(table, equivalence_bound=bound, scale=statistic, progress=progress)


REFERENCES = {
    "standard": "the standard, a pinhole picture of another scene,",
    "same-scene": "the pinhole picture of the same scene",
}
"""Description of the reference picture, by the design setting `reference`."""


def questions_of(
    analysis: Analysis | str,
    fixations: Collection[str],
    scenes: int,
    design: Mapping[str, Any],
    bound: float = BOUND,
    rules: Rules | None = None,
) -> Questions:
    """Return the questions of an analysis (or its name) about a design or table, with its exclusion rules.

    Parameters
    ----------
    analysis, bound
        As in `analyse`.
    fixations
        Objects in focus.
    scenes
        Number of scenes.
    design
        Settings of the design; empty for the user's own table.
    rules
        Exclusion rules; None: the defaults.

    Examples
    --------
    >>> questions_of("ordinal", {"farthest", "nearest"}, 1, {"steps": 5}).outcome[-28:]
    'the nearest object in focus.'
    """
    statistic, fixations = analysis_named(analysis), in_order(fixations)
    steps = many(int(design["steps"]), "step") if "steps" in design else "steps"
    if isinstance(statistic, Slopes | Choices):
        reference = REFERENCES[str(design.get("reference", "standard"))]
        asked = slope_questions(fixations, statistic, scenes, reference, steps)
    elif statistic.ratios:
        asked = rating_questions(fixations, bound, scenes)
    else:
        asked = step_questions(fixations, scenes, steps)
        asked = replace(asked, prepare=lambda table: ordinal_rating(main_trials(table, statistic), []).outcomes)
    also = [confidence_questions()] if design.get("confidence") else []
    if factors := design.get("factors"):
        also.append(factor_questions(factors, ratios=statistic.ratios))
    return replace(
        asked,
        exclusions=partial(quality, rules=rules, scale=statistic),
        kind="ratings",
        rules=(*OF_RATINGS, "bound") if statistic.ratios else OF_RATINGS,
        choices=("exclusions", *statistic.choices),
        also=[*asked.also, *also],
    )


def has_confidence(table: pd.DataFrame) -> bool:
    """Return whether confidence was answered in a trial."""
    return "confidence" in table and bool(table["confidence"].notna().any())
