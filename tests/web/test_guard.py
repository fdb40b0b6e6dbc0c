"""Limits of what browsers send: from which site, how often, how slowly; a classroom at once still takes part."""

from __future__ import annotations

import re
import socket
import sys
import threading
import time
from collections import Counter
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import closing
from pathlib import Path
from typing import Any

import pytest
import uvicorn
from participant import PASSWORD, SITTING, Participant, client_of, study
from starlette.testclient import TestClient

from focalgradient.web import Limits, application
from focalgradient.web import guard as guards
from focalgradient.web.guard import TimedProtocol

AUTH = ("experimenter", PASSWORD)
SAME: list[dict[str, str]] = [
    {},
    {"Origin": "http://testserver"},
    {"Origin": "https://testserver:443", "Sec-Fetch-Site": "same-origin"},
    {"Referer": "http://testserver/experimenter"},
    {"Origin": "https://study.example.org", "Sec-Fetch-Site": "same-origin"},  # by a proxy, which --public names
]
OTHER: list[dict[str, str]] = [
    {"Origin": "https://evil.example"},
    {"Origin": "null"},
    {"Origin": ""},
    {"Origin": "http://testserver.evil.example"},
    {"Origin": "http://testserver:8001"},
    {"Origin": "http://[testserver"},
    {"Referer": "https://evil.example/testserver"},
    {"Origin": "http://testserver", "Referer": "https://evil.example/"},
    {"Sec-Fetch-Site": "cross-site"},
    {"Sec-Fetch-Site": "same-site"},
    {"Sec-Fetch-Site": "none"},
    {"Origin": "http://testserver", "Sec-Fetch-Site": "cross-site"},
]
CHANGING = [
    *(f"/api/{name}" for name in ("join", "state", "begin", "answer", "here", "leave", "finish", "withdraw")),
    "/experimenter/stop/001",
]


def test_what_changes_something_comes_from_the_servers_own_pages(tmp_path: Path) -> None:
    client = TestClient(application(study(tmp_path), PASSWORD, public="https://study.example.org/"))
    with client:
        someone = Participant(client)
        for path in CHANGING:
            for headers in OTHER:
                reply = client.post(path, json={}, headers=headers, auth=AUTH)
                assert reply.status_code == 403, (path, headers)
                assert "another site" in reply.json()["error"]
            for headers in SAME:
                message = {"token": someone.token, "tab": "tab-1"}
                assert client.post(path, json=message, headers=headers, auth=AUTH).status_code != 403, (path, headers)


def test_who_joins_too_often_is_asked_to_wait(tmp_path: Path) -> None:
    with client_of(study(tmp_path), Limits(joins=2)) as client:
        replies = [client.post("/api/join", json={"platform": {}}) for _ in range(6)]
        assert [reply.status_code for reply in replies] == [200] * 4 + [429] * 2
        assert 1 <= int(replies[-1].headers["retry-after"]) <= 30
        someone = Participant(client, replies[0].json()["token"])
        assert someone.begin().status_code == 200  # who is in is not kept waiting


def test_wrong_passwords_are_slowed_down_and_right_ones_pass(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys.modules[application.__module__], "SLOWEST_GUESS_S", 0.5)
    monkeypatch.setattr(sys.modules[application.__module__], "MOST_GUESSES", 4)
    client = TestClient(application(study(tmp_path), PASSWORD, limits=Limits(guesses=3)), client=("192.0.2.1", 1))
    address = "/experimenter/overview.json"
    assert client.get(address).status_code == 401  # what a browser asks first is no guess

    def guess(number: int) -> tuple[int, float]:
        begun = time.monotonic()
        status = client.get(address, auth=("experimenter", f"{number}")).status_code
        return status, time.monotonic() - begun

    with client:
        assert [guess(number)[0] for number in range(6)] == [401] * 6
        assert guess(7)[1] > 0.4
        with ThreadPoolExecutor(12) as threads:
            burst = [threads.submit(guess, number) for number in range(12)]
            time.sleep(0.2)
            begun = time.monotonic()
            assert client.get(address, auth=AUTH).status_code == 200  # from the address of the guesses
            assert time.monotonic() - begun < 0.4
        assert {reply.result()[0] for reply in burst} == {401, 429}


