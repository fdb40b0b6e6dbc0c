"""Protection of the server: origin, rate and speed of requests are limited."""

from __future__ import annotations

import asyncio
import ipaddress
import math
import socket
import struct
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

SMALL_BYTES = 64 << 10
"""Maximum size in bytes of a message, except responses, whose size depends on the design."""

PAUSE_S = 5.0
"""Maximum pause within a message or its head, in s: lost packets are resent within one or two."""

MESSAGE_S = 30.0
"""Maximum duration of a message, in s: 1.5 MB at 0.4 Mbit/s, a slow mobile network."""

BURST_MINUTES = 2
"""Burst size, in minutes of the permitted rate: at 60 per min, a class of 60 whose browsers all load the page twice."""

TOTAL_RATIO = 4
"""Total quota of all addresses, in multiples of one address's quota."""

UNREAD_S = 30.0
"""Maximum time in s in which a client must read `UNREAD_BYTES` of a response: longer than a network loss of 20 s."""

UNREAD_BYTES = 30_000
"""Minimum number of bytes read within `UNREAD_S`: 8 kbit/s, a fiftieth of a slow mobile network."""

KERNEL_BYTES = 1 << 18
"""Maximum size in bytes of the kernel's send buffer of a connection; several MB by default."""

SLOWEST_GUESS_S = 10.0
"""Maximum delay of the answer to a wrong password, in s."""

MOST_GUESSES = 50
"""Maximum number of wrong passwords whose answers are delayed at the same time; others are refused."""

CLOSE = {"Connection": "close"}
"""Header of a response after which the rest of the message is not read."""

MOST_KEYS = 10_000
"""Maximum number of addresses remembered, which occupy a few MB."""


@dataclass(frozen=True, slots=True)
class Limits:
    """Maximum rates of joining and of password guesses per address; for all addresses together, four times as much.

    Parameters
    ----------
    joins
        Participants per minute on the open link; twice as many may arrive at once.
    guesses
        Wrong passwords for the experimenter's page per minute that are answered at once, after twice as many; further
        ones are answered late.
    """

    joins: int = 60
    guesses: int = 6

    def __post_init__(self) -> None:
        check_number("joins", self.joins, "people per minute", positive=True)
        check_number("guesses", self.guesses, "passwords per minute", positive=True)


class Rate:
    """Rate limiter per address and in total (generic cell rate algorithm, ITU-T I.371).

    Parameters
    ----------
    per_minute
        Maximum rate per address; the quota of `BURST_MINUTES` minutes may be used at once, and `TOTAL_RATIO` times as
        much in total.
    in_all
        Whether the total is limited; otherwise only each address, or each session by its label.
    clock
        Function that returns the time in s.

    Examples
    --------
    >>> rate = Rate(1, clock=lambda: 0.0)
    >>> for _ in range(2):
    ...     rate.count("192.0.2.1")
    >>> rate.wait("192.0.2.1"), rate.wait("192.0.2.2")
    (60.0, 0.0)
    """

    def __init__(self, per_minute: float, *, in_all: bool = True, clock: Callable[[], float] = time.monotonic):
        self._interval, self._in_all, self._clock = 60 / per_minute, in_all, clock
        self._burst = BURST_MINUTES * 60.0
        self._until: dict[str, float] = {}

    def _intervals(self, address: str) -> tuple[tuple[str, float], ...]:
        one = (_network(address), self._interval)
        return (("", self._interval / TOTAL_RATIO), one) if self._in_all else (one,)

    def wait(self, address: str) -> float:
        """Return the time in s until an address's next event is allowed."""
        now = self._clock()
        keys = self._intervals(address)
        return max([0.0, *(self._until.get(key, now) - now - self._burst + interval for key, interval in keys)])

    def count(self, address: str) -> None:
        """Count one event."""
        now = self._clock()
        for key, interval in self._intervals(address):
            self._until[key] = max(self._until.get(key, now), now) + interval
        if len(self._until) > MOST_KEYS:
            self._until = {key: until for key, until in self._until.items() if until > now}


def _network(address: str) -> str:
    """Return the network that counts as one address: for IPv6 the first 64 bits, which belong to one household.

    >>> _network("2001:db8::1"), _network("192.0.2.1"), _network("unix")
    ('2001:db8::/64', '192.0.2.1', 'unix')
    """
    try:
        found = ipaddress.ip_address(address)
    except ValueError:
        return address
    return address if found.version == 4 else str(ipaddress.ip_network((found, 64), strict=False))


