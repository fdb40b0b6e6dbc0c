"""The report of a data set: what was done, to whom, what came out and how far it can be relied on.

`make_report` gives the contents of all its files: one HTML page that needs nothing else, the same in Markdown, the
figures, and every table as CSV. The same data give the same bytes.
"""

from __future__ import annotations

import json
import os
from collections.abc import Callable, Iterable, Iterator, Mapping
from concurrent.futures import Executor
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any, TypeVar

from focalgradient.dataset import DataSet, checking
from focalgradient.dataset.bids import read_description
from focalgradient.errors import InputError, check_installed
from focalgradient.plotting.figures import as_files
from focalgradient.plotting.subjects import (
    blur_figure,
    depth_rating_figure,
    necker_figure,
    ordinal_figure,
    scenes_figure,
)
from focalgradient.progress import Progress
from focalgradient.report.analysed import (
    BOUND,
    Ratings,
    Reports,
    analyse_necker,
    analyse_ratings,
    analyse_report_table,
    analyse_table,
)
from focalgradient.report.bayes import bayes_analysis, bayes_methods, bayes_part
from focalgradient.report.displays import (
    blur_seen,
    place_effects,
    place_effects_of_cube,
    place_sheet,
    screens,
    screens_sheet,
)
from focalgradient.report.document import (
    Block,
    Figure,
    Heading,
    Notice,
    Paragraph,
    as_html,
    as_markdown,
)
from focalgradient.report.exclusions import main_results, sensitivity
from focalgradient.report.export import report_files, safe_csv, trial_files
from focalgradient.report.gaze import gaze_part
from focalgradient.report.own_tasks import OwnTask, analyse_own_task, methods_own_task, own_task_part
from focalgradient.report.provenance import listed, provenance
from focalgradient.report.rules import Stated, as_toml, load_rules
from focalgradient.report.scales import comparison_findings, comparison_sheets, factor_sheet
from focalgradient.report.tables import Sheet, necker_sheets, quality_sheets, rating_sheets
from focalgradient.report.thresholds import Thresholds, analyse_thresholds, methods_thresholds, threshold_part
from focalgradient.report.words import counts, methods_necker, methods_ratings, necker_findings, rating_findings
from focalgradient.scales import Analysis, analysis_named
from focalgradient.statistics import (
    DepthRatingResult,
    NotComputed,
    OrdinalResult,
    Rules,
    read_ratings,
    read_reports,
)
from focalgradient.statistics.bayes import NEEDED
from focalgradient.statistics.own_reports import holds_reports
from focalgradient.tasks import is_task, task_named, task_names, unknown_task
from focalgradient.tasks.registry import OURS

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

Part = TypeVar("Part", Ratings, Reports, Thresholds, OwnTask)

SHARE_CAPTION = (
    "The turning cube. Left: nonrigid share of the time with one of the two readings, each subject thin, mean and 95 % "
    "interval of the mean bold. Middle: mean shares of all the time. Right: median and middle half of the fitted "
    "distribution of durations."
)


BLUR_CAPTION = (
    "The same over the largest blur of the pictures in minutes of arc, on the participants' own screens. Bars up and "
    "down: 95 % intervals of the mean; to the sides: standard deviation for one participant, of what differs between "
    "them and of the uncertainty of screen and viewing distance."
)

SCENES_CAPTION = (
    "The same by scenes. Left: each scene thin, geometric mean over subjects and scenes bold. Right: the rise at the "
    "largest aperture of each scene, with its 95 % interval over subjects."
)


ORDINAL_CAPTION = (
    "Left and middle: mean shares of the steps of the scale over subjects, by aperture and fixation, the highest step "
    "darkest. Right: the latent scale of the cumulative-link model in log odds, with 95 % intervals; dashed the "
    "thresholds between the steps."
)


