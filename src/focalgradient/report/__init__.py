"""Reports of data sets: methods, participants, results and their reliability.

`make_report` returns the contents of all files of a report: one self-contained HTML page, the same as Markdown, the
figures, and every table as CSV. Identical data give identical bytes.
"""

from __future__ import annotations

import json
import os
from collections.abc import Callable, Collection, Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pandas as pd

from focalgradient.dataset import DataSet, checking
from focalgradient.dataset.bids import DEFAULT_NAME, read_description
from focalgradient.errors import InputError, check_installed, entries_as_options
from focalgradient.files import printable
from focalgradient.progress import Progress
from focalgradient.report.analysed import analyse_necker, analyse_ratings, analyse_table, design_in, read_task
from focalgradient.report.choices import explained
from focalgradient.report.conditions import conditions_of_dataset
from focalgradient.report.cube import cube_of_dataset
from focalgradient.report.document import Block, Heading, Notice, Paragraph, as_html, as_markdown
from focalgradient.report.exclusions import EFFECT, main_results
from focalgradient.report.export import safe_csv
from focalgradient.report.parts import BOUND, Asked, Output, Part
from focalgradient.report.provenance import provenance
from focalgradient.report.ratings import POSTERIOR, ratings_of_dataset
from focalgradient.report.reading import RATINGS, kind_of, refuse_unused
from focalgradient.report.rules import Stated, as_toml, load_rules
from focalgradient.report.tables import Sheet
from focalgradient.report.thresholds import thresholds_of_dataset
from focalgradient.scales import Analysis, analysis_named
from focalgradient.statistics import Rules
from focalgradient.statistics.bayes import NEEDED
from focalgradient.statistics.questions import Answers, Kind
from focalgradient.statistics.wording import many
from focalgradient.tasks import Task, is_task, task_named, task_names, unknown_task
from focalgradient.tasks.check import called
from focalgradient.user_tables.files import Paths, UserTable, chosen_rows, read_table
from focalgradient.user_tables.source import Where

if TYPE_CHECKING:
    from focalgradient.report.observers import FittedObservers

__all__ = [
    "BOUND",
    "Report",
    "Stated",
    "analyse_necker",
    "analyse_ratings",
    "analyse_table",
    "load_rules",
    "make_report",
]


@dataclass(frozen=True, slots=True)
class Report:
    """Report of a data set.

    Parameters
    ----------
    files
        File contents by name.
    problems
        Problems of the data set and analyses that failed, one sentence each.
    results
        Main results with and without exclusions, as in ``results.json``; `value` and its interval are in the unit that
        `what` names, `estimate` and the other fields are those of `Effect`.
    notices
        Interpretations of the user's own table that change the results, one sentence each.
    """

    files: Mapping[str, bytes]
    problems: tuple[str, ...]
    results: tuple[Mapping[str, Any], ...] = ()
    notices: tuple[str, ...] = ()


