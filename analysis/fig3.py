"""Fig. 3: increase in perceived depth with blur, from a data set: `python analysis/fig3.py [DATASET]`.

The data set may contain people or simulated observers, which the figure states.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

from report import Progress, Shown, images, numbers_json
from simulated import take_part

from focalgradient import InputError
from focalgradient.plotting.subjects import depth_rating_figure
from focalgradient.report import BOUND, analyse_ratings
from focalgradient.statistics import DepthRatingResult, Effect, Equivalence, Interval, NotComputed
from focalgradient.statistics.wording import interval, probability

__all__ = ["ASSUMED", "PUBLISHED", "main", "make", "shown"]

ASSUMED = (
    "Of simulated observers: no finding about people. They interpret blur by a prior (blurred is farther), which the "
    "layout does not reverse, and discount blur that contradicts the layout. The layout itself is the scene’s true one."
)
"""Assumptions on which Fig. 3 of the simulated observers depends: see `observers_sensitivity`."""

PUBLISHED = "The paper reports a strong increase with the nearest object in focus and none with the farthest."


def shown(dataset: Path, *, bound: float = BOUND) -> Shown:
    """Make Fig. 3 from a data set.

    Raises
    ------
    InputError
        If it contains no depth ratings, cannot be read, or the exclusion rules leave nobody.
    """
    part = analyse_ratings(dataset, bound=bound)
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
    for each in result.fixations:
        if isinstance(each.rise, Effect):
            ratio = each.rise.ratio
            summary[f"rise_with_{each.fixation}_in_focus_and_its_interval"] = [ratio.estimate, ratio.low, ratio.high]
        summary[f"p_of_the_rise_with_{each.fixation}_in_focus"] = _decisive(each.rise)
        if isinstance(each.equivalence, Equivalence):
            summary[f"equivalent_to_none_with_{each.fixation}_in_focus"] = each.equivalence.equivalent
    summary["p_of_the_difference_of_rises"] = _decisive(result.interaction)
    plotted: dict[str, Any] = {}
    for each in result.fixations:
        means = [mean for mean in result.means if mean.fixation == each.fixation and isinstance(mean.ratio, Interval)]
        ratios = [mean.ratio for mean in means if isinstance(mean.ratio, Interval)]
        plotted[each.fixation] = {
            "aperture": [mean.aperture for mean in means],
            "aperture_mm": [mean.aperture_mm for mean in means],
            **{name: [getattr(ratio, name) for ratio in ratios] for name in ("estimate", "low", "high")},
            "subjects": {
                name: [
                    mean.ratio
                    for mean in result.subject_means
                    if (mean.participant_id, mean.fixation) == (name, each.fixation)
                ]
                for name in result.participants
            },
        }
    return Shown(
        title="Fig. 3: impression of depth by blur, near and far fixation",
        caption=(
            f"Increase in the impression of depth relative to a pinhole picture, {len(result.participants)} {who}, "
            "for growing apertures: with the nearest object in focus, so that farther ones are blurred, and with the "
            "farthest in focus, so that nearer ones are. Every subject thin; bold the geometric mean over subjects "
            f"with its 95 % interval by t on the logarithm, {_generality(result)}.",
            "The depth effect, from the pinhole to the largest aperture, was tested likewise, its equivalence to zero "
            f"by two one-sided tests against a factor of {bound:g}. {_measured(result)} {PUBLISHED}",
            *((ASSUMED,) if part.simulated else ()),
        ),
        figure=depth_rating_figure(result, simulated=part.simulated),
        summary=summary,
        plotted=plotted,
    )


def _decisive(test: Effect | NotComputed) -> float | None:
    """Return the p that decides: after Holm's correction, unless the test is the primary one."""
    return test.corrected_p if isinstance(test, Effect) else None


def _measured(result: DepthRatingResult) -> str:
    """Describe the depth effect of each fixation by its ratio, interval, test and equivalence."""
    sentences = []
    for fixation in result.fixations:
        test, equivalence = fixation.rise, fixation.equivalence
        if isinstance(test, NotComputed):
            sentences.append(f"With the {fixation.fixation} object in focus it was not tested: {test.reason}")
            continue
        ratio, p = test.ratio, probability(test.corrected_p)
        change = "was not shown to change" if not test.significant else "rose" if ratio.estimate > 1 else "fell"
        equivalent = isinstance(equivalence, Equivalence) and equivalence.equivalent
        sentences.append(
            f"With the {fixation.fixation} object in focus the impression of depth {change}: ratio "
            f"{ratio.estimate:.2f}, 95 % CI {interval(ratio.low, ratio.high, 2)}, p {p if '<' in p else f'= {p}'}"
            + (", equivalent to zero within that factor." if equivalent else ".")
        )
    return " ".join(sentences)


def _generality(result: DepthRatingResult) -> str:
    """Describe the population to which the intervals generalise."""
    methods = {each.rise.method for each in result.fixations if isinstance(each.rise, Effect)}
    scenes = f"{len(result.scenes)} scene{'' if len(result.scenes) == 1 else 's'}"
    if any("Satterthwaite" in method for method in methods):
        return f"over subjects and the {scenes}"
    return f"over subjects, for the {scenes} shown"


def make(dataset: Path, *, full: bool = False, progress: Progress | None = None) -> Shown:
    """Make the figure within the run of all figures, which supplies the data set; `full` has no effect."""
    return shown(dataset)


def main(name: str, shown: Callable[[Path], Shown]) -> int:
    """Make one figure from a data set named on the command line, or from simulated observers: PNG, PDF and numbers."""
    parser = argparse.ArgumentParser(description=f"Make {name} of a data set.")
    text = "folder of the data set; left out, simulated observers take part first"
    parser.add_argument("dataset", type=Path, nargs="?", help=text)
    parser.add_argument("--out", type=Path, default=Path("results"), help="folder for the figure (default: results)")
    asked = parser.parse_args()
    try:
        if asked.dataset is not None:
            figure = shown(asked.dataset)
        else:
            with tempfile.TemporaryDirectory() as folder:
                figure = shown(take_part(Path(folder, "simulated")))
    except InputError as error:
        print(f"Error: {error}", file=sys.stderr)
        return 2
    asked.out.mkdir(parents=True, exist_ok=True)
    for kind, content in images(figure).items():
        (asked.out / f"{name}.{kind}").write_bytes(content)
    (asked.out / f"{name}.json").write_text(numbers_json({name: figure}), encoding="utf-8")
    print(f"Done: open {asked.out / f'{name}.png'}")
    return 0


if __name__ == "__main__":
    sys.exit(main("fig3", shown))