@dataclass(frozen=True, slots=True)
class Report:
    """A report.

    Parameters
    ----------
    files
        Contents by name.
    problems
        What is wrong with the data set or could not be analysed, a sentence each.
    results
        Main results with and without exclusions, as in ``results.json``; `value` and its interval are in the unit that
        `what` names, `estimate` and the other fields are those of `Effect`.
    notices
        What was taken otherwise than it stands in a table of one's own, a sentence each.
    """

    files: Mapping[str, bytes]
    problems: tuple[str, ...]
    results: tuple[Mapping[str, Any], ...] = ()
    notices: tuple[str, ...] = ()


def make_report(
    root: str | os.PathLike[str],
    *,
    bound: float | None = None,
    scale: Analysis | str | None = None,
    stated: Stated | None = None,
    columns: Mapping[str, str] | None = None,
    conditions: Mapping[str, str] | None = None,
    focal_length_mm: float | None = None,
    bayes: bool = False,
    executor: Executor | None = None,
    progress: Progress | None = None,
) -> Report:
    """Analyse a data set, or a table of one's own, and write down all of it.

    Parameters
    ----------
    root
        The data set's folder; or a CSV or TSV file, read by `focalgradient.statistics.read_ratings` with `columns`,
        `conditions` and `focal_length_mm`, or, with a column of percepts, by `focalgradient.statistics.read_reports`.
    bound
        Of equivalence: see `focalgradient.statistics.depth_rating`. Without it that of `stated`, or 1.2, and the report
        says so.
    scale
        What the ratings are; None: what the designs of the data set say, and ratios in a table of one's own.
    stated
        Rules of exclusion: see `load_rules`.
    columns, conditions, focal_length_mm
        Of a table of one's own.
    bayes
        Whether the ratings are analysed by Bayesian models, too: see `focalgradient.statistics.bayes`.
    executor
        What checks the sessions of a data set: see `focalgradient.dataset.validate`. None: this process.
    progress
        Called with the share done of the ordinal model, then of the Bayesian ones: the parts that take long.

    Raises
    ------
    InputError
        If nothing can be analysed, for the first reason; or if a table of reports on the cube is given with `bound`,
        `scale`, `bayes` or `focal_length_mm`, which are of ratings.
    """
    root, stated = Path(root), stated or Stated(Rules())
    if bayes:
        check_installed(*NEEDED)
    chosen = stated.bound if bound is None else bound
    used = BOUND if chosen is None else chosen
    if not root.is_file():
        found = _of_dataset(root, used, scale, stated.rules, executor, progress)
    elif holds_reports(root, columns):
        settings = {"bound": bound, "scale": scale, "bayes": bayes or None, "focal_length_mm": focal_length_mm}
        if given := [name for name, value in settings.items() if value is not None]:
            raise InputError(
                f"{given[0]} is of depth ratings, but {root.name} holds reports on the cube: leave it out."
            )
        read = read_reports(root, columns, conditions)
        reports = analyse_report_table(read.table, rules=stated.rules)
        found = _Analysed(root.stem, reports=reports, notes=[*read.notes], notices=[*read.notices])
    else:
        own = read_ratings(
            root,
            columns,
            conditions,
            focal_length_mm=focal_length_mm,
            steps=scale is not None and analysis_named(scale).whole,
        )
        ratings = analyse_table(own.table, bound=used, scale=scale, rules=stated.rules, progress=progress)
        found = _Analysed(root.stem, ratings, notes=[*own.notes], problems=[*own.problems], notices=[*own.notices])
    sheets: list[Sheet] = []
    figures: dict[str, bytes] = {}
    body: list[Block] = [Notice(f"Problem: {_local(problem, root)}") for problem in found.problems]
    body += map(Notice, found.notices)
    if any(part.simulated for part in found.parts):
        body = [Notice("Simulated observers, not people: every answer was computed by a model."), *body]
    methods: list[str] = []
    if found.ratings is not None:
        body += _rating_part(found.ratings, sheets, figures)
        if bayes and isinstance(found.ratings.result, DepthRatingResult):
            posterior = bayes_analysis(found.ratings, found.ratings.result.analysis, chosen, used, progress)
            body += bayes_part(posterior, sheets, figures, simulated=found.ratings.simulated)
            methods.append(bayes_methods(posterior))
    if found.reports is not None:
        body += _necker_part(found.reports, sheets, figures)
    if found.thresholds is not None:
        body += threshold_part(found.thresholds, sheets, figures)
    for other in found.own_tasks:
        body += own_task_part(other, sheets)
    body += _methods(found, chosen, used, methods, sheets)
    if stated.sha256:
        body.append(Paragraph(f"The rules were read from {stated.file} (SHA-256 {stated.sha256})."))
    body += [Heading("Provenance"), *(Paragraph(_local(note, root)) for note in found.notes)]
    body += _shown(provenance(root, found.parts, used, stated), sheets)
    files = _files(found.title, body, sheets, figures) | _trials(found)
    files["rules.toml"] = as_toml(stated.rules, used).encode()
    results = main_results(sheets)
    simulated = any(part.simulated for part in found.parts)
    problems = [_local(one, root) for one in found.problems]
    told = {"simulated": simulated, "problems": problems, "notices": found.notices, "results": results}
    files["results.json"] = (json.dumps(told, indent=1, ensure_ascii=False) + "\n").encode()
    return Report(files, tuple(found.problems), tuple(results), tuple(found.notices))


