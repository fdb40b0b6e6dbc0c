"""Section of the report on depth ratings."""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from typing import ClassVar

from focalgradient.dataset import DataSet
from focalgradient.plotting.residuals import residual_figure
from focalgradient.plotting.subjects import blur_figure, depth_rating_figure, ordinal_figure, scenes_figure
from focalgradient.report.analysed import Ratings, analyse_ratings
from focalgradient.report.bayes import bayes_analysis, bayes_methods, bayes_part
from focalgradient.report.choices import of_analysis
from focalgradient.report.displays import blur_seen, place_effects, screens, screens_sheet
from focalgradient.report.document import FURTHER, Block, Details, Notice, Paragraph
from focalgradient.report.exclusions import exclusions_table, with_and_without
from focalgradient.report.export import trial_files
from focalgradient.report.gaze import findings, gaze_part
from focalgradient.report.parts import Asked, Output, Part
from focalgradient.report.robustness_part import ROBUSTNESS_PLAN, robustness_part, variant_answers
from focalgradient.report.scene_effects import SCENE_EFFECTS, scene_effects_file
from focalgradient.report.tables import CHECKS, MEANS, answer_tables, quality_sheets, rating_sheets
from focalgradient.report.words import counts, methods_ratings, skewed
from focalgradient.statistics import (
    DepthRatingResult,
    Interval,
    NotComputed,
    OrdinalResult,
    Quality,
)
from focalgradient.statistics.criteria import OF_RATINGS
from focalgradient.statistics.posteriors import BayesResult
from focalgradient.statistics.questions import NO_ANSWERS, Answer, Answers, Caution, stated
from focalgradient.statistics.residuals import rating_residuals
from focalgradient.statistics.robustness import Variant, robustness
from focalgradient.statistics.slope_questions import CONFIDENCE_METHOD, CONFIDENCE_SLOPE, confidence_answers

__all__ = ["RatingPart"]

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


