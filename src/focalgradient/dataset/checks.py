"""Validation of a data set against its designs, journals and stimuli."""

from __future__ import annotations

import json
import re
from collections import Counter
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import Executor
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from focalgradient.dataset.alike import differences
from focalgradient.dataset.arrival import late_arrivals
from focalgradient.dataset.bids import (
    Files,
    derived_files,
    is_of_this_version,
    journals,
    read_description,
    source_files,
)
from focalgradient.dataset.conduct import asked_for_removal, conduct
from focalgradient.dataset.events import SHA256
from focalgradient.dataset.focus import focus_journals, wrong_focus
from focalgradient.dataset.journal import Log, scan_journal
from focalgradient.dataset.plausible import implausible, is_age, missing_trials, pictures_of
from focalgradient.dataset.read import (
    SessionTable,
    checked_design,
    named_files,
    participants_of,
    read_session,
    sessions_of,
    wrong_kinds,
)
from focalgradient.dataset.replay import replay
from focalgradient.dataset.stimuli import check_stimuli, read_manifest
from focalgradient.dataset.withdrawal import withdrawals
from focalgradient.errors import InputError
from focalgradient.parallel import in_order
from focalgradient.tasks import is_task, unknown_task

__all__ = ["Findings", "checking", "validate"]

BATCH = 25
"""Number of sessions per job."""


SAFE = "no finished trial was lost."
UNSURE = "the content of the truncated lines is unknown."


@dataclass(frozen=True, slots=True)
class Findings:
    """Findings of a validation.

    Parameters
    ----------
    sessions, trials
        Numbers of sessions and of trials.
    problems
        Problems, one sentence each; empty for a valid data set.
    notes
        Remarks that are not problems.
    """

    sessions: int
    trials: int
    problems: tuple[str, ...]
    notes: tuple[str, ...]


def validate(root: Path, stimuli: Path | None = None, *, executor: Executor | None = None) -> Findings:
    """Validate a data set: every trial of its design must be present once, in agreement with the journal.

    All problems are listed, session by session; a damaged session does not prevent the others from being checked.

    Parameters
    ----------
    root
        Folder of the data set.
    stimuli
        Folder of the pictures that were shown, to be checked too.
    executor
        Executor that checks batches of sessions, with the same findings. Its workers must see the folder under the same
        path. None: this process.

    Raises
    ------
    InputError
        If the folder is not a data set, or a worker cannot see it.

    Examples
    --------
    >>> from tempfile import TemporaryDirectory
    >>> from focalgradient.design import BlurThresholdDesign
    >>> from focalgradient.observers import simulate
    >>> with TemporaryDirectory() as folder:
    ...     root = Path(folder, "data")
    ...     _ = simulate(BlurThresholdDesign(), root, observers=2, seed=1)
    ...     validate(root).problems
    ()
    """
    return checking(root, stimuli, executor=executor)()


def checking(root: Path, stimuli: Path | None = None, *, executor: Executor | None = None) -> Callable[[], Findings]:
    """Start validation, with an executor if given; return a function that waits for the findings: see `validate`."""
    root = Path(root)
    checked = _Checked(root, bool(read_description(root).get("Simulated")))
    of_files = set(sessions_of(root))
    unknown: dict[str, list[Path]] = {}
    for path in journals(root):
        files = named_files(root, path.with_suffix(".tsv").name)
        if files is not None and not is_task(files.task):
            unknown.setdefault(files.task, []).append(path)
            checked.labels.add(files.participant)
        elif files is None or files.journal != path:
            checked.problems.append(f"{path} is not in the folder that its name requires: move it back there.")
        else:
            of_files.add(files)
    for task, paths in unknown.items():
        others = f" and {len(paths) - 1} more" if len(paths) > 1 else ""
        verb = "are" if others else "is"
        checked.problems.append(f"{paths[0]}{others} {verb} of a task {unknown_task(task, 'validate')}")
    of_focus = focus_journals(root)
    for path in of_focus:
        checked.problems += wrong_focus(root, path)
        checked.labels.add(path.name.partition("_")[0].removeprefix("sub-"))
    for path in sorted({*source_files(root, "*.jsonl")} - {*journals(root), *of_focus}):
        checked.problems.append(f"{path} does not have the name of a journal: move it out of the data set.")
    ordered = sorted(of_files, key=lambda one: one.name)
    place = root if executor is None else root.absolute()  # workers may have another working folder
    there = [replace(files, root=place) for files in ordered]
    jobs = [(place, checked.simulated, there[first : first + BATCH]) for first in range(0, len(there), BATCH)]
    return partial(_ended, checked, in_order(executor, _check_sessions, jobs), stimuli, len(of_files) + len(of_focus))