@dataclass(frozen=True, slots=True)
class _Analysed:
    """The experiments of a data set or table, what is wrong with it, and what is to be said of it."""

    title: str
    ratings: Ratings | None = None
    reports: Reports | None = None
    thresholds: Thresholds | None = None
    own_tasks: list[OwnTask] = field(default_factory=list)
    problems: list[str] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)
    notices: list[str] = field(default_factory=list)

    @property
    def parts(self) -> list[Ratings | Reports | Thresholds | OwnTask]:
        """The experiments that people took part in."""
        ours = [part for part in (self.ratings, self.reports, self.thresholds) if part is not None]
        return [*ours, *self.own_tasks]


def _of_dataset(
    root: Path,
    bound: float,
    scale: Analysis | str | None,
    rules: Rules,
    executor: Executor | None,
    progress: Progress | None,
) -> _Analysed:
    """The experiments of a data set, each where people took part in it."""
    title = str(read_description(root).get("Name", root.name))
    checked = checking(root, executor=executor)  # by the workers, while this process analyses
    refused: list[InputError] = []

    def tried(task: str, analyse: Callable[[], Part]) -> Part | None:
        if not any(root.glob(f"sub-*/**/*_task-{task}_beh.tsv")):
            return None
        try:
            return analyse()
        except InputError as error:
            refused.append(error)
            return None

    ratings = tried(
        "depthrating", lambda: analyse_ratings(root, bound=bound, scale=scale, rules=rules, progress=progress)
    )
    reports = tried("necker", lambda: analyse_necker(root, rules=rules))
    thresholds = tried("blurthreshold", lambda: analyse_thresholds(root))
    others = [task_named(name) for name in task_names() if name not in OURS]
    tries = [tried(task.name, partial(analyse_own_task, root, task)) for task in others]
    found = _Analysed(title, ratings, reports, thresholds, [one for one in tries if one is not None])
    if not found.parts:
        if refused:
            raise refused[0]
        for path in sorted(root.glob("sub-*/**/*_beh.tsv")):
            if not is_task(name := path.stem.rpartition("_task-")[2].removesuffix("_beh")):
                raise InputError(f"{path} is of a task {unknown_task(name)}")
        raise InputError(
            f"{root} holds neither depth ratings nor reports on the cube nor blur thresholds nor answers to a task of "
            "your own: there is nothing to report."
        )
    problems = [str(error) for error in refused]
    try:
        valid = checked()
        problems += valid.problems
        found.notes.extend(valid.notes)
    except InputError as error:
        problems.append(str(error))
    left_out = [one for part in found.parts if part.data for one in part.data.problems]
    found.problems.extend(
        f"Left out of the analysis: {one}" if one in left_out else one for one in dict.fromkeys(problems)
    )
    return found


