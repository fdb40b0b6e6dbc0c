"""Routes of the server: the page, its pictures and messages, and the experimenter's page."""

from __future__ import annotations

import asyncio
import hashlib
import hmac
import io
import os
import socket
import sys
import zipfile
from base64 import b64decode
from collections.abc import Callable, Mapping
from contextlib import asynccontextmanager
from functools import cache
from importlib.resources import files
from typing import Any

import uvicorn
from pydantic import BaseModel, ValidationError
from starlette.applications import Starlette
from starlette.concurrency import run_in_threadpool
from starlette.middleware import Middleware
from starlette.requests import ClientDisconnect, Request
from starlette.responses import JSONResponse, Response
from starlette.routing import Route
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from focalgradient.errors import InputError, one_line
from focalgradient.web.answers import first_problem
from focalgradient.web.guard import (
    MOST_GUESSES,
    SLOWEST_GUESS_S,
    SMALL_BYTES,
    Limits,
    Rate,
    SameOrigin,
    TimedProtocol,
    read_body,
    too_many,
)
from focalgradient.web.messages import Begin, Expose, Given, Join, Judge, Next, Who
from focalgradient.web.pictures import FILM, PNG, REFOCUSING, refocusing
from focalgradient.web.possible import most_bytes
from focalgradient.web.store import Refused
from focalgradient.web.study import Study

__all__ = ["application", "check_page", "run"]

HEADERS = {
    "Content-Security-Policy": (
        "default-src 'none'; script-src 'self'; style-src 'self' 'unsafe-inline'; img-src 'self' data: blob:; "
        "connect-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
    ),
    "X-Content-Type-Options": "nosniff",
    "Referrer-Policy": "no-referrer",
    "Cross-Origin-Opener-Policy": "same-origin",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Permissions-Policy": "camera=(), microphone=(), geolocation=()",
}
"""HTTP headers of every response: resources of other sites are not loaded, other sites cannot embed the page, and links
are not passed on as referrers. The first two Cross-Origin headers give performance.now() its finest resolution.
"""

STATIC = {
    name: f"text/{kind}; charset=utf-8"
    for name, kind in (("page.js", "javascript"), ("experimenter.js", "javascript"), ("page.css", "css"))
}


class Headers:
    """Middleware that adds `HEADERS` to every response."""

    def __init__(self, app: ASGIApp):
        self._app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Pass the request on, and add the headers to the response."""

        async def with_headers(message: Message) -> None:
            if message["type"] == "http.response.start":
                own = [(name.lower().encode(), value.encode()) for name, value in HEADERS.items()]
                message = {**message, "headers": [*message.get("headers", ()), *own]}
            await send(message)

        await self._app(scope, receive, with_headers if scope["type"] == "http" else send)


def check_page() -> None:
    """Raise `InputError` unless the page is bundled from its present sources, as at building and set-up."""
    web = files("focalgradient.web")
    made = web / "static" / "sources.sha256"
    shared = files("focalgradient.live") / "gl.js"
    pages = sorted((web / "page").iterdir(), key=lambda file: file.name)
    sources = b"".join(file.read_bytes() for file in (*pages, shared))
    if not made.is_file() or made.read_text(encoding="utf-8") != hashlib.sha256(sources).hexdigest():
        raise InputError(
            "the page for browsers is not built, or from older sources: run 'make', or '.venv/bin/python "
            "hatch_build.py', in the checkout, or install a wheel."
        )


@cache
def _static(name: str) -> bytes:
    return (files("focalgradient.web") / "static" / name).read_bytes()


async def _message(request: Request, kind: type[BaseModel], most: int = SMALL_BYTES) -> Any:
    """Parse a message of the given type and of at most `most` bytes; raise `Refused` if it is invalid."""
    try:
        body = await read_body(request, most)
    except ClientDisconnect as error:
        raise Refused(400, "The message was incomplete.") from error
    try:
        return await run_in_threadpool(kind.model_validate_json, body)
    except ValidationError as error:
        raise Refused(400, f"The message is invalid: {first_problem(error)}.") from error
    except RecursionError as error:
        raise Refused(400, "The message is nested too deeply.") from error


async def _refused(_: Request, error: Exception) -> Response:
    assert isinstance(error, Refused)
    return JSONResponse(error.content, error.status, error.headers)


async def _wrong(_: Request, error: Exception) -> Response:
    """Print the fault on the server's terminal, because it may contain file names; send the page a general message."""
    print(f"Error: {one_line(error)}", file=sys.stderr, flush=True)
    if isinstance(error, OSError) or isinstance(error.__cause__, OSError):  # a full disk: nothing was acknowledged
        return JSONResponse({"error": "The server cannot write at the moment."}, 503, {"Retry-After": "5"})
    return JSONResponse({"error": "The study cannot continue: tell the person who gave you the link."}, 400)


