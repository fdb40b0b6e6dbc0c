"""A session as a program runs it: which trial is next, and what was answered, safe before the next begins."""

from __future__ import annotations

import os
import platform
import tempfile
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import asdict
from datetime import UTC, datetime
from importlib.metadata import version
from pathlib import Path
from typing import Any

from focalgradient.dataset.answers import Answer, Apparatus, Response, answer_event
from focalgradient.dataset.bids import (
    Files,
    Kind,
    add_participant,
    begin_dataset,
    check_folder,
    check_participant,
    make_table,
)
from focalgradient.dataset.columns import TIMES
from focalgradient.dataset.events import Event, cell_test
from focalgradient.dataset.journal import Journal, Log, create_whole, make_folder, read_journal, writing
from focalgradient.dataset.stimuli import Manifest, check_stimuli
from focalgradient.design import Design, Trial, recorded_design
from focalgradient.errors import InputError
from focalgradient.tasks import task_named
from focalgradient.tasks.noted import check_noted

__all__ = ["Session"]

RESERVED = frozenset(
    {
        *("participant_id", "session", "simulated", "file", "row", "event", "phase", "presses", "received"),
        *("TaskName", "TaskDescription", "Simulated", "Seed", "Design", "Keys", "StimuliSHA256", "Sittings"),
        *("Participant", "Journal", "Repaired", "Noted"),
        *(column.name for column in TIMES),
    }
)
"""Names with a meaning of their own beside the columns of a table: of its rows, of events, of the sidecar."""

ROOM = 1 << 20
"""Bytes that must be free on the disk before a session begins."""


