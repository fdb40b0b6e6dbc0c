"""A clock of the server that a test, or a benchmark, turns on."""

from __future__ import annotations

from datetime import datetime, timedelta

from focalgradient.web.store import Clock


class Hurried(Clock):
    """A participant's trials take no time, and the server sees the time that they say: `ahead` seconds are added."""

    ahead = 0.0

    def now(self) -> datetime:
        return super().now() + timedelta(seconds=self.ahead)

    def since(self) -> float:
        return super().since() + self.ahead
