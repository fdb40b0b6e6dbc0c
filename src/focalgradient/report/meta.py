"""Meta-analysis of the reports of several data sets with the same design."""

from __future__ import annotations

import json
import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from focalgradient.errors import InputError
from focalgradient.plotting.forest import forest_figure
from focalgradient.report import Report, compiled
from focalgradient.report.document import Block, Heading, Paragraph
from focalgradient.report.parts import Output
from focalgradient.report.scene_effects import SCENE_EFFECTS
from focalgradient.report.tables import Sheet, listed
from focalgradient.statistics.meta_analysis import Pooled, random_effects
from focalgradient.statistics.wording import SPACE, decimals, freedom, interval, many, number, p_is

__all__ = ["combined_report"]

METHODS = (
    "The main results of each data set, with exclusions where there are any, were pooled by a random-effects model: "
    "the variance between data sets by Paule and Mandel (1982), interval and test by Hartung and Knapp (2001), "
    "Student’s t with one degree of freedom less than data sets. The interval of prediction is that of the effect in "
    "a new data set, with the uncertainty of the variance between data sets (Nagashima, Noma and Furukawa, "
    "2019). Ratios were pooled on their logarithm. "
    "Data sets that show the same scenes (by the SHA-256 of the pictures, or by name where a data set has none) are "
    "not independent. Their effects by scene, averaged over the subjects of a data set, were then crossed, with data "
    "sets and scenes both random (each data set counts once; Satterthwaite’s t), and the differences between data sets "
    "and the interval of prediction are those for these scenes. With fewer than five scenes, and for answers in "
    "steps, everything holds for these scenes only. Probabilities are not corrected for several effects."
)


def combined_report(reports: Mapping[str, Report], notices: Sequence[str] = ()) -> Report:
    """Pool the main results of several reports.

    Parameters
    ----------
    reports
        Two or more reports, by the name of the data set.
    notices
        Sentences on all data sets, for the top, above the notices of each.

    Raises
    ------
    InputError
        If fewer than two have a main result in common.
    """
    rows = [{"data_set": name} | dict(result) for name, made in reports.items() for result in _main(made.results)]
    output, body = Output(), list[Block]()
    simulated = any(json.loads(made.files["results.json"])["simulated"] for made in reports.values())
    pooled, alone = [], []
    for (experiment, what), found in _grouped(rows).items():
        if len(found) < 2:
            alone.append(what)
            continue
        common = _common_scenes(experiment, what, [reports[row["data_set"]] for row in found])
        tested, by_scene = common or (found, None)
        estimates, errors = ([row[name] for row in tested] for name in ("estimate", "standard_error"))
        result = random_effects(estimates, errors, by_scene)
        # the displayed value may be the exponential of the estimate
        logs = math.isclose(found[0]["value"], math.exp(min(found[0]["estimate"], 700.0)), rel_tol=1e-9)
        shown = _shown(result, logs)
        pooled.append({"experiment": experiment, "what": what, **shown, **asdict(result)})
        title = what[:1].upper() + what[1:]
        body += [Heading(title), Paragraph(_sentence(result, shown, logs, common is not None))]
        studies = [(row["data_set"], row["value"], row["value_low"], row["value_high"]) for row in found]
        mean = shown["value"], shown["value_low"], shown["value_high"]
        ends = (shown["value_predicted_low"], shown["value_predicted_high"]) if len(shown) > 3 else None
        figure = forest_figure(what, studies, mean, ends, none=1.0 if logs else 0.0, simulated=simulated)
        caption = f"{title}: each data set with its 95 % interval, mean of all, and dashed the interval of prediction."
        body.append(output.figure(f"forest_{len(pooled):02}", figure, caption))
    if not pooled:
        raise InputError("no two of the data sets have a main result in common: give data sets of one design.")
    if alone:
        body.append(Paragraph(f"In one data set only, and not pooled: {'; '.join(alone)}."))
    head = ["data set", "result", "subjects", "estimate", f"95{SPACE}%"]
    cells = [
        [
            row["data_set"],
            row["what"],
            str(row["subjects"]),
            number(row["value"]),
            interval(row["value_low"], row["value_high"]),
        ]
        for row in rows
        if row.get("value") is not None
    ]
    body += output.tables([listed("studies_read.csv", "Data sets", head, cells)])
    output.sheets.append(Sheet("studies.csv", None, pd.DataFrame(rows)))
    output.sheets.append(Sheet("meta_analysis.csv", None, pd.DataFrame(pooled)))
    return compiled(
        f"Meta-analysis of {many(len(reports), 'data set')}",
        [*body, Heading("Methods"), Paragraph(METHODS)],
        output,
        simulated=simulated,
        problems=[f"{name}: {problem}" for name, made in reports.items() for problem in made.problems],
        results=pooled,
        notices=[*notices, *(f"{name}: {notice}" for name, made in reports.items() for notice in made.notices)],
    )