def too_many(wait: float, sentence: str) -> Refused:
    """Return a refusal with status 429 that states when to retry."""
    return Refused(429, sentence, headers={"Retry-After": str(max(1, math.ceil(wait)))})


class SameOrigin:
    """Middleware that rejects requests from pages of other sites, by Sec-Fetch-Site, Origin and Referer.

    Browsers state the origin of every POST request. A program that sends none of the three headers is not a browser,
    whose user another site could exploit.

    Parameters
    ----------
    app
        Application that handles the other requests.
    public
        Address at which participants' browsers reach the server, if a proxy sends a different Host header.
    """

    def __init__(self, app: ASGIApp, public: str | None = None):
        self._app, self._public = app, _host(public or "")

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Pass the request on, or reject it."""
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
    """Return host and port of an address, without the scheme's default port; "" if there is no host.

    >>> _host("https://Lab.example.org:443/s/x"), _host("//127.0.0.1:8000"), _host("null")
    ('lab.example.org', '127.0.0.1:8000', '')
    """
    try:
        found = urlsplit(address)
        port = found.port
    except ValueError:
        return ""
    return (found.hostname or "") + (f":{port}" if port not in (None, 80, 443) else "")


async def read_body(request: Request, most: int = SMALL_BYTES) -> bytes:
    """Read the body of a message; raise `Refused` and close the connection if it exceeds `most` bytes or is slow."""
    body, loop = bytearray(), asyncio.get_running_loop()
    latest = loop.time() + MESSAGE_S
    try:
        async with asyncio.timeout(PAUSE_S) as patience:
            async for part in request.stream():
                body += part
                if len(body) > most:
                    raise Refused(413, f"The message exceeds {most >> 10} kB.", headers=CLOSE)
                patience.reschedule(min(loop.time() + PAUSE_S, latest))
    except TimeoutError as error:
        raise Refused(408, "The message was sent too slowly.", headers=CLOSE) from error
    return bytes(body)


class TimedProtocol(H11Protocol):
    """HTTP/1.1 protocol that closes a connection whose client sends or reads too slowly.

    The head of the next request must be complete within `PAUSE_S`. While a response is unread, the next request is not
    handled, and the connection is closed unless `UNREAD_BYTES` are read within each `UNREAD_S`.
    """

    _late: asyncio.TimerHandle | None = None
    _unread: asyncio.TimerHandle | None = None

    def connection_made(self, transport: Any) -> None:
        """Start waiting for the first request."""
        super().connection_made(transport)
        transport.set_write_buffer_limits(high=0)  # `pause_writing` is called whenever something is unread
        if (connection := transport.get_extra_info("socket")) is not None:
            connection.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, KERNEL_BYTES)
        self._time()

    def pause_writing(self) -> None:
        """Start waiting for the client to read."""
        super().pause_writing()
        self._expect_reading()

    def resume_writing(self) -> None:
        """Stop waiting, because everything was read."""
        self._stop_expecting()
        super().resume_writing()

    def _expect_reading(self) -> None:
        size = self.transport.get_write_buffer_size()
        self._unread = self.loop.call_later(UNREAD_S, self._check_reading, max(0, size - UNREAD_BYTES))

    def _check_reading(self, most: int) -> None:
        if self.transport.get_write_buffer_size() > most:
            if (connection := self.transport.get_extra_info("socket")) is not None:  # drop the kernel's buffer, too
                connection.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
            self.transport.abort()
        else:
            self._expect_reading()

    def _stop_expecting(self) -> None:
        if self._unread is not None:
            self._unread.cancel()
            self._unread = None

    def data_received(self, data: bytes) -> None:
        """Process a part of a request."""
        super().data_received(data)
        self._time()

    def connection_lost(self, exc: Exception | None) -> None:
        """Stop waiting."""
        self._forget()
        self._stop_expecting()
        super().connection_lost(exc)

    def _time(self) -> None:
        if self.cycle is not None and not self.cycle.response_complete:
            self._forget()  # the head is complete; `read_body` limits the time for the body
        elif self._late is None:
            self._late = self.loop.call_later(PAUSE_S, self.transport.close)

    def _forget(self) -> None:
        if self._late is not None:
            self._late.cancel()
            self._late = None
