"""Sentences of a report: short findings, and methods for a paper."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from focalgradient.report.analysed import Ratings, Reports
from focalgradient.report.exclusions import CUBE_CATCH, catch_answers, excluded
from focalgradient.report.plans import ENOUGH_SUBJECTS, in_focus, plan_of
from focalgradient.report.tables import SPACE, decimals, freedom, interval, many, probability
from focalgradient.scales import scale_of
from focalgradient.statistics import (
    Components,
    DepthRatingResult,
    Effect,
    Equivalence,
    FixationResult,
    Interval,
    NeckerResult,
    NotComputed,
    OrdinalResult,
    Quality,
)
from focalgradient.statistics.crossed import random_scenes
from focalgradient.statistics.tables import FIXATIONS

__all__ = [
    "analysis_necker",
    "counts",
    "methods_necker",
    "methods_ratings",
    "necker_findings",
    "p_is",
    "rating_cautions",
    "rating_checks",
    "rating_findings",
]


def counts(found: Quality) -> str:
    """Describe the sample before and after exclusions."""
    return (
        f"{many(found.subjects_before, 'subject')} with {many(found.trials_before, 'trial')} before exclusions; "
        f"{many(found.subjects_after, 'subject')} with {many(found.trials_after, 'trial')} after (catch trials not "
        "counted)."
    )


def rating_findings(result: DepthRatingResult) -> list[str]:
    """Answer the questions of experiment 1 in one sentence each: primary effect, equivalence, difference."""
    if isinstance(result.ordinal, OrdinalResult):
        return _ordinal_findings(result.ordinal)
    sentences = []
    for number, each in enumerate(result.fixations):
        subject = f"With {in_focus(each.fixation)}"
        if isinstance(each.rise, NotComputed):
            sentences.append(f"{subject}, the depth effect was not tested: {each.rise.reason}")
        elif number and isinstance(each.equivalence, Equivalence):
            sentences.append(_equivalence_sentence(subject, each.rise, each.equivalence))
        else:
            sentences.append(_rise_sentence(subject, each.rise))
    if isinstance(result.interaction, Effect):
        differ = "differed" if result.interaction.significant else "were not shown to differ"
        ratio = result.interaction.ratio
        ends = interval(ratio.low, ratio.high, 2)
        sentences.append(
            f"The two depth effects {differ} (their ratio {decimals(ratio.estimate)}, 95{SPACE}% CI {ends}; "
            f"{_test(result.interaction)}{_size(result.interaction)})."
        )
    for (one, other), (test, _) in result.differences.items():
        sentences.append(_pair(one, other, test, "depth effects"))
    if sentences and result.analysis.ratios:
        sentences[0] = f"Primary outcome. {sentences[0]}"
    return sentences


def _rise_sentence(subject: str, rise: Effect) -> str:
    """Describe a depth effect by its test."""
    ratio = rise.ratio
    return (
        f"{subject}, ratings {_direction(rise)} from the pinhole to the largest aperture (ratio "
        f"{decimals(ratio.estimate)}, 95{SPACE}% CI {interval(ratio.low, ratio.high, 2)}; {_test(rise)}{_size(rise)}; "
        f"over {_over(rise)})."
    )


def _equivalence_sentence(subject: str, rise: Effect, equal: Equivalence) -> str:
    """Describe a depth effect by the test of equivalence to zero; by its own where it is significant and not small."""
    if rise.significant and not equal.equivalent:
        return _rise_sentence(subject, rise)
    bound = f"within a factor of {decimals(math.exp(equal.bound))}"
    ends = interval(math.exp(equal.low), math.exp(equal.high), 2)
    if rise.significant:
        said = f"ratings {_direction(rise)}, by less than what would matter: the depth effect is"
    else:
        said = "the depth effect is" if equal.equivalent else "the depth effect was not shown to be"
    return (
        f"{subject}, {said} equivalent to zero {bound} (ratio {decimals(rise.ratio.estimate)}, 90{SPACE}% CI {ends}; "
        f"two one-sided tests, p{SPACE}{p_is(equal.p)})."
    )


def _direction(rise: Effect) -> str:
    return "were not shown to change" if not rise.significant else "rose" if rise.estimate > 0 else "fell"


def rating_cautions(result: DepthRatingResult) -> list[str]:
    """Return what changes the reading of the answers: a sensitivity analysis that disagrees, skewed subjects."""
    return [
        sentence
        for each in result.fixations
        for sentence in (_bootstrapped(each)[1], _assumption(each))
        if sentence and isinstance(each.rise, Effect)
    ]


def rating_checks(result: DepthRatingResult) -> list[str]:
    """Return the tests beside the answers that decide nothing: for these scenes, and the sensitivity analysis."""
    sentences = []
    for each in result.fixations:
        rise, fixed = each.rise, each.rise_these_scenes
        if isinstance(rise, Effect) and random_scenes(rise) and isinstance(fixed, Effect):
            ends = interval(fixed.ratio.low, fixed.ratio.high, 2)
            sentences.append(
                f"With {in_focus(each.fixation)}, for these {len(result.scenes)} scenes alone: 95{SPACE}% CI {ends}; "
                f"{_test(fixed)}."
            )
        if agrees := _bootstrapped(each)[0]:
            sentences.append(agrees)
    return sentences


def _bootstrapped(each: FixationResult) -> tuple[str, str]:
    """Report the sensitivity analysis of the primary effect, first if it agrees, second if it disagrees."""
    found, rise, fixed = each.bootstrap, each.rise, each.rise_these_scenes
    if isinstance(found, NotComputed) or isinstance(rise, NotComputed):
        return "", ""
    ends = interval(math.exp(found.low), math.exp(found.high), 2)
    said = f"Sensitivity: bootstrap-t over subjects, for these scenes, 95{SPACE}% CI {ends}, p{SPACE}{p_is(found.p)}"
    if found.significant == rise.significant:
        return f"{said}; it agrees.", ""
    if isinstance(fixed, Effect) and fixed.significant == found.significant:
        because = "It disagrees because, as the test for these scenes, it does not generalise to other scenes."
        return "", f"{said}. {because}"
    return (
        "",
        f"{said}. It disagrees, and the test above decides: the result depends on the assumption that subjects’ "
        "effects are normally distributed. Look at each subject’s effect (Q-Q plot), and do not rely on the result "
        "before it is repeated with more subjects.",
    )


def _assumption(each: FixationResult) -> str:
    """Return advice if the planned check finds the subjects' effects not normally distributed, else an empty text."""
    parts = each.components
    if not isinstance(parts, Components) or not parts.skewed:
        return ""
    return (
        f"Subjects’ depth effects are not normally distributed (Shapiro-Wilk W{SPACE}={SPACE}"
        f"{decimals(parts.subjects_w, 3)}, p{SPACE}{p_is(parts.subjects_p)}; skewness {decimals(parts.skewness)}; see "
        "the Q-Q plot): Student’s t assumes that they are, and no test of few subjects makes up for it (where one "
        f"subject in five shows the effect, about {ENOUGH_SUBJECTS} subjects do)."
    )


