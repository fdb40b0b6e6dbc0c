"""Firefox on a screen that only it sees, spoken to through its own protocol (Marionette)."""

from __future__ import annotations

import itertools
import json
import os
import shutil
import socket
import subprocess
import time
from pathlib import Path
from types import TracebackType
from typing import Any, Self

FIREFOX = shutil.which("xvfb-run") and (shutil.which("firefox-esr") or shutil.which("firefox"))

PATIENCE = 60.0
"""Seconds to wait for an answer."""

PREFERENCES = """user_pref("webgl.force-enabled", true);
user_pref("marionette.port", {port});
"""


class Firefox:
    """Firefox with one page, and an empty profile of its own."""

    def __init__(self, profile: Path) -> None:
        assert FIREFOX is not None
        with socket.socket() as free:
            free.bind(("127.0.0.1", 0))
            port = free.getsockname()[1]
        (profile / "user.js").write_text(PREFERENCES.format(port=port))
        # Without a screen it has no WebGL, although it draws none of its windows.
        command = ["xvfb-run", "-a", FIREFOX, "--headless", "--no-remote", "--marionette", "--profile", str(profile)]
        environment = os.environ | {"LIBGL_ALWAYS_SOFTWARE": "1"}
        self.process = subprocess.Popen(command, env=environment, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        self._numbers, self._rest = itertools.count(1), b""
        end = time.monotonic() + PATIENCE
        while True:
            try:
                self._socket = socket.create_connection(("127.0.0.1", port), PATIENCE)
                break
            except ConnectionRefusedError:
                assert time.monotonic() < end, "Firefox does not start"
                time.sleep(0.1)
        self._next()
        self.call("WebDriver:NewSession", capabilities={})

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        self.call("Marionette:Quit", flags=["eForceQuit"])
        self._socket.close()
        self.process.wait(20)

    def call(self, name: str, **parameters: Any) -> Any:
        """Call a command, and wait for its result."""
        data = json.dumps([0, next(self._numbers), name, parameters]).encode()
        self._socket.sendall(f"{len(data)}:".encode() + data)
        _, _, error, result = self._next()
        assert error is None, error
        return result

    def _next(self) -> Any:
        while b":" not in self._rest or len(self._rest.split(b":", 1)[1]) < int(self._rest.split(b":", 1)[0]):
            part = self._socket.recv(1 << 20)
            if not part:
                raise EOFError("Firefox has ended")
            self._rest += part
        size, rest = self._rest.split(b":", 1)
        self._rest = rest[int(size) :]
        return json.loads(rest[: int(size)])

    def open(self, page: Path) -> None:
        """Open a file."""
        self.call("WebDriver:Navigate", url=page.as_uri())

    def js(self, expression: str) -> Any:
        """Value of an expression in the page."""
        value, error = (
            f"x => {{ window.answer = JSON.stringify({{ {part} }}); }}" for part in ("value: x", "error: String(x)")
        )
        script = f"window.answer = null; Promise.resolve({expression}).then({value}, {error})"
        self.call("WebDriver:ExecuteScript", script="window.eval(arguments[0]);", args=[script])
        end = time.monotonic() + PATIENCE
        while True:
            asked = self.call("WebDriver:ExecuteScript", script="return window.answer;", args=[])
            if asked["value"] is not None:
                answer = json.loads(asked["value"])
                assert "error" not in answer, answer["error"]
                return answer.get("value")
            assert time.monotonic() < end, f"{expression} gave no answer"
            time.sleep(0.02)
