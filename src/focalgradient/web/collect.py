"""Sessions of an exported study brought into a data set: the journals and tables that a server would have written.

All is checked, by recording it once out of sight, before anything is written. What is there already is not added twice;
a session that has gone on since is gone on with.
"""

from __future__ import annotations

import json
import tempfile
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from focalgradient.dataset import Apparatus, Files, Journal, Manifest, Session, check_stimuli, export, read_journal
from focalgradient.dataset.bids import add_participant, begin_dataset, check_folder, check_participant
from focalgradient.dataset.journal import create_whole, make_folder, whole_lines, writing
from focalgradient.dataset.withdrawal import has_withdrawn, record_of
from focalgradient.design import DepthRatingDesign, Design, NeckerDesign, Trial, recorded_design
from focalgradient.design.form import check_about
from focalgradient.errors import InputError
from focalgradient.files import printable
from focalgradient.stimuli import StimulusSet, read_set
from focalgradient.tasks import task_named
from focalgradient.web import texts
from focalgradient.web.answers import about_sitting, apparatus_of, first_problem, record
from focalgradient.web.lists import digest_of
from focalgradient.web.messages import Answered, Begun, Resumed
from focalgradient.web.results import read_results

__all__ = ["Collected", "LeftOut", "collect"]


@dataclass(frozen=True, slots=True)
class Collected:
    """A session that is in the data set.

    Parameters
    ----------
    participant
        Its label.
    session
        Its name at the platform's files.
    trials
        How many its list has, practice among them.
    answered
        How many of them are answered.
    added
        How many of these answers are new to the data set.
    """

    participant: str
    session: str
    trials: int
    answered: int
    added: int


@dataclass(frozen=True, slots=True)
class LeftOut:
    """A session, or the end of one, that is not in the data set, and why, in a sentence."""

    session: str
    why: str


@dataclass(frozen=True, slots=True)
class _Given:
    """A session as files give it: its first line, and all that follow without a gap."""

    begun: Begun
    more: tuple[Resumed | Answered, ...]

    @property
    def answered(self) -> int:
        return sum(isinstance(line, Answered) for line in self.more)


class _Study:
    """What all sessions share: the design, its pictures."""

    def __init__(self, sessions: Sequence[_Given], stimuli: Path | None):
        first = sessions[0].begun
        for given in sessions:
            if (given.begun.design, given.begun.stimuli) != (first.design, first.stimuli):
                raise InputError(
                    f"sessions {first.session} and {given.begun.session} have two designs: collect one study at a time."
                )
        self.design: Design = recorded_design(f"session {first.session}", first.design)
        if not (isinstance(self.design, DepthRatingDesign | NeckerDesign) or task_named(self.design.task).described):
            raise InputError(f"session {first.session} is of {self.design.task}, which no browser runs: leave it out.")
        self.manifest: Manifest | None = None
        self.pictures: StimulusSet | None = None
        if isinstance(self.design, DepthRatingDesign):
            texts.check(self.design)
            if stimuli is None:
                raise InputError(
                    "depth rating shows pictures: give the folder of pictures that the study was made with."
                )
            self.manifest = check_stimuli(stimuli)
            self.pictures = read_set(stimuli)
        if first.stimuli != (self.manifest and self.manifest.sha256):
            raise InputError(
                f"session {first.session} was shown other pictures than those of {stimuli}: give the folder "
                "that the study was made with."
            )

    def trials(self, begun: Begun) -> tuple[Trial, ...]:
        """A session's trial list, which must be the design's for its label."""
        trials: tuple[Trial, ...] = self.design.trials(begun.participant)
        if digest_of(trials) != begun.list:
            raise InputError(
                f"session {begun.session} had another trial list than its design gives to {begun.participant}: collect "
                "it with the version of focalgradient that exported it."
            )
        return trials

    def record(self, given: _Given, root: Path) -> Path:
        """Record a session into a folder of its own; gives its journal."""
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
                else:
                    self._answer(session, line)
        finally:
            session.__exit__()
        return session.files.journal

    def _answer(self, session: Session, line: Answered) -> None:
        given, remaining = line.given, session.remaining()
        if not remaining or (given.phase, given.trial) != (remaining[0].phase, remaining[0].trial):
            raise InputError(f"trial {given.trial} ({given.phase}) is not the next")
        record(session, self.pictures, given)


