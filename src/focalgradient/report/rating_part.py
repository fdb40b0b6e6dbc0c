"""Section of the report on depth ratings."""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from focalgradient.dataset import DataSet
from focalgradient.plotting.residuals import residual_figure
from focalgradient.plotting.subjects import blur_figure, depth_rating_figure, ordinal_figure, scenes_figure
from focalgradient.report.analysed import Ratings, analyse_ratings
from focalgradient.report.bayes import bayes_analysis, bayes_methods, bayes_part
from focalgradient.report.choices import of_analysis
from focalgradient.report.displays import blur_seen, place_effects, place_sheet, screens, screens_sheet
from focalgradient.report.document import FURTHER, Block, Details, Notice, Paragraph
from focalgradient.report.exclusions import answers_of, with_and_without
from focalgradient.report.export import trial_files
from focalgradient.report.gaze import findings, gaze_part
from focalgradient.report.parts import Asked, Output, Part
from focalgradient.report.plans import CONFIDENCE_PLAN, in_focus
from focalgradient.report.robustness_part import ROBUSTNESS_PLAN, robustness_part, variant_answers
from focalgradient.report.scales import comparison_sheets, factor_sheet
from focalgradient.report.scene_effects import SCENE_EFFECTS, scene_effects_file
from focalgradient.report.tables import quality_sheets, rating_sheets
from focalgradient.report.words import counts, methods_ratings, rating_cautions, rating_checks
from focalgradient.statistics import (
    DepthRatingResult,
    Effect,
    FactorEffect,
    Interval,
    NotComputed,
    OrdinalResult,
    Quality,
)
from focalgradient.statistics.comparisons import confidence_answers
from focalgradient.statistics.criteria import OF_RATINGS
from focalgradient.statistics.posteriors import BayesResult
from focalgradient.statistics.questions import Answer, stated
from focalgradient.statistics.residuals import rating_residuals
from focalgradient.statistics.robustness import Variant, robustness

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
    """

    ratings: Ratings
    asked: Asked
    posterior: BayesResult | None
    variants: tuple[Variant, ...]
    data: DataSet | None
    simulated: bool

    @classmethod
    def of(cls, ratings: Ratings, asked: Asked) -> RatingPart:
        """Create the section from analysed ratings, with the Bayesian analysis if requested."""
        posterior = None
        if asked.bayes and isinstance(ratings.result, DepthRatingResult):
            posterior = bayes_analysis(ratings, ratings.result.analysis, asked.bound, asked.used_bound, asked.progress)
        variants = () if ratings.kept.empty else robustness(ratings.table, ratings.quality.rules, ratings.analysis)
        return cls(ratings, asked, posterior, variants, ratings.data, ratings.simulated)

    @classmethod
    def of_dataset(cls, root: str | os.PathLike[str], asked: Asked) -> RatingPart:
        """Read and analyse the ratings of a data set; errors as in `analyse_ratings`."""
        ratings = analyse_ratings(
            root, bound=asked.used_bound, scale=asked.scale, rules=asked.rules, progress=asked.progress
        )
        return cls.of(ratings, asked)

    @property
    def title(self) -> str:
        return "Depth ratings"

    @property
    def name(self) -> str:
        return "depth_rating"

    @property
    def quality(self) -> Quality:
        """Data quality and exclusions."""
        return self.ratings.quality

    @property
    def rules(self) -> tuple[str, ...]:
        return (*OF_RATINGS, "bound") if self.ratings.analysis.ratios else OF_RATINGS

    def findings(self, output: Output) -> Iterator[Block]:
        part = self.ratings
        for sentence in findings(part):
            yield Notice(sentence) if isinstance(part.main, NotComputed) else Paragraph(sentence)
        result = part.result if isinstance(part.result, DepthRatingResult) else None
        if result is not None:
            yield from map(Paragraph, rating_cautions(result))
        yield Paragraph(counts(part.quality))
        own = quality_sheets(part.quality, "depth_rating")
        seen = [] if part.data is None else screens(part.data)
        if places := self._places():
            unit = "logarithm of the ratings" if part.analysis.ratios else "units of the scale"
            own = [place_sheet(places, "depth_rating", unit), *own]
        own += [sheet for sheet in [screens_sheet(seen, "depth_rating")] if sheet]
        if part.factors:
            own = [factor_sheet(part.factors, part.analysis), *own]
        yield from with_and_without("depth_rating", part.quality, part.main, part.everyone, own)
        folded: list[Block] = []
        results = [*comparison_sheets(part.compared)] if part.compared is not None else []
        if result is not None:
            figure, *further = self._figures(result, output)
            yield figure
            folded += [*map(Paragraph, rating_checks(result)), *further]
            results = rating_sheets(result)
        shown, *tables = output.tables([*results, *own])
        yield shown
        checked = rating_residuals(part.kept, part.analysis)
        if not part.kept.empty and checked:
            drawn = residual_figure(checked, simulated=part.simulated)
            folded.append(output.figure("depth_rating_residuals", drawn, RESIDUALS))
        folded += robustness_part(self.variants, part.analysis, output)
        folded += tables
        if result is not None:
            yield from map(Paragraph, result.remarks)
        for answer in confidence_answers(part.kept):
            found = answer.outcome
            said = found.summary() if isinstance(found, Effect) else getattr(found, "reason", "")
            yield Paragraph(f"With {in_focus(answer.level)}, slope of confidence on the aperture: {said}")
        yield from gaze_part(part, output.sheets)
        if self.posterior is not None:
            yield from bayes_part(self.posterior, output.sheets, output.figures, simulated=part.simulated)
        yield Details(FURTHER, folded)

    def answers(self) -> Iterator[Answer]:
        part = self.ratings
        yield from answers_of(part.main, part.everyone, part.quality)
        if isinstance(part.fixated, Ratings) and not isinstance(part.fixated.main, NotComputed):
            yield from part.fixated.main.answers.variant("without trials in which gaze left the object")
        yield from confidence_answers(part.kept)
        unit = "log ratio" if part.analysis.ratios else "units of the scale"
        for one in (*part.factors, *self._places()):
            level = f"{one.level} less {one.against}"
            yield stated(f"{one.measure} by {one.factor}", level, one.effect, "secondary", unit)
        yield from variant_answers(self.variants, part.main)
        for name, found in ({} if self.posterior is None else self.posterior.posteriors).items():
            outcome = found if isinstance(found, NotComputed) else Interval(found.median, found.low, found.high)
            yield stated("posterior of the depth effect", name, outcome, "check", unit)

    def _places(self) -> tuple[FactorEffect, ...]:
        """Compare participants in a browser with those in the laboratory."""
        part = self.ratings
        seen = [] if part.data is None else screens(part.data)
        return place_effects(seen, part.kept, ratios=part.analysis.ratios)

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
        if confidence_answers(self.ratings.kept).rows:
            yield Paragraph(CONFIDENCE_PLAN)
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