def _methods(
    found: _Analysed, chosen: float | None, used: float, bayes: list[str], sheets: list[Sheet]
) -> Iterator[Block]:
    """What was done in each experiment; the bound of equivalence is `used`, and was `chosen` or is the default."""
    yield Heading("Methods")
    if (part := found.ratings) is not None:
        yield Heading("Depth ratings", 3)
        yield from map(Paragraph, [*methods_ratings(part, used), *bayes])
        yield from _shown([] if part.data is None else [_design(part.data, "depth_rating")], sheets)
        if chosen is None and part.analysis.ratios:
            yield Notice(f"The bound of equivalence, {used:.3g}, is the default: state your own in advance.")
    if found.reports is not None:
        yield Heading("Necker cube", 3)
        yield from map(Paragraph, methods_necker(found.reports))
        yield from _shown([] if found.reports.data is None else [_design(found.reports.data, "necker")], sheets)
    if found.thresholds is not None:
        yield Heading("Blur thresholds", 3)
        yield from map(Paragraph, methods_thresholds(found.thresholds.design))
        yield from _shown([_design(found.thresholds.data, "blur_threshold")], sheets)
    for own in found.own_tasks:
        yield Heading(own.task.title, 3)
        yield from map(Paragraph, methods_own_task(own))
        yield from _shown([_design(own.data, own.task.name)], sheets)


def _trials(found: _Analysed) -> dict[str, bytes]:
    """Every trial of each experiment, for another's analysis."""
    files: dict[str, bytes] = {}
    if (part := found.ratings) is not None:
        result = None if isinstance(part.result, NotComputed) else part.result
        files |= trial_files(part.table, part.kept, part.compared or result)
    if (reports := found.reports) is not None:
        computed = None if isinstance(reports.result, NotComputed) else reports.result
        files |= report_files(reports.table, reports.kept, computed)
    if found.thresholds is not None:
        files["blur_threshold_trials.csv"] = safe_csv(found.thresholds.table)
    files |= {f"{own.task.name}_trials.csv": safe_csv(own.table) for own in found.own_tasks}
    return files


def _rating_part(part: Ratings, sheets: list[Sheet], figures: dict[str, bytes]) -> Iterator[Block]:
    yield Heading("Depth ratings")
    yield Paragraph(counts(part.quality))
    own = quality_sheets(part.quality, "depth_rating")
    seen = [] if part.data is None else screens(part.data)
    if places := place_effects(seen, part.kept, ratios=part.analysis.ratios):
        unit = "logarithm of the ratings" if part.analysis.ratios else "units of the scale"
        own = [place_sheet(places, "depth_rating", unit), *own]
    own += [sheet for sheet in [screens_sheet(seen, "depth_rating")] if sheet]
    if part.factors:
        own = [factor_sheet(part.factors, part.analysis), *own]
    without = [*_without(part, "depth_rating", own)]
    if part.compared is not None:
        yield from map(Paragraph, comparison_findings(part.compared))
        yield from without
        own = [*comparison_sheets(part.compared), *own]
    elif isinstance(part.result, NotComputed):
        yield Notice(part.result.reason)
        yield from without
    else:
        yield from map(Paragraph, rating_findings(part.result))
        yield from without
        draw = ordinal_figure if isinstance(part.result.ordinal, OrdinalResult) else depth_rating_figure
        figures |= _pictures("depth_rating", as_files(draw(part.result, simulated=part.simulated)))
        ratio = any(mean.ratio is not None for mean in part.result.subject_means)
        what = "Increase in the impression of depth over the pinhole" if ratio else "Ratings of depth"
        bold = "" if not part.result.means else "; geometric mean over subjects and its 95 % interval bold"
        caption = f"{what}, by aperture: each subject thin{bold}."
        if draw is ordinal_figure:
            caption = ORDINAL_CAPTION
        yield Figure("depth_rating.png", figures["depth_rating.png"], caption)
        blur = {} if part.data is None else blur_seen(part.data, seen, part.result.participants)
        if blur and part.result.means:
            figures |= _pictures(
                "depth_rating_blur", as_files(blur_figure(part.result, blur, simulated=part.simulated))
            )
            yield Figure("depth_rating_blur.png", figures["depth_rating_blur.png"], BLUR_CAPTION)
        if part.result.scene_means:
            figures |= _pictures("depth_rating_scenes", as_files(scenes_figure(part.result, simulated=part.simulated)))
            yield Figure("depth_rating_scenes.png", figures["depth_rating_scenes.png"], SCENES_CAPTION)
        own = [*rating_sheets(part.result), *own]
    yield from _shown(own, sheets)
    if isinstance(part.result, DepthRatingResult):
        yield from map(Paragraph, part.result.remarks)
    yield from gaze_part(part, sheets)