def make_report(
    root: Paths,
    *,
    bound: float | None = None,
    scale: Analysis | str | None = None,
    stated: Stated | None = None,
    columns: Mapping[str, str] | None = None,
    conditions: Mapping[str, str] | None = None,
    focal_length_mm: float | None = None,
    guess_rate: float | None = None,
    where: Where | None = None,
    by: Sequence[str] = (),
    order: Sequence[str] = (),
    bayes: bool = False,
    observers: bool = False,
    executor: Executor | None = None,
    progress: Progress | None = None,
) -> Report:
    """Analyse a data set or the user's own table, and write a report.

    Parameters
    ----------
    root
        Folder of the data set; or a CSV, TSV, XLSX or JSON file (or the files of one data set, one per participant, or
        what `focalgradient.user_tables.read_table` read of them), which is analysed by its columns by
        `focalgradient.statistics.read_ratings`, `read_reports` (percepts), `read_thresholds` (levels and correct
        answers) or `read_detection` (signals and answers).
    bound
        Equivalence bound: see `focalgradient.statistics.depth_rating`. None: that of `stated`, else 1.2, which the
        report states.
    scale
        Analysis of the ratings; None: that of the designs, and for the user's own table choices if all ratings are 0 or
        1, else ratios.
    stated
        Exclusion rules: see `load_rules`.
    columns, conditions, focal_length_mm, guess_rate, where
        Settings of the user's own table; `where` gives values by column, of which an analysed row has one; the
        guess rate is for answers at levels, see `focalgradient.statistics.read_thresholds`.
    by
        Columns of conditions of a table of ratings, whose effects are tested instead of the depth effect: slopes of
        numbers, contrasts of others.  [default: the apertures of a table without fixations]
    order
        Words of answers in steps (of ratings, which are then ordinal, or of confidence), from the least to the most.
    bayes
        True to add a Bayesian analysis of the ratings: see `focalgradient.statistics.bayes`.
    observers
        True to fit simulated observers to the answers and compare them by cross-validation over people: see
        `focalgradient.observers.compare_observers`. Takes some additional minutes for the cube.
    executor
        Executor that checks the sessions of a data set: see `focalgradient.dataset.validate`. None: this process.
    progress
        Function called with the completed fraction of the slow parts: ordinal model, Bayesian models and observers.

    Raises
    ------
    InputError
        If nothing can be analysed (the message gives the first reason), or if a setting is given that applies to none
        of the data: `bound`, `scale`, `bayes` and `focal_length_mm` apply to ratings, rules also to the cube.
    """
    given = root if isinstance(root, UserTable) else None
    root = root.paths if isinstance(root, UserTable) else root
    paths = [Path(root)] if isinstance(root, str | os.PathLike) else [Path(path) for path in root]
    root, stated = paths[0], stated or Stated(Rules())
    if given is None and not root.exists():
        raise InputError(
            f"{printable(root)} does not exist: give a table of answers, or the folder that 'run', 'serve' or "
            "'simulate' wrote."
        )
    if len(paths) > 1 and not all(path.is_file() for path in paths):
        raise InputError("several data sets are reported by themselves: give the folder of one, or tables of one.")
    if bayes:
        check_installed(*NEEDED)
    asked = Asked(stated, bound, scale, bayes, progress)
    settings: dict[str, Any] = {"bound": bound, "scale": scale, "bayes": bayes, "focal_length_mm": focal_length_mm}
    settings |= {"by": tuple(by), "order": tuple(order), "guess_rate": guess_rate}
    if root.is_file():
        files = chosen_rows(given or read_table(paths), where, (columns or {}).values())
        kind = kind_of(files, columns, by)
        refuse_unused(root.name, f"contains {kind.what}", settings, kind.settings)
        if order and scale is None and kind.what == RATINGS:
            asked = replace(asked, scale="ordinal")
        steps = asked.scale is not None and analysis_named(asked.scale).whole
        how = settings | {"columns": columns, "conditions": conditions, "guess": guess_rate}
        own = kind.read(files, how | {"steps": steps})
        problems = [*own.problems]
        folder = Path(os.path.commonpath([path.absolute().parent for path in paths])).name
        title = folder if len(paths) > 1 and folder else root.stem
        found = _Analysed(title, [kind.part(own, asked)], problems, [*own.notes], [*own.notices])
    else:
        refuse_unused(printable(root), "is a data set", settings | {"where": where}, {"bound", "scale", "bayes"})
        found = _of_dataset(root, asked, executor)
    parts = found.parts
    emptied = (part for part in parts if part.quality and not part.quality.subjects_after)
    found.notices.extend(notice for part in emptied for notice in part.notices)
    applied = {name for part in parts for name in part.plan.questions.rules}
    _refuse_unused(applied, bound, stated, bayes, parts)
    output, body = Output(), list[Block]()
    fitted: Sequence[FittedObservers] = ()
    if observers:
        from focalgradient.report.observers import fitted_observers  # with eyes and pictures, which no test needs

        fitted = fitted_observers(parts, progress)
    for part in parts:
        body += [Heading(part.title), *part.findings(output)]
        body += [block for one in fitted if one.part is part for block in one.findings(output)]
    body.append(Heading("Methods"))
    for part in parts:
        body += [Heading(part.title, 3), *part.methods(output)]
        body += [block for one in fitted if one.part is part for block in one.methods()]
    body += explained([key for part in parts for key in part.plan.questions.choices])
    if stated.sha256:
        body.append(Paragraph(f"The rules were read from {stated.file} (SHA-256 {stated.sha256})."))
    body += [Heading("Provenance"), *(Paragraph(entries_as_options(_local(note, root))) for note in found.notes)]
    body += output.tables(provenance(paths, parts, applied, asked.used_bound, stated))
    answers = Answers(tuple(answer for part in parts for answer in part.answers))
    output.sheets.append(Sheet("results.csv", None, answers.frame()))
    results = []
    for part in parts:
        if part.usual:  # its questions have the names of another task's
            output.sheets.append(Sheet(part.named("results.csv"), None, part.answers.frame()))
        if rows := main_results(part.both):
            output.sheets.append(Sheet(f"{part.name}{EFFECT}", None, pd.DataFrame(rows)))
        results += [{"experiment": part.name} | row for row in rows]
    further = {name: content for part in parts for name, content in part.files.items()}
    if applied:
        used = asked.used_bound if "bound" in applied else None
        further["rules.toml"] = as_toml(stated.rules, used, applied).encode()
    return compiled(
        found.title,
        body,
        output,
        simulated=any(part.simulated for part in parts),
        problems=[_local(problem, root) for problem in found.problems],
        notices=found.notices,
        results=results,
        files=further,
    )


