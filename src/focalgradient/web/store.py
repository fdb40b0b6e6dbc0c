"""Stores of a study's journals: the interface, and the local folder, which is the default.

A session is always recorded in a folder, in the laboratory's format. A store controls who may act on the session, first
copies what other servers have added into that folder, and afterwards stores the additions.
"""

from __future__ import annotations

import hmac
import threading
import time
from collections.abc import Iterator, Mapping
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass, field
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, Literal, Protocol

from focalgradient.dataset import Session, read_journal
from focalgradient.dataset.withdrawal import record_of

__all__ = ["UNKNOWN", "Clock", "Local", "Place", "Refused", "Status", "Store", "lost"]

SILENT_S = 20.0
"""Time in s without a heartbeat after which a tab no longer owns its session; pages send one every 5 s."""


TOKEN_DIGITS = 32
"""Number of hexadecimal digits of a trial's token (128 bits)."""

UNKNOWN = "This link is invalid or its data were deleted. Please use the link you received."


class Refused(Exception):  # noqa: N818  a response to the page, not a fault of the server
    """Rejection of a page's request: an HTTP status and a sentence."""

    def __init__(self, status: int, sentence: str, *, headers: Mapping[str, str] | None = None, **content: Any):
        super().__init__(sentence)
        self.status, self.content, self.headers = status, {"error": sentence, **content}, headers


class Clock:
    """Time of day and elapsed time; unlike `time.monotonic`, elapsed time includes suspension of the computer."""

    def now(self) -> datetime:
        """Return the date and time (UTC)."""
        return datetime.now(UTC)

    def since(self) -> float:
        """Return the time in s since an arbitrary moment."""
        return time.clock_gettime(time.CLOCK_BOOTTIME) if hasattr(time, "CLOCK_BOOTTIME") else time.time()


def lost(frames: Mapping[str, Any]) -> int:
    """Return how often the page was hidden, left full screen or zoomed during a trial."""
    return sum(frames.get(name, 0) for name in ("hidden", "left_full_screen", "zoomed"))


Status = Literal["new", "begun", "complete", "stopped", "busy"]


@dataclass
class Place:
    """State of a participant's session on one server.

    Parameters
    ----------
    participant
        Label in the data.
    journal
        File of the journal in the server's folder, if the session has begun.
    guard
        Lock held by the thread that acts on the session.
    session
        Session open for recording on this server, or None.
    tab
        Identifier of the browser tab that shows the session.
    alive
        Time of that tab's last heartbeat, by `time.monotonic` in s.
    stopped
        Whether no more responses are accepted.
    done
        Number of trials with a response.
    lost
        Number of times that the page was hidden, left full screen or zoomed during a trial.
    stored
        Size in bytes of the journal in a shared store.
    key
        Secret of the session, from its journal, by which the tokens of its trials are made.
    began
        Index of the first trial of the present sitting, which may repeat practice.
    """

    participant: str
    journal: Path
    guard: threading.Lock = field(default_factory=threading.Lock)
    session: Session | None = None
    tab: str | None = None
    alive: float = -1e9
    stopped: bool = False
    done: int = 0
    lost: int = 0
    stored: int = 0
    key: str | None = None
    began: int = 0

    def trial_token(self, phase: str, trial: int) -> str:
        """Return the token of a trial, the same from every server and after every restart."""
        if self.key is None:
            self.key = record_of(read_journal(self.journal).events)
        if self.key is None:  # a server was killed before it had recorded the sitting
            raise Refused(425, "The session must be resumed before a trial is requested.")
        return hmac.digest(self.key.encode(), f"{phase} {trial}".encode(), "sha256").hex()[:TOKEN_DIGITS]

    def is_token(self, given: str, phase: str, trial: int) -> bool:
        """Return whether a token is that of a trial."""
        return hmac.compare_digest(given.encode(), self.trial_token(phase, trial).encode())

    def held_by_another(self, tab: str) -> bool:
        """Return whether another tab has sent a heartbeat within `SILENT_S`."""
        return self.tab not in (None, tab) and time.monotonic() - self.alive < SILENT_S

    def progress(self, trials: int) -> tuple[Status, int]:
        """Return the status of a session of `trials` trials and its number of answers, from disk if it is not open."""
        if self.stopped:
            return "stopped", self.done
        if self.session is not None:
            trials, self.done = len(self.session.trials), len(self.session.recorded)
        elif not self.journal.exists():
            return "new", 0
        else:
            log = read_journal(self.journal)
            self.done = len(log.of("trial"))
            self.lost = sum(lost(note) for note in log.of("note") if note["kind"] == "frames")
        return ("complete" if self.done == trials else "begun"), self.done

    def close(self) -> None:
        """Close the session, and write its table."""
        if self.session is not None:
            session, self.session = self.session, None
            session.__exit__()


class Store(Protocol):
    """Protocol of the storage of a study's journals."""

    shared: bool
    """Whether several servers may act on the same participants."""

    def held(self, place: Place) -> AbstractContextManager[None]:
        """Own a participant's place exclusively, with journal and tab as last stored.

        On exit, additions to the journal are stored; if the exit raises, they are not.
        """

    def data(self) -> AbstractContextManager[Path]:
        """Return a context with a folder that contains the present data set."""


class Local:
    """Store in a folder that belongs to one server."""

    shared = False

    def __init__(self, folder: Path):
        self.folder = folder

    @contextmanager
    def held(self, place: Place) -> Iterator[None]:
        """See `Store`."""
        with place.guard:
            yield

    @contextmanager
    def data(self) -> Iterator[Path]:
        """See `Store`."""
        yield self.folder