class _Pages:
    """Endpoints for pages, pictures and the experimenter's views."""

    def __init__(self, study: Study, password: str, limits: Limits) -> None:
        self._study, self._password = study, password
        self._joins, self._guesses = Rate(limits.joins), Rate(limits.guesses)
        self._delayed = 0

    async def join(self, request: Request) -> Response:
        """Handle a new participant on the open link, at a limited rate."""
        address = _address(request)
        if wait := self._joins.wait(address):
            raise too_many(wait, "Too many people join at this moment: wait a little, and load the page again.")
        self._joins.count(address)
        given = await _message(request, Join)
        return JSONResponse(dict(await run_in_threadpool(self._study.join, given)))

    async def page(self, _: Request) -> Response:
        return Response(
            _static("index.html"), media_type="text/html; charset=utf-8", headers={"Cache-Control": "no-store"}
        )

    async def opening(self, _: Request) -> Response:
        return JSONResponse(self._study.opening(), headers={"Cache-Control": "no-store"})

    async def static(self, request: Request) -> Response:
        name = request.path_params["name"]
        if name == REFOCUSING:
            return Response(refocusing(), media_type=STATIC["page.js"], headers={"Cache-Control": "no-cache"})
        if name not in STATIC:
            raise Refused(404, "There is no such file.")
        return Response(_static(name), media_type=STATIC[name], headers={"Cache-Control": "no-cache"})

    async def picture(self, request: Request) -> Response:
        token = (request.headers.get("authorization") or "").removeprefix("Bearer ")
        content = await run_in_threadpool(self._study.picture, token, **request.path_params)
        kind = {PNG[:1]: "image/png", FILM: "application/octet-stream"}.get(content[:1], "application/json")
        return Response(content, media_type=kind, headers={"Cache-Control": "no-store"})

    async def _allow(self, request: Request) -> None:
        """Raise `Refused` unless the request has the experimenter's password; the answer to wrong ones is delayed."""
        given, address = request.headers.get("authorization"), _address(request)
        scheme, _, encoded = (given or "").partition(" ")
        try:
            credentials = b64decode(encoded, validate=True) if scheme.lower() == "basic" else b""
        except ValueError:
            credentials = b""
        if hmac.compare_digest(credentials, f"experimenter:{self._password}".encode()):
            return
        if given is not None:
            await self._delay(address)
        headers = {"WWW-Authenticate": 'Basic realm="experimenter"'}
        raise Refused(401, "Give the experimenter's password.", headers=headers)

    async def _delay(self, address: str) -> None:
        wait = min(self._guesses.wait(address), SLOWEST_GUESS_S)
        if wait and self._delayed >= MOST_GUESSES:
            raise too_many(wait, "Too many wrong passwords: wait a little.")
        if wait < SLOWEST_GUESS_S:
            self._guesses.count(address)
        self._delayed += 1
        try:
            await asyncio.sleep(wait)
        finally:
            self._delayed -= 1

    async def experimenter(self, request: Request) -> Response:
        await self._allow(request)
        return Response(_static("experimenter.html"), media_type="text/html; charset=utf-8")

    async def overview(self, request: Request) -> Response:
        await self._allow(request)
        return JSONResponse(await run_in_threadpool(self._study.summary))

    async def stop(self, request: Request) -> Response:
        await self._allow(request)
        participant = request.path_params["participant"]
        if participant not in self._study.people.everybody():
            raise Refused(404, "There is no such participant.")
        await run_in_threadpool(self._study.stop, participant)
        return JSONResponse({})

    async def data(self, request: Request) -> Response:
        await self._allow(request)
        content = await run_in_threadpool(_zipped, self._study)
        headers = {"Content-Disposition": 'attachment; filename="data.zip"'}
        return Response(content, media_type="application/zip", headers=headers)


