"""A study that is being run: which session each link is of, what its page shows next, and what was answered.

Each answer is on the disk before it is acknowledged. Answers come in the order of the trials; one that comes again is
acknowledged and not recorded twice, so that the page may send it as often as the network asks for.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from functools import cache
from importlib.metadata import version
from pathlib import Path
from typing import Any, Literal

from pydantic import ValidationError

from focalgradient.dataset import Files, Session, read_journal, withdraw
from focalgradient.design import Design
from focalgradient.errors import InputError
from focalgradient.web.answers import apparatus_of, first_problem, read_answer
from focalgradient.web.lists import Consent, Lists
from focalgradient.web.messages import Begin, Given, Who
from focalgradient.web.people import People

__all__ = ["Refused", "Study"]

SILENT_S = 20.0
"""A tab that has given no sign of life for so long no longer holds its session: pages give one every 5 s."""

Status = Literal["new", "begun", "complete", "stopped", "busy"]


class Refused(Exception):  # noqa: N818  an answer to the page, not an error of ours
    """What a page asked for cannot be done: an HTTP status and a sentence."""

    def __init__(self, status: int, sentence: str, **content: Any):
        super().__init__(sentence)
        self.status, self.content = status, {"error": sentence, **content}


@dataclass
class _Place:
    """A participant's session on this server."""

    participant: str
    guard: threading.Lock = field(default_factory=threading.Lock)
    session: Session | None = None
    tab: str | None = None
    alive: float = -1e9
    stopped: bool = False
    done: int = 0
    lost: int = 0

    def held_by_another(self, tab: str) -> bool:
        return self.tab not in (None, tab) and time.monotonic() - self.alive < SILENT_S


