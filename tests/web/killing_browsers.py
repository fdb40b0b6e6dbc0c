"""Page, network and server killed at random: `python tests/web/killing_browsers.py [COUNT] [SEED] [postgresql]`.

A real Chromium takes part by keys. Between it and the server stands a proxy, which can lose a request, or the answer to
one that the server has acted on, and which notes every answer that the server acknowledged. A page is reloaded, closed,
crashed, or killed with its whole browser; the server gets SIGKILL. Now and then the participant opens a second tab. At
the end each session is complete and valid, and every acknowledged answer is in its journal once, as it was sent.
"""

from __future__ import annotations

import http.client
import json
import os
import random
import signal
import subprocess
import sys
import tempfile
import threading
import time
from collections import Counter
from contextlib import ExitStack, suppress
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import Any

from playwright.sync_api import Error, Page, Playwright, sync_playwright

sys.path.insert(0, str(Path(__file__).parents[1]))
from browser import CHROMIUM, OPTIONS
from chromium import Server, step
from databases import cluster
from participant import DEPTH, NECKER, make_set

from focalgradient.dataset import read_journal, validate
from focalgradient.design import load_design
from focalgradient.web.postgres import collect_store

SHORT = "trial_s = 1.0\npractice_s = 1.0\npractice_trials = 2\nrepetitions = 1\n"
DESIGNS = {
    "necker": "".join(line for line in NECKER.splitlines(True) if line.split(" ")[0] not in SHORT) + SHORT,
    "depthrating": DEPTH.replace("repetitions = 1", "repetitions = 2"),
}
PAGE = ("reload", "close", "crash", "kill the browser")
NETWORK = ("requests lost", "acknowledgements lost")
BLANK_S = 8.0
"""After so long a participant loads an empty page again."""

MOST_EACH = 12
"""Kills of one session: the more, the longer it takes to reach its end."""

BUSY = "This session is open in another window"


class Network(ThreadingHTTPServer):
    """What stands between browser and server: it passes on, loses, and notes what was acknowledged."""

    daemon_threads = True
    request_queue_size = 128

    def __init__(self, port: int) -> None:
        super().__init__(("127.0.0.1", 0), Passing)
        self.port, self.lost = port, ""
        self.acknowledged: list[tuple[str, int, dict[str, Any]]] = []
        threading.Thread(target=self.serve_forever, daemon=True).start()

    def handle_error(self, request: Any, client_address: Any) -> None:
        """A browser that was killed has left its connections."""


class Passing(BaseHTTPRequestHandler):
    """One request."""

    server: Network

    def do_POST(self) -> None:
        """Pass it on, or lose it, or what comes back."""
        self.close_connection = True
        body = self.rfile.read(int(self.headers.get("Content-Length") or 0))
        if self.server.lost == "requests lost":
            return
        server = http.client.HTTPConnection("127.0.0.1", self.server.port, timeout=60)
        try:
            server.request(self.command, self.path, body, dict(self.headers))
            reply = server.getresponse()
            content = reply.read()
        except (OSError, http.client.HTTPException):
            return  # the server is away
        finally:
            server.close()
        if self.path == "/api/answer" and reply.status == 200 and json.loads(content)["recorded"]:
            sent = json.loads(body)
            self.server.acknowledged.append((sent["phase"], sent["trial"], sent))
        if self.server.lost:
            return
        self.send_response(reply.status)
        for name, value in reply.getheaders():
            if name.lower() not in ("date", "connection", "transfer-encoding"):
                self.send_header(name, value)
        self.send_header("Connection", "close")
        self.end_headers()
        self.wfile.write(content)

    do_GET = do_POST  # noqa: N815  the name that the library calls

    def log_message(self, *_: object) -> None:
        """Say nothing."""


class Browser:
    """A Chromium with a profile on the disk, which outlives its kill."""

    def __init__(self, playwright: Playwright, profile: Path, address: str) -> None:
        self.playwright, self.profile, self.address = playwright, profile, address
        self.open()

    def open(self) -> None:
        """Start it, and show the page."""
        assert CHROMIUM is not None
        said = self.profile / "DevToolsActivePort"
        said.unlink(missing_ok=True)
        program = [CHROMIUM, "--headless=new", "--remote-debugging-port=0", f"--user-data-dir={self.profile}"]
        self.process = subprocess.Popen(
            [*program, *OPTIONS, "--no-first-run", "--window-size=1280,800", "about:blank"],
            start_new_session=True,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )
        end = time.monotonic() + 60
        while not (said.exists() and "\n" in said.read_text()):
            assert time.monotonic() < end, "Chromium does not start"
            time.sleep(0.05)
        self.connected = self.playwright.chromium.connect_over_cdp(f"http://127.0.0.1:{said.read_text().split()[0]}")
        self.show()

    def show(self) -> None:
        """The page, in a new tab, as soon as there is a server."""
        self.page = self.connected.contexts[0].new_page()
        self.go()

    def go(self) -> None:
        """Load the page until it is there."""
        end = time.monotonic() + 60
        while True:
            with suppress(Error):
                self.page.goto(self.address, timeout=10_000)
                return
            assert time.monotonic() < end, "the page cannot be loaded"
            time.sleep(0.3)

    def kill(self, how: str) -> None:
        """Lose the page; `go_on` brings it back."""
        if how == "close":
            self.page.close()
        elif how == "crash":
            with suppress(Error):
                self.page.goto("chrome://crash", timeout=5_000)
        elif how == "kill the browser":
            os.killpg(self.process.pid, signal.SIGKILL)
            self.process.wait()

    def go_on(self, how: str) -> None:
        """What a participant would do."""
        if how == "reload":
            self.go()
        elif how == "kill the browser":
            self.open()
        else:
            with suppress(Error):
                self.page.close()
            self.show()

    def end(self) -> None:
        """Close it."""
        with suppress(Error):
            self.connected.close()
        with suppress(ProcessLookupError):
            os.killpg(self.process.pid, signal.SIGKILL)
        self.process.wait()