def _address(request: Request) -> str:
    """Return the browser's address; for a local proxy, the address that it forwards (uvicorn reads X-Forwarded-For)."""
    return "" if request.client is None else request.client.host


def application(study: Study, password: str, *, limits: Limits | None = None, public: str | None = None) -> Starlette:
    """Return the server's application (ASGI).

    Parameters
    ----------
    study
        Study to run; closed when the server ends.
    password
        Password of the experimenter's page, whose user name is "experimenter".
    limits
        Maximum rates of joining and of password guesses per address; default: `Limits()`.
    public
        Address at which participants reach the server, if it is behind a proxy.
    """
    pages = _Pages(study, password, limits or Limits())

    @asynccontextmanager
    async def lifespan(_: Starlette) -> Any:
        yield
        await run_in_threadpool(study.close)

    def post(path: str, kind: type[BaseModel], act: Callable[[Any], Mapping[str, Any]]) -> Route:
        most = most_bytes(study.design) if kind in (Given, Judge) else SMALL_BYTES

        async def endpoint(request: Request) -> Response:
            given = await _message(request, kind, most)
            return JSONResponse(dict(await run_in_threadpool(act, given)))  # in a thread, because files are written

        return Route(path, endpoint, methods=["POST"])

    return Starlette(
        routes=[
            Route("/", pages.page),
            Route("/s/{token:str}", pages.page),
            Route("/static/{name:str}", pages.static),
            Route("/pictures/standard", pages.picture),
            Route("/pictures/{phase:str}/{trial:int}/{number:int}", pages.picture),
            Route("/api/join", pages.join, methods=["POST"]),
            Route("/api/opening", pages.opening),
            post("/api/state", Who, study.state),
            post("/api/begin", Begin, study.begin),
            post("/api/expose", Expose, study.expose),
            post("/api/answer", Given, study.answer),
            post("/api/next", Next, study.next),
            post("/api/judge", Judge, study.judge),
            post("/api/here", Who, study.here),
            post("/api/leave", Who, study.leave),
            post("/api/finish", Who, study.finish),
            post("/api/withdraw", Who, study.withdraw),
            Route("/experimenter", pages.experimenter),
            Route("/experimenter/overview.json", pages.overview),
            Route("/experimenter/data.zip", pages.data),
            Route("/experimenter/stop/{participant:str}", pages.stop, methods=["POST"]),
        ],
        middleware=[Middleware(Headers), Middleware(SameOrigin, public=public)],
        exception_handlers={Refused: _refused, InputError: _wrong, OSError: _wrong},
        lifespan=lifespan,
    )


def _zipped(study: Study) -> bytes:
    """Return the data set as a ZIP archive, without the file of links, which identifies participants."""
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_DEFLATED) as archive, study.store.data() as data:
        for folder, _, names in os.walk(data):
            for name in sorted(names):
                path = os.path.join(folder, name)
                archive.write(path, os.path.relpath(path, data))
    return buffer.getvalue()


def run(
    study: Study,
    password: str,
    host: str,
    port: int,
    ready: Callable[[str], object],
    *,
    limits: Limits | None = None,
    public: str | None = None,
) -> None:
    """Serve a study until the process is terminated.

    Parameters
    ----------
    study, password
        As for `application`.
    host, port
        Address and port to listen on; port 0: any free one.
    ready
        Called with the address, such as "http://127.0.0.1:8000", once the server is listening.
    limits, public
        As for `application`.

    Raises
    ------
    InputError
        If the address is in use, or does not belong to this computer.
    """
    app = application(study, password, limits=limits, public=public)
    config = uvicorn.Config(
        app, host=host, port=port, http=TimedProtocol, log_level="warning", server_header=False, ws="none"
    )
    listening = socket.socket(socket.AF_INET6 if ":" in host else socket.AF_INET)
    listening.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    try:
        listening.bind((host, port))
        listening.listen(1024)  # connections made before the server has started wait for it
    except OSError as error:
        listening.close()
        study.close()
        raise InputError(f"{host} port {port} cannot be used ({error.strerror}): give another host or port.") from error
    ready(f"http://{host}:{listening.getsockname()[1]}")
    uvicorn.Server(config).run(sockets=[listening])
