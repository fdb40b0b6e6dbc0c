"""Running study: the session of each link, the stimuli of its page, and the recording of responses.

Each response is on disk before it is acknowledged. Responses arrive in the order of the trials; one that arrives again
is acknowledged but not recorded twice, so that the page may resend it as often as the network requires.
"""

from __future__ import annotations

import secrets
import threading
import time
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from functools import cache
from importlib.metadata import version
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from focalgradient.dataset import Apparatus, Files, Journal, Session, read_journal
from focalgradient.dataset.withdrawal import record_of, remove_participant
from focalgradient.design import Design, check_design
from focalgradient.design.consent import Consent
from focalgradient.design.form import check_about
from focalgradient.errors import InputError
from focalgradient.web.answers import about_sitting, apparatus_of, expose, first_problem, read_practice, record
from focalgradient.web.guard import Rate, too_many
from focalgradient.web.lists import Lists, check_completion
from focalgradient.web.messages import Begin, Expose, Given, Join, Judge, Next, Who
from focalgradient.web.people import Roster
from focalgradient.web.pictures import padded
from focalgradient.web.rounds import PASSED, judge, note_round, practice_numbers, start_of
from focalgradient.web.store import UNKNOWN, Clock, Local, Place, Refused, Status, Store, lost

__all__ = ["Refused", "Study"]

OPEN_ELSEWHERE = "The session is open in another window."
STOPPED = "The session was stopped."

WITHDRAWN_S = 60.0
"""Interval in s between checks for participants who have withdrawn on another server."""

BEGINS = 10
"""Maximum number of begins and resumptions of one session per minute; twice as many may arrive at once."""

MESSAGES = 1200
"""Maximum number of other messages of one session per minute: pages send about 100; twice as many may arrive at once.
"""

AHEAD = 4
"""Maximum number of trials that a page may be ahead of the recorded responses, and whose stimuli it receives."""


