"""Reports on the rotating Necker cube by focal gradient: `python analysis/necker.py [DATASET]`."""

from __future__ import annotations

import math
import sys
from pathlib import Path
from typing import Any

from fig3 import main
from report import Progress, Shown

from focalgradient import InputError
from focalgradient.plotting.subjects import necker_figure
from focalgradient.report import analyse_necker
from focalgradient.statistics import DurationFit, Effect, NeckerResult, NotComputed

__all__ = ["make", "shown"]


def shown(dataset: Path) -> Shown:
    """Make the Necker figure from a data set.

    Raises
    ------
    InputError
        If it contains no reports on the cube, cannot be read, or the exclusion rules leave nobody.
    """
    part = analyse_necker(dataset)
    result = part.result
    if part.data is not None and part.data.problems:
        raise InputError(part.data.problems[0])  # unlike a report, a figure cannot state exclusions
    if isinstance(result, NotComputed):
        raise InputError(f"{dataset}: {result.reason}")
    who = "simulated observers" if part.simulated else "subjects"
    summary: dict[str, Any] = {
        "simulated": part.simulated,
        "subjects_before_and_after_exclusions": [part.quality.subjects_before, part.quality.subjects_after],
        "trials_analysed": result.trials,
    }
    for effect in result.effects:
        name = f"{effect.gradient}_{effect.strength:g}mm"
        odds = effect.odds_of_time
        if isinstance(odds, Effect):
            ends = [math.exp(end) for end in (odds.estimate, odds.low, odds.high)]
            summary[f"odds_ratio_of_nonrigid_time_and_its_interval_{name}"] = ends
            summary[f"p_{name}"] = odds.p
    summary["nonrigid_share_without_a_gradient_percent"] = _nonrigid(result, "none")
    summary["nonrigid_share_at_its_largest_percent"] = _nonrigid(result, "nonrigid")
    return Shown(
        title="The Necker cube by focal gradient",
        caption=(
            f"Reports of {len(result.participants)} {who} on a turning wireframe cube whose lines are all sharp (0), "
            "or blurred in agreement with the depth of one of its two readings. Left: nonrigid share of the time "
            "with one of the readings; every subject thin, bold the mean with its 95 % interval (t on log odds). "
            "Middle: mean shares of all the time. Right: how long a reading lasts, as median and middle half of the "
            "better of a gamma and a log-normal distribution; what the end of a trial cut off counts as a lower limit.",
            "Two readings that alternate are reported about equally often whatever their strength: the time that "
            "they last is informative.",
        ),
        figure=necker_figure(result, simulated=part.simulated),
        summary=summary,
        plotted=_plotted(result),
    )


def _plotted(result: NeckerResult) -> dict[str, Any]:
    """Return the numbers behind the figure."""
    fits = [each.lognormal if each.better == "lognormal" else each.gamma for each in result.dominance]
    return {
        "share_of_time": [
            {
                "gradient": share.gradient,
                "strength_mm": share.strength,
                "percept": share.percept,
                "estimate": share.time.estimate,
                "low": share.time.low,
                "high": share.time.high,
            }
            for share in result.shares
        ],
        "nonrigid_share_of_subjects": [
            {
                "subject": each.participant_id,
                "gradient": each.gradient,
                "strength_mm": each.strength,
                "nonrigid": each.nonrigid,
            }
            for each in result.subject_shares
        ],
        "durations": [
            {
                "gradient": each.gradient,
                "strength_mm": each.strength,
                "percept": each.percept,
                "family": fit.family,
                "shape": fit.shape,
                "scale_s": fit.scale,
            }
            for each, fit in zip(result.dominance, fits, strict=True)
            if isinstance(fit, DurationFit)
        ],
    }


def _nonrigid(result: NeckerResult, gradient: str) -> float | None:
    """Return the nonrigid proportion of the reported time, in percent: mean over subjects, strongest gradient."""
    own = [each for each in result.subject_shares if each.gradient == gradient and each.nonrigid is not None]
    strongest = max((each.strength for each in own), default=0.0)
    shares = [each.nonrigid for each in own if each.strength == strongest and each.nonrigid is not None]
    return 100 * sum(shares) / len(shares) if shares else None


def make(dataset: Path, *, full: bool = False, progress: Progress | None = None) -> Shown:
    """Make the figure within the run of all figures, which supplies the data set; `full` has no effect."""
    return shown(dataset)


if __name__ == "__main__":
    sys.exit(main("necker", shown))
