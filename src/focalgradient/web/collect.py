"""Import of an exported study's sessions into a data set, as the journals and tables that a server would write.

All sessions are first checked by recording them in a temporary folder. Sessions that the data set already contains are
not added again; those that have continued since are extended.
"""

from __future__ import annotations

import json
import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from focalgradient.dataset import Apparatus, Files, Journal, Session, export, read_journal
from focalgradient.dataset.bids import add_participant, begin_dataset, check_folder, check_participant
from focalgradient.dataset.journal import create_whole, whole_lines, writing
from focalgradient.dataset.withdrawal import has_withdrawn, record_of
from focalgradient.design import Design, Trial, check_design
from focalgradient.design.form import check_about
from focalgradient.errors import InputError, located
from focalgradient.files import printable
from focalgradient.web.answers import about_sitting, apparatus_of, expose, first_problem, record
from focalgradient.web.lists import Lists, digest_of
from focalgradient.web.messages import Answered, Begun, Exposed, Record, Resumed
from focalgradient.web.results import read_results

__all__ = ["Collected", "LeftOut", "collect"]


@dataclass(frozen=True, slots=True)
class Collected:
    """Session that has been imported into the data set.

    Parameters
    ----------
    participant
        Label of the participant.
    session
        Identifier of the session in the platform's files.
    trials
        Number of trials in its list, including practice.
    answered
        Number of trials with a response.
    added
        Number of responses that were new to the data set.
    """

    participant: str
    session: str
    trials: int
    answered: int
    added: int


@dataclass(frozen=True, slots=True)
class LeftOut:
    """Session, or end of a session, that was not imported, and the reason as a sentence."""

    session: str
    why: str


@dataclass(frozen=True, slots=True)
class _Given:
    """Session in a platform's files: its first line, and all that follow without a gap."""

    begun: Begun
    more: tuple[Resumed | Exposed | Answered, ...]

    @property
    def answered(self) -> int:
        return sum(isinstance(line, Answered) for line in self.more)


class _Study:
    """Design and pictures, which all sessions share."""

    def __init__(self, sessions: Sequence[_Given], stimuli: Path | None):
        first = sessions[0].begun
        for given in sessions:
            if (given.begun.design, given.begun.stimuli) != (first.design, first.stimuli):
                raise InputError(
                    f"sessions {first.session} and {given.begun.session} have different designs or pictures: collect "
                    "one study at a time."
                )
        self.design: Design = check_design(f"session {first.session}", first.design)
        with located(f"session {first.session}"):
            lists = Lists(self.design, stimuli)
        self.manifest, self.pictures = lists.manifest, lists.pictures
        if first.stimuli != (self.manifest and self.manifest.sha256):
            raise InputError(
                f"session {first.session} showed pictures other than those of {stimuli}: give the folder "
                "that the study was exported with."
            )

    def trials(self, begun: Begun) -> tuple[Trial, ...]:
        """Return a session's trial list, which must be the design's list for its label."""
        trials: tuple[Trial, ...] = self.design.trials(begun.participant)
        if digest_of(trials) != begun.list:
            raise InputError(
                f"session {begun.session} had a trial list other than its design's for {begun.participant}: collect "
                "it with the version of focalgradient that exported it."
            )
        return trials

    def record(self, given: _Given, root: Path) -> Path:
        """Record a session in a separate folder; return its journal."""
        begun = given.begun
        self.trials(begun)
        shared: dict[str, Any] = {"stimuli": self.manifest, "durable": False}
        about = begun.sitting.about
        check_about(about, self.design.ask)
        session = Session.begin(
            *(root, self.design, begun.participant), apparatus=_apparatus(begun), time=begun.time, about=about, **shared
        )
        _note_sitting(session, begun)
        try:
            for line in given.more:
                if isinstance(line, Resumed):
                    session.__exit__()
                    session = Session.resume(
                        root, self.design.task, begun.participant, apparatus=_apparatus(line), time=line.time, **shared
                    )
                    _note_sitting(session, line)
                elif isinstance(line, Exposed):
                    expose(session, line.shown)
                else:
                    self._answer(session, line)
        finally:
            session.__exit__()
        return session.files.journal

    def _answer(self, session: Session, line: Answered) -> None:
        given, remaining = line.given, session.remaining()
        if not remaining or (given.phase, given.trial) != (remaining[0].phase, remaining[0].trial):
            raise InputError(f"trial {given.trial} ({given.phase}) is not the next trial")
        record(session, self.pictures, given, practice=given.practice)


def _apparatus(line: Begun | Resumed) -> Apparatus:
    return apparatus_of(line.sitting, platform=line.platform)


def _note_sitting(session: Session, line: Begun | Resumed) -> None:
    about = {**about_sitting(line.sitting), "consent": line.sitting.consent}
    session.note("sitting", **about, platform=line.platform, record=line.session)