def compiled(
    title: str,
    body: Sequence[Block],
    output: Output,
    *,
    simulated: bool,
    problems: Sequence[str],
    results: Sequence[Mapping[str, Any]],
    notices: Sequence[str] = (),
    files: Mapping[str, bytes] | None = None,
) -> Report:
    """Return the report with all files: page, figures, tables, results.json and further `files`."""
    warned = ["Simulated observers, not people: every answer was computed by a model."] * simulated
    warned += [*(f"Problem: {problem}" for problem in problems), *notices]
    blocks = [*(Notice(entries_as_options(line)) for line in warned), *body]
    contents = {"simulated": simulated, "problems": problems, "notices": notices, "results": results}
    written = output.figures | {
        "report.html": as_html(title, blocks).encode(),
        "report.md": as_markdown(title, blocks).encode(),
        **{sheet.file: safe_csv(sheet.digits) for sheet in output.sheets},
        **(files or {}),
        "results.json": (json.dumps(contents, indent=1, ensure_ascii=False) + "\n").encode(),
    }
    return Report(written, tuple(problems), tuple(results), tuple(notices))


def _refuse_unused(
    applied: Collection[str], bound: float | None, stated: Stated, bayes: bool, parts: Sequence[Part]
) -> None:
    """Raise `InputError` for settings that no part of the report goes by."""
    if bound is not None and "bound" not in applied and not bayes:  # Bayesian models of steps have one, too
        raise InputError("bound is for ratings on a ratio scale, of which the data contain none: leave it out.")
    if stated.sha256 and not applied:
        raise InputError(
            f"{stated.file} has rules for depth ratings and the cube, of which the data contain none: leave it out."
        )
    if bayes and not any(answer.name == POSTERIOR for part in parts for answer in part.answers):
        raise InputError("bayes is for ratings in ratios or steps, of which the data contain none: leave it out.")


@dataclass(frozen=True, slots=True)
class _Analysed:
    """Analysed tasks of a data set or table, with its problems and notices."""

    title: str
    parts: list[Part]
    problems: list[str] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)
    notices: list[str] = field(default_factory=list)


def _is_ours(path: Path) -> bool:
    """Return whether the sidecar of a table of behaviour names this package."""
    sidecar = path.with_suffix(".json")
    return sidecar.is_file() and b"focalgradient" in sidecar.read_bytes().lower()


REPORTED: Mapping[Kind, Callable[[Task, DataSet, Asked], Part]] = {
    "conditions": conditions_of_dataset,
    "ratings": ratings_of_dataset,
    "cube": cube_of_dataset,
    "thresholds": thresholds_of_dataset,
}
"""Parts by the kind of the task's analysis."""


def _part(root: Path, task: Task, asked: Asked) -> Part:
    """Return a task's part of the report on a data set; damaged sessions are left out, and named in `Part.data`."""
    part: Part | None = task.reported and task.reported(root, asked)
    if part:
        return part
    data = read_task(root, task)
    part = REPORTED[called(task, "analysis", task.analysis, design_in(data)).kind](task, data, asked)
    return part if part.name.replace("_", "") == task.name else part.of_task(task)


def _of_dataset(root: Path, asked: Asked, executor: Executor | None) -> _Analysed:
    """Analyse every task of a data set that has sessions."""
    title = str(read_description(root).get("Name", root.name))
    checked = checking(root, executor=executor)  # in the executor, while this process analyses
    refused: list[InputError] = []
    parts: list[Part] = []
    for name in task_names():
        if any(root.glob(f"sub-*/**/*_task-{name}_beh.tsv")):
            try:
                parts.append(_part(root, task_named(name), asked))
            except InputError as error:
                refused.append(error)
    found = _Analysed(title.replace(DEFAULT_NAME, parts[0].title) if len(parts) == 1 else title, parts)
    if not parts:
        if refused:
            raise refused[0]
        for path in sorted([*root.glob("sub-*/**/*_beh.tsv"), *root.glob("sub-*/**/*_events.tsv")]):
            name, _, kind = path.stem.rpartition("_task-")[2].rpartition("_")
            pattern = "/".join(["sub-*", *["*"] * (len(path.relative_to(root).parts) - 2), f"*_{kind}.tsv"])
            if not is_task(name) and (kind == "events" or not _is_ours(path)):
                raise InputError(
                    f"{root} holds the task {name!r} of another program: name its tables, {root}/{pattern}, and their "
                    "columns, as in 'focalgradient report TABLES --columns rating=NAME'."
                )
            if not is_task(name):
                raise InputError(f"{path} is of a task {unknown_task(name)}")
        known = ", ".join(task_named(name).called for name in task_names())
        raise InputError(f"{root} contains no answers to any known task ({known}): there is nothing to report.")
    problems = [str(error) for error in refused]
    try:
        valid = checked()
        problems += valid.problems
        found.notes.extend(valid.notes)
    except InputError as error:
        problems.append(str(error))
    if gone := {label for part in parts if part.data for label in part.data.withdrawn}:
        found.notices.append(
            f"Left out whatever the rules: {many(len(gone), 'participant')} who asked for removal of the answers."
        )
    left_out = [one for part in parts if part.data for one in part.data.problems]
    found.problems.extend(
        f"Left out of the analysis: {one}" if one in left_out else one for one in dict.fromkeys(problems)
    )
    return found


def _local(sentence: str, root: Path) -> str:
    """Make paths in a sentence relative to the data set, as a report must not contain paths of the machine."""
    return sentence.replace(f"{root}{os.sep}", "")
