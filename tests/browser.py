"""A browser without a window, spoken to through a pair of pipes (Chromium's DevTools protocol)."""

from __future__ import annotations

import base64
import itertools
import json
import os
import select
import shutil
import subprocess
import time
from collections.abc import Mapping
from pathlib import Path
from types import TracebackType
from typing import Any, Self

CHROMIUM = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)

PATIENCE = 120.0
"""Seconds to wait for an answer."""


_CUT = """scrolled => [...document.querySelectorAll("body *")].filter(one => {
    const box = one.getBoundingClientRect(), wide = document.documentElement.clientWidth;
    if (scrolled && one.scrollWidth > one.clientWidth + 1 && getComputedStyle(one).overflowX === "auto") return true;
    if (!box.width || (box.left >= -1 && box.right <= wide + 1)) return false;
    for (let outer = one.parentElement; outer !== document.body; outer = outer.parentElement)
        if (getComputedStyle(outer).overflowX === "auto") return false;
    return true;
}).map(one => `${one.tagName} ${one.innerText.slice(0, 60)}`)"""
"""What leaves the page, in the page's own words."""


class Browser:
    """Chromium with one page; `events` are what it told unasked, `profile` is an empty folder of its own."""

    def __init__(self, profile: Path) -> None:
        assert CHROMIUM is not None
        its_input, ours = os.pipe()
        mine, its_output = os.pipe()
        command = [CHROMIUM, "--headless=new", "--remote-debugging-pipe", "--no-sandbox"]
        command += ["--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]  # WebGL by software
        command += [f"--user-data-dir={profile}", "--no-first-run", "--disable-background-networking", "about:blank"]
        # Chromium reads from 3 and writes to 4.
        shell = ["bash", "-c", f'exec "$@" 3<&{its_input} 4>&{its_output}', "bash", *command]
        self.process = subprocess.Popen(
            shell, pass_fds=(its_input, its_output), stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
        )
        os.close(its_input)
        os.close(its_output)
        self._in, self._out, self._numbers, self._rest = ours, mine, itertools.count(1), b""
        self._session: str | None = None
        self.events: list[dict[str, Any]] = []
        target = self.call("Target.createTarget", url="about:blank")["targetId"]
        self._session = self.call("Target.attachToTarget", targetId=target, flatten=True)["sessionId"]
        for domain in ("Page", "Runtime", "Log", "Network"):
            self.call(f"{domain}.enable")

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        os.close(self._in)  # it ends when the pipe does
        try:
            self.process.wait(20)
        except subprocess.TimeoutExpired:
            self.process.kill()
            self.process.wait()
        os.close(self._out)

    def call(self, method: str, **parameters: Any) -> dict[str, Any]:
        """Call a method of the protocol, and wait for its result."""
        number = next(self._numbers)
        message: dict[str, Any] = {"id": number, "method": method, "params": parameters}
        if self._session:
            message["sessionId"] = self._session
        data = json.dumps(message).encode() + b"\0"
        while data:
            data = data[os.write(self._in, data) :]
        while True:
            answer = self._next()
            if answer.get("id") != number:
                self.events.append(answer)
            elif "error" in answer:
                raise AssertionError(f"{method}: {answer['error']}")
            else:
                return dict(answer["result"])

    def _next(self) -> dict[str, Any]:
        while b"\0" not in self._rest:
            if not select.select([self._out], [], [], PATIENCE)[0]:
                raise TimeoutError("the browser does not answer")
            part = os.read(self._out, 1 << 20)
            if not part:
                raise EOFError("the browser has ended")
            self._rest += part
        first, self._rest = self._rest.split(b"\0", 1)
        return dict(json.loads(first))

    def js(self, expression: str) -> Any:
        """Value of an expression in the page."""
        result = self.call("Runtime.evaluate", expression=expression, awaitPromise=True, returnByValue=True)
        assert "exceptionDetails" not in result, result["exceptionDetails"]
        return result["result"].get("value")

    def wait(self, expression: str) -> None:
        """Wait until an expression is true."""
        end = time.monotonic() + PATIENCE
        while not self.js(f"!!({expression})"):
            assert time.monotonic() < end, f"{expression} never came true"
            time.sleep(0.05)

    def open(self, page: Path, size: tuple[int, int], *, phone: bool = False, dark: bool = False) -> None:
        """Open a file in a page of so many pixels."""
        self.call(
            "Emulation.setDeviceMetricsOverride", width=size[0], height=size[1], deviceScaleFactor=1, mobile=phone
        )
        scheme: Mapping[str, str] = {"name": "prefers-color-scheme", "value": "dark" if dark else "light"}
        self.call("Emulation.setEmulatedMedia", features=[scheme])
        self.events.clear()
        self.call("Page.navigate", url=page.as_uri())

    def cut(self, *, scrolled: bool = False) -> list[str]:
        """Tags and words of what leaves the page's sides; not what scrolls in a box of its own, unless `scrolled`."""
        return list(self.js(f"({_CUT})({json.dumps(scrolled)})"))

    def processor_s(self) -> float:
        """Processor time in seconds of the processes that draw pages, all together."""
        found = self._browser("SystemInfo.getProcessInfo")["processInfo"]
        return sum(float(one["cpuTime"]) for one in found if one["type"] == "renderer")

    def _browser(self, method: str) -> dict[str, Any]:
        """Call a method of the browser itself, not of its page."""
        session, self._session = self._session, None
        try:
            return self.call(method)
        finally:
            self._session = session

    def screenshot(self, path: Path) -> None:
        """Write what is seen as a PNG."""
        path.write_bytes(base64.b64decode(self.call("Page.captureScreenshot")["data"]))
