"""What a report says in sentences: findings in short, and methods as a paper needs them."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from focalgradient.report.analysed import Ratings, Reports
from focalgradient.report.tables import SPACE, interval, number, probability
from focalgradient.statistics import (
    DepthRatingResult,
    Effect,
    Equivalence,
    Interval,
    NeckerResult,
    NotComputed,
    Quality,
    Scale,
)

__all__ = ["counts", "methods_necker", "methods_ratings", "necker_findings", "rating_findings"]

OBJECT = {"nearest": "the nearest object in focus", "farthest": "the farthest object in focus"}


def counts(found: Quality) -> str:
    """How many before and after exclusions."""
    return (
        f"{_many(found.subjects_before, 'subject')} with {_many(found.trials_before, 'trial')} before exclusions; "
        f"{_many(found.subjects_after, 'subject')} with {_many(found.trials_after, 'trial')} after (catch trials not "
        "counted)."
    )


def rating_findings(result: DepthRatingResult) -> list[str]:
    """Experiment 1 in a few sentences."""
    told = []
    for each in result.fixations:
        subject = f"With {OBJECT[each.fixation]}"
        slope = each.ordinal if result.scale == "ordinal" else each.slope
        if isinstance(slope, NotComputed):
            told.append(f"{subject} there is no test of the slope: {slope.reason}")
            continue
        what = "did not change reliably" if slope.p >= 0.05 else "rose" if slope.estimate > 0 else "fell"
        sentence = f"{subject}, ratings {what} with blur ({_test(slope)}"
        if isinstance(each.rise, Interval):
            ends = interval(each.rise.low, each.rise.high)
            sentence += f"; rise at the largest aperture {number(each.rise.estimate)}, 95 % {ends}"
        sentence += ")."
        if isinstance(each.equivalence, Equivalence) and slope.p >= 0.05:
            bound = math.exp(each.equivalence.bound)
            within = "is" if each.equivalence.equivalent else "is not shown to be"
            sentence += f" The rise {within} as good as none within a factor {bound:.3g}"
            sentence += f" (two one-sided tests, p {_is(each.equivalence.p)})."
        told.append(sentence)
    if isinstance(result.interaction, Effect):
        differ = "differ" if result.interaction.p < 0.05 else "do not differ reliably"
        told.append(f"The slopes of the two fixations {differ} ({_test(result.interaction)}).")
    return told


def necker_findings(result: NeckerResult) -> list[str]:
    """Experiment 2 in a few sentences."""
    told = []
    for effect in result.effects:
        blur = f"Blur that agrees with the {effect.gradient} reading ({effect.strength:g} mm)"
        if isinstance(effect.share, NotComputed):
            told.append(f"{blur} was not tested: {effect.share.reason}")
            continue
        share = effect.share
        verb = "left" if share.p >= 0.05 else "raised" if share.estimate > 0 else "lowered"
        change = f"{number(100 * share.estimate)} points, 95 % {interval(100 * share.low, 100 * share.high)}"
        unchanged = " without reliable change" if share.p >= 0.05 else ""
        told.append(f"{blur} {verb} the nonrigid share of the time{unchanged} ({change}; {_test(share)}).")
    return told


def methods_ratings(part: Ratings, bound: float, scale: Scale) -> list[str]:
    """Methods of experiment 1, for a paper."""
    designs = [sidecar["Design"] for sidecar in part.data.sidecars.values()]
    design = designs[0]
    apertures, scenes = _listed(design.get("apertures", ())), len(design.get("scenes", ()))
    told = [
        f"{_people(part.quality, part.simulated)} judged the depth of pictures of {_many(scenes, 'scene')} at the "
        f"apertures {apertures} ({design.get('focal_length_mm', '?')} mm lens), once with the nearest and once with "
        f"the farthest object in focus and fixated, {_times(design.get('repetitions', 1))} in random order "
        f"({design.get('fixation_order', 'mixed')} fixation). Ratings were ratios to a pinhole picture that counts as "
        f"1, shown for {design.get('picture_s', '?')} s each. {_catches(design)}{_same(designs)}".strip(),
        _excluded(part.quality),
    ]
    if scale == "ratio":
        told.append(
            "Ratings were analysed on their logarithm and are given as ratios; means are geometric. For each "
            "fixation a linear mixed model with random intercepts and slopes of the subjects, correlated, and scenes "
            "as fixed effects was fitted by REML to the logarithm of the rating against the diameter of the aperture "
            "(the pinhole is 0), its slope referred to Student’s t with N − 1 degrees of freedom. The interaction of "
            "blur with fixation was tested by a paired t-test of the subjects’ own least-squares slopes. Slopes and "
            "interaction were corrected by Holm’s method as one family, the comparisons of single apertures with the "
            "pinhole (paired t-tests) as another. Absence of an increase was tested by two one-sided tests against a "
            f"factor {bound:.3g} at the largest aperture, the smallest that would matter. Order was tested by Page’s "
            "trend test, and by a t-test of the subjects’ rank correlations with the order of apertures. Intervals "
            "of ratios are BCa bootstrap intervals over subjects (9,999 resamples); those of ratings are within "
            "subjects (Cousineau, Morey). Tests are two-sided unless stated, at .05."
        )
    else:
        told.append(
            "Answers were steps of an ordinal scale. For each fixation a cumulative-link mixed model (logit) with "
            "random intercepts and slopes of the subjects, and scenes as fixed effects, was fitted by adaptive "
            "Gauss-Hermite quadrature; its slope on the diameter of the aperture was referred to Student’s t with N "
            "− 1 degrees of freedom. Order was tested by Page’s trend test."
        )
    return told


def methods_necker(part: Reports) -> list[str]:
    """Methods of experiment 2, for a paper."""
    designs = [sidecar["Design"] for sidecar in part.data.sidecars.values()]
    design = designs[0]
    strengths = _listed(f"{strength:g}" for strength in design.get("strengths_mm", ()))
    return [
        f"{_people(part.quality, part.simulated)} watched a wireframe Necker cube turn in perspective and held a key "
        "for as long as it looked rigid, another for as long as it looked nonrigid. Its lines were all sharp, or "
        f"blurred in agreement with the depth of one of the readings ({_listed(design.get('gradients', ()))}; "
        f"aperture {strengths} mm). Each condition was shown for {design.get('trial_s', '?')} s, "
        f"{_times(design.get('repetitions', 1))}, turning {_listed(design.get('directions', ()))}. "
        f"{_catches(design)}{_same(designs)}".strip(),
        _excluded(part.quality, cube=True),
        "The nonrigid share of the time with one of the two readings was taken for each subject and gradient. Each "
        "gradient was compared with none by a paired t-test and by Wilcoxon’s signed ranks, and by marginal logistic "
        "models (GEE, independence, standard errors corrected for few subjects after Mancl and DeRouen, t with N − 1 "
        "degrees of freedom) of each trial’s share of time and of single reports; Holm’s method corrects each kind "
        "over gradients. Gamma and log-normal distributions were fitted to the durations of each percept by maximum "
        "likelihood, durations cut off by the end of a trial as lower limits.",
    ]


def _people(found: Quality, simulated: bool) -> str:
    if simulated:
        return f"{_many(found.subjects_before, 'simulated observer')} (computed by a model; no people took part)"
    return _many(found.subjects_before, "subject")


def _excluded(found: Quality, *, cube: bool = False) -> str:
    rules = found.rules
    stated = []
    if rules.response_time is not None and not cube:
        shortest, longest = rules.response_time
        stated.append(f"ratings given in less than {shortest:g} s or more than {longest:g} s were left out")
    if rules.dropped_frames is not None:
        stated.append(f"trials with more than {rules.dropped_frames} dropped frames were left out")
    who = []
    if rules.catch_passed is not None:
        passed = (
            f"a truly nonrigid shape, seen so for more than {rules.catch_share:.0%} of the time with a reading"
            if cube
            else f"the standard itself, rated within a factor {rules.catch_factor:g} of 1"
        )
        who.append(f"passed less than {rules.catch_passed:.0%} of the catch trials ({passed})")
    if rules.repeat_factor is not None and not cube:
        who.append(f"spread answers to one picture by more than a factor {rules.repeat_factor:g} (geometric SD)")
    if rules.lapses is not None:
        lapse = (
            "held no key or both for"
            if cube
            else f"gave answers more than a factor {rules.lapse_factor:g} from their own median for the condition in"
        )
        who.append(f"{lapse} more than {rules.lapses:.0%} of the {'time' if cube else 'trials'}")
    if who:
        stated.append(f"subjects were left out who {', or '.join(who)}")
    trials = sum(one.trials for one in found.exclusions if not one.whole_subject)
    return (
        f"By rules that do not look at the effect, {'; '.join(stated)}. This left out "
        f"{_many(found.subjects_before - found.subjects_after, 'subject')}"
        f" and {_many(trials, 'single trial')}; the recorded data stay as they were."
    )


def _catches(design: Mapping[str, Any]) -> str:
    catches = design.get("catch_trials", 0)
    return f"{_many(catches, 'catch trial')} checked attention. " if catches else ""


def _same(designs: list[Mapping[str, Any]]) -> str:
    """A warning where sessions had different designs."""
    apart = [{key: value for key, value in design.items() if key != "seed"} for design in designs]
    return "" if all(one == apart[0] for one in apart) else "Sessions differ in their design; the first is told here. "


def _test(effect: Effect) -> str:
    holm = "" if effect.p_holm is None else f", by Holm {_is(effect.p_holm)}"
    return f"t({effect.df:g}){SPACE}={SPACE}{number(effect.statistic)}, p{SPACE}{_is(effect.p)}{holm}"


def _is(p: float) -> str:
    text = probability(p)
    return text if text.startswith("<") else f"={SPACE}{text}"


def _many(count: int, thing: str) -> str:
    return f"{count:,} {thing}{'' if count == 1 else 's'}"


def _times(count: int) -> str:
    return {1: "once", 2: "twice"}.get(count, f"{count} times")


def _listed(things: Any) -> str:
    *first, last = map(str, things) if things else ("none stated",)
    return f"{', '.join(first)} and {last}" if first else last