def _over(effect: Effect) -> str:
    return "subjects and scenes, both random" if random_scenes(effect) else "subjects, for these scenes"


def _pair(one: str, other: str, test: Effect | NotComputed, what: str) -> str:
    """Describe the difference between a pair out of more than two fixations."""
    if isinstance(test, NotComputed):
        return f"The {what} of “{one}” and “{other}” were not compared: {test.reason}"
    differ = "differed" if test.significant else "were not shown to differ"
    ends = interval(test.ratio.low, test.ratio.high, 2)
    return (
        f"The {what} of “{one}” and “{other}” {differ} (their ratio {decimals(test.ratio.estimate)}, "
        f"95{SPACE}% CI {ends}; {_test(test)})."
    )


def _ordinal_findings(result: OrdinalResult) -> list[str]:
    """Summarise ordinal answers in a few sentences."""
    sentences = []
    for number, (fixation, rise) in enumerate(zip(result.fixations, result.rises, strict=True)):
        subject = f"With {in_focus(fixation)}"
        if isinstance(rise, NotComputed):
            sentences.append(f"{subject}, the slope was not tested: {rise.reason}")
            continue
        what = "were not shown to change" if not rise.significant else "rose" if rise.estimate > 0 else "fell"
        ends = interval(rise.ratio.low, rise.ratio.high, 2)
        sentences.append(
            f"{subject}, ratings {what} with blur (odds ratio of a higher answer at the largest aperture "
            f"{decimals(rise.ratio.estimate)}, 95{SPACE}% CI {ends}; {_test(rise)}; over {_over(rise)})."
        )
        fixed = result.these_scenes[number] if result.these_scenes else rise
        if random_scenes(rise) and isinstance(fixed, Effect):
            ends = interval(fixed.ratio.low, fixed.ratio.high, 2)
            sentences[-1] += f" For these scenes alone: 95{SPACE}% CI {ends}; {_test(fixed)}."
    if isinstance(result.interaction, Effect):
        differ = "differed" if result.interaction.significant else "were not shown to differ"
        ratio = result.interaction.ratio
        sentences.append(
            f"The two slopes {differ} (ratio of the odds ratios {decimals(ratio.estimate)}, 95{SPACE}% CI "
            f"{interval(ratio.low, ratio.high, 2)}; {_test(result.interaction)})."
        )
    for (one, other), test in result.differences.items():
        sentences.append(_pair(one, other, test, "odds ratios"))
    return [f"Primary outcome. {sentences[0]}", *sentences[1:]]


