"""Sentences of a report: short findings, and methods for a paper."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from focalgradient.report.analysed import Ratings, Reports
from focalgradient.report.exclusions import CUBE_CATCH, catch_answers, excluded
from focalgradient.scales import scale_of
from focalgradient.statistics import (
    Components,
    DepthRatingResult,
    Effect,
    Quality,
)
from focalgradient.statistics.cube import cube_questions
from focalgradient.statistics.effects import questions_of
from focalgradient.statistics.rating_questions import ENOUGH_SUBJECTS
from focalgradient.statistics.wording import SPACE, decimals, listed, many, p_is
from focalgradient.user_tables.tidy import FIXATIONS

__all__ = [
    "counts",
    "methods_necker",
    "methods_ratings",
    "skewed",
]


def counts(found: Quality) -> str:
    """Describe the sample before and after exclusions."""
    return (
        f"{many(found.subjects_before, 'subject')} with {many(found.trials_before, 'trial')} before exclusions; "
        f"{many(found.subjects_after, 'subject')} with {many(found.trials_after, 'trial')} after (catch trials not "
        "counted)."
    )


def skewed(result: DepthRatingResult) -> Iterator[str]:
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


def methods_ratings(part: Ratings, bound: float) -> list[str]:
    """Return the methods of experiment 1, for a paper."""
    if part.data is None:
        return [_own_table(part), excluded(part.quality, catch_answers(part.analysis)), *_analysis(part, bound, {})]
    designs = [sidecar["Design"] for sidecar in part.data.sidecars.values()]
    design = designs[0]
    apertures, scenes = listed(design.get("apertures", ())), len(design.get("scenes", ()))
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
    return f"each with {listed([f'“{name}”' for name in names])}"


def _answers(design: Mapping[str, Any]) -> str:
    """Describe the answers in a sentence; empty if the analysis states them."""
    sentence = scale_of(design).reported
    return f"{sentence} " if sentence else ""


def _analysis(part: Ratings, bound: float, design: Mapping[str, Any]) -> list[str]:
    """Return primary outcome and analysis in the wording of the plan."""
    rows = part.kept[~part.kept["catch"]]
    if rows.empty:
        rows = part.table[~part.table["catch"]]
    asked = questions_of(part.analysis, {*rows["fixation"]}, rows["scene"].nunique(), design, bound)
    return [asked.outcome, asked.method]


def _own_table(part: Ratings) -> str:
    """Describe the user's own table, for which no design is known."""
    main = part.table[~part.table["catch"]]
    names = main.drop_duplicates("aperture_mm").sort_values("aperture_mm")["aperture"]
    return (
        f"{_people(part.quality, part.simulated)} rated {many(main['scene'].nunique(), 'scene')} at the apertures "
        f"{listed(list(names))}, with the {listed(sorted(main['fixation'].unique()))} object in focus. The data are "
        "a table; what was shown, and how, is not recorded in it."
    )


def methods_necker(part: Reports) -> list[str]:
    """Return the methods of experiment 2, for a paper."""
    method = cube_questions([], rules=part.quality.rules).method
    return [_cube_shown(part), excluded(part.quality, CUBE_CATCH), method]


def _cube_shown(part: Reports) -> str:
    if part.data is None:
        trials = part.table[~part.table["catch"]]
        blurs = listed(sorted({*trials["gradient"]} - {"none"}))
        sizes = sorted(trials["strength"][trials["strength"] > 0].unique())
        lines = "sharp"
        if sizes:
            apertures = listed(f"{mm:g}" for mm in sizes)
            lines = f"blurred in agreement with one of the readings ({blurs}; aperture {apertures} mm)"
        return (
            f"{_people(part.quality, part.simulated)} reported the rigid and the nonrigid reading of a turning Necker "
            f"cube, with its lines {lines}. The data are a table; what was shown, and how, is not recorded in it."
        )
    designs = [sidecar["Design"] for sidecar in part.data.sidecars.values()]
    design = designs[0]
    strengths = listed(f"{strength:g}" for strength in design.get("strengths_mm", ()))
    blurred = [name for name in design.get("gradients", ()) if name != "none"]
    lines = "Its lines were all sharp"
    if blurred:
        kinds = f"{listed(blurred)}; aperture {strengths} mm"
        lines += f", or blurred in agreement with the depth of one of the readings ({kinds})"
    return (
        f"{_people(part.quality, part.simulated)} watched a wireframe Necker cube turn in perspective and held a key "
        f"for as long as it looked rigid, another for as long as it looked nonrigid. {lines}. Each "
        f"condition was shown for {design.get('trial_s', '?')} s, "
        f"{_times(design.get('repetitions', 1))}, turning {listed(design.get('directions', ()))}. "
        f"{_catches(design)}{_same(designs)}".strip()
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


def _times(count: int) -> str:
    return {1: "once", 2: "twice"}.get(count, f"{count} times")