class Study:
    """A design, run with everybody who has a link.

    Parameters
    ----------
    design
        Of depth rating or of the cube.
    data
        Folder of the data set.
    people
        Who may take part.
    stimuli
        Folder of the pictures, which depth rating needs.
    consent
        To be agreed to, where there is one.
    completion
        Address that a participant is sent to when the last answer is on the disk.
    open_link
        Whether new people may come without an invitation.

    Raises
    ------
    InputError
        If the design cannot be run in a browser, or the pictures are missing or have changed.
    """

    def __init__(
        self,
        design: Design,
        data: Path,
        people: People,
        *,
        stimuli: Path | None = None,
        consent: Consent | None = None,
        completion: str | None = None,
        open_link: bool = True,
    ):
        self.design, self.data, self.people = design, data, people
        self.completion, self.open_link = completion, open_link
        self.lists = Lists(design, stimuli, consent)
        self._trials = cache(design.trials)  # asked for at each look at the experimenter's page
        self._places: dict[str, _Place] = {}
        self._guard = threading.Lock()

    def _place(self, token: str) -> _Place:
        person = self.people.of(token)
        if person is None:
            raise Refused(404, "This link is not known: follow the link that you were given.")
        return self._place_of(person.participant)

    def _place_of(self, participant: str) -> _Place:
        with self._guard:
            return self._places.setdefault(participant, _Place(participant))

    @contextmanager
    def _held(self, who: Who) -> Iterator[_Place]:
        """A participant's place, held by this tab from now on: none other has given a sign of life of late."""
        place = self._place(who.token)
        with place.guard:
            if place.stopped:
                raise Refused(410, "The session was stopped.")
            if place.held_by_another(who.tab):
                raise Refused(409, "The session is open in another window.", busy=True)
            place.tab, place.alive = who.tab, time.monotonic()
            yield place

    def _journal(self, participant: str) -> Path:
        return Files(self.data, self.design.task, participant, None).journal

    def _progress(self, place: _Place) -> tuple[Status, int]:
        """How far a session is, from the disk where this server has not touched it."""
        if place.stopped:
            return "stopped", place.done
        if place.session is not None:
            place.done = len(place.session.trials) - len(place.session.remaining())
            return ("begun" if place.session.remaining() else "complete"), place.done
        path = self._journal(place.participant)
        if not path.exists():
            return "new", 0
        log = read_journal(path)
        place.done = len(log.of("trial"))
        return ("complete" if place.done == len(self._trials(place.participant)) else "begun"), place.done

    def join(self, platform: Mapping[str, str]) -> dict[str, Any]:
        """Give a link's secret to who comes without one."""
        if not self.open_link:
            raise Refused(403, "This study is by invitation: follow the link that you were given.")
        return {"token": self.people.join(platform)}

    def state(self, who: Who) -> dict[str, Any]:
        """Give what the page needs before the session begins or goes on."""
        place = self._place(who.token)
        with place.guard:
            status, done = self._progress(place)
            if status in ("new", "begun") and place.held_by_another(who.tab):
                status = "busy"
        return {
            "status": status,
            "done": done,
            **self.lists.opening(),
        }

    def begin(self, given: Begin) -> dict[str, Any]:
        """Begin a session, or go on with one: give all trials that are left."""
        consent = self.lists.consent and self.lists.consent.sha256
        if consent and given.consent != consent:
            raise Refused(403, "The session begins when the participant agrees to the text that is in force now.")
        with self._held(given) as place:
            status, _ = self._progress(place)
            if status == "complete":
                raise Refused(409, "The session is complete.", complete=True)
            if place.session is not None:
                self._close(place)
                status = "begun"
            apparatus = apparatus_of(given, starlette=version("starlette"))
            if status == "new":
                session = Session.begin(
                    self.data, self.design, place.participant, apparatus=apparatus, stimuli=self.lists.folder
                )
            else:
                session = Session.resume(
                    self.data, self.design.task, place.participant, apparatus=apparatus, stimuli=self.lists.folder
                )
            place.session = session
            session.note("sitting", browser=given.browser, pixel_ratio=given.pixel_ratio, consent=consent)
            shown = self.lists.shown(session.trials, session.remaining())
            return {"start_ms": given.now_ms, **self.lists.session(place.participant), "trials": shown}

    def answer(self, given: Given) -> dict[str, Any]:
        """Record an answer, and say so when it is on the disk."""
        with self._held(given) as place:
            session = place.session
            if session is None:
                return self._unbegun(place, given)
            key = (given.phase, given.trial)
            numbers = {(trial.phase, trial.trial): number for number, trial in enumerate(session.trials)}
            done = len(session.trials) - len(session.remaining())
            if key not in numbers:
                raise Refused(400, f"There is no trial {given.trial} of {given.phase}.")
            if numbers[key] < done:
                return {"recorded": True, "again": True, "done": done}
            if numbers[key] > done:
                raise Refused(409, f"Trial {given.trial} ({given.phase}) is not the next.", done=done)
            try:
                answer, frames = read_answer(self.lists.pictures, session.trials[done], given.answer)
            except ValidationError as error:
                raise Refused(400, f"The answer is not one: {first_problem(error)}.") from error
            place.lost += frames["hidden"] + frames["left_full_screen"] + frames["zoomed"]
            session.note("frames", phase=given.phase, trial=given.trial, **frames)
            session.record(session.trials[done], answer, attempt=given.attempt)
            place.done = done + 1
            return {"recorded": True, "done": done + 1}

    def _unbegun(self, place: _Place, given: Given) -> dict[str, Any]:
        """An answer that comes before this server has begun anything: one that an earlier server may have recorded."""
        _, done = self._progress(place)
        keys = [(trial.phase, trial.trial) for trial in self._trials(place.participant)]
        if (given.phase, given.trial) in keys[:done]:
            return {"recorded": True, "again": True, "done": done}
        raise Refused(425, "The session has to go on before answers are taken.", done=done)

    def here(self, who: Who) -> dict[str, Any]:
        """Take a sign of life of the tab that shows the session; it holds the session from its first on."""
        with self._held(who):
            return {}

    def leave(self, who: Who) -> dict[str, Any]:
        """Let another tab have the session: this one is closed."""
        place = self._place(who.token)
        with place.guard:
            if place.tab == who.tab:
                place.alive = -1e9
        return {}

    def finish(self, who: Who) -> dict[str, Any]:
        """Close a complete session, and give the address to go to."""
        place = self._place(who.token)
        with place.guard:
            status, done = self._progress(place)
            if status != "complete":
                raise Refused(409, "The session is not complete.", done=done)
            self._close(place)
        return {"completion": self.completion, "done": done}

    def stop(self, participant: str) -> None:
        """Stop a participant's session: what was recorded stays, nothing more is taken."""
        place = self._place_of(participant)
        with place.guard:
            place.stopped = True
            self._close(place)

    def withdraw(self, who: Who) -> dict[str, Any]:
        """Remove all that a participant has given, at the participant's wish."""
        place = self._place(who.token)
        with place.guard:
            place.stopped = True
            self._close(place)
            if self._journal(place.participant).exists():
                withdraw(self.data, f"sub-{place.participant}")
        return {}

    def _close(self, place: _Place) -> None:
        if place.session is not None:
            place.session.__exit__()
            place.session = None

    def overview(self) -> list[dict[str, Any]]:
        """Give a row for everybody: how far the session is, when there was a sign of life, what was lost."""
        rows = []
        for participant, person in sorted(self.people.everybody().items()):
            place = self._place_of(participant)
            with place.guard:
                status, done = self._progress(place)
                silent = time.monotonic() - place.alive
            row = {"participant": participant, "status": status, "done": done, "lost": place.lost}
            row["trials"] = len(self._trials(participant))
            row["silent_s"] = round(silent, 1) if silent < 1e6 else None
            row["came_from"] = "platform" if person.platform else "link"
            rows.append(row)
        return rows

    def summary(self) -> dict[str, Any]:
        """Give everybody's progress, and live counts of answers by condition."""
        rows = self.overview()
        counts: dict[str, int] = {}
        for row in rows:
            trials = self._trials(row["participant"])
            for trial in trials[: row["done"]]:
                if trial.phase == "main" and not trial.catch:
                    name = ", ".join(map(str, trial.condition))
                    counts[name] = counts.get(name, 0) + 1
        return {"task": self.design.task, "participants": rows, "answers_by_condition": dict(sorted(counts.items()))}

    def close(self) -> None:
        """End: sessions that are open stay to be resumed."""
        for place in self._places.values():
            with place.guard, suppress(InputError):
                self._close(place)
        self.people.close()