def necker_findings(result: NeckerResult) -> list[str]:
    """Summarise experiment 2 in a few sentences."""
    sentences = []
    shares = {
        (each.gradient, each.strength): f"{decimals(100 * each.of_readings.estimate, 1)}{SPACE}%"
        for each in result.shares
        if each.percept == "nonrigid" and isinstance(each.of_readings, Interval)
    }
    largest = {
        effect.gradient: effect.strength for effect in sorted(result.effects, key=lambda effect: effect.strength)
    }
    for effect in result.effects:
        if effect.strength < largest[effect.gradient]:
            continue
        blur = f"Blur that agrees with the {effect.gradient} reading ({effect.strength:g} mm)"
        test = effect.odds_of_time
        if isinstance(test, NotComputed):
            sentences.append(f"{blur} was not tested: {test.reason}")
            continue
        verb = "was not shown to change" if not test.significant else "raised" if test.estimate > 0 else "lowered"
        without, with_ = (shares[key] for key in (("none", 0.0), (effect.gradient, effect.strength)))
        sentences.append(
            f"{blur} {verb} the nonrigid share of the time (odds ratio {decimals(math.exp(test.estimate))}, "
            f"95{SPACE}% CI {interval(math.exp(test.low), math.exp(test.high), 2)}; {_test(test)}{_size(test)}; "
            f"mean share {without} without, {with_} with it)."
        )
    if not result.effects:
        return ["No trial had a gradient of blur: nothing was compared."]
    if len(result.effects) > 1:
        sentences.append("The other gradients are secondary, one family by Holm’s method.")
    return [f"Primary outcome. {sentences[0]}", *sentences[1:]]


def methods_ratings(part: Ratings, bound: float) -> list[str]:
    """Return the methods of experiment 1, for a paper."""
    if part.data is None:
        return [_own_table(part), excluded(part.quality, catch_answers(part.analysis)), *_analysis(part, bound, {})]
    designs = [sidecar["Design"] for sidecar in part.data.sidecars.values()]
    design = designs[0]
    apertures, scenes = _listed(design.get("apertures", ())), len(design.get("scenes", ()))
    return [
        f"{_people(part.quality, part.simulated)} judged the depth of pictures of {many(scenes, 'scene')} at the "
        f"apertures {apertures} ({design.get('focal_length_mm', '?')} mm lens), "
        f"{_focused(design)} in focus and fixated, {_times(design.get('repetitions', 1))} in random order "
        f"({design.get('fixation_order', 'mixed')} fixation). {_answers(design)}"
        f"Pictures were shown for {design.get('picture_s', '?')} s each. {_catches(design)}{_same(designs)}".strip(),
        excluded(part.quality, catch_answers(part.analysis, design.get("catch_pictures") or ("standard",))),
        *_analysis(part, bound, design),
    ]


def _focused(design: Mapping[str, Any]) -> str:
    """Describe the fixated objects of the design."""
    names = tuple(design.get("fixations", FIXATIONS))
    if names == FIXATIONS:
        return "once with the nearest and once with the farthest object"
    return f"each with {_listed([f'“{name}”' for name in names])}"


def _answers(design: Mapping[str, Any]) -> str:
    """Describe the answers in a sentence; empty if the analysis states them."""
    sentence = scale_of(design).reported
    return f"{sentence} " if sentence else ""


def _analysis(part: Ratings, bound: float, design: Mapping[str, Any]) -> list[str]:
    """Return primary outcome and analysis in the wording of the plan."""
    rows = part.kept[~part.kept["catch"]]
    if rows.empty:
        rows = part.table[~part.table["catch"]]
    plan = plan_of(part.analysis, {*rows["fixation"]}, rows["scene"].nunique(), design, bound)
    return [plan.outcome, plan.analysis]


def _own_table(part: Ratings) -> str:
    """Describe the user's own table, for which no design is known."""
    main = part.table[~part.table["catch"]]
    names = main.drop_duplicates("aperture_mm").sort_values("aperture_mm")["aperture"]
    return (
        f"{_people(part.quality, part.simulated)} rated {many(main['scene'].nunique(), 'scene')} at the apertures "
        f"{_listed(list(names))}, with the {_listed(sorted(main['fixation'].unique()))} object in focus. The data are "
        "a table; what was shown, and how, is not recorded in it."
    )