def _common_scenes(
    experiment: str, what: str, reports: Sequence[Report]
) -> tuple[list[Mapping[str, Any]], NDArray[np.float64]] | None:
    """Return the effects of data sets, for these scenes alone and by scene (data sets x scenes), if two share a scene.

    None if no scene is shared, or scenes are unknown.
    """
    read = [_scene_effects(report, experiment, what) for report in reports]
    if any(table.empty for table in read):
        return None
    scenes = [table[table["scene"] != ""] for table in read]
    known = all((table["pictures_sha256"] != "").all() for table in scenes)
    if not known and any(len(table) < 2 for table in scenes):
        return None  # a table without a column of scenes
    pictures: list[set[str]] = []

    def number(row: pd.Series[Any]) -> int:
        """Return the number of a scene, the same in each data set that shows a picture of it."""
        own = set(row["pictures_sha256"].split()) if known else {row["scene"]}
        for at, others in enumerate(pictures):
            if own & others:
                others |= own
                return at
        pictures.append(own)
        return len(pictures) - 1

    effects = [table["effect"].groupby(table.apply(number, axis=1)).mean() for table in scenes]
    by_scene = pd.concat(effects, axis=1)
    if by_scene.shape[0] == sum(map(len, effects)):
        return None
    here: list[Mapping[str, Any]] = [
        {"estimate": row["effect"], "standard_error": row["standard_error"]}
        for row in (table[table["scene"] == ""].iloc[0] for table in read)
    ]
    return here, by_scene.to_numpy(dtype=float).T


def _scene_effects(report: Report, experiment: str, what: str) -> pd.DataFrame:
    """Return the rows of an effect, empty unless they have that of these scenes together."""
    file = f"{experiment}{SCENE_EFFECTS}"
    if file not in report.files:
        return pd.DataFrame()
    rows = [row for row in json.loads(report.files[file])["effects"] if row["what"] == what]
    if not rows:
        return pd.DataFrame()
    table = pd.DataFrame(rows).astype({"effect": float, "standard_error": float})
    return table if (table["scene"] == "").any() else table.iloc[:0]


def _main(results: Sequence[Mapping[str, Any]]) -> list[Mapping[str, Any]]:
    """Return the results with exclusions, or those without if a task excludes nobody."""
    with_ = {one["experiment"] for one in results if one["exclusions"] == "with exclusions"}
    return [one for one in results if one["exclusions"] == "with exclusions" or one["experiment"] not in with_]


def _grouped(rows: Sequence[Mapping[str, Any]]) -> dict[tuple[str, str], list[Mapping[str, Any]]]:
    """Group the rows with results by experiment and effect."""
    found: dict[tuple[str, str], list[Mapping[str, Any]]] = {}
    for row in rows:
        error = row.get("standard_error")
        if error is not None and math.isfinite(error) and error > 0:
            found.setdefault((str(row["experiment"]), str(row["what"])), []).append(row)
    return found


def _shown(result: Pooled, logs: bool) -> dict[str, float]:
    """Return the mean, its ends, and those of the prediction if there are any; as ratios if `logs`."""
    ends = {"value": result.estimate, "value_low": result.low, "value_high": result.high}
    if result.predicted_low is not None and result.predicted_high is not None:
        ends |= {"value_predicted_low": result.predicted_low, "value_predicted_high": result.predicted_high}
    return {name: math.exp(end) if logs else end for name, end in ends.items()}


def _sentence(result: Pooled, shown: Mapping[str, float], logs: bool, common: bool) -> str:
    new = ""
    if "value_predicted_low" in shown:
        ends = interval(shown["value_predicted_low"], shown["value_predicted_high"])
        new = f" In a new data set{' with these scenes' * common} it is expected within {ends}."
    over = ""
    if result.scenes is not None:
        over = f" that share scenes, and over {many(result.scenes, 'scene')},"
    elif common:
        over = " that share scenes, and for these scenes only,"
    return (
        f"Over {many(result.studies, 'data set')}{over} it is {number(shown['value'])}, 95{SPACE}% CI "
        f"{interval(shown['value_low'], shown['value_high'])}, t({freedom(result.df)}) = "
        f"{decimals(result.statistic)}, p {p_is(result.p)}. Data sets differ by a standard "
        f"deviation of {number(result.tau)}{' (of the logarithm)' if logs else ''}; Q = {decimals(result.q)}, p "
        f"{p_is(result.q_p)}, I² = {result.i2:.0%}.{new}"
    )


def file_names(names: Sequence[str]) -> list[str]:
    """Return short names of the data sets for file names: the last part of each path, numbered if repeated.

    >>> file_names(["a/data", "b/data", "c"])
    ['data', 'data (2)', 'c']
    """
    found: list[str] = []
    for name in names:
        base = re.split(r"[\\/]", name.rstrip("/\\"))[-1] or name
        count = sum(one == base or one.startswith(f"{base} (") for one in found)
        found.append(base if not count else f"{base} ({count + 1})")
    return found
