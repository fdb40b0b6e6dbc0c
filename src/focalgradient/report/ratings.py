"""Depth ratings: their plan, and the section of the report."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import Any

import pandas as pd

from focalgradient.dataset import DataSet
from focalgradient.plotting.residuals import residual_figure
from focalgradient.plotting.subjects import blur_figure, depth_rating_figure, ordinal_figure, scenes_figure
from focalgradient.report.analysed import Ratings, analyse_table, asked_of_ratings, designs_in, trials_in
from focalgradient.report.bayes import bayes_analysis, bayes_methods, bayes_part
from focalgradient.report.displays import blur_seen, place_effects, screens, screens_sheet, with_place
from focalgradient.report.document import Block, Heading, Paragraph
from focalgradient.report.exclusions import always_the_same, catch_answers, criteria
from focalgradient.report.export import r_script, trial_files
from focalgradient.report.parts import Asked, Drawing, Output, Part, Plan
from focalgradient.report.scene_effects import SCENE_EFFECTS, scene_effects_file
from focalgradient.report.tables import CHECKS, EFFECTS, MEANS, Sheet, listed, sheet
from focalgradient.report.words import OF_TABLE, catches, counts, differing, setting, times
from focalgradient.scales import Analysis, Choices, Slopes, scale_of
from focalgradient.statistics import (
    Components,
    DepthRatingResult,
    Effect,
    Interval,
    NotComputed,
    OrdinalResult,
    Rules,
    as_table,
)
from focalgradient.statistics.criteria import WORDING
from focalgradient.statistics.posteriors import BayesResult
from focalgradient.statistics.questions import Analysis as Questions
from focalgradient.statistics.questions import Answer, Answers, stated
from focalgradient.statistics.rating_questions import ENOUGH_SUBJECTS
from focalgradient.statistics.residuals import rating_residuals
from focalgradient.statistics.robustness import ALL_RULES, Variant, robustness
from focalgradient.statistics.wording import SPACE, decimals, in_focus, many, number, p_is
from focalgradient.statistics.wording import listed as in_words
from focalgradient.tasks import Task
from focalgradient.user_tables.tidy import FIXATIONS

__all__ = ["POSTERIOR", "gaze_blocks", "rating_part", "rating_plan", "ratings_of_dataset"]

BLUR_CAPTION = (
    "The same over the largest blur of the pictures in minutes of arc, on the participants' own screens. Bars up and "
    "down: 95 % intervals of the mean; to the sides: standard deviation for one participant, of what differs between "
    "them and of the uncertainty of screen and viewing distance."
)

SCENES_CAPTION = (
    "The same by scenes. Left: each scene thin, geometric mean over subjects and scenes bold. Right: the depth effect "
    "at the largest aperture of each scene, with its 95 % interval over subjects."
)

RESIDUALS = (
    "Assumptions. Left: each subject’s own effect by normal quantiles; the line and the grey band are those of normal "
    "samples of that size and standard deviation (95 % at each rank). Middle and right: residuals of each subject and "
    "scene, by normal quantiles and by fitted value."
)

ORDINAL_CAPTION = (
    "Left and middle: mean shares of the steps of the scale over subjects, by aperture and fixation, the highest step "
    "darkest. Right: the latent scale of the cumulative-link model in log odds, with 95 % intervals; dashed the "
    "thresholds between the steps."
)

POSTERIOR = "posterior of the depth effect"
"""Name of the answers of the Bayesian analysis."""

ROBUSTNESS = (
    "Robustness. The analysis is repeated with each exclusion rule left out. These variants share their data; each has "
    "its own uncorrected p, and none decides."
)


def rating_plan(
    questions: Questions,
    analysis: Analysis,
    design: Mapping[str, Any],
    *,
    shown: str,
    rules: Rules,
    unjudged: Mapping[str, str],
    further: Sequence[str] = (),
) -> Plan:
    """Return the plan of depth ratings.

    Parameters
    ----------
    questions, analysis, design
        Analysis of the task, of the answers on its scale, and settings of the design.
    shown
        Design in sentences.
    rules, unjudged
        Exclusion rules, and those that cannot be applied, with the reasons.
    further
        Further sentences on the analysis.
    """
    catch = catch_answers(analysis, design.get("catch_pictures") or ("standard",))
    return Plan(questions, shown, criteria(rules, unjudged, catch), [ROBUSTNESS, *further])


def shown_ratings(design: Mapping[str, Any]) -> str:
    """Describe the design of depth ratings."""
    names = tuple(design.get("fixations", FIXATIONS))
    focused = f"each with {in_words([f'“{name}”' for name in names])}"
    if names == FIXATIONS:
        focused = "with the nearest and with the farthest object"
    elif len(names) == 1 and names[0] in FIXATIONS:
        focused = f"with the {names[0]} object"
    texts = [
        f"{{people}} judged the depth of pictures of {many(len(design.get('scenes', ())), 'scene')} at the apertures "
        f"{in_words(design.get('apertures', ()))} ({setting(design, 'focal_length_mm')} mm lens), {focused} in focus "
        f"and fixated, {times(design)}. Every subject judged every scene, in random order "
        f"({design.get('fixation_order', 'mixed')} fixation) from the seed that the data set records.",
        scale_of(design).answered,
        f"Pictures were shown for {setting(design, 'picture_s')} s each.",
        catches(design),
    ]
    return " ".join(filter(None, texts))


def _shown(part: Ratings) -> str:
    """Describe the design that a data set recorded, or the user's own table, for which none is known."""
    if part.data is not None:
        designs = designs_in(part.data)
        return shown_ratings(designs[0]) + differing(designs)
    main = part.table[~part.table["catch"]]
    apertures = main.drop_duplicates("aperture_mm").sort_values("aperture_mm")["aperture"]
    return (
        f"{{people}} rated {many(main['scene'].nunique(), 'scene')} at the apertures {in_words([*apertures])}, with "
        f"the {in_words(sorted(main['fixation'].unique()))} object in focus. {OF_TABLE}"
    )