@dataclass(frozen=True, slots=True, eq=False)
class RatingPart(Part):
    """Section on depth ratings, of a data set or of the user's own table.

    Parameters
    ----------
    ratings
        Analysed ratings.
    asked
        Settings of the report.
    posterior
        Bayesian analysis, if requested and possible.
    variants
        Main effects with each exclusion rule left out.
    data, simulated
        As in `ratings`.
    found
        All effects.
    """

    title: ClassVar[str] = "Depth ratings"
    name: ClassVar[str] = "depth_rating"

    ratings: Ratings
    asked: Asked
    posterior: BayesResult | None
    variants: tuple[Variant, ...]
    data: DataSet | None
    simulated: bool
    found: Answers = NO_ANSWERS

    @classmethod
    def of(cls, ratings: Ratings, asked: Asked) -> RatingPart:
        """Create the section from analysed ratings, with the Bayesian analysis if requested."""
        posterior = None
        if asked.bayes and isinstance(ratings.result, DepthRatingResult):
            posterior = bayes_analysis(ratings, ratings.result.analysis, asked.bound, asked.used_bound, asked.progress)
        variants = () if ratings.kept.empty else robustness(ratings.table, ratings.quality.rules, ratings.analysis)
        made = cls(ratings, asked, posterior, variants, ratings.data, ratings.simulated)
        return replace(made, found=Answers(tuple(made._answers())))

    @classmethod
    def of_dataset(cls, root: str | os.PathLike[str], asked: Asked) -> RatingPart:
        """Read and analyse the ratings of a data set; errors as in `analyse_ratings`."""
        ratings = analyse_ratings(
            root, bound=asked.used_bound, scale=asked.scale, rules=asked.rules, progress=asked.progress
        )
        return cls.of(ratings, asked)

    @property
    def quality(self) -> Quality:
        """Data quality and exclusions."""
        return self.ratings.quality

    @property
    def rules(self) -> tuple[str, ...]:
        return (*OF_RATINGS, "bound") if self.ratings.analysis.ratios else OF_RATINGS

    def findings(self, output: Output) -> Iterator[Block]:
        part, answers = self.ratings, self.found
        for sentence in findings(part):
            yield Notice(sentence) if isinstance(part.main, NotComputed) else Paragraph(sentence)
        result = part.result if isinstance(part.result, DepthRatingResult) else None
        checks = [] if isinstance(part.main, NotComputed) else [*part.main.answers.sentences(*CHECKS)]
        checks += confidence_answers(part.kept).sentences(*CHECKS)
        cautions = [sentence for sentence in checks if isinstance(sentence, Caution)]
        if result is not None:
            yield from map(Paragraph, [*cautions, *skewed(result)])
        yield Paragraph(counts(part.quality))
        yield from with_and_without(part.quality, self.both)
        folded: list[Block] = [Paragraph(sentence) for sentence in checks if sentence not in cautions]
        if result is not None:
            figure, *further = self._figures(result, output)
            yield figure
            folded += further
        yield from answer_tables(answers, self._caption)
        checked = () if isinstance(part.main, NotComputed) else rating_residuals(part.main.answers, part.kept)
        if checked:
            drawn = residual_figure(checked, simulated=part.simulated)
            folded.append(output.figure("depth_rating_residuals", drawn, RESIDUALS))
        folded += robustness_part(self.variants, part.analysis, output)
        folded += answer_tables(answers, "Tests that decide nothing; p is not corrected", CHECKS)
        how = "within subjects" if part.analysis.ratios else "by t on the log odds" if part.analysis.binary else "by t"
        folded += answer_tables(answers, f"Means over subjects, 95 % intervals {how}", MEANS)
        if part.quality.exclusions:
            folded.append(exclusions_table(self.both, self.name))
        sheets = [] if result is None else rating_sheets(result)
        seen = [] if part.data is None else screens(part.data)
        folded += output.tables(
            [*sheets, *quality_sheets(part.quality, self.name), *filter(None, [screens_sheet(seen, self.name)])]
        )
        if result is not None:
            yield from map(Paragraph, result.remarks)
        yield from gaze_part(part, output.sheets)
        if self.posterior is not None:
            yield from bayes_part(self.posterior, output.sheets, output.figures, simulated=part.simulated)
        yield Details(FURTHER, folded)

    @property
    def _caption(self) -> str:
        result = self.ratings.main
        caption = "Effects. p (Holm): over all secondary comparisons"
        if self.ratings.factors:
            caption += ", of a factor over its levels"
        if not isinstance(result, DepthRatingResult):
            return caption
        if isinstance(result.ordinal, OrdinalResult):
            return f"{caption}. Cumulative-link mixed model: {result.ordinal.formula}"
        return f"{caption}. Depth effect: ratings at the largest aperture ({result.largest_mm:.3g} mm) over the pinhole"

    def answers(self) -> Answers:
        return self.found

    def _answers(self) -> Iterator[Answer]:
        part = self.ratings
        yield from part.answers
        if isinstance(part.fixated, Ratings) and not isinstance(part.fixated.main, NotComputed):
            yield from part.fixated.main.answers.variant("without trials in which gaze left the object")
        yield from confidence_answers(part.kept)
        yield from part.factors
        if part.data is not None:
            yield from place_effects(screens(part.data), part.kept, ratios=part.analysis.ratios)
        yield from variant_answers(self.variants, part.main)
        unit = "log ratio" if part.analysis.ratios else "units of the scale"
        for name, found in ({} if self.posterior is None else self.posterior.posteriors).items():
            outcome = found if isinstance(found, NotComputed) else Interval(found.median, found.low, found.high)
            yield stated("posterior of the depth effect", name, outcome, "check", unit)

    def _figures(self, result: DepthRatingResult, output: Output) -> Iterator[Block]:
        simulated, data = self.simulated, self.ratings.data
        if isinstance(result.ordinal, OrdinalResult):
            yield output.figure("depth_rating", ordinal_figure(result, simulated=simulated), ORDINAL_CAPTION)
        else:
            ratio = any(mean.ratio is not None for mean in result.subject_means)
            what = "Increase in the impression of depth over the pinhole" if ratio else "Ratings of depth"
            bold = "" if not result.means else "; geometric mean over subjects and its 95 % interval bold"
            caption = f"{what}, by aperture: each subject thin{bold}."
            yield output.figure("depth_rating", depth_rating_figure(result, simulated=simulated), caption)
        blur = {} if data is None else blur_seen(data, screens(data), result.participants)
        if blur and result.means:
            yield output.figure("depth_rating_blur", blur_figure(result, blur, simulated=simulated), BLUR_CAPTION)
        if result.scene_means:
            yield output.figure("depth_rating_scenes", scenes_figure(result, simulated=simulated), SCENES_CAPTION)

    def methods(self, output: Output) -> Iterator[Block]:
        yield from map(Paragraph, [*methods_ratings(self.ratings, self.asked.used_bound), ROBUSTNESS_PLAN])
        if self.found.to(CONFIDENCE_SLOPE):
            yield Paragraph(CONFIDENCE_METHOD)
        if self.posterior is not None:
            yield Paragraph(bayes_methods(self.posterior))
        yield from output.tables(self.design_table())
        if self.asked.bound is None and self.ratings.analysis.ratios:
            used = self.asked.used_bound
            yield Notice(f"The bound of equivalence, {used:.3g}, is the default: state your own in advance.")

    @property
    def choices(self) -> tuple[str, ...]:
        return of_analysis(self.ratings.analysis)

    def exports(self) -> Mapping[str, bytes]:
        part = self.ratings
        result = None if isinstance(part.result, NotComputed) else part.result
        found = trial_files(part.table, part.kept, part.compared or result, self.data)
        return {**found, SCENE_EFFECTS: scene_effects_file(part)}
