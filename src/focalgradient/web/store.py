"""Where a study keeps its journals: the interface of a store, and the local folder, which is the default.

A session is always recorded into a folder, in the form of the laboratory's. A store says who may act on it, brings what
other servers have added into that folder before, and keeps what was added after.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Iterator, Mapping
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Protocol

from focalgradient.dataset import Session

__all__ = ["UNKNOWN", "Local", "Place", "Refused", "Store"]

SILENT_S = 20.0
"""A tab that has given no sign of life for so long no longer holds its session: pages give one every 5 s."""


UNKNOWN = "This link is not known, or its answers were removed: follow the link that you were given."


class Refused(Exception):  # noqa: N818  an answer to the page, not an error of ours
    """What a page asked for cannot be done: an HTTP status and a sentence."""

    def __init__(self, status: int, sentence: str, *, headers: Mapping[str, str] | None = None, **content: Any):
        super().__init__(sentence)
        self.status, self.content, self.headers = status, {"error": sentence, **content}, headers


@dataclass
class Place:
    """A participant's session as one server knows it.

    Parameters
    ----------
    participant
        Label in the data.
    journal
        Its file in the server's folder, where a session has begun.
    guard
        Held by the thread that acts on it.
    session
        Open for recording on this server; None where it is not.
    tab
        Of the browser that shows the session.
    alive
        When that tab gave the last sign of life, in seconds of `time.monotonic`.
    stopped
        Whether nothing more is taken.
    done
        Trials that are answered.
    lost
        How often the page was hidden, left full screen or zoomed during a trial.
    stored
        Bytes of the journal that a shared store has.
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

    def held_by_another(self, tab: str) -> bool:
        """Whether another tab has given a sign of life of late."""
        return self.tab not in (None, tab) and time.monotonic() - self.alive < SILENT_S

    def close(self) -> None:
        """Let go of the session, and make its table."""
        if self.session is not None:
            session, self.session = self.session, None
            session.__exit__()


class Store(Protocol):
    """Where the journals of a study are kept."""

    shared: bool
    """Whether other servers may act on the same participants."""

    def held(self, place: Place) -> AbstractContextManager[None]:
        """Own a participant's place: nobody else acts on it meanwhile, and journal and tab are as they were left.

        On leaving it, what was added to the journal is kept; it is not, where leaving it raises.
        """

    def data(self) -> AbstractContextManager[Path]:
        """Give a folder that has the data set as it is now."""


class Local:
    """A folder that one server has for itself: what is on its disk is kept."""

    shared = False

    def __init__(self, folder: Path):
        self.folder = folder

    @contextmanager
    def held(self, place: Place) -> Iterator[None]:
        """As `Store` has it."""
        with place.guard:
            yield

    @contextmanager
    def data(self) -> Iterator[Path]:
        """As `Store` has it."""
        yield self.folder