def collect(paths: Sequence[Path], data: Path, stimuli: Path | None = None) -> tuple[list[Collected], list[LeftOut]]:
    """Import the sessions in a platform's files into a data set.

    Parameters
    ----------
    paths
        Files downloaded from JATOS, DataPipe or Pavlovia, unchanged.
    data
        Folder of the data set: new, empty, or with human data.
    stimuli
        Folder of the study's pictures; required for depth rating.

    Returns
    -------
    collected, left_out
        Sessions now in the data set, by label; and sessions left out.

    Raises
    ------
    InputError
        If a file contains lines that are not those of an exported study, or the data set cannot be extended; nothing is
        then written.
    """
    left: list[LeftOut] = []
    sessions = [
        given for name, lines in sorted(read_results(paths).items()) if (given := _whole(name, lines, left)) is not None
    ]
    if not sessions:
        return [], left
    study = _Study(sessions, stimuli)
    check_folder(data, "human")
    chosen = _chosen(sessions, study, data, left)
    with tempfile.TemporaryDirectory() as hidden:
        made: list[tuple[_Given, Files, Path, int]] = []
        for number, given in enumerate(chosen):
            files = Files(data, study.design.task, given.begun.participant, None)
            try:
                journal = study.record(given, Path(hidden, str(number)))
                check_participant(data, given.begun.participant, "human")
                there = _there(files.journal, journal)
            except ValidationError as error:
                raise _refused(given, printable(first_problem(error))) from error
            except InputError as error:
                raise _refused(given, str(error).replace(hidden, "")) from error
            made.append((given, files, journal, there))
        return [_written(study, *one) for one in made], left


def _refused(given: _Given, why: str) -> InputError:
    return InputError(
        f"session {given.begun.session}: {why.rstrip('.')}; leave its results out, and collect the others."
    )


def _whole(name: str, lines: Mapping[int, Record], left: list[LeftOut]) -> _Given | None:
    """Return a session's lines up to the first missing one."""
    begun = lines.get(0)
    if begun is None:
        left.append(LeftOut(name, "its first line is missing: give all files of the session."))
        return None
    if not isinstance(begun, Begun):
        raise InputError(f"session {name} does not start with its first line: leave its results out.")
    more: list[Resumed | Exposed | Answered] = []
    while (line := lines.get(len(more) + 1)) is not None:
        if isinstance(line, Begun):
            raise InputError(f"session {name} begins twice: leave its results out.")
        more.append(line)
    if len(lines) > len(more) + 1:
        rest = len(lines) - len(more) - 1
        left.append(
            LeftOut(
                name, f"its line {len(more) + 1} is missing, and {rest} after it were not used: give all its files."
            )
        )
    return _Given(begun, tuple(more))


def _chosen(sessions: Sequence[_Given], study: _Study, data: Path, left: list[LeftOut]) -> list[_Given]:
    """Select one session per label: that in the data set, or that with the most responses (the first of several)."""
    by_label: dict[str, list[_Given]] = {}
    for given in sessions:
        by_label.setdefault(given.begun.participant, []).append(given)
    described = (data / "dataset_description.json").exists()
    chosen = []
    for label, every in sorted(by_label.items()):
        gone = [given for given in every if described and has_withdrawn(data, given.begun.session)]
        left += [LeftOut(given.begun.session, "its participant has withdrawn.") for given in gone]
        several = [given for given in every if given not in gone]
        if not several:
            continue
        best: str | None = min(several, key=lambda one: (-one.answered, one.begun.time)).begun.session
        journal = Files(data, study.design.task, label, None).journal
        if journal.exists():
            best = record_of(read_journal(journal).events)
        for given in several:
            if given.begun.session == best:
                chosen.append(given)
                continue
            why = f"list {label} was used by {f'session {best}' if best else 'another session'}, which sub-{label} is"
            left.append(LeftOut(given.begun.session, f"{why}: its {given.answered} answers stay in the files."))
    return chosen


def _there(place: Path, made: Path) -> int:
    """Return the number of a session's events that the data set already has; they must equal the new ones.

    Raises
    ------
    InputError
        If an event differs.
    """
    if not place.exists():
        return 0
    old, new = (_content(path) for path in (place, made))
    common = min(len(old), len(new))
    if old[:common] != new[:common]:
        raise InputError(f"{place} differs from these results: check which of the two was changed.")
    return len(old)


def _content(journal: Path) -> list[str]:
    """Return a journal's events, without the software versions used to collect them."""
    events = read_journal(journal).events
    return [json.dumps({key: value for key, value in event.items() if key != "versions"}) for event in events]


def _written(study: _Study, given: _Given, files: Files, made: Path, there: int) -> Collected:
    """Write a session, or the part of it that the data set lacks, to the data set."""
    participant, new = given.begun.participant, read_journal(made).events
    with writing(files.root):
        if not there:
            begin_dataset(files.root, "human")
            if study.manifest is not None:
                files.keep_manifest(study.manifest.sha256, study.manifest.content)
            create_whole(files.journal, made.read_bytes())
        elif there < len(new):
            with Journal.take(files.journal):
                old = read_journal(files.journal).events
                create_whole(files.journal, whole_lines([*old, *new[there:]]), replace=True)
        add_participant(files.root, participant, {"kind": "human", **given.begun.sitting.about})
    if there < len(new) or not files.table.exists():
        export(files.journal)
    added = sum(event["event"] == "trial" for event in new[there:])
    return Collected(participant, given.begun.session, len(study.trials(given.begun)), given.answered, added)
