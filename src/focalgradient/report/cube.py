"""The rotating Necker cube: its plan, and the section of the report."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from functools import partial
from typing import Any

import pandas as pd

from focalgradient.dataset import DataSet
from focalgradient.plotting.subjects import necker_figure
from focalgradient.report.analysed import Reports, analyse_report_table, designs_in, trials_in
from focalgradient.report.displays import place_effects_of_cube, screens, screens_sheet, with_place
from focalgradient.report.exclusions import CUBE_CATCH, criteria
from focalgradient.report.export import r_script, report_files
from focalgradient.report.parts import Asked, Drawing, Part, Plan
from focalgradient.report.tables import EFFECTS, MEANS, Sheet, sheet
from focalgradient.report.words import OF_TABLE, catches, counts, differing, setting, times
from focalgradient.statistics import DominanceModel, NeckerResult, NotComputed, as_table
from focalgradient.statistics.questions import NO_ANSWERS, Answers
from focalgradient.statistics.wording import listed
from focalgradient.tasks import Task

__all__ = ["cube_of_dataset", "cube_part", "shown_cube"]

CAPTION = (
    "The turning cube. Left: nonrigid share of the time with one of the two readings, each subject thin, mean and 95 % "
    "interval of the mean bold (that of the table). Middle: mean shares of all the time. Right: median and middle "
    "half of the fitted distribution of durations."
)
CAPTIONS = {
    EFFECTS: "Odds of the nonrigid reading (time), each gradient against none; first row: primary. p_Holm: over all "
    "secondary comparisons",
    MEANS: "Reported percepts, means over subjects with 95 % intervals",
}


def shown_cube(design: Mapping[str, Any]) -> str:
    """Describe the design of reports on the cube."""
    blurred = [name for name in design.get("gradients", ()) if name != "none"]
    lines = "Its lines were all sharp"
    if blurred:
        strengths = listed(f"{strength:g}" for strength in design.get("strengths_mm", ()))
        lines += (
            f", or blurred in agreement with the depth of one of the readings ({listed(blurred)}; aperture {strengths} "
            "mm)"
        )
    texts = [
        "{people} watched a wireframe Necker cube turn in perspective and held a key for as long as it looked rigid, "
        f"another for as long as it looked nonrigid. {lines}. Each condition was shown for "
        f"{setting(design, 'trial_s')} s, {times(design)}, turning {listed(design.get('directions', ()))}. Every "
        "subject saw every condition, in random order from the seed that the data set records.",
        catches(design),
    ]
    return " ".join(filter(None, texts))


def cube_of_dataset(task: Task, data: DataSet, asked: Asked) -> Part:
    """Analyse the reports on a cube."""
    return cube_part(analyse_report_table(trials_in(data), rules=asked.rules, data=data))


def cube_part(reports: Reports, exported: pd.DataFrame | None = None) -> Part:
    """Return the section on analysed reports; `exported` is their table with further columns."""
    result, quality, data = reports.result, reports.quality, reports.data
    seen = [] if data is None else screens(data)
    trials = reports.table[~reports.table["catch"]]
    sizes = sorted(trials["strength"][trials["strength"] > 0].unique())
    blurs = sorted({*trials["gradient"]} - {"none"})
    if data is not None:
        designs = designs_in(data)
        shown = shown_cube(designs[0]) + differing(designs)
    else:
        lines = "sharp"
        if sizes:
            apertures = listed(f"{mm:g}" for mm in sizes)
            lines = f"blurred in agreement with one of the readings ({listed(blurs)}; aperture {apertures} mm)"
        shown = (
            "{people} reported the rigid and the nonrigid reading of a turning Necker cube, with its lines "
            f"{lines}. {OF_TABLE}"
        )
    unjudged = {one.rule: one.reason for one in quality.unjudged}
    plan = Plan(reports.questions, shown, criteria(quality.rules, unjudged, CUBE_CATCH))
    computed = None if isinstance(result, NotComputed) else result
    notices = [result.reason] if isinstance(result, NotComputed) else []
    if computed and not computed.effects:
        notices = ["No trial had a gradient of blur: nothing was compared."]
    places = place_effects_of_cube(seen, computed) if computed else NO_ANSWERS
    table = with_place(seen, reports.table if exported is None else exported)
    files = report_files(table, reports.kept, computed, data)
    figure = Drawing("necker", CAPTION, partial(necker_figure, computed)) if computed else None
    return Part(
        title="Necker cube",
        name="necker",
        plan=plan,
        answers=Answers((*reports.answers, *places)),
        simulated=reports.simulated,
        sample=[counts(quality)],
        data=data,
        quality=quality,
        notices=notices,
        remarks=computed.remarks if computed else (),
        figures=[figure] if figure else [],
        captions=CAPTIONS,
        sheets=[*(_sheets(computed) if computed else ()), *screens_sheet(seen, "necker")],
        files=files | ({"necker_places.R": r_script("necker_places", places)} if places else {}),
        observed=(reports.kept,),
    )


CONDITION = {"blur agrees with": "{gradient}", "mm": "{strength}", "percept": "{percept}"}
DURATIONS = {
    **CONDITION,
    "reports (cut off)": "{reports} ({censored})",
    **{
        f"{family}: {what}": f"{{{family}.{field}}}"
        for family in ("gamma", "lognormal")
        for what, field in (("mean (s)", "mean"), ("CV", "cv"), ("log L", "log_likelihood:1"))
    },
    "better": "{better}",
}
OF_PEOPLE = {
    "geometric mean (s)": "geometric_mean",
    "SE of its log": "geometric_mean_log_se",
    "gamma shape": "shape",
    "SE": "shape_se",
    "SD of log mean": "log_sd",
    "its SE": "log_sd_se",
}
"""Columns of the durations over subjects: estimates, each with its standard error."""

PARAMETERS = {
    "median": "median duration (s) in a first trial, geometric mean over subjects",
    "median_log_sd": "SD over subjects of log median",
    "spread": "SD of log duration, geometric mean over subjects",
    "spread_log_sd": "SD over subjects of its logarithm",
    "preference": "log ratio of medians, rigid over nonrigid, mean over subjects",
    "preference_sd": "SD of it over subjects",
    "first_ratio": "first percept of a trial over later ones (ratio of medians)",
    "drift": "exponent of the trial's number",
    "serial": "correlation with the percept before",
}
"""Parameters of the log-normal model."""


def _sheets(result: NeckerResult) -> Iterator[Sheet]:
    """Yield the tables beside those of the effects and shares."""
    yield Sheet("necker_subjects.csv", None, as_table(result.subject_shares))
    caption = "Percept durations (right-censored at trial end)"
    yield sheet("necker_durations.csv", caption, result.dominance, DURATIONS)
    rows = [
        {"gradient": one.gradient, "strength": one.strength, "percept": one.percept}
        | (
            {"not_computed": one.fit.reason}
            if isinstance(one.fit, NotComputed)
            else {"subjects": len(one.fit.people)} | {name: getattr(one.fit, name) for name in OF_PEOPLE.values()}
        )
        for one in result.people
    ]
    columns = CONDITION | {"subjects": "{subjects}"} | {head: f"{{{name}}}" for head, name in OF_PEOPLE.items()}
    caption = (
        "Durations over subjects: gamma distributions of one shape and each subject’s own mean, the cut-off censored"
    )
    notes = [one["not_computed"] for one in rows if "not_computed" in one]
    yield sheet("necker_durations_of_people.csv", caption, rows, columns, notes=notes)
    if result.over_people is not None:
        yield _lognormal(result.over_people)


def _lognormal(model: DominanceModel | NotComputed) -> Sheet:
    """Return the parameters of the log-normal model, on the scale that `DominanceModel` states."""
    file = "necker_durations_lognormal.csv"
    caption = "Durations over subjects: log-normal model with each subject's own median, spread and preference"
    columns = {
        "parameter": "{about}",
        "estimate": "{estimate}",
        "SE (of the logarithm; of atanh for the correlation; else as it stands)": "{se}",
    }
    if isinstance(model, NotComputed):
        digits = pd.DataFrame([{"not_computed": model.reason}])
        return sheet(file, caption, [{"about": "all", "estimate": model}], columns, digits=digits)
    rows = [
        {"parameter": name, "estimate": getattr(model, name), "se": model.standard_errors.get(name)}
        for name in PARAMETERS
    ]
    note = (
        f"{model.people} subjects, {model.percepts} percepts, {model.censored} cut off (censored); log likelihood "
        f"{model.log_likelihood:.1f}. A parameter without a standard error was not fitted."
    )
    shown = [row | {"about": PARAMETERS[row["parameter"]]} for row in rows]
    return sheet(file, caption, shown, columns, digits=pd.DataFrame(rows), notes=[note])