def ratings_of_dataset(task: Task, data: DataSet, asked: Asked) -> Part:
    """Analyse the ratings of a task."""
    options: Any = {"bound": asked.used_bound, "scale": asked.scale, "rules": asked.rules}
    return rating_part(analyse_table(trials_in(data), data=data, progress=asked.progress, **options), asked)


def rating_part(ratings: Ratings, asked: Asked, exported: pd.DataFrame | None = None) -> Part:
    """Return the section on analysed ratings, with the Bayesian analysis if it is requested and possible.

    Parameters
    ----------
    ratings, asked
        Analysed ratings, and settings of the report.
    exported
        Table of the ratings with further columns, for the exported trials.
    """
    main, analysis, data, quality = ratings.main, ratings.analysis, ratings.data, ratings.quality
    result = ratings.result if isinstance(ratings.result, DepthRatingResult) else None
    posterior = None
    if asked.bayes and result is not None:
        posterior = bayes_analysis(ratings, result.analysis, asked.bound, asked.used_bound, asked.progress)
    variants = () if ratings.kept.empty else robustness(ratings.table, quality.rules, analysis)
    seen = [] if data is None else screens(data)
    further = Answers((*ratings.also, *place_effects(seen, ratings.kept, ratios=analysis.ratios)))
    answers = Answers(tuple(_answers(ratings, further, variants, posterior)))
    checked = () if isinstance(main, NotComputed) else rating_residuals(main.answers, ratings.kept)
    blur = blur_seen(data, seen, result.participants) if data and result else {}
    figures = [*_figures(result, blur)] if result else []
    if checked:
        figures.append(Drawing("depth_rating_residuals", RESIDUALS, partial(residual_figure, checked), folded=True))
    within = "within subjects" if analysis.ratios else "by t on the log odds" if analysis.binary else "by t"
    methods = [] if posterior is None else [bayes_methods(posterior)]
    rows = ratings.kept[~ratings.kept["catch"]]
    rows = ratings.table[~ratings.table["catch"]] if rows.empty else rows
    design = {} if data is None else designs_in(data)[0]
    unjudged = {one.rule: one.reason for one in quality.unjudged}
    questions = asked_of_ratings(rows, replace(asked.options, scale=analysis), data)
    plan = rating_plan(
        *(questions, analysis, design), shown=_shown(ratings), rules=quality.rules, unjudged=unjudged, further=methods
    )
    default = asked.bound is None and analysis.ratios
    subsections = [partial(gaze_blocks, ratings)] if data is not None and ratings.fixated is not None else []
    subsections += [] if posterior is None else [partial(bayes_part, posterior, simulated=ratings.simulated)]
    computed = ratings.compared or result
    trials = with_place(seen, ratings.table if exported is None else exported)
    return Part(
        title="Depth ratings",
        name="depth_rating",
        plan=plan,
        answers=answers,
        simulated=ratings.simulated,
        sample=[counts(quality)],
        data=data,
        quality=quality,
        said=[] if result is None else [*_skewed(result)],
        notices=[main.reason] if isinstance(main, NotComputed) else always_the_same(rows) * (not analysis.binary),
        remarks=[*([] if result is None else result.remarks), *_robust(variants, analysis)],
        figures=figures,
        captions={
            EFFECTS: _caption(ratings),
            CHECKS: "Supplementary tests; p is not corrected",
            MEANS: f"Means over subjects, 95 % intervals {within}",
        },
        sheets=[*_sheets(result, variants), *screens_sheet(seen, "depth_rating")],
        subsections=subsections,
        advice=[f"The bound of equivalence, {asked.used_bound:.3g}, is the default: state your own in advance."]
        * default,
        files={
            **trial_files(trials, ratings.kept, computed, data),
            f"depth_rating{SCENE_EFFECTS}": scene_effects_file(ratings),
            **({"further_tests.R": r_script("further_tests", further)} if further else {}),
        },
        observed=(ratings.kept, analysis),
    )


