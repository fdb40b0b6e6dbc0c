"""Session as recorded by a program: the next trial, and answers that are saved before the next trial begins."""

from __future__ import annotations

import os
import platform
import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import asdict, replace
from datetime import UTC, datetime
from importlib.metadata import version
from pathlib import Path
from typing import Any

from focalgradient.dataset.answers import Answer, Apparatus, answer_event, fields_of
from focalgradient.dataset.bids import (
    Files,
    Kind,
    add_participant,
    begin_dataset,
    check_folder,
    check_participant,
    make_table,
)
from focalgradient.dataset.conduct import EXPOSURE, exposures
from focalgradient.dataset.events import Event, cell_tests
from focalgradient.dataset.journal import Journal, Log, read_journal, writing
from focalgradient.dataset.stimuli import Manifest, check_stimuli
from focalgradient.design import Design, Trial, check_design
from focalgradient.errors import InputError
from focalgradient.tasks import task_named
from focalgradient.tasks.columns import RESERVED
from focalgradient.tasks.noted import AGAIN, AGAIN_ABOUT, EXTRA, Noted, check_noted, plain

__all__ = ["Session"]

ROOM = 1 << 20
"""Disk space in bytes that must be free before a session begins."""


class Session:
    r"""Session of one participant, being recorded.

    Leaving the context closes the journal, and writes table and sidecar of the trials recorded so far.

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

    def __init__(
        self,
        files: Files,
        design: Design,
        journal: Journal,
        events: Sequence[Event] = (),
        *,
        trials: Sequence[Trial] | None = None,
    ):
        self.files = files
        self.design = design
        self.task = task_named(design.task)
        self.trials = tuple(design.trials(files.participant, files.session) if trials is None else trials)
        settings = design.model_dump(mode="json")
        self._cells = cell_tests({"design": settings})
        self._taken = RESERVED.union(column.name for column in self.task.columns(settings))
        self._journal = journal
        self._recorded = [event for event in events if event["event"] == "trial"]
        self._noted = {kind: noted for event in self._recorded for kind, noted in _noted(event).items()}
        self._exposures = exposures(events)
        self._exposed = {event[EXPOSURE] for event in events if EXPOSURE in event}

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
        """Check a session before the participant arrives: raise what `begin` or `resume` would, without recording.

        Parameters
        ----------
        root, design, participant, session, kind, stimuli
            As for `begin`.
        resume
            Whether the session is to be resumed; then only the task of `design` is used.

        Returns
        -------
        Design
            Design that will be run; with `resume` that of the session.

        Raises
        ------
        InputError
            As for `begin` or `resume`; also if the disk is full.

        Examples
        --------
        >>> from focalgradient.design import Pinhole
        >>> Session.check(Path("nowhere-yet"), Pinhole(), "01").task
        'pinhole'
        """
        files = Files(root, design.task, participant, session)
        if resume:
            with Journal.take(files.journal):
                _, design = _to_resume(files, stimuli)
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
        """Begin a session, and create the data set if necessary.

        Parameters
        ----------
        root
            Folder of the data set.
        design
            Design to run.
        participant, session
            Labels of letters and digits.
        apparatus
            Apparatus of the sitting.
        kind
            Whether a person or a simulated observer answers. Simulated answers are reproducible, and so not flushed to
            disk.
        stimuli
            Folder of the pictures, which are checked against their manifest; or the manifest, once checked.
        about
            Data of the participant for ``participants.tsv``: age (years), sex, handedness.
        time
            Start of the session; None: now.
        durable
            Whether to wait until each answer of a person is on disk.

        Raises
        ------
        InputError
            If a label is not alphanumeric, the session already exists, the pictures were changed, or the folder is not
            a data set, is one of the other kind, or cannot be written.
        """
        files = Files(root, design.task, participant, session)
        manifest = _new(files, stimuli)
        with writing(root):
            begin_dataset(root, kind)
            check_participant(root, participant, kind)
            if manifest is not None:
                files.keep_manifest(manifest.sha256, manifest.content)
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
        return cls(files, design, journal)

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
        """Resume an interrupted session with its original design, after its last finished trial.

        Parameters
        ----------
        root, participant, session
            As at the beginning of the session.
        task
            Task of its design.
        apparatus
            Apparatus of this sitting.
        stimuli
            Folder of the pictures, which must be unchanged; or their manifest, once checked.
        time, durable
            As for `begin`.

        Raises
        ------
        InputError
            If there is no such session, another program records it, it is finished, its journal is damaged, or the
            pictures were changed.
        """
        files = Files(root, task, participant, session)
        journal = Journal.take(files.journal)
        try:
            log, design = _to_resume(files, stimuli)
            kind = log.head["kind"]
            with writing(root):  # the row may be missing after a crash
                add_participant(root, participant, {"kind": kind, **log.head.get("about", {})})
            journal.resume(log, _event("resumed", apparatus, time), durable=durable and kind == "human")
        except BaseException:
            journal.close()
            raise
        return cls(files, design, journal, log.events)

    def remaining(self) -> tuple[Trial, ...]:
        """Return the remaining trials in order, including practice."""
        return self.trials[len(self._recorded) :]

    @property
    def recorded(self) -> tuple[Event, ...]:
        """Trials recorded so far with their answers, in order; input of adaptive procedures."""
        return tuple(self._recorded)

    def expose(self, trial: Trial, round: int = 1, *, exposure: str | None = None) -> None:
        """Record that a trial is about to be shown, and return when that is saved: call it before each exposure.

        An interruption of any kind (a key, a signal, a power failure, a reloaded page) thus leaves its exposure in the
        journal, and `record` counts all exposures but the last in the column ``interruptions``.

        Parameters
        ----------
        trial
            Trial that begins.
        round
            Round of practice, which shows its trials again on purpose.
        exposure
            Identifier of an exposure that may be reported again, as by a page whose network failed: it is recorded
            once.

        Raises
        ------
        InputError
            If it cannot be written.
        """
        if exposure in self._exposed:
            return
        named = {} if exposure is None else {EXPOSURE: exposure}
        self.note(EXPOSURE, phase=trial.phase, trial=trial.trial, round=round, **named)
        self._exposures[trial.phase, trial.trial, round] += 1
        self._exposed |= {*named.values()}

    def was_shown(self, trial: Trial) -> bool:
        """Return whether an exposure of a trial is recorded, in any round of practice."""
        return any((phase, number) == (trial.phase, trial.trial) for phase, number, _ in self._exposures)

    def record(
        self, trial: Trial, answer: Answer, *, notes: Sequence[tuple[str, Mapping[str, Any]]] = (), **noted: Any
    ) -> None:
        """Record the answer to the next trial, and return when it is saved.

        Values of `noted`, such as times on a second clock, are kept in the journal only. So are `notes`, each a kind
        and its content: they are written before the answer, as by `note`, with a single wait for the disk.

        Raises
        ------
        InputError
            If it is not the trial's turn, the answer has the wrong type, or it cannot be written.
        """
        if (begun_again := self._exposures[trial.phase, trial.trial, 1] - 1) > 0:
            answer = replace(answer, extra={**answer.extra, AGAIN: Noted(begun_again, description=AGAIN_ABOUT)})
        self.check_answer(trial, answer)
        event = {**noted, "event": "trial", **fields_of(trial), **answer_event(answer)}
        self._journal.write(*(_note(kind, about) for kind, about in notes), event)
        self._recorded.append(event)
        self._noted |= _noted(event)

    def check_answer(self, trial: Trial, answer: Answer) -> None:
        """Raise what `record` would for this answer, without recording it."""
        done = len(self._recorded)
        if done == len(self.trials) or trial != self.trials[done]:
            raise InputError(f"trial {trial.trial} ({trial.phase}) is not the next: record the trials in their order.")
        if not isinstance(answer, self.task.answer):
            raise InputError(
                f"the answer is {type(answer).__name__}, but {self.design.task} requires {self.task.answer.__name__}."
            )
        for name, allowed, expected in self._cells:
            if hasattr(answer, name) and not allowed(plain(value := getattr(answer, name))):
                raise InputError(f"{name} is {value!r}, but must be {expected}.")
        if answer.extra:
            if wrong := sorted(self._taken & {*answer.extra}):
                raise InputError(f"{wrong[0]!r} is a reserved name in data sets: use another name.")
            if not (noted := _noted(answer_event(answer))).keys() <= self._noted.keys():
                check_noted([*self._noted.values(), *noted.values()])
        if self.task.check_answer is not None:
            self.task.check_answer(self.design, trial, answer)

    def note(self, kind: str, **content: Any) -> None:
        """Record another event, such as a break, in the journal."""
        self.note_all([(kind, content)])

    def note_all(self, notes: Sequence[tuple[str, Mapping[str, Any]]]) -> None:
        """Record several other events, each a kind and its content, with a single wait for the disk."""
        self._journal.write(*(_note(kind, content) for kind, content in notes))

    def __enter__(self) -> Session:
        return self

    def __exit__(self, *error: object) -> None:
        # While the journal is still locked: whoever resumes the session next writes a longer table.
        with self._journal:
            make_table(self.files.journal)


def _new(files: Files, stimuli: Path | Manifest | None) -> Manifest | None:
    """Check that a session does not exist yet, and that its pictures are unchanged."""
    there = next((path for path in (files.journal, files.table) if path.exists()), None)
    if there is not None:
        raise _taken(files, there)
    return check_stimuli(stimuli) if isinstance(stimuli, Path) else stimuli


def _taken(files: Files, there: Path) -> InputError:
    return InputError(
        f"{there} already contains a session of sub-{files.participant}, which is never overwritten: resume it, "
        "or give a new session label."
    )


def _to_resume(files: Files, stimuli: Path | Manifest | None) -> tuple[Log, Design]:
    """Read a session whose journal is locked by the caller: its journal and its design."""
    log = read_journal(files.journal)
    if log.changed:
        raise InputError(log.changed[0])
    design = check_design(str(files.journal), log.head["design"])
    trials = design.trials(files.participant, files.session)
    recorded = log.of("trial")
    done = [(event["phase"], event["trial"]) for event in recorded]
    if done != [(trial.phase, trial.trial) for trial in trials[: len(done)]]:
        raise InputError(f"{files.journal} does not follow the order of its design: begin a new session.")
    if len(done) == len(trials):
        make_table(files.journal)  # a crash may have come between the last trial and the table
        raise InputError(f"{files.journal} is finished, all {len(trials)} trials: give a new session label.")
    practised = [note for note in log.of("note") if note.get("kind") == "practice"]
    ended = getattr(design, "practice_required", False) and done and trials[len(done)].phase == "main"
    if ended and not any(note.get("passed") for note in practised) and all(phase == "practice" for phase, _ in done):
        raise InputError(
            f"{files.journal} ended with its practice, which was not passed and which the design requires: begin a new "
            "session."
        )
    began_with = log.head["stimuli"]
    manifest = check_stimuli(stimuli) if isinstance(stimuli, Path) else stimuli
    if (None if manifest is None else manifest.sha256) != began_with:
        raise InputError(
            f"{_folder_of(stimuli)} is given for the pictures, but the session began with other ones "
            f"({'none' if began_with is None else f'the set whose manifest is {began_with[:12]}'}): give those."
        )
    return log, design


def _folder_of(stimuli: Path | Manifest | None) -> str:
    return str(stimuli) if isinstance(stimuli, Path) else "no folder" if stimuli is None else "another manifest"


def _noted(event: Event) -> dict[tuple[Any, ...], Event]:
    """Return the additional values of an event by name, type and unit, which must agree over a session."""
    extra = event.get(EXTRA, {})
    return {(name, type(one["value"]), one.get("unit")): {EXTRA: {name: one}} for name, one in extra.items()}


def _note(kind: str, content: Mapping[str, Any]) -> Event:
    return {"event": "note", "kind": kind, **content}


def _event(event: str, apparatus: Apparatus, at: datetime | None, **content: Any) -> Event:
    versions = {name: version(name) for name in ("focalgradient", "numpy")}
    machine = {"python": platform.python_version(), "system": platform.platform()}
    content["apparatus"] = {key: value for key, value in asdict(apparatus).items() if key != "versions"}
    content["versions"] = versions | machine | dict(apparatus.versions)
    return {"event": event, "time": (at or datetime.now(UTC)).isoformat(timespec="milliseconds"), **content}