def _ended(checked: _Checked, parts: Iterator[_Checked], stimuli: Path | None, sessions: int) -> Findings:
    for part in parts:
        checked.add(part)
    checked.alike()
    checked.people()
    if stimuli is not None:
        shown = {stated["StimuliSHA256"] for _, stated in checked.stated.values()}
        checked.problems += _other_stimuli(stimuli, shown)
    if gone := len(withdrawals(checked.root)):
        checked.notes.append(
            f"{gone} {'participant' if gone == 1 else 'participants'} withdrew; the data were removed."
        )
    return Findings(sessions, checked.trials, tuple(checked.problems), (*checked.notes, *checked.dropped()))


def _check_sessions(job: tuple[Path, bool, list[Files]]) -> _Checked:
    root, simulated, sessions = job
    if not (root / "dataset_description.json").exists():
        raise InputError(f"a worker cannot see {root}: give a path that is the same on every machine.")
    checked = _Checked(root, simulated)
    for files in sessions:
        checked.session(files)
    return checked


class _Checked:
    """Running validation: the findings so far, and data for comparisons between sessions."""

    def __init__(self, root: Path, simulated: bool):
        self.root = root
        self.simulated = simulated
        self.kind = "simulated" if simulated else "human"
        self.problems: list[str] = []
        self.notes: list[str] = []
        self.trials = 0
        self.late: Counter[str] = Counter()
        self.manifests: dict[str, tuple[list[str], dict[tuple[str, ...], str], frozenset[str]]] = {}
        self.stated: dict[Files, tuple[str, dict[str, Any]]] = {}
        self.labels: set[str] = set()
        self.to_resume: set[str] = set()

    def add(self, other: _Checked) -> None:
        """Add the findings of other sessions, with paths as in this data set."""

        def named(sentence: str) -> str:
            return sentence.replace(str(other.root), str(self.root))

        self.problems += map(named, other.problems)
        self.notes += map(named, other.notes)
        self.trials += other.trials
        self.late += other.late
        self.manifests |= other.manifests
        self.stated |= {files: (named(where), stated) for files, (where, stated) in other.stated.items()}
        self.labels |= other.labels
        self.to_resume |= other.to_resume

    def session(self, files: Files) -> None:
        """Check one session."""
        self.labels.add(files.participant)
        log = self._journal(files)
        if not files.table.exists():
            self.problems.append(
                f"{files.journal} has no table: resume the session, or write the table with 'focalgradient "
                "validate --export'."
            )
            self.to_resume.add(files.participant)
            if log is not None:
                self._follow(files, log, None)
            return
        found = read_session(files)
        self.problems += found.problems
        if found.sidecar.get("Simulated", self.simulated) is not self.simulated:
            self.problems.append(
                f"{files.sidecar}: Simulated disagrees with dataset_description.json: restore the wrong one."
            )
        if log is not None:
            self.problems += self._derived(files, log)
        self._follow(files, log, found)

    def _derived(self, files: Files, log: Log) -> Iterator[str]:
        """Compare the files derived from a journal with it."""
        made = derived_files(log, files)
        folder, beside = files.table.parent, (files.beside(end).name for end in ("recording-*", "events.*"))
        there = {files.table, files.sidecar}.union(*map(folder.glob, beside))
        wording = is_of_this_version(log)
        for path in sorted({*made, *there}):
            if path not in there:
                yield f"{path} is missing: write it with 'focalgradient validate --export'."
            elif path not in made:
                yield f"{path} is not derived from its journal, which has no gaze: move it away."
            else:
                try:
                    yield from (f"{path}: {each}" for each in differences(path, made[path], wording=wording))
                except InputError as error:
                    if path not in (files.table, files.sidecar):  # which are named already
                        yield str(error)

    def _journal(self, files: Files) -> Log | None:
        """Read a session's journal; None if it is unusable."""
        path = files.journal
        if not path.exists():
            self.problems.append(
                f"{files.table} has no journal to compare it with: restore {path.relative_to(self.root)} from a copy."
            )
            return None
        try:
            log = scan_journal(path)
        except InputError as error:
            self.problems.append(str(error))
            return None
        self.problems += [*log.damaged, *log.changed]
        if not log.events:
            return None
        head = log.head
        own = (head["design"]["task"], head["participant"], head["session"])
        if own != (files.task, files.participant, files.session):
            self.problems.append(
                f"{path} belongs to a participant, session or task other than that of its name: restore it."
            )
            return None
        if (head["kind"] == "simulated") != self.simulated:
            kind = head["kind"]
            self.problems.append(f"{path}: its kind is {kind}, but dataset_description.json says {self.kind}.")
        self.notes += [f"{path}: {sentence}" for sentence in conduct(log)]
        if asked_for_removal(log.events):
            self.problems.append(
                f"{path}: the participant asked for removal of the answers: run 'focalgradient withdraw {self.root} "
                f"sub-{files.participant}'."
            )
        if any(note.get("kind") == "same identifier" for note in log.of("note")):
            self.notes.append(
                f"{path}: someone else joined with the same platform identifier: check in the file of links "
                "whether one person took part twice."
            )
        if log.broken and not (log.damaged or log.changed):
            # The chain shows that a resumed session continued directly after the last whole line.
            safe = log.lines[-1] > log.broken[-1]
            lines = f"the session was interrupted {len(log.broken)} {'time' if len(log.broken) == 1 else 'times'}"
            self.notes.append(f"{path}: {lines}; {SAFE if safe else UNSURE}")
        for event in log.of("repaired"):
            left = " ".join(event.get("left_out", ())) or "nothing was left out."
            self.notes.append(f"{path} was repaired on {str(event.get('time'))[:10]}: {left}")
        return None if log.damaged else log

    def _follow(self, files: Files, log: Log | None, found: SessionTable | None) -> None:
        """Check a session against its design."""
        sidecar = found.sidecar if found is not None else {}
        stated = log.head["design"] if log is not None else sidecar.get("Design")
        if not stated:
            return
        where = files.table if found is not None else files.journal
        try:
            design = checked_design(str(where), stated)
            if design.task != files.task:
                raise InputError(f"{where}: the design is of {design.task}.")
            trials = design.trials(files.participant, files.session)
        except InputError as error:
            self.problems.append(str(error))
            return
        sha256 = log.head["stimuli"] if log is not None else sidecar.get("StimuliSHA256")
        self.stated[files] = (str(where), {"Design": stated, "StimuliSHA256": sha256})
        if log is not None:
            self.problems += [f"{log.path}, {found.sentence}" for found in replay(log, design, trials)]
            if (waited := late_arrivals(log, design, trials)) is not None:
                self.notes.append(f"{log.path}: {waited}")
        if found is None or len(found.columns) < len(found.expected):
            return
        first = found.columns["trial"]
        self.trials += len(set(first.tolist()))
        self.late[files.task] += len(set(first[found.columns["dropped_frames"] > 0].tolist()))
        self.problems += [f"{files.table}: {sentence}" for sentence in self._pictures(files, sha256, found)]
        if log is None:
            main = [trial for trial in trials if trial.phase == "main"]
            missing = missing_trials([("main", number) for number in dict.fromkeys(first.tolist())], main)
            self.problems += [f"{files.table}: {sentence}" for sentence in missing]
            return
        recorded = [(event["phase"], event["trial"]) for event in log.of("trial")]
        sentences = [*missing_trials(recorded, trials), *implausible(log, design, trials, self._shown(sha256))]
        self.problems += [f"{log.path}: {sentence}" for sentence in sentences]

    def _shown(self, sha256: str | None) -> dict[tuple[str, ...], str]:
        return {} if sha256 is None else self.manifests.get(sha256, ([], {}, frozenset()))[1]

    def _pictures(self, files: Files, sha256: Any, found: SessionTable) -> Iterator[str]:
        """Check the manifest of a session's pictures, each manifest once."""
        named = {name for name in found.columns.get("stimulus", np.array([], object)).tolist() if name is not None}
        if sha256 is None:
            if named:
                yield "it names pictures, but not their manifest: restore it."
            return
        if not (isinstance(sha256, str) and re.fullmatch(SHA256, sha256)):
            yield f"StimuliSHA256 is {str(sha256)[:80]!r}, but must be a SHA-256 in hexadecimal."
            return
        if sha256 not in self.manifests:
            self.manifests[sha256] = self._manifest(files.manifest(sha256), sha256)
        wrong, _, names = self.manifests[sha256]
        yield from wrong
        strange = sorted(named - names) if names else []
        if strange:
            yield f"its picture {strange[0]} is not in {files.manifest(sha256)}."

    def _manifest(self, path: Path, sha256: str) -> tuple[list[str], dict[tuple[str, ...], str], frozenset[str]]:
        try:
            manifest = read_manifest(path)
        except InputError as error:
            return [str(error)], {}, frozenset()
        wrong = [] if manifest.sha256 == sha256 else [f"{path} has changed since the session: restore it from a copy."]
        return wrong, pictures_of(path), frozenset(manifest.files)

    def alike(self) -> None:
        """Check that all participants of one task and session had the same design and set of pictures."""
        groups: dict[tuple[str, str | None], dict[Files, dict[str, Any]]] = {}
        for files, (_, stated) in self.stated.items():
            groups.setdefault((files.task, files.session), {})[files] = stated
        for group in groups.values():
            texts = {files: json.dumps(_without_list(stated), sort_keys=True) for files, stated in group.items()}
            usual = Counter(texts.values()).most_common(1)[0][0]
            like = next(files for files, text in texts.items() if text == usual)
            for files, text in texts.items():
                if text != usual:
                    keys = ", ".join(_differing(group[files], group[like]))
                    where = self.stated[files][0]
                    self.problems.append(
                        f"{where}: {keys} differ from those of sub-{like.participant}: keep different designs in "
                        "data sets of their own."
                    )

    def people(self) -> None:
        """Check ``participants.tsv``."""
        path = self.root / "participants.tsv"
        try:
            table = participants_of(path)
        except InputError as error:
            self.problems.append(str(error))
            return
        names = [str(name) for name in table["participant_id"]]
        wrong = wrong_kinds(table, path)
        self.problems += wrong.values()
        self.problems += [
            f"participants.tsv: {name} is {kind}, but dataset_description.json says {self.kind}."
            for name, kind in zip(names, table["kind"], strict=True)
            if name not in wrong and kind != self.kind
        ]
        if "age" in table:
            for row, age in enumerate(table["age"].tolist(), start=2):
                if not is_age(age):
                    self.problems.append(f"{path}, row {row}: age is {age}, but must be a number of years, or n/a.")
        self.problems += [
            f"{path}: {name} occurs {count} times: keep one row." for name, count in Counter(names).items() if count > 1
        ]
        known = {name.removeprefix("sub-") for name in names}
        self.problems += [  # resuming an interrupted session also adds its missing row
            f"{path}: sub-{label} is missing: add a row, with its kind."
            for label in sorted(self.labels - known - self.to_resume)
        ]
        numbers: dict[str, str] = {}
        for label in sorted(self.labels | known):
            if label.isascii() and label.isdigit():
                other = numbers.setdefault(label.lstrip("0"), label)
                if other != label:
                    self.problems.append(
                        f"sub-{other} and sub-{label} are the same number, and had the same trial order: merge them, "
                        "or rename one."
                    )
        absent = sorted(known - self.labels)
        if absent:
            self.notes.append(f"{path}: sub-{absent[0]} has no session ({len(absent)} such).")

    def dropped(self) -> Iterator[str]:
        """Yield the number of trials with dropped frames, by task."""
        for task, late in self.late.items():
            if late:
                trials = "trial" if late == 1 else "trials"
                yield f"{late} {trials} of {task} had dropped frames (column dropped_frames); none is excluded."


def _without_list(stated: Mapping[str, Any]) -> dict[str, Any]:
    """Return a session's design and pictures without a given list of trials, which may differ between participants."""
    design = {key: value for key, value in stated["Design"].items() if key != "given_trials"}
    return {**stated, "Design": design}


def _differing(one: Mapping[str, Any], other: Mapping[str, Any]) -> Iterator[str]:
    """Yield the keys in which two designs and sets of pictures differ."""
    if one["StimuliSHA256"] != other["StimuliSHA256"]:
        yield "StimuliSHA256"
    own, usual = one["Design"], other["Design"]
    yield from sorted(key for key in {*own, *usual} - {"given_trials"} if own.get(key) != usual.get(key))


def _other_stimuli(stimuli: Path, manifests: set[Any]) -> Iterator[str]:
    try:
        sha256 = check_stimuli(stimuli).sha256
    except InputError as error:
        yield str(error)
        return
    if manifests == {None}:
        yield f"{stimuli} cannot be compared, as the sessions name no pictures: leave it out."
    elif sha256 not in manifests:
        yield (
            f"{stimuli} is not the set of pictures that was shown: no session names its manifest ({sha256[:12]}); "
            "give another folder."
        )
