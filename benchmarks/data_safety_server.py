"""Cases of `data_safety.py` on the server: sessions of others, full disks, remains after withdrawal, floods."""

from __future__ import annotations

import errno
import hashlib
import os
import re
import socket
import subprocess
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from importlib import import_module
from pathlib import Path
from typing import Any

from reruns import Lines
from starlette.testclient import TestClient

from focalgradient.design import load_design
from focalgradient.web import People, Study, application

DESIGN = """
task = "necker"
repetitions = 1
trial_s = 2.0
practice_s = 2.0
practice_trials = 2
catch_trials = 0
strengths_mm = [4.0]
break_every = 0
"""
SCREEN = {"screen_px": [1920, 1080], "pixel_ratio": 1.0, "refresh_hz": 60.0, "browser": "none", "now_ms": 0.0}
FRAMES = {"shown": [{"event": "cube", "stamps": [16.67 * number for number in range(120)]}]}
PASSWORD = "secret"
TESTS = Path(__file__).parents[1] / "tests"
sys.path.insert(0, str(TESTS / "web"))
Hurried = import_module("hurried").Hurried  # clock of the tests, which advances with each answer

PROGRAM = str(Path(sys.executable).with_name("focalgradient"))


@contextmanager
def served(folder: Path) -> Iterator[TestClient]:
    """Yield a client of a server with its data in a folder."""
    (folder / "design.toml").write_text(DESIGN)
    people = People(folder / "data-links.jsonl", data=folder / "data")
    study = Study(load_design(folder / "design.toml"), folder / "data", people)
    study.clock = Hurried()
    with TestClient(application(study, PASSWORD), raise_server_exceptions=False) as client:
        yield client


def take_part(client: TestClient, platform: dict[str, str]) -> str:
    """Take part from the open link to the end; return the secret."""
    token = str(client.post("/api/join", json={"platform": platform}).json()["token"])
    who = {"token": token, "tab": "tab"}
    trials = client.post("/api/begin", json={**who, **SCREEN}).json()["trials"]
    practised: list[dict[str, Any]] = []
    for number, trial in enumerate(trials):
        Hurried.ahead += 10.0
        answer = {"onset": 10.0 * number, "presses": [[0.5, "f", True], [1.5, "f", False]], "trial_duration": 2.0}
        key = {"phase": trial["phase"], "trial": trial["trial"]}
        passed = {}
        if trial["phase"] == "practice":
            practised.append({**key, "answer": {**answer, "frames": FRAMES}})
        elif practised:
            judged = client.post("/api/judge", json={**who, "round": 20, "answers": practised}).json()
            passed = {"practice_token": judged["practice_token"]}
        given = client.post("/api/next", json={**who, **key, **passed}).json()
        client.post("/api/expose", json={**who, **key, "round": 1, "exposure": f"e-{number}"}).raise_for_status()
        key |= {"attempt": f"attempt-{number}", "trial_token": given["trial_tokens"][0]}
        client.post("/api/answer", json={**who, **key, "answer": {**answer, "frames": FRAMES}}).raise_for_status()
    client.post("/api/finish", json=who).raise_for_status()
    return token


def other_sessions() -> str:
    """Count how many of five complete sessions remain after someone tries identifiers 1 to 5."""
    with tempfile.TemporaryDirectory() as folder, served(Path(folder)) as client:
        for number in range(1, 6):
            take_part(client, {"id": str(number)})
        for number in range(1, 6):
            token = client.post("/api/join", json={"platform": {"id": str(number)}}).json()["token"]
            client.post("/api/withdraw", json={"token": token, "tab": "tab"})
        left = len(list(Path(folder, "data").rglob("sub-*_beh.jsonl")))
    return f"{5 - left} of 5 removed"


def full_disk() -> str:
    """Report the response to joining at each number of free bytes, and whether the server restarts."""
    replies, starts, write = Counter[str](), 0, os.write
    rooms = range(0, 120, 10)
    for room in rooms:
        with tempfile.TemporaryDirectory() as folder:
            with served(Path(folder)) as client:
                left = [room]

                def limited(file: int, content: Any, left: list[int] = left) -> int:
                    if not left[0]:
                        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
                    count = write(file, bytes(content)[: left[0]])
                    left[0] -= count
                    return count

                os.write = limited
                try:
                    status = client.post("/api/join", json={"platform": {}}).status_code
                finally:
                    os.write = write
                replies["token" if status == 200 else str(status)] += 1
                client.post("/api/join", json={"platform": {}})
            try:
                People(Path(folder, "data-links.jsonl")).close()
                starts += 1
            except Exception as error:  # a failed start is a result
                print(f"{room} bytes left: {error}", file=sys.stderr)
    found = ", ".join(f"{count} x {reply}" for reply, count in sorted(replies.items()))
    return f"{found}; starts again {starts} of {len(rooms)}"


