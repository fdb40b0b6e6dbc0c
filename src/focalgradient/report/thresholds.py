"""Thresholds, of blur or of the user's own levels: their plan, and the section of the report."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from functools import partial
from typing import Any

import pandas as pd

from focalgradient.dataset import DataSet
from focalgradient.errors import InputError
from focalgradient.plotting.thresholds import person_figure, threshold_figure
from focalgradient.report.analysed import design_in, designs_in
from focalgradient.report.exclusions import WITHOUT
from focalgradient.report.export import r_script, table_files
from focalgradient.report.parts import Asked, Drawing, Part, Plan, is_simulated
from focalgradient.report.tables import EFFECTS, Sheet, listed
from focalgradient.report.words import setting, times
from focalgradient.statistics import (
    Interval,
    NotComputed,
    SubjectThreshold,
    ThresholdFit,
    ThresholdResult,
    blur_thresholds,
)
from focalgradient.statistics.adaptive import WITHOUT_FIT
from focalgradient.statistics.questions import Analysis, Answers
from focalgradient.statistics.threshold_questions import threshold_questions
from focalgradient.statistics.thresholds import ATTENDING, LateLevels
from focalgradient.statistics.wording import many, number, with_interval
from focalgradient.tasks import Task
from focalgradient.user_tables.thresholds import OwnThresholds

__all__ = ["threshold_part", "threshold_plan", "thresholds_of_dataset", "thresholds_of_table"]

DISCS = "(disc: larger for more trials; ten at most, of neighbouring levels together)"
GROUPS = (
    f"Left: each person’s function, with the share of right answers at each level {DISCS}. "
    "Right: thresholds with 95 % intervals, those of the table; geometric means bold."
)
MISSED = " Dotted and open: too few catch trials right."
PEOPLE = f"Each person’s share of right answers at each level {DISCS} and function."


def threshold_plan(questions: Analysis, design: Mapping[str, Any]) -> Plan:
    """Return the plan of a design of blur thresholds."""
    is_blur = design["judged"] == "blur"
    unit = unit_of(design)
    scenes = f"of {len(design['scenes'])} scenes" if len(design["scenes"]) > 1 else "scene"
    question = "which of the two was more blurred" if is_blur else "which of the two looked deeper"
    how = (
        f"the whole picture was defocused for a pupil of {setting(design, 'pupil_mm')} mm"
        if is_blur
        else "it was seen through a lens focused on the fixated object, by the depth of its scene"
    )
    return Plan(
        questions,
        shown=f"Each trial showed one {scenes} in two intervals of "
        f"{setting(design, 'picture_s')} s and asked {question}; in one of them {how}, by a level above the "
        f"{setting(design, 'pedestal')} {unit} of both. The level was chosen before each trial by QUEST+ (Watson, "
        f"2017; questplus) from {design['level_steps']} between {setting(design, 'least_level')} and "
        f"{setting(design, 'most_level')} {unit}. Each scene was shown {times(design)} with it in each interval; "
        f"{many(design['catch_trials'], 'catch trial')} showed the greatest level.",
        exclusions=[
            f"Participants with less than {ATTENDING:.0%} of the catch trials right are named; as a high threshold has "
            "the same effect as inattention, the mean is over all participants, and that without them is also "
            "reported."
        ],
    )


def unit_of(design: Mapping[str, Any]) -> str:
    """Return the unit of a design's levels.

    >>> unit_of({"judged": "blur"}), unit_of({"judged": "depth"})
    ('D', 'mm')
    """
    return "D" if design["judged"] == "blur" else "mm"


def thresholds_of_table(own: OwnThresholds) -> Part:
    """Fit each person of a table in each condition."""
    least, most = float(own.table["level"].min()), float(own.table["level"].max())
    rows = dict(iter(own.table.groupby("condition")))
    results = {
        name: blur_thresholds(rows[name], least=least, most=most, unit=own.unit, guess=own.guess)
        for name in own.conditions
    }
    return threshold_part(own.exported, results, own.unit, own.guess)


def thresholds_of_dataset(task: Task, data: DataSet, asked: Asked) -> Part:
    """Fit all sessions of a data set.

    Raises
    ------
    InputError
        If psignifit is not installed, or sessions differ in task or levels.
    """
    designs = designs_in(data)
    first, table = designs[0], data.tables[task.name]
    for key in ("judged", "least_level", "most_level", "pedestal", "pupil_mm"):
        if len({str(design.get(key)) for design in designs}) > 1:
            raise InputError(f"{data.root} has sessions that differ in {key}: keep designs in data sets of their own.")
    known = {
        f"sub-{files.participant}": float(sidecar["Participant"]["threshold"])
        for files, sidecar in data.sidecars.items()
        if sidecar.get("Simulated") and "threshold" in sidecar.get("Participant", {})
    }
    least, most = float(first["least_level"]), float(first["most_level"])
    result = blur_thresholds(table, least=least, most=most, unit=unit_of(first), known=known)
    return threshold_part(table, {"": result}, result.unit, data=data, questions=task.analysis(design_in(data)))


def threshold_part(
    table: pd.DataFrame,
    results: Mapping[str, ThresholdResult],
    unit: str,
    guess: float = 0.5,
    data: DataSet | None = None,
    questions: Analysis | None = None,
    prefix: str = "",
) -> Part:
    """Return the section on thresholds.

    Parameters
    ----------
    table
        All trials.
    results
        Thresholds of each person, by condition.
    unit, guess
        Unit of the levels, and guess rate.
    data
        Data set with the design; None for the user's own table.
    questions
        Analysis of the task; None for the user's own table.
    prefix
        Beginning of the names of files, but for those of a design of blur thresholds.
    """
    questions = questions or threshold_questions(unit, results, guess)
    answers = everyone = questions.answers(results)
    file = "blur_thresholds" if data else f"{prefix}thresholds"
    simulated = is_simulated(table, data)
    plan = Plan(questions)
    said: list[str] = []
    levels = float(table["level"].min()), float(table["level"].max())
    if data is not None:
        design = designs_in(data)[0]
        levels = float(design["least_level"]), float(design["most_level"])
        plan = threshold_plan(questions, design)
        result = results[""]
        main = questions.asked(results).of_roles("main")
        answers = Answers((*main, *everyone.of_roles("description"), *everyone.variant(WITHOUT)))
        said = [_attending(result, unit)] if isinstance(result.mean, Interval) else []
    ends = " to ".join(f"{number(level)} {unit}".strip() for level in levels)
    people, who = table["participant_id"].nunique(), "simulated observer" if simulated else "person"
    several = f" in {len(results)} conditions" if len(results) > 1 else ""
    sessions = [(name, one) for name, result in results.items() for one in result.subjects]
    figures = []
    if any(isinstance(one.fit, ThresholdFit) for _, one in sessions):
        level = None if data else f"level ({unit})" if unit else "level"
        caption = GROUPS + MISSED * any(not one.kept for _, one in sessions)
        figures.append(Drawing(file, caption, partial(threshold_figure, results, level=level)))
        figures.append(Drawing(f"{prefix}threshold_people", PEOPLE, partial(person_figure, results, level=level)))
    return Part(
        title="Blur thresholds" if data else "Thresholds",
        name=(name := "blur_threshold" if data else "threshold"),
        plan=plan,
        answers=answers,
        simulated=simulated,
        sample=[f"{many(people, who)}{several} answered {many(len(table), 'trial')} at levels from {ends}."],
        shown=everyone,
        data=data,
        said=said,
        notices=[*_notices(sessions, levels, ends)],
        figures=figures,
        captions={EFFECTS: "Geometric mean thresholds" + ", and their ratios between conditions" * bool(several)},
        sheets=[_sheet(f"{file}.csv", results, unit, is_design=data is not None)],
        files=table_files(f"{name}_trials", table)
        | {f"{prefix}thresholds.R": r_script("thresholds", answers).replace(b"THRESHOLDS", file.encode())},
        observed=(table, guess),
    )


def _notices(sessions: Sequence[tuple[str, SubjectThreshold]], levels: tuple[float, float], ends: str) -> Iterator[str]:
    at_end = []
    if any(isinstance(one.fit, LateLevels) for _, one in sessions):
        yield WITHOUT_FIT
    for condition, one in sessions:
        who = ", ".join(filter(None, [one.name, condition]))
        fit = one.fit
        if isinstance(fit, NotComputed):
            yield f"{who}: {fit.reason}"
        elif isinstance(fit, ThresholdFit) and (fit.low < 1.1 * levels[0] or fit.high > levels[1] / 1.1):
            at_end.append(who)
        if not one.kept:
            yield (
                f"{who} was right in {one.catch_right} of {one.catch_trials} catch trials, fewer than {ATTENDING:.0%}: "
                "by inattention, or because the threshold is high."
            )
    if at_end:
        yield (
            f"{'; '.join(at_end)}: the 95 % interval of the threshold comes within 10 % of the lowest or the highest "
            f"level shown ({ends}), so the threshold may lie beyond the levels."
        )


def _attending(result: ThresholdResult, unit: str) -> str:
    """Describe the mean without those who missed catch trials."""
    if all(one.kept for one in result.subjects):
        return "None missed the catch trials: the mean with exclusions is the same."
    if not isinstance(result.mean_attending, Interval):
        return "All missed the catch trials: there is no mean with exclusions."
    return (
        f"Without the {sum(not one.kept for one in result.subjects)} who missed catch trials: "
        f"{with_interval(result.mean_attending, unit)}. People with a high threshold miss them as well: this mean is "
        "too low if thresholds reach the greatest level."
    )


def _sheet(file: str, results: Mapping[str, ThresholdResult], unit: str, *, is_design: bool) -> Sheet:
    """Return the threshold of each session; columns of sessions, catch trials and truth where there are any."""
    of = f" ({unit})" if unit else ""
    rows: list[dict[str, Any]] = []
    has_sessions = any(one.session for result in results.values() for one in result.subjects)
    for name, one in ((name, one) for name, result in results.items() for one in result.subjects):
        fit = None if isinstance(one.fit, NotComputed) else one.fit
        row: dict[str, Any] = {"participant": one.participant}
        row |= {"session": one.session} if has_sessions else {}
        row |= {} if is_design else {"condition": name}
        row["threshold" + of * is_design] = fit and fit.threshold
        row |= {key: getattr(fit, key, None) for key in ("low", "high", "slope")}
        row |= {"lapses": getattr(fit, "lapse", None), "trials": fit.trials if fit else 0}
        if one.catch_trials:
            row["catch trials right"] = f"{one.catch_right} of {one.catch_trials}"
            row["enough of them"] = "yes" if one.kept else "no"
        rows.append(row if one.known is None else row | {"known": one.known})
    head = list(dict.fromkeys(name for row in rows for name in row))
    caption = f"Each person’s threshold{of} with its 95 % interval; slope: exponent of the Weibull function"
    cells = [[row.get(name) for name in head] for row in rows]
    return listed(file, caption, head, cells)