class Study:
    """Study with one design, for all participants with a link.

    Parameters
    ----------
    design
        Design that a browser can run (see `Lists`).
    data
        Folder of the data set.
    people
        Participants.
    store
        Store of the journals; default: the folder itself.
    stimuli
        Folder of the pictures; required for depth rating.
    consent
        Consent text, if there is one.
    completion
        Address to which a participant is redirected once the last response is on disk.
    gamma
        Whether participants match greys to estimate their display's gamma.
    open_link
        Whether new participants may join without an invitation.

    Raises
    ------
    InputError
        If the design cannot run in a browser, or pictures are missing or were changed.
    """

    def __init__(
        self,
        design: Design,
        data: Path,
        people: Roster,
        *,
        store: Store | None = None,
        stimuli: Path | None = None,
        consent: Consent | None = None,
        completion: str | None = None,
        gamma: bool = False,
        open_link: bool = True,
    ):
        check_completion(completion)
        self.design, self.data, self.people = design, data, people
        self.completion, self.open_link = completion, open_link
        self.store: Store = Local(data) if store is None else store
        self.lists = Lists(design, stimuli, consent, gamma=gamma)
        self._trials = cache(design.trials)  # requested at each refresh of the experimenter's page
        self.clock = Clock()
        self._places: dict[str, Place] = {}
        self._handed: dict[str, float] = {}
        self._begins = Rate(BEGINS, in_all=False)
        self._messages = Rate(MESSAGES, in_all=False)
        self._guard = threading.Lock()
        self._looked = time.monotonic()

    def _place(self, token: str, rate: Rate | None = None) -> Place:
        person = self.people.of(token)
        if person is None:
            raise Refused(404, UNKNOWN)
        rate = rate or self._messages
        if wait := rate.wait(person.participant):
            raise too_many(wait, "This session sends too many messages: wait a little.")
        rate.count(person.participant)
        return self._place_of(person.participant)

    def _place_of(self, participant: str) -> Place:
        with self._guard:
            if participant not in self._places:
                journal = Files(self.data, self.design.task, participant, None).journal
                self._places[participant] = Place(participant, journal, stopped=self.people.is_stopped(participant))
            return self._places[participant]

    @contextmanager
    def _held(self, who: Who, rate: Rate | None = None) -> Iterator[Place]:
        """Own a participant's place for this tab, unless another tab has sent a recent heartbeat."""
        place = self._place(who.token, rate)
        with self.store.held(place):
            if place.stopped:
                raise Refused(410, STOPPED)
            if place.held_by_another(who.tab):
                raise Refused(409, OPEN_ELSEWHERE, busy=True)
            place.tab, place.alive = who.tab, time.monotonic()
            try:
                yield place
            except InputError as error:
                if not isinstance(error.__cause__, OSError):
                    raise
                with suppress(InputError):  # disk full or unavailable: the page keeps its response and retries
                    place.close()
                raise Refused(503, "The server cannot write at the moment.") from error

    def _progress(self, place: Place) -> tuple[Status, int]:
        return place.progress(len(self._trials(place.participant)))

    def join(self, given: Join) -> dict[str, Any]:
        """Return a secret for a participant on the open link, or confirm the one that the browser generated."""
        if not self.open_link:
            raise Refused(403, "This study is by invitation: follow the link that you were given.")
        return {"token": self.people.join(given.platform, given.secret)}

    def opening(self) -> dict[str, Any]:
        """Return what a page needs to check the device and ask for consent, before it has a session."""
        return self.lists.opening()

    def state(self, who: Who) -> dict[str, Any]:
        """Return what the page needs before the session begins or is resumed."""
        place = self._place(who.token)
        with self.store.held(place):
            status, done = self._progress(place)
            if status in ("new", "begun") and place.held_by_another(who.tab):
                status = "busy"
        return {"status": status, "done": done, **self.lists.opening()}

    def begin(self, given: Begin) -> dict[str, Any]:
        """Begin or resume a session; return its first pages, and the numbers of the remaining trials."""
        consent = self.lists.consent and self.lists.consent.sha256
        if consent and given.consent != consent:
            raise Refused(
                403, "The session begins once the participant agrees to the present version of the consent text."
            )
        with self._held(given, self._begins) as place:
            status, _ = self._progress(place)
            if status == "complete":
                raise Refused(409, "The session is complete.", complete=True)
            if place.session is not None:
                place.close()
                status = "begun"
            how: dict[str, Any] = {
                "apparatus": apparatus_of(given, starlette=version("starlette")),
                "stimuli": self.lists.folder,
                "durable": not self.store.shared,  # a shared store keeps the data itself
            }
            if status == "new":
                session = Session.begin(
                    self.data, self.design, place.participant, about=self._about(given), time=self.clock.now(), **how
                )
            else:
                session = Session.resume(self.data, self.design.task, place.participant, time=self.clock.now(), **how)
            place.session = session
            self._handed[place.participant] = self.clock.since() - given.waited_ms / 1000
            agreed = self.lists.consent and self.lists.consent.stated(self.clock.now().isoformat(timespec="seconds"))
            # A random number that makes the tokens of trials, and identifies copies of the session after its removal.
            known = status != "new" and record_of(read_journal(place.journal).events) is not None
            record = {} if known else {"record": secrets.token_hex(16)}
            session.note("sitting", **about_sitting(given), consent=agreed, **record)
            if status == "new" and place.participant in self.people.sharing_identifiers():
                session.note("same identifier")
            place.began, first = start_of(session, read_journal(place.journal).events)
            again = {"practice_round": first, "again": self.lists.again(place.participant)} if first > 1 else {}
            left = [{"phase": trial.phase, "trial": trial.trial} for trial in session.trials[place.began :]]
            return {"start_ms": given.now_ms, **self.lists.session(place.participant), "trials": left, **again}

    def _about(self, given: Begin) -> dict[str, str]:
        """Return the entries of the form, which must be those that the design asks for."""
        try:
            check_about(given.about, self.design.ask)
        except InputError as error:
            raise Refused(400, str(error)) from error
        return dict(given.about)

    def _elapsed(self, place: Place) -> float | None:
        """Return the time in s since the page received its trials; None if another or an earlier server sent them."""
        handed = self._handed.get(place.participant)
        return None if handed is None else self.clock.since() - handed

    def next(self, given: Next) -> dict[str, Any]:
        """Return a trial and those that follow it, with their tokens, stimuli and pages.

        The page may be `AHEAD` trials ahead of the recorded responses, which the network may hold back; in an adaptive
        task, one.
        """
        with self._held(given) as place:
            session = self._resumed(place, "a trial is requested")
            mine = [(trial.phase, trial.trial) for trial in session.trials[place.began :]]
            since, practice = len(session.recorded) - place.began, len(practice_numbers(session.trials[place.began :]))
            last = since + _ahead(session)
            if practice and not place.is_token(given.practice_token, *PASSED):
                if given.phase == "main":
                    raise Refused(403, "Practice is not passed: repeat it before the main trials.")
                last = min(last, practice)
            key = (given.phase, given.trial)
            first = mine.index(key) if key in mine else last
            repeated = given.phase == "practice" and since >= practice
            if first >= last or (first < since and not repeated):
                raise Refused(409, f"Trial {given.trial} ({given.phase}) is not the next trial.")
            asked = slice(first, min(last, first + AHEAD))
            tokens = [place.trial_token(*key) for key in mine[asked]]
            shown = self.lists.shown(place.participant, session.trials, place.began, asked, session.recorded)
            return {"trial_tokens": tokens, "trials": shown}

    def picture(self, token: str, phase: str = "", trial: int = 0, number: int = 0) -> bytes:
        """Return a picture of a trial that the page has received, or the standard's if no trial is named."""
        place = self._place(token)
        with self.store.held(place):
            if place.stopped:
                raise Refused(410, STOPPED)
            session = self._resumed(place, "a picture is requested")
            known = session.trials[: len(session.recorded) + _ahead(session)]
            named = next((one for one in known if (one.phase, one.trial) == (phase, trial)), None)
            files = [] if phase or (standard := self.lists.standard()) is None else padded([standard])
            # Of trials already answered only practice is shown again.
            if named is not None and (phase == "practice" or named not in known[: len(session.recorded)]):
                files = self.lists.files(place.participant, named, session.recorded)
        if not 0 <= number < len(files):
            raise Refused(404, "There is no such picture.")
        return files[number]

    def judge(self, given: Judge) -> dict[str, Any]:
        """Judge the responses of a round of practice so far: whether it is passed, and is to be repeated.

        With the last response of a round, its result is recorded, and the page before the next round or the token for
        the main trials is returned.
        """
        with self._held(given) as place, _refusing():
            session = self._resumed(place, "practice is judged")
            practised = read_practice(session, self.lists.pictures, given.answers)
            found = judge(session, practised, given.round)
            if not practice_numbers(session.trials[place.began :]) <= {trial.trial for trial, _ in practised}:
                return found
            events = read_journal(place.journal).events
            note_round(session, practised, given.round, found, events, self._elapsed(place))
            if found["again"]:
                return found | {"page": self.lists.again(place.participant)}
            return found | {"practice_token": place.trial_token(*PASSED)}

    def answer(self, given: Given) -> dict[str, Any]:
        """Record a response, and acknowledge it once it is on disk."""
        with self._held(given) as place:
            session = place.session or self._rejoined(place)
            if session is None:
                return self._unbegun(place, given)
            key = (given.phase, given.trial)
            numbers = {(trial.phase, trial.trial): number for number, trial in enumerate(session.trials)}
            done = len(session.recorded)
            if key not in numbers:
                raise Refused(400, f"There is no {given.phase} trial {given.trial}.")
            if numbers[key] < done:
                return {"recorded": True, "again": True, "done": done}
            if numbers[key] > done:
                raise Refused(409, f"Trial {given.trial} ({given.phase}) is not the next trial.", done=done)
            if not place.is_token(given.trial_token, *key):
                raise Refused(403, f"Trial {given.trial} ({given.phase}) was not shown: request it first.", done=done)
            if not session.was_shown(session.trials[done]):
                name = f"Trial {given.trial} ({given.phase})"
                raise Refused(403, f"{name} was not shown: report its exposure before the response.", done=done)
            with _refusing():
                frames = record(session, self.lists.pictures, given, self.clock.now(), self._elapsed(place))
            place.lost += lost(frames)
            place.done = done + 1
            return {"recorded": True, "done": done + 1}

    def _resumed(self, place: Place, purpose: str) -> Session:
        """Return the session of the present sitting; raise `Refused` if none has begun."""
        session = place.session or self._rejoined(place)
        if session is None:
            raise Refused(425, f"The session must be resumed before {purpose}.")
        return session

    def _rejoined(self, place: Place) -> Session | None:
        """Continue the last sitting, which another server, or this one before its restart, has begun.

        The response belongs to that sitting's page and clock. Returns None if no sitting has begun.
        """
        if not place.journal.exists():
            return None
        log = read_journal(place.journal)
        if log.changed:
            return None
        durable = not self.store.shared
        resumed = [number for number, event in enumerate(log.events) if event["event"] == "resumed"]
        if not place.journal.read_bytes().endswith(b"\n"):  # a crash truncated a line, which the journal must record
            last = [log.head, *log.of("resumed")][-1]
            apparatus = Apparatus(**last["apparatus"], versions=last["versions"])
            place.session = Session.resume(
                *(self.data, self.design.task, place.participant),
                apparatus=apparatus,
                stimuli=self.lists.folder,
                durable=durable,
            )
        else:
            journal = Journal.take(place.journal)
            journal.follow(log, durable=durable)
            design = check_design(str(place.journal), log.head["design"])
            place.session = Session(Files(self.data, design.task, place.participant), design, journal, log.events)
        place.began, _ = start_of(place.session, log.events[: max(resumed, default=0)])
        return place.session

    def _unbegun(self, place: Place, given: Given) -> dict[str, Any]:
        """Acknowledge a response that an earlier server recorded; raise `Refused` for any other response."""
        _, done = self._progress(place)
        keys = [(trial.phase, trial.trial) for trial in self._trials(place.participant)]
        if (given.phase, given.trial) in keys[:done]:
            return {"recorded": True, "again": True, "done": done}
        raise Refused(425, "The session must be resumed before responses are accepted.", done=done)

    def expose(self, given: Expose) -> dict[str, Any]:
        """Record that a trial was about to be shown, and acknowledge it once that is on disk."""
        with self._held(given) as place:
            session = self._resumed(place, "exposures are accepted")
            with _refusing(409):
                expose(session, given)
            return {"recorded": True}

    def here(self, who: Who) -> dict[str, Any]:
        """Record a heartbeat of the tab that shows the session; the tab owns the session from its first heartbeat."""
        if time.monotonic() - self._looked > WITHDRAWN_S:
            self._remove_withdrawn()
        with self._held(who):
            return {}

    def leave(self, who: Who) -> dict[str, Any]:
        """Release the session, because its tab was closed."""
        place = self._place(who.token)
        with self.store.held(place):
            if place.tab == who.tab:
                place.alive = -1e9
        return {}

    def finish(self, who: Who) -> dict[str, Any]:
        """Close a complete session, and return the address to redirect to."""
        place = self._place(who.token)
        with self.store.held(place):
            status, done = self._progress(place)
            if status != "complete":
                raise Refused(409, "The session is not complete.", done=done)
            if place.session is None:  # a server that crashed after the last response has not written the table
                self._rejoined(place)
            place.close()
        closing = self.lists.closing(place.participant)
        return {"completion": self.completion, "done": done, "closing": closing}

    def stop(self, participant: str) -> None:
        """Stop a participant's session: recorded responses are kept, no more are accepted."""
        self.people.stop(participant)
        place = self._place_of(participant)
        with self.store.held(place):
            place.stopped = True
            place.close()

    def withdraw(self, who: Who) -> dict[str, Any]:
        """Remove all data of a participant on request; after an interruption it can be requested again."""
        place = self._place(who.token)
        with self.store.held(place):
            if place.held_by_another(who.tab):
                raise Refused(409, OPEN_ELSEWHERE, busy=True)
            place.stopped = True
            with suppress(InputError):  # if the disk is full
                place.close()
            if (self.data / "dataset_description.json").exists():
                remove_participant(self.data, place.participant)
        self.people.forget(place.participant)
        return {}

    def _remove_withdrawn(self) -> None:
        """Remove data in this server's folder of participants who have withdrawn on another server."""
        self._looked = time.monotonic()
        there = self.people.everybody() if self.store.shared else self._places
        for place in [place for label, place in self._places.items() if label not in there]:
            with place.guard:
                place.stopped = True
                with suppress(InputError):
                    place.close()
                with suppress(InputError):  # retried at the next check
                    remove_participant(self.data, place.participant)

    def overview(self) -> list[dict[str, Any]]:
        """Return one row per participant: progress, time since the last heartbeat, and disturbances of the display."""
        rows = []
        sharing = self.people.sharing_identifiers()
        self._remove_withdrawn()
        for participant, person in sorted(self.people.everybody().items()):
            place = self._place_of(participant)
            try:
                with self.store.held(place):
                    status, done = self._progress(place)
                    silent = time.monotonic() - place.alive
            except Refused as error:
                if error.status == 404:  # withdrawn meanwhile
                    continue
                raise
            row = {"participant": participant, "status": status, "done": done, "lost": place.lost}
            row["trials"] = len(self._trials(participant))
            row["silent_s"] = round(silent, 1) if silent < 1e6 else None
            row["came_from"] = "platform" if person.platform else "link"
            row["same_identifier"] = participant in sharing
            rows.append(row)
        return rows

    def summary(self) -> dict[str, Any]:
        """Return every participant's progress, and current counts of responses by condition."""
        rows = self.overview()
        done = [trial for row in rows for trial in self._trials(row["participant"])[: row["done"]]]
        counts = Counter(
            ", ".join(map(str, trial.condition)) for trial in done if trial.phase == "main" and not trial.catch
        )
        return {"task": self.design.task, "participants": rows, "answers_by_condition": dict(sorted(counts.items()))}

    def close(self) -> None:
        """Close the study; open sessions can be resumed."""
        for place in self._places.values():
            with place.guard, suppress(InputError):
                place.close()  # responses have been stored already
        self.people.close()


@contextmanager
def _refusing(status: int = 400) -> Iterator[None]:
    """Refuse a message that is found invalid; not if the disk cannot be written."""
    try:
        yield
    except ValidationError as error:
        raise Refused(400, f"The response is invalid: {first_problem(error)}.") from error
    except InputError as error:
        if isinstance(error.__cause__, OSError):
            raise
        raise Refused(status, " ".join(str(error).split())) from error


def _ahead(session: Session) -> int:
    return 1 if session.task.adapts else AHEAD