def methods_necker(part: Reports) -> list[str]:
    """Return the methods of experiment 2, for a paper."""
    return [_cube_shown(part), excluded(part.quality, CUBE_CATCH), analysis_necker(part.shortest_both)]


def _cube_shown(part: Reports) -> str:
    if part.data is None:
        trials = part.table[~part.table["catch"]]
        blurs = _listed(sorted({*trials["gradient"]} - {"none"}))
        sizes = sorted(trials["strength"][trials["strength"] > 0].unique())
        lines = "sharp"
        if sizes:
            apertures = _listed(f"{mm:g}" for mm in sizes)
            lines = f"blurred in agreement with one of the readings ({blurs}; aperture {apertures} mm)"
        return (
            f"{_people(part.quality, part.simulated)} reported the rigid and the nonrigid reading of a turning Necker "
            f"cube, with its lines {lines}. The data are a table; what was shown, and how, is not recorded in it."
        )
    designs = [sidecar["Design"] for sidecar in part.data.sidecars.values()]
    design = designs[0]
    strengths = _listed(f"{strength:g}" for strength in design.get("strengths_mm", ()))
    blurred = [name for name in design.get("gradients", ()) if name != "none"]
    lines = "Its lines were all sharp"
    if blurred:
        kinds = f"{_listed(blurred)}; aperture {strengths} mm"
        lines += f", or blurred in agreement with the depth of one of the readings ({kinds})"
    return (
        f"{_people(part.quality, part.simulated)} watched a wireframe Necker cube turn in perspective and held a key "
        f"for as long as it looked rigid, another for as long as it looked nonrigid. {lines}. Each "
        f"condition was shown for {design.get('trial_s', '?')} s, "
        f"{_times(design.get('repetitions', 1))}, turning {_listed(design.get('directions', ()))}. "
        f"{_catches(design)}{_same(designs)}".strip()
    )


def analysis_necker(shortest_both: float) -> str:
    """Describe the analysis of reports on the cube."""
    return (
        "The log odds of the nonrigid reading (its time over that of the rigid reading) were computed for each subject "
        "and gradient; half of the mean duration of a report was added to each time, which keeps log odds finite and "
        "reduces their bias. Each gradient was compared with none by a paired t-test over subjects. Primary "
        "is the nonrigid gradient (without one the rigid gradient) at its largest aperture, uncorrected; the others "
        "are secondary, one family by Holm’s method. Intervals are 95 % intervals over subjects by t; "
        "shares of time only describe, with intervals on the log odds of their mean. "
        f"Both keys held for less than {shortest_both:g} s counted as a transition, not as a report. Gamma and "
        "log-normal distributions were fitted to the durations of each percept by maximum likelihood, with durations "
        "cut off by the end of a trial as lower limits."
    )


def _people(found: Quality, simulated: bool) -> str:
    if simulated:
        return f"{many(found.subjects_before, 'simulated observer')} (computed by a model; no people took part)"
    return many(found.subjects_before, "subject")


def _catches(design: Mapping[str, Any]) -> str:
    catches = design.get("catch_trials", 0)
    return f"{many(catches, 'catch trial')} checked attention. " if catches else ""


def _same(designs: list[Mapping[str, Any]]) -> str:
    """Return a warning if sessions had different designs."""
    apart = [{key: value for key, value in design.items() if key != "seed"} for design in designs]
    return "" if all(one == apart[0] for one in apart) else "Sessions differ in their design; the first is given here. "


def _test(effect: Effect) -> str:
    """Format the test statistic with its p value, after Holm's correction in a family."""
    name, p = ("p", effect.p) if effect.p_holm is None else ("p_Holm", effect.p_holm)
    return f"t({freedom(effect.df)}){SPACE}={SPACE}{decimals(effect.statistic)}, {name}{SPACE}{p_is(p)}"


def _size(effect: Effect) -> str:
    """Format the effect size with its interval: d over subjects and scenes, d_z over subjects."""
    size, name = (effect.d, "d") if effect.d is not None else (effect.dz_interval, "d_z")
    return (
        "" if size is None else f", {name}{SPACE}={SPACE}{decimals(size.estimate)} {interval(size.low, size.high, 2)}"
    )


def p_is(p: float | None) -> str:
    r"""Format a p value as it follows "p".

    >>> p_is(0.0312), p_is(0.00004)
    ('=\xa0.031', '<\xa0.001')
    """
    text = probability(p)
    return text if text.startswith("<") else f"={SPACE}{text}"


def _times(count: int) -> str:
    return {1: "once", 2: "twice"}.get(count, f"{count} times")


def _listed(things: Any) -> str:
    *first, last = [str(thing) for thing in things] or ["none stated"]
    return f"{', '.join(first)} and {last}" if first else last