@pytest.fixture
def port(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[int]:
    """A server with short times; its port."""
    monkeypatch.setattr(guards, "PAUSE_S", 0.5)
    monkeypatch.setattr(guards, "MESSAGE_S", 2.0)
    listening = socket.create_server(("127.0.0.1", 0), backlog=512)
    config = uvicorn.Config(application(study(tmp_path), PASSWORD), http=TimedProtocol, log_level="error", ws="none")
    server = uvicorn.Server(config)
    thread = threading.Thread(target=server.run, kwargs={"sockets": [listening]})
    thread.start()
    yield listening.getsockname()[1]
    server.should_exit = True
    thread.join(30)
    assert not thread.is_alive()


HEAD = b"POST /api/join HTTP/1.1\r\nHost: x\r\nContent-Type: application/json\r\nContent-Length: %d\r\n\r\n"
SLOW = {
    "nothing": (b"", b""),
    "half a head": (HEAD[:30], b""),
    "a head without its body": (HEAD % 100, b""),
    "half a body": (HEAD % 100 + b'{"platform": ', b""),
    "a head by drops": (HEAD[:10], b"x"),
    "a body by drops": (HEAD % 100, b" "),
}


@pytest.mark.fast_cases(3)
@pytest.mark.parametrize("kind", SLOW)
def test_what_comes_too_slowly_is_closed(port: int, kind: str) -> None:
    first, drop = SLOW[kind]
    begun = time.monotonic()
    many = [socket.create_connection(("127.0.0.1", port)) for _ in range(50)]
    for one in many:
        one.sendall(first)
        one.settimeout(0.1)
    still, said = set(many), Counter[bytes]()
    while still and time.monotonic() < begun + 20:
        for one in sorted(still, key=id):
            try:
                if drop:
                    one.sendall(drop)
                one.settimeout(0.002)
                content = one.recv(1000)
            except TimeoutError:
                continue
            except OSError:
                content = b""
            if content:
                said.update(re.findall(rb"HTTP/1.1 \d+", content))
            else:
                still.discard(one)
                one.close()
    assert not still
    assert time.monotonic() - begun < 10
    assert set(said) <= {b"HTTP/1.1 408"}
    with closing(socket.create_connection(("127.0.0.1", port))) as well:
        well.sendall(HEAD % 16 + b'{"platform": {}}')
        well.settimeout(10)
        assert well.recv(1000).startswith(b"HTTP/1.1 200")


def _read_to_the_end(connection: socket.socket) -> None:
    while connection.recv(1 << 20):
        pass


@pytest.mark.slow
def test_who_reads_nothing_is_cut_off_and_others_are_served(port: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(guards, "UNREAD_S", 0.5)
    page = b"GET /static/page.js HTTP/1.1\r\nHost: x\r\n\r\n"
    many = [socket.create_connection(("127.0.0.1", port)) for _ in range(20)]
    for one in many:
        one.sendall(page * 20)
    begun = time.monotonic()
    with closing(socket.create_connection(("127.0.0.1", port))) as well:
        well.settimeout(10)
        well.sendall(page)
        assert well.recv(1000).startswith(b"HTTP/1.1 200")
    assert time.monotonic() - begun < 3
    time.sleep(1.5)
    for one in many:
        one.settimeout(5)
        with closing(one), pytest.raises(ConnectionResetError):
            _read_to_the_end(one)


@pytest.mark.slow
def test_a_connection_that_is_kept_serves_the_next_request(port: int) -> None:
    message = HEAD % 16 + b'{"platform": {}}'
    with closing(socket.create_connection(("127.0.0.1", port))) as one:
        one.settimeout(10)
        for _ in range(3):
            one.sendall(message[:40])
            time.sleep(0.2)
            one.sendall(message[40:-5])
            time.sleep(0.2)
            one.sendall(message[-5:])
            reply = b""
            while not reply.endswith(b"}"):
                reply += one.recv(2000)
            assert reply.startswith(b"HTTP/1.1 200")
            time.sleep(0.7)  # longer than what a request may take


def test_a_classroom_of_60_behind_one_address_takes_part_at_once(tmp_path: Path) -> None:
    with client_of(study(tmp_path)) as client:

        def take_part(number: int) -> list[int]:
            secret = f"a-secret-of-the-browser-number-{number:03}"
            replies = [client.post("/api/join", json={"platform": {}, "secret": secret}) for _ in range(2)]  # reloaded
            who: dict[str, Any] = {"token": secret, "tab": f"tab-{number}"}
            replies += [client.post("/api/state", json=who), client.post("/api/begin", json={**who, **SITTING})]
            return [reply.status_code for reply in replies]

        with ThreadPoolExecutor(16) as threads:
            statuses = Counter(code for codes in threads.map(take_part, range(60)) for code in codes)
        assert statuses == {200: 240}
        rows = client.get("/experimenter/overview.json", auth=AUTH).json()["participants"]
        assert [row["participant"] for row in rows] == [f"{number:03}" for number in range(1, 61)]