class Session:
    r"""A session of one participant, being recorded.

    Leaving it as a context closes the journal, and makes table and sidecar of what was recorded, finished or not.

    Examples
    --------
    >>> import tempfile
    >>> from focalgradient.dataset import Rated
    >>> from focalgradient.design import Pinhole
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     begun = Session.begin(Path(folder), Pinhole(), "01", apparatus=Apparatus("seconds from the start"))
    ...     with begun as session:
    ...         for number, trial in enumerate(session.remaining()):
    ...             session.record(trial, Rated(onset=10.0 * number, rating=1.2, response_time=2.0))
    ...     session.files.table.read_text().splitlines()[1].split("\t")[:7]
    ['1', 'real', 'tube', 'room', '1', '0.0', '1.2']
    """

    def __init__(self, files: Files, design: Design, journal: Journal, done: Sequence[Event]):
        self.files = files
        self.design = design
        self.task = task_named(design.task)
        self.trials: tuple[Trial, ...] = design.trials(files.participant, files.session)
        self._journal = journal
        self._recorded: list[Event] = list(done)

    @classmethod
    def check(
        cls,
        root: Path,
        design: Design,
        participant: str,
        session: str | None = None,
        *,
        resume: bool = False,
        kind: Kind = "human",
        stimuli: Path | None = None,
    ) -> Design:
        """Say what is wrong before the participant waits: raise what `begin` or `resume` would, and record nothing.

        Parameters
        ----------
        root, design, participant, session, kind, stimuli
            As for `begin`.
        resume
            Whether the session is to be resumed; of `design` only the task counts then.

        Returns
        -------
        Design
            The one that is going to be run: with `resume` that of the session.

        Raises
        ------
        InputError
            As `begin` or `resume` does; also if the disk is full.

        Examples
        --------
        >>> from focalgradient.design import Pinhole
        >>> Session.check(Path("nowhere-yet"), Pinhole(), "01").task
        'pinhole'
        """
        files = Files(root, design.task, participant, session)
        if resume:
            with Journal.take(files.journal):
                _, design, _ = _to_resume(files, stimuli)
        else:
            _new(files, stimuli)
            check_folder(root, kind)
            check_participant(root, participant, kind)
        base = next(folder for folder in (root.absolute(), *root.absolute().parents) if folder.exists())
        with writing(root), tempfile.TemporaryFile(dir=base) as file:
            file.write(bytes(ROOM))
            file.flush()
            os.fsync(file.fileno())
        return design

    @classmethod
    def begin(
        cls,
        root: Path,
        design: Design,
        participant: str,
        session: str | None = None,
        *,
        apparatus: Apparatus,
        kind: Kind = "human",
        stimuli: Path | Manifest | None = None,
        about: Mapping[str, Any] | None = None,
        time: datetime | None = None,
        durable: bool = True,
    ) -> Session:
        """Begin a session, and the data set where it is missing.

        Parameters
        ----------
        root
            Folder of the data set.
        design
            What to run.
        participant, session
            Labels: letters and digits.
        apparatus
            What it is run with.
        kind
            Whether a person answers. What is simulated can be computed again, and is not waited for on the disk.
        stimuli
            Folder of the pictures, which are checked against their manifest; or that, once checked.
        about
            Of the participant, for ``participants.tsv``: age (years), sex, handedness.
        time
            When it began, where that is not now.
        durable
            Whether each answer of a person is waited for on the disk.

        Raises
        ------
        InputError
            If a label is not alphanumeric, the session is there already, the pictures have changed, the folder is no
            data set or one of the other kind, or cannot be written.
        """
        files = Files(root, design.task, participant, session)
        manifest = _new(files, stimuli)
        with writing(root):
            begin_dataset(root, kind)
            check_participant(root, participant, kind)
            if manifest is not None:
                make_folder(files.manifest(manifest.sha256).parent)
                with suppress(FileExistsError):
                    create_whole(files.manifest(manifest.sha256), manifest.content)
        head = _event(
            "begun",
            apparatus,
            time,
            participant=participant,
            session=session,
            kind=kind,
            design=design.of(participant).model_dump(mode="json"),
            keys=design.keys_of(participant) if task_named(design.task).percepts else None,  # type: ignore[union-attr]
            stimuli=None if manifest is None else manifest.sha256,
            about=dict(about or {}),
        )
        try:
            journal = Journal.begin(files.journal, head, durable=durable and kind == "human")
        except FileExistsError as error:
            raise _taken(files, files.journal) from error
        try:
            with writing(root):
                add_participant(root, participant, {"kind": kind, **(about or {})})
        except InputError:
            journal.close()
            raise
        return cls(files, design, journal, ())

    @classmethod
    def resume(
        cls,
        root: Path,
        task: str,
        participant: str,
        session: str | None = None,
        *,
        apparatus: Apparatus,
        stimuli: Path | Manifest | None = None,
        time: datetime | None = None,
        durable: bool = True,
    ) -> Session:
        """Go on with a session that was cut off, by the design that it began with, after its last finished trial.

        Parameters
        ----------
        root, participant, session
            As it began.
        task
            Of its design.
        apparatus
            What this sitting is run with.
        stimuli
            Folder of the pictures, which must still be the same; or their manifest, once checked.
        time, durable
            As for `begin`.

        Raises
        ------
        InputError
            If there is no such session, another program records it, it is finished, its journal is damaged, or the
            pictures have changed.
        """
        files = Files(root, task, participant, session)
        journal = Journal.take(files.journal)
        try:
            log, design, done = _to_resume(files, stimuli)
            kind = log.head["kind"]
            with writing(root):  # a kill may have come before the row
                add_participant(root, participant, {"kind": kind, **log.head.get("about", {})})
            journal.resume(log, _event("resumed", apparatus, time), durable=durable and kind == "human")
        except BaseException:
            journal.close()
            raise
        return cls(files, design, journal, done)

    def remaining(self) -> tuple[Trial, ...]:
        """Trials still to be run, practice among them, in their order."""
        return self.trials[len(self._recorded) :]

    @property
    def recorded(self) -> tuple[Event, ...]:
        """The trials recorded so far with their answers, in order, from which an adaptive procedure is replayed."""
        return tuple(self._recorded)

    def record(
        self, trial: Trial, answer: Answer, *, notes: Sequence[tuple[str, Mapping[str, Any]]] = (), **noted: Any
    ) -> None:
        """Write what was answered in the next trial, and come back when it is safe.

        What is `noted` beside it, as the times of a second clock, stays in the journal. So do `notes`, each a kind
        and its content: they are written before it as `note` would write them, but the disk is waited for once.

        Raises
        ------
        InputError
            If it is not that trial's turn, the answer is not of its kind, or it cannot be written.
        """
        self.check_answer(trial, answer)
        event = {**noted, "event": "trial", **asdict(trial), **answer_event(answer)}
        self._journal.write(*(_note(kind, about) for kind, about in notes), event)
        self._recorded.append(event)

    def check_answer(self, trial: Trial, answer: Answer) -> None:
        """Raise what `record` would for this answer, and record nothing."""
        done = len(self._recorded)
        if done == len(self.trials) or trial != self.trials[done]:
            raise InputError(f"trial {trial.trial} ({trial.phase}) is not the next: record the trials in their order.")
        if not isinstance(answer, self.task.answer):
            raise InputError(f"the answer is {type(answer).__name__}, which {self.design.task} does not ask for.")
        if isinstance(answer, Response):
            for column in self.task.columns(None):
                value = getattr(answer, column.name, None)
                if hasattr(answer, column.name) and not cell_test(column)(value):
                    raise InputError(f"{column.name} is {value!r}, but must be {column.expected}.")
        if answer.extra:
            taken = RESERVED | {column.name for column in self.task.columns(self.design.model_dump(mode="json"))}
            if wrong := sorted(taken & {*answer.extra}):
                raise InputError(f"{wrong[0]!r} has a meaning in the data set already: note it by another name.")
            check_noted([*self._recorded, answer_event(answer)])
        self.task.check_answer(self.design, trial, answer)

    def note(self, kind: str, **content: Any) -> None:
        """Write down something else that happened, as a break or a marker sent; it stays in the journal."""
        self._journal.write(_note(kind, content))

    def __enter__(self) -> Session:
        return self

    def __exit__(self, *error: object) -> None:
        # While the journal is still ours: whoever resumes the session next makes a longer table.
        with self._journal:
            make_table(self.files.journal)