def _necker_part(part: Reports, sheets: list[Sheet], figures: dict[str, bytes]) -> Iterator[Block]:
    yield Heading("Necker cube")
    yield Paragraph(counts(part.quality))
    own = quality_sheets(part.quality, "necker")
    seen = [] if part.data is None else screens(part.data)
    own += [sheet for sheet in [screens_sheet(seen, "necker")] if sheet]
    without = [*_without(part, "necker", own)]
    if isinstance(part.result, NotComputed):
        yield Notice(part.result.reason)
        yield from without
    else:
        yield from map(Paragraph, necker_findings(part.result))
        yield from without
        figures |= _pictures("necker", as_files(necker_figure(part.result, simulated=part.simulated)))
        yield Figure("necker.png", figures["necker.png"], SHARE_CAPTION)
        if places := place_effects_of_cube(seen, part.result):
            own = [place_sheet(places, "necker", "nonrigid share of the time"), *own]
        own = [*necker_sheets(part.result), *own]
    yield from _shown(own, sheets)
    if not isinstance(part.result, NotComputed):
        yield from map(Paragraph, part.result.remarks)


def _without(part: Ratings | Reports, name: str, own: list[Sheet]) -> Iterator[Block]:
    """Results without exclusions beside those with them: sentences and notices; the table is put first."""
    kept = part.main if isinstance(part, Ratings) else part.result
    sheet, sentences, notices = sensitivity(name, part.quality, kept, part.everyone or kept)
    own.insert(0, sheet)
    yield from map(Notice, notices)
    yield from map(Paragraph, sentences)


def _shown(own: Iterable[Sheet], sheets: list[Sheet]) -> list[Block]:
    """The tables to read; their files are put with the others."""
    own = list(own)
    sheets += own
    return [sheet.table for sheet in own if sheet.table]


def _design(data: DataSet, name: str) -> Sheet:
    """Every setting of the design, with all its values where sessions differ."""
    values: dict[str, dict[str, None]] = {}
    for sidecar in data.sidecars.values():
        for setting, value in sidecar["Design"].items():
            text = ", ".join(map(str, value)) if isinstance(value, list) else str(value)
            values.setdefault(setting, {})[text] = None
    rows = [[setting, "; ".join(text)] for setting, text in values.items()]
    return listed(f"{name}_design.csv", "Design", ["setting", "value"], rows)


def _files(title: str, blocks: list[Block], sheets: list[Sheet], figures: dict[str, bytes]) -> dict[str, bytes]:
    files = dict(figures)
    files["report.html"] = as_html(title, blocks).encode()
    files["report.md"] = as_markdown(title, blocks).encode()
    for sheet in sheets:
        files[sheet.file] = safe_csv(sheet.digits)
    return files


def _pictures(name: str, files: Mapping[str, bytes]) -> dict[str, bytes]:
    return {f"{name}.{kind}": content for kind, content in files.items()}


def _local(sentence: str, root: Path) -> str:
    """The sentence with paths from the data set's own folder on: a report must not name paths of the machine."""
    return sentence.replace(f"{root}{os.sep}", "")