def _answers(
    part: Ratings, further: Answers, variants: Sequence[Variant], posterior: BayesResult | None
) -> Iterator[Answer]:
    yield from part.answers
    if isinstance(part.fixated, Ratings) and not isinstance(part.fixated.main, NotComputed):
        yield from part.fixated.main.answers.variant("without trials in which gaze left the object")
    yield from further
    if not isinstance(part.main, NotComputed):
        question = part.main.answers.primary[0].question
        for one in variants:
            if one.rules != ALL_RULES:
                without = NotComputed(one.reason) if one.estimate is None else one
                yield Answer(question, one.fixation, without, f"without the rule {one.rules}", one.subjects)
    unit = "log ratio" if part.analysis.ratios else "units of the scale"
    for name, found in ({} if posterior is None else posterior.posteriors).items():
        outcome = found if isinstance(found, NotComputed) else Interval(found.median, found.low, found.high)
        yield stated(POSTERIOR, name, outcome, "check", unit)


def _figures(result: DepthRatingResult, blur: Mapping[str, tuple[float, float]]) -> Iterator[Drawing]:
    if isinstance(result.ordinal, OrdinalResult):
        yield Drawing("depth_rating", ORDINAL_CAPTION, partial(ordinal_figure, result))
    else:
        ratio = any(mean.ratio is not None for mean in result.subject_means)
        what = "Increase in the impression of depth over the pinhole" if ratio else "Ratings of depth"
        bold = "" if not result.means else "; geometric mean over subjects and its 95 % interval bold"
        caption = f"{what}, by aperture: each subject thin{bold}."
        yield Drawing("depth_rating", caption, partial(depth_rating_figure, result))
    if blur and result.means:
        yield Drawing("depth_rating_blur", BLUR_CAPTION, partial(blur_figure, result, blur), folded=True)
    if result.scene_means:
        yield Drawing("depth_rating_scenes", SCENES_CAPTION, partial(scenes_figure, result), folded=True)


def _caption(part: Ratings) -> str:
    result = part.main
    caption = "Effects. p_Holm: over all secondary comparisons"
    if any(answer.question.family for answer in part.also):  # the questions about factors
        caption += ", of a factor over its levels"
    if not isinstance(result, DepthRatingResult):
        return caption
    if isinstance(result.ordinal, OrdinalResult):
        return f"{caption}. Cumulative-link mixed model: {result.ordinal.formula}"
    return f"{caption}. Depth effect: ratings at the largest aperture ({result.largest_mm:.3g} mm) over the pinhole"


def _skewed(result: DepthRatingResult) -> Iterator[str]:
    """Yield advice where the planned check finds subjects' effects not normally distributed."""
    for each in result.fixations:
        parts = each.components
        if isinstance(each.rise, Effect) and isinstance(parts, Components) and parts.skewed:
            yield (
                f"Subjects’ depth effects are not normally distributed (Shapiro-Wilk W{SPACE}={SPACE}"
                f"{decimals(parts.subjects_w, 3)}, p{SPACE}{p_is(parts.subjects_p)}; skewness "
                f"{decimals(parts.skewness)}; see the Q-Q plot): Student’s t assumes that they are, and no test of few "
                "subjects makes up for it (where one subject in five shows the effect, about "
                f"{ENOUGH_SUBJECTS} subjects do)."
            )