def _new(files: Files, stimuli: Path | Manifest | None) -> Manifest | None:
    """Make sure that a session is not there yet, and that its pictures are as they were made."""
    there = next((path for path in (files.journal, files.table) if path.exists()), None)
    if there is not None:
        raise _taken(files, there)
    return check_stimuli(stimuli) if isinstance(stimuli, Path) else stimuli


def _taken(files: Files, there: Path) -> InputError:
    return InputError(
        f"{there} holds a session of sub-{files.participant} already, which is never overwritten: resume it, "
        "or give a new session label."
    )


def _to_resume(files: Files, stimuli: Path | Manifest | None) -> tuple[Log, Design, list[Event]]:
    """Read what a session has recorded whose journal is ours, its design, and the trials that are done."""
    log = read_journal(files.journal)
    if log.changed:
        raise InputError(log.changed[0])
    design = recorded_design(str(files.journal), log.head["design"])
    trials = design.trials(files.participant, files.session)
    recorded = log.of("trial")
    done = [(event["phase"], event["trial"]) for event in recorded]
    if done != [(trial.phase, trial.trial) for trial in trials[: len(done)]]:
        raise InputError(f"{files.journal} does not follow the order of its design: begin a new session.")
    if len(done) == len(trials):
        make_table(files.journal)  # the end may have come between the last trial and the table
        raise InputError(f"{files.journal} is finished, all {len(trials)} trials: give a new session label.")
    began_with = log.head["stimuli"]
    manifest = check_stimuli(stimuli) if isinstance(stimuli, Path) else stimuli
    if (None if manifest is None else manifest.sha256) != began_with:
        raise InputError(
            f"{_folder_of(stimuli)} is given for the pictures, which is not what the session began with "
            f"({'none' if began_with is None else f'the set whose manifest is {began_with[:12]}'}): give that."
        )
    return log, design, recorded


def _folder_of(stimuli: Path | Manifest | None) -> str:
    return str(stimuli) if isinstance(stimuli, Path) else "no folder" if stimuli is None else "another manifest"


def _note(kind: str, content: Mapping[str, Any]) -> Event:
    return {"event": "note", "kind": kind, **content}


def _event(event: str, apparatus: Apparatus, at: datetime | None, **content: Any) -> Event:
    versions = {name: version(name) for name in ("focalgradient", "numpy")}
    machine = {"python": platform.python_version(), "system": platform.platform()}
    content["apparatus"] = {key: value for key, value in asdict(apparatus).items() if key != "versions"}
    content["versions"] = versions | machine | dict(apparatus.versions)
    return {"event": event, "time": (at or datetime.now(UTC)).isoformat(timespec="milliseconds"), **content}
