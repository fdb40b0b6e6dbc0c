"""A clock of the server that a test, or a benchmark, turns on."""

from __future__ import annotations

from datetime import UTC, datetime, timedelta

from focalgradient.web.store import Clock

BEGAN = datetime.now(UTC)


class Hurried(Clock):
    """A participant's trials take no time, and the server sees the time that they say: `ahead` seconds.

    The computer's own time is left out, so that a slow computer gives what a fast one gives.
    """

    ahead = 0.0

    def now(self) -> datetime:
        return BEGAN + timedelta(seconds=self.ahead)

    def since(self) -> float:
        return self.ahead