def _robust(variants: Iterable[Variant], analysis: Analysis) -> list[str]:
    """Describe the effect at each fixation without each rule that excludes data; empty if none does."""
    slopes = isinstance(analysis, Slopes | Choices)
    what = "the slope" if slopes else "the odds ratio" if analysis.latent else "the depth effect"
    said: dict[str, list[str]] = {}
    for one in variants:
        if one.rules != ALL_RULES and one.distinct and one.estimate is not None:
            value = number(one.estimate if slopes else math.exp(one.estimate))
            text = f"{value} without the rule “{WORDING[one.rules].name}” (p {p_is(one.p)})"
            said.setdefault(one.fixation, []).append(text)
    of = [f"With {in_focus(name)}, {what} is {', '.join(texts)}." for name, texts in said.items()]
    return [" ".join(["Robustness.", *of])] if of else []


COMPONENTS = {
    "in focus": "{fixation}",
    "model": "{model.formula}",
    "SD of subjects": "{model.subjects:3}",
    "SD of scenes": "{model.scenes:3}",
    "SD of residuals": "{model.residual:3}",
    "Shapiro-Wilk W": "{model.shapiro_w:3}",
    "p": "{model.shapiro_p:p}",
    "largest residual (SD)": "{model.largest:2}",
    "skewness of subjects’ depth effects": "{model.skewness:2}",
    "their Shapiro-Wilk W": "{model.subjects_w:3}",
    "their p": "{model.subjects_p:p}",
}
"""Columns of the table of variance components."""


def _sheets(result: DepthRatingResult | None, variants: Sequence[Variant]) -> Iterator[Sheet]:
    """Yield the tables beside those of the effects."""
    if variants:
        yield Sheet("robustness.csv", None, as_table(variants))
    if result is None:
        return
    yield Sheet("depth_rating_subjects.csv", None, as_table(result.subject_means))
    if isinstance(result.ordinal, OrdinalResult):
        if result.ordinal.thresholds:
            columns = {"between": "{below} | {above}", "threshold": "{place.estimate:2}", "95 %": "{place:i2}"}
            caption = "Thresholds between the steps, in log odds; the pinhole with the first scene is 0"
            yield sheet("depth_rating_thresholds.csv", caption, result.ordinal.thresholds, columns)
        yield Sheet("depth_rating_shares.csv", None, as_table(result.ordinal.shares))
        return
    if result.scene_means:
        yield Sheet("depth_rating_scenes.csv", None, as_table(result.scene_means))
    rows = [{"fixation": one.fixation, "model": one.components} for one in result.fixations]
    digits = pd.DataFrame([{"fixation": r["fixation"]} | as_table([r["model"]]).iloc[0].to_dict() for r in rows])
    caption = "Model of the depth effect (log ratio of each subject and scene), its variance components and residuals"
    yield sheet("depth_rating_components.csv", caption, rows, COMPONENTS, digits=digits)


def gaze_blocks(part: Ratings, output: Output) -> Iterator[Block]:
    """Yield a count of trials in which gaze left the fixated object, and the findings without them."""
    assert part.data is not None
    degrees = float(designs_in(part.data)[0].get("gaze_within_deg", 0.0))
    rows = part.table[~part.table["catch"]]
    yield Heading("Gaze", 3)
    yield Paragraph(
        f"In {int(rows['gaze_left'].sum()):,} of {len(rows):,} trials a fixation of the eyes was more than {degrees:g} "
        "degrees away from the fixated object while pictures were shown, or the eyes were not found (column "
        "gaze_left). The results above are of all trials."
    )
    cells = []
    for name, own in rows.groupby("participant_id"):
        away = own["gaze_away"].dropna()
        median = None if away.empty else round(float(away.median()), 2)
        cells.append([str(name), len(own), int(own["gaze_left"].sum()), len(own) - len(away), median])
    caption = "Gaze: trials that left the fixated object, and how far fixations were from it at most (median)"
    head = ["subject", "trials", "left", "not known", "farthest (deg)"]
    yield from output.tables([listed("gaze.csv", caption, head, cells)])
    main = part.fixated.main if isinstance(part.fixated, Ratings) else part.fixated
    if main is None or isinstance(main, NotComputed):
        yield from map(Paragraph, [main.reason] if main else [])
        return
    first, *others = main.answers.sentences(*EFFECTS)
    yield from map(Paragraph, [f"Without those trials: {first}", *others])