def _apparatus(line: Begun | Resumed) -> Apparatus:
    return apparatus_of(line.sitting, platform=line.platform)


def _note_sitting(session: Session, line: Begun | Resumed) -> None:
    about = {**about_sitting(line.sitting), "consent": line.sitting.consent}
    session.note("sitting", **about, platform=line.platform, record=line.session)


def collect(paths: Sequence[Path], data: Path, stimuli: Path | None = None) -> tuple[list[Collected], list[LeftOut]]:
    """Bring the sessions in a platform's files into a data set.

    Parameters
    ----------
    paths
        Of what JATOS, DataPipe or Pavlovia gave, as it is.
    data
        Folder of the data set: new, empty, or one of people.
    stimuli
        Folder of the pictures that the study was made with; depth rating needs it.

    Returns
    -------
    collected, left_out
        Sessions that are in the data set now, by label; and what was left out.

    Raises
    ------
    InputError
        If something in the files is none of an exported study's, or the data set cannot take it; nothing is
        written then.
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


def _whole(name: str, lines: Mapping[int, Begun | Resumed | Answered], left: list[LeftOut]) -> _Given | None:
    """A session's lines up to the first that is missing."""
    begun = lines.get(0)
    if begun is None:
        left.append(LeftOut(name, "its beginning is missing: give all files of the session."))
        return None
    if not isinstance(begun, Begun):
        raise InputError(f"session {name} does not begin as a session does: leave its results out.")
    more: list[Resumed | Answered] = []
    while (line := lines.get(len(more) + 1)) is not None:
        if isinstance(line, Begun):
            raise InputError(f"session {name} begins twice: leave its results out.")
        more.append(line)
    if len(lines) > len(more) + 1:
        rest = len(lines) - len(more) - 1
        left.append(
            LeftOut(name, f"{rest} of its lines follow line {len(more) + 1}, which is missing: give all its files.")
        )
    return _Given(begun, tuple(more))


def _chosen(sessions: Sequence[_Given], study: _Study, data: Path, left: list[LeftOut]) -> list[_Given]:
    """One session a label: that which is in the data set, or the one with most answers, of those the earliest."""
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
            best = record_of(read_journal(journal))
        for given in several:
            if given.begun.session == best:
                chosen.append(given)
                continue
            why = f"list {label} was used by {f'session {best}' if best else 'another session'}, which sub-{label} is"
            left.append(LeftOut(given.begun.session, f"{why}: its {given.answered} answers stay in the files."))
    return chosen


def _there(place: Path, made: Path) -> int:
    """How many events of a session the data set has already; all must be as those that were made.

    Raises
    ------
    InputError
        If one differs.
    """
    if not place.exists():
        return 0
    old, new = (_content(path) for path in (place, made))
    common = min(len(old), len(new))
    if old[:common] != new[:common]:
        raise InputError(f"{place} holds something else than these results: see which of them was changed.")
    return len(old)


def _content(journal: Path) -> list[str]:
    """Events of a journal, but for the versions of what they were collected with."""
    events = read_journal(journal).events
    return [json.dumps({key: value for key, value in event.items() if key != "versions"}) for event in events]


def _written(study: _Study, given: _Given, files: Files, made: Path, there: int) -> Collected:
    """Bring a session that was made out of sight into the data set, or what the data set has not of it."""
    participant, new = given.begun.participant, read_journal(made).events
    with writing(files.root):
        if not there:
            begin_dataset(files.root, "human")
            if study.manifest is not None:
                make_folder(files.manifest(study.manifest.sha256).parent)
                with suppress(FileExistsError):
                    create_whole(files.manifest(study.manifest.sha256), study.manifest.content)
            make_folder(files.journal.parent)
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
