"""Selection of the analysis by response scale, and extraction of its main effects."""

from __future__ import annotations

import pandas as pd

from focalgradient.progress import Progress
from focalgradient.scales.analyses import Analysis, Choices, Slopes, analysis_named
from focalgradient.statistics.comparisons import ComparisonResult, compare_pictures
from focalgradient.statistics.ratings import DepthRatingResult, depth_rating
from focalgradient.statistics.records import Effect, NotComputed

__all__ = ["analyse", "effects"]

BOUND = 1.2
"""Default equivalence bound (ratio), as `focalgradient.report.BOUND`."""

Found = tuple[Effect | NotComputed, ...]


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
        As for `focalgradient.statistics.tables.rating_table`.
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


def effects(result: DepthRatingResult | ComparisonResult) -> tuple[Found, Found]:
    """Return the effects of aperture at each fixation (positive: more depth with blur), and their differences."""
    first, *pair = dict.fromkeys(answer.name for answer in result.answers.headlines)
    differences = (test for name in pair for test in result.answers.to(name).values())
    return tuple(result.answers.to(first).values()), tuple(differences)