def after_withdrawal() -> str:
    """List names left in data and links after a withdrawal by the page and by the command."""
    left = {}
    for way in ("page", "command"):
        with tempfile.TemporaryDirectory() as folder:
            root = Path(folder)
            platform = {"PROLIFIC_PID": "5f1e4c0d9b", "SESSION_ID": "session-17"}
            with served(root) as client:
                token = take_part(client, platform)
                if way == "page":
                    client.post("/api/withdraw", json={"token": token, "tab": "tab"})
            if way == "command":
                command = [PROGRAM, "withdraw", str(root / "data"), "sub-001", "--yes"]
                subprocess.run(command, check=True, capture_output=True)
            names = {
                **platform,
                "label": '"001"',
                "digest": hashlib.sha256(token.encode()).hexdigest(),
                "sub": "sub-001",
            }
            names["date"] = time.strftime("%Y-%m-%d", time.gmtime())
            content = b"\n".join(path.read_bytes() for path in root.rglob("*") if path.is_file())
            left[way] = [name for name, value in names.items() if value.encode() in content]
    return "; ".join(f"{way}: {', '.join(names) or 'nothing'}" for way, names in left.items())


def stop_from_elsewhere() -> str:
    """Report the response to requests from another site to stop a session."""
    evil = "https://evil.example"
    with tempfile.TemporaryDirectory() as folder, served(Path(folder)) as client:
        take_part(client, {})
        address, auth = "/experimenter/stop/001", ("experimenter", PASSWORD)
        found = {
            name: client.post(address, auth=auth, headers={name: value}).status_code
            for name, value in (("Sec-Fetch-Site", "cross-site"), ("Origin", evil), ("Referer", evil))
        }
    return ", ".join(f"{name}: {status}" for name, status in found.items())


def slow_messages() -> str:
    """Count how many of 300 half-sent messages are open after 12 s, for the server of the command."""
    with tempfile.TemporaryDirectory() as folder:
        Path(folder, "design.toml").write_text(DESIGN)
        command = [PROGRAM, "serve", "design.toml", "--data", "data", "--port", "0"]
        with subprocess.Popen(command, cwd=folder, stdout=subprocess.PIPE, text=True) as server:
            assert server.stdout is not None
            said = next(line for line in server.stdout if "http://" in line)
            port = int(re.findall(r":(\d+)/", said)[0])
            many = [socket.create_connection(("127.0.0.1", port)) for _ in range(300)]
            for one in many:
                one.sendall(b"POST /api/join HTTP/1.1\r\nHost: x\r\nContent-Length: 100\r\n\r\n{")
            time.sleep(12)
            still = sum(_is_open(one) for one in many)
            server.terminate()
    return f"{still} of 300 open after 12 s"


def _is_open(one: socket.socket) -> bool:
    one.setblocking(False)
    try:
        while one.recv(4096):
            pass
        return False
    except BlockingIOError:
        return True
    finally:
        one.close()


def _guess(client: TestClient, password: str) -> int:
    return client.get("/experimenter", auth=("experimenter", password)).status_code


def flood() -> str:
    """Count how many of 600 joins, and of 600 wrong passwords, one address can send at once."""
    with tempfile.TemporaryDirectory() as folder, served(Path(folder)) as client:
        joined = [client.post("/api/join", json={"platform": {}}).status_code for _ in range(600)]
        with ThreadPoolExecutor(600) as at_once:  # one after another, each is answered after up to 10 s
            guessed = [*at_once.map(lambda one: _guess(client, str(one)), range(600))]
    return f"{joined.count(200)} of 600 joins, {guessed.count(401)} of 600 passwords"


def register(table: Lines) -> None:
    """Add the lines of this file to a table."""
    table.line("1.1", "identifiers 1 to 5 tried by the open link", "5 of 5 removed")(other_sessions)
    table.line("1.2", "joining with 0 to 110 bytes left", "1 x 500, 11 x token; starts again 1 of 12")(full_disk)
    names = "PROLIFIC_PID, SESSION_ID, label, digest, sub, date"
    table.line("1.3", "left after withdrawing", f"page: {names}; command: {names}")(after_withdrawal)
    table.line("1.4.1", "stop from another site", "Sec-Fetch-Site: 403, Origin: 200, Referer: 200")(stop_from_elsewhere)
    table.line("1.4.2", "half-sent messages", "300 of 300 open after 12 s")(slow_messages)
    table.line("1.4.3", "taken at once from one address", "600 of 600 joins, 600 of 600 passwords")(flood)
