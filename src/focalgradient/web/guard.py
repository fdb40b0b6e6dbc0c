"""Limit what browsers send to a server: from which site, how often, how slowly."""

from __future__ import annotations

import asyncio
import ipaddress
import math
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any
from urllib.parse import urlsplit

from starlette.datastructures import Headers
from starlette.requests import Request
from starlette.responses import JSONResponse
from starlette.types import ASGIApp, Receive, Scope, Send
from uvicorn.protocols.http.h11_impl import H11Protocol

from focalgradient.errors import check_number
from focalgradient.web.store import Refused

__all__ = ["Limits", "Rate", "SameOrigin", "TimedProtocol", "read_body", "too_many"]

MOST_BYTES = 4 << 20
"""Of a message: an answer with the time stamps of ten minutes of frames at 240 Hz has some 1.5 MB."""

PAUSE_S = 5.0
"""Longest pause within a message or its head (s): lost packets are sent again within one or two."""

MESSAGE_S = 30.0
"""Longest time for a message (s): 1.5 MB at 0.4 Mbit/s, a slow mobile network."""

BURST = 2
"""Minutes of a rate that may come at once: at 60 a minute a classroom of 60, whose browsers are all loaded again."""

ADDRESSES = 4
"""Addresses' worth of a rate that may come from all addresses together."""

CLOSE = {"Connection": "close"}
"""Header of an answer after which nothing more of the message is read."""

MOST_KEYS = 10_000
"""Addresses that are remembered: some MB."""


@dataclass(frozen=True, slots=True)
class Limits:
    """How often a server lets one address join or guess the password; from all together, four times as often.

    Parameters
    ----------
    joins
        People who come by the open link, a minute; twice as many may come at once.
    guesses
        Wrong passwords of the experimenter's page, a minute; twice as many may come at once.
    """

    joins: int = 60
    guesses: int = 6

    def __post_init__(self) -> None:
        check_number("joins", self.joins, "people a minute", positive=True)
        check_number("guesses", self.guesses, "passwords a minute", positive=True)


class Rate:
    """How often something may happen, for each address and in all (the generic cell rate algorithm, ITU-T I.371).

    Parameters
    ----------
    per_minute
        For one address; `BURST` minutes' worth may happen at once, and `ADDRESSES` times as much in all.
    clock
        Gives seconds.

    Examples
    --------
    >>> rate = Rate(1, clock=lambda: 0.0)
    >>> for _ in range(2):
    ...     rate.count("192.0.2.1")
    >>> rate.wait("192.0.2.1"), rate.wait("192.0.2.2")
    (60.0, 0.0)
    """

    def __init__(self, per_minute: float, clock: Callable[[], float] = time.monotonic):
        self._interval, self._clock = 60 / per_minute, clock
        self._burst = BURST * 60.0
        self._until: dict[str, float] = {}

    def _intervals(self, address: str) -> tuple[tuple[str, float], ...]:
        return ("", self._interval / ADDRESSES), (_network(address), self._interval)

    def wait(self, address: str, *, in_all: bool = True) -> float:
        """Return how long an address has to wait before the next one (s), with or without the limit for all."""
        now = self._clock()
        keys = self._intervals(address)[0 if in_all else 1 :]
        return max(0.0, *(self._until.get(key, now) - now - self._burst + interval for key, interval in keys))

    def count(self, address: str) -> None:
        """Count one."""
        now = self._clock()
        for key, interval in self._intervals(address):
            self._until[key] = max(self._until.get(key, now), now) + interval
        if len(self._until) > MOST_KEYS:
            self._until = {key: until for key, until in self._until.items() if until > now}


def _network(address: str) -> str:
    """The network that counts as one address: of IPv6 the first 64 bits, all of which one household has.

    >>> _network("2001:db8::1"), _network("192.0.2.1"), _network("unix")
    ('2001:db8::/64', '192.0.2.1', 'unix')
    """
    try:
        found = ipaddress.ip_address(address)
    except ValueError:
        return address
    return address if found.version == 4 else str(ipaddress.ip_network((found, 64), strict=False))


def too_many(wait: float, sentence: str) -> Refused:
    """Refuse with 429, and say when to come again."""
    return Refused(429, sentence, headers={"Retry-After": str(max(1, math.ceil(wait)))})


class SameOrigin:
    """Refuses what the page of another site sends, by Sec-Fetch-Site, Origin and Referer.

    Browsers name the origin of all that a page sends by POST. A program that sends none of the three is no browser,
    whose user another site could use.

    Parameters
    ----------
    app
        What else is asked.
    public
        Address that participants' browsers know the server by, where a proxy sends another one as Host.
    """

    def __init__(self, app: ASGIApp, public: str | None = None):
        self._app, self._public = app, _host(public or "")

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Pass on what is asked, or refuse it."""
        app = self._app
        if scope["type"] == "http" and scope["method"] not in ("GET", "HEAD", "OPTIONS"):
            headers = Headers(scope=scope)
            own = {_host(f"//{headers.get('host', '')}"), self._public} - {""}
            named = [*headers.getlist("origin"), *headers.getlist("referer")]
            sites = headers.getlist("sec-fetch-site")
            if any(site != "same-origin" for site in sites) or any(_host(one) not in own for one in named):
                sentence = "This was sent from the page of another site: use the page of the study."
                app = JSONResponse({"error": sentence}, 403, CLOSE)
        await app(scope, receive, send)


def _host(address: str) -> str:
    """Host and port of an address, without a port that the scheme implies; "" of none.

    >>> _host("https://Lab.example.org:443/s/x"), _host("//127.0.0.1:8000"), _host("null")
    ('lab.example.org', '127.0.0.1:8000', '')
    """
    try:
        found = urlsplit(address)
        port = found.port
    except ValueError:
        return ""
    return (found.hostname or "") + (f":{port}" if port not in (None, 80, 443) else "")


async def read_body(request: Request) -> bytes:
    """Read a message; one that is too large, or comes too slowly, is refused and its connection closed."""
    body, loop = bytearray(), asyncio.get_running_loop()
    latest = loop.time() + MESSAGE_S
    try:
        async with asyncio.timeout(PAUSE_S) as patience:
            async for part in request.stream():
                body += part
                if len(body) > MOST_BYTES:
                    raise Refused(413, f"The message has more than {MOST_BYTES >> 20} MB.", headers=CLOSE)
                patience.reschedule(min(loop.time() + PAUSE_S, latest))
    except TimeoutError as error:
        raise Refused(408, "The message came too slowly.", headers=CLOSE) from error
    return bytes(body)


class TimedProtocol(H11Protocol):
    """HTTP/1.1, which closes a connection whose next request does not come whole, up to its body, in `PAUSE_S`."""

    _late: asyncio.TimerHandle | None = None

    def connection_made(self, transport: Any) -> None:
        """Wait for the first request."""
        super().connection_made(transport)
        self._time()

    def data_received(self, data: bytes) -> None:
        """Take a part of a request."""
        super().data_received(data)
        self._time()

    def connection_lost(self, exc: Exception | None) -> None:
        """Wait no longer."""
        self._forget()
        super().connection_lost(exc)

    def _time(self) -> None:
        if self.cycle is not None and not self.cycle.response_complete:
            self._forget()  # the request is there; its body is waited for where it is read
        elif self._late is None:
            self._late = self.loop.call_later(PAUSE_S, self.transport.close)

    def _forget(self) -> None:
        if self._late is not None:
            self._late.cancel()
            self._late = None
