"""The report of a data set: what was done, to whom, what came out and how far it can be relied on.

`make_report` gives the contents of all its files: one HTML page that needs nothing else, the same in Markdown, the
figures, and every table as CSV. The same data give the same bytes.
"""

from __future__ import annotations

import hashlib
import os
import platform
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from importlib.metadata import version
from pathlib import Path
from typing import Any

import pandas as pd

from focalgradient.dataset import Files, validate
from focalgradient.dataset.bids import read_description
from focalgradient.errors import InputError
from focalgradient.plotting.subjects import as_files, depth_rating_figure, necker_figure
from focalgradient.report.analysed import BOUND, Ratings, Reports, analyse_necker, analyse_ratings
from focalgradient.report.document import (
    Block,
    Figure,
    Heading,
    Notice,
    Paragraph,
    Table,
    as_html,
    as_markdown,
)
from focalgradient.report.tables import Sheet, necker_sheets, quality_sheets, rating_sheets
from focalgradient.report.words import counts, methods_necker, methods_ratings, necker_findings, rating_findings
from focalgradient.statistics import NotComputed, Scale

__all__ = ["BOUND", "Report", "analyse_necker", "analyse_ratings", "make_report"]

PACKAGES = ("focalgradient", "numpy", "scipy", "pandas", "statsmodels", "matplotlib")