def answers_for(page: Page, seconds: float) -> bool:
    """Take part for so long; whether the end was reached."""
    end, blank = time.monotonic() + seconds, time.monotonic() + BLANK_S
    seen: list[str] = []
    while time.monotonic() < end:
        try:
            if page.query_selector("#complete"):
                return True
            if page.query_selector("#stage *"):
                blank = time.monotonic() + BLANK_S
            elif time.monotonic() > blank:  # its script was lost on the way
                page.reload(timeout=10_000)
            step(page, seen, "")
        except Error as error:  # the screen has changed meanwhile
            if "closed" in str(error) or "crashed" in str(error):
                raise
        time.sleep(0.05)
    return False


def second_tab(browser: Browser) -> str:
    """Open the page once more: it says that it is open elsewhere, and the first goes on."""
    if browser.page.query_selector("#stage .page, #stage canvas, #stage input") is None:
        return "nothing shown yet"
    first = browser.page.inner_text("body")
    other = browser.connected.contexts[0].new_page()
    try:
        other.goto(browser.address, timeout=10_000)
        other.wait_for_function("document.body.innerText.trim().length > 20", timeout=20_000)
        text = other.inner_text("body")
    except Error:
        return "no answer"
    finally:
        other.close()
    if BUSY in first:
        return "both wait"
    assert BUSY in text, text
    return "second was told"


def one_session(folder: Path, task: str, chance: random.Random, most: int, store: str | None = None) -> Counter[str]:
    """Take part in a session that is killed `most` times or until its end; gives how often what happened."""
    (folder / "design.toml").write_text(DESIGNS[task])
    if task == "depthrating":
        make_set(folder / "set", ["spheres-00", "spheres-01", "spheres-02"], size=(320, 241))
    server = Server(folder, 0, store=store)
    server.start("--invite", 1)
    network = Network(server.port)
    count: Counter[str] = Counter()
    with sync_playwright() as playwright:
        browser = Browser(playwright, folder / "profile", f"http://127.0.0.1:{network.server_port}/s/{server.token}")
        try:
            killed = 0
            while not answers_for(browser.page, chance.uniform(0, 9) if killed < most else 300):
                assert killed < most, browser.page.inner_text("body")
                if chance.random() < 0.1:
                    count[f"second tab: {second_tab(browser)}"] += 1
                killed += 1
                count.update(_kill(browser, network, server, chance))
        finally:
            browser.end()
            network.shutdown()
            network.server_close()
            server.end()
    if store is not None:
        collect_store(store, folder / "data")
    return count + checked(folder, network)


def _kill(browser: Browser, network: Network, server: Server, chance: random.Random) -> list[str]:
    """Kill some of the three at once, and bring them back after a while; gives what was killed."""
    chosen = [name for name in ("page", "network", "server") if chance.random() < 0.5] or ["page"]
    page, lost = chance.choice(PAGE), chance.choice(NETWORK)
    if "network" in chosen:
        network.lost = lost
        answers_for(browser.page, chance.uniform(0, 3))
    if "server" in chosen:
        server.end(signal.SIGKILL)
    if "page" in chosen:
        browser.kill(page)
    else:
        answers_for(browser.page, chance.uniform(0, 2))  # what is answered meanwhile is kept in the browser
    if "server" in chosen:
        server.start()
    network.lost = ""
    if "page" in chosen:
        browser.go_on(page)
    return ["kills", " and ".join(chosen), *([page] if "page" in chosen else []), *([lost] * ("network" in chosen))]


def checked(folder: Path, network: Network) -> Counter[str]:
    """Hold what the journal has against what was acknowledged."""
    data = folder / "data"
    found = validate(data, folder / "set" if (folder / "set").exists() else None)
    assert found.problems == (), found.problems
    log = read_journal(next((data / "sourcedata").rglob("*.jsonl")))
    trials = log.of("trial")
    planned = [(one.phase, one.trial) for one in load_design(folder / "design.toml").trials("001")]
    assert [(one["phase"], one["trial"]) for one in trials] == planned
    kept = {(one["phase"], one["trial"]): one for one in trials}
    for phase, trial, sent in network.acknowledged:
        one = kept[phase, trial]
        assert (one["attempt"], one["onset"]) == (sent["attempt"], sent["answer"]["onset"]), (phase, trial)
    again = len(network.acknowledged) - len(planned)
    return Counter(answers=len(planned), sittings=1 + len(log.of("resumed"))) + Counter(
        {"acknowledged again": again, "lines cut short": len(log.broken)}
    )


def main() -> None:
    """Kill so many times, over as many sessions as that takes, and say what happened."""
    numbers = [int(text) for text in sys.argv[1:] if text.isdecimal()]
    most, seed = (numbers + [200, 1][len(numbers) :])[:2]
    chance, count = random.Random(seed), Counter[str]()
    with ExitStack() as stack:
        databases = stack.enter_context(cluster()) if "postgresql" in sys.argv else None
        while count["kills"] < most:
            task = ("depthrating", "necker")[count["sessions"] % 2]
            with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as folder:
                store = None if databases is None else databases.address()
                count += one_session(Path(folder), task, chance, min(most - count["kills"], MOST_EACH), store)
            count["sessions"] += 1
            print(dict(count), flush=True)
    print(f"{count['kills']} kills, seed {seed}: every acknowledged answer was there once, all sessions are valid")


if __name__ == "__main__":
    main()