SHARE_CAPTION = (
    "The turning cube. Left: nonrigid share of the time with one of the two readings, each subject thin, mean and 95 % "
    "interval of the mean bold. Middle: mean shares of all the time. Right: median and middle half of the fitted "
    "distribution of durations."
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
    """

    files: Mapping[str, bytes]
    problems: tuple[str, ...]


def make_report(
    root: str | os.PathLike[str], *, bound: float = BOUND, bound_stated: bool = False, scale: Scale = "ratio"
) -> Report:
    """Analyse a data set and write down all of it.

    Parameters
    ----------
    root
        Its folder.
    bound
        Of equivalence: see `focalgradient.statistics.depth_rating`.
    bound_stated
        Whether that was asked for: a default is told as one.
    scale
        What the ratings are.

    Raises
    ------
    InputError
        If neither experiment can be analysed, for the first reason.
    """
    root = Path(root)
    description = read_description(root)
    refused: list[InputError] = []
    ratings: Ratings | None = None
    reports: Reports | None = None
    if _took_part(root, "depthrating"):
        try:
            ratings = analyse_ratings(root, bound=bound, scale=scale)
        except InputError as error:
            refused.append(error)
    if _took_part(root, "necker"):
        try:
            reports = analyse_necker(root)
        except InputError as error:
            refused.append(error)
    if ratings is None and reports is None:
        raise (
            refused[0]
            if refused
            else InputError(f"{root} holds neither depth ratings nor reports on the cube: there is nothing to report.")
        )
    problems = [str(error) for error in refused]
    notes: list[str] = []
    try:
        found = validate(root)
        problems += found.problems
        notes += found.notes
    except InputError as error:
        problems = list(dict.fromkeys([*problems, str(error)]))
    left_out = [problem for part in (ratings, reports) if part is not None for problem in part.data.problems]
    problems = [f"Left out of the analysis: {one}" if one in left_out else one for one in problems]
    simulated = any(part.simulated for part in (ratings, reports) if part is not None)

    blocks: list[Block] = []
    if simulated:
        blocks.append(Notice("Simulated observers, not people: every answer was computed by a model."))
    blocks += [Notice(f"Problem: {_local(problem, root)}") for problem in problems]
    sheets: list[Sheet] = []
    figures: dict[str, bytes] = {}
    if ratings is not None:
        blocks += _rating_part(ratings, sheets, figures)
    if reports is not None:
        blocks += _necker_part(reports, sheets, figures)
    blocks.append(Heading("Methods"))
    if ratings is not None:
        blocks += [Heading("Depth ratings", 3), *map(Paragraph, methods_ratings(ratings, bound, scale))]
        blocks += _shown([_design(ratings, "depth_rating")], sheets)
        if not bound_stated and scale == "ratio":
            blocks.append(Notice(f"The bound of equivalence, {bound:.3g}, is the default: state your own in advance."))
    if reports is not None:
        blocks += [Heading("Necker cube", 3), *map(Paragraph, methods_necker(reports))]
        blocks += _shown([_design(reports, "necker")], sheets)
    blocks += [Heading("Provenance"), *(Paragraph(_local(note, root)) for note in notes)]
    parts = [part for part in (ratings, reports) if part is not None]
    blocks += _shown(_provenance(root, description, parts, bound), sheets)
    return Report(_files(str(description.get("Name", root.name)), blocks, sheets, figures), tuple(problems))


def _took_part(root: Path, task: str) -> bool:
    return any(root.glob(f"sub-*/**/*_task-{task}_beh.tsv"))


def _rating_part(part: Ratings, sheets: list[Sheet], figures: dict[str, bytes]) -> Iterator[Block]:
    yield Heading("Depth ratings")
    yield Paragraph(counts(part.quality))
    own = quality_sheets(part.quality, "depth_rating")
    if isinstance(part.result, NotComputed):
        yield Notice(part.result.reason)
    else:
        yield from map(Paragraph, rating_findings(part.result))
        figures |= _pictures("depth_rating", as_files(depth_rating_figure(part.result, simulated=part.simulated)))
        ratio = any(mean.ratio is not None for mean in part.result.subject_means)
        what = "Increase in the impression of depth over the pinhole" if ratio else "Ratings of depth"
        bold = "" if not part.result.means else "; geometric mean over subjects and its 95 % interval bold"
        caption = f"{what}, by aperture: each subject thin{bold}."
        yield Figure("depth_rating.png", figures["depth_rating.png"], caption)
        own = [*rating_sheets(part.result), *own]
    yield from _shown(own, sheets)
    if not isinstance(part.result, NotComputed):
        yield from map(Paragraph, part.result.remarks)


def _necker_part(part: Reports, sheets: list[Sheet], figures: dict[str, bytes]) -> Iterator[Block]:
    yield Heading("Necker cube")
    yield Paragraph(counts(part.quality))
    own = quality_sheets(part.quality, "necker")
    if isinstance(part.result, NotComputed):
        yield Notice(part.result.reason)
    else:
        yield from map(Paragraph, necker_findings(part.result))
        figures |= _pictures("necker", as_files(necker_figure(part.result, simulated=part.simulated)))
        yield Figure("necker.png", figures["necker.png"], SHARE_CAPTION)
        own = [*necker_sheets(part.result), *own]
    yield from _shown(own, sheets)
    if not isinstance(part.result, NotComputed):
        yield from map(Paragraph, part.result.remarks)


def _shown(own: Iterable[Sheet], sheets: list[Sheet]) -> list[Block]:
    """The tables to read; their files are put with the others."""
    own = list(own)
    sheets += own
    return [sheet.table for sheet in own if sheet.table]


def _listed(file: str, caption: str, header: list[str], rows: list[list[str]]) -> Sheet:
    return Sheet(file, Table(caption, header, rows, csv=file), pd.DataFrame(rows, columns=header))


def _design(part: Ratings | Reports, name: str) -> Sheet:
    """Every setting of the design, with all its values where sessions differ."""
    values: dict[str, dict[str, None]] = {}
    for sidecar in part.data.sidecars.values():
        for setting, value in sidecar["Design"].items():
            told = ", ".join(map(str, value)) if isinstance(value, list) else str(value)
            values.setdefault(setting, {})[told] = None
    rows = [[setting, "; ".join(told)] for setting, told in values.items()]
    return _listed(f"{name}_design.csv", "Design", ["setting", "value"], rows)


def _provenance(
    root: Path, description: Mapping[str, Any], parts: Sequence[Ratings | Reports], bound: float
) -> Iterator[Sheet]:
    made = [[name, version(name)] for name in PACKAGES] + [["Python", platform.python_version()]]
    yield _listed("versions.csv", "Analysed with", ["what", "version"], made)
    sidecars: dict[Files, Mapping[str, Any]] = {}
    for part in parts:
        sidecars |= part.data.sidecars
    said: dict[str, dict[str, None]] = {"BIDS version": {str(description.get("BIDSVersion", "not stated")): None}}
    for sidecar in sidecars.values():
        said.setdefault(f"seed of {sidecar['TaskName']}", {})[str(sidecar.get("Seed"))] = None
        said.setdefault("stimuli (SHA-256 of the manifest)", {})[str(sidecar.get("StimuliSHA256") or "none")] = None
        for sitting in sidecar.get("Sittings", ()):
            for name, value in sitting.get("Versions", {}).items():
                said.setdefault(f"recorded with {name}", {})[str(value)] = None
    for name, value in asdict(parts[0].quality.rules).items():
        said[f"rule {name}"] = {str(value): None}
    said["bound of equivalence"] = {f"{bound:g}": None}
    told = [[name, ", ".join(values)] for name, values in said.items()]
    yield _listed("data_set.csv", "Data set", ["what", "value"], told)
    hashes = []
    for files in sidecars:
        for path in (files.table, files.sidecar):
            hashes.append([path.relative_to(root).as_posix(), hashlib.sha256(path.read_bytes()).hexdigest()])
    whole = hashlib.sha256("".join(f"{sha}  {name}\n" for name, sha in sorted(hashes)).encode()).hexdigest()
    hashes.append(["all of them together", whole])
    yield _listed("files.csv", "Files analysed", ["file", "SHA-256"], hashes)


def _files(title: str, blocks: list[Block], sheets: list[Sheet], figures: dict[str, bytes]) -> dict[str, bytes]:
    files = dict(figures)
    files["report.html"] = as_html(title, blocks).encode()
    files["report.md"] = as_markdown(title, blocks).encode()
    for sheet in sheets:
        files[sheet.file] = sheet.digits.to_csv(index=False, lineterminator="\n").encode()
    return files


def _pictures(name: str, files: Mapping[str, bytes]) -> dict[str, bytes]:
    return {f"{name}.{kind}": content for kind, content in files.items()}


def _local(sentence: str, root: Path) -> str:
    """The sentence with paths from the data set's own folder on: a report must not tell of the machine."""
    return sentence.replace(f"{root}{os.sep}", "")
