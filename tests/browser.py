"""Chromium without a window: pages by Playwright, and one page by the DevTools protocol."""

from __future__ import annotations

import importlib.util
import json
import shutil
import threading
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from functools import partial
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from types import TracebackType
from typing import Any, Self

from playwright import sync_api

CHROMIUM = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)

JSPSYCH = Path(__file__).parents[1] / "plugins" / "jspsych"
"""The plugins of jsPsych."""

OPTIONS = ["--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]
"""Of Chromium: it draws WebGL without a graphics card."""

PATIENCE = 120.0
"""Seconds to wait for an expression."""

EVENTS = ("Network.requestWillBeSent", "Runtime.exceptionThrown", "Runtime.consoleAPICalled", "Log.entryAdded")


@contextmanager
def chromium() -> Iterator[sync_api.Browser]:
    """A browser; it must be there."""
    assert CHROMIUM is not None, "Chromium is missing: install the Debian package chromium"
    with sync_api.sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=CHROMIUM, args=OPTIONS)
        try:
            yield browser
        finally:
            browser.close()


class Quiet(SimpleHTTPRequestHandler):
    """Files of a folder, of whose requests nothing is printed."""

    def log_message(self, *_: object) -> None:
        pass


@contextmanager
def serving(folder: Path, handler: type[SimpleHTTPRequestHandler] = Quiet) -> Iterator[str]:
    """Serve a folder's files; give their address."""
    server = ThreadingHTTPServer(("127.0.0.1", 0), partial(handler, directory=str(folder)))
    thread = threading.Thread(target=server.serve_forever, daemon=True)
    thread.start()
    try:
        yield f"http://127.0.0.1:{server.server_address[1]}"
    finally:
        server.shutdown()
        server.server_close()
        thread.join()


def bundle_jspsych(source: str, folder: Path, name: str) -> str:
    """Bundle a timeline of jsPsych with the plugins, as a laboratory does; give the name of its page in the folder."""
    spec = importlib.util.spec_from_file_location("jspsych_build", JSPSYCH / "build.py")
    assert spec is not None
    assert spec.loader is not None
    build = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(build)
    build.write_shared()
    text = source.replace('"@focalgradient/jspsych"', json.dumps(str(JSPSYCH / "src" / "index.js")))
    (folder / f"{name}.js").write_text(text)
    plain = ("bundle", "--quiet", "--frozen", "--platform", "browser", "-c", "deno.json")
    build.deno(*plain, "-o", folder / f"{name}-bundled.js", folder / f"{name}.js")
    body = f'<body></body><script type="module" src="{name}-bundled.js"></script>'
    (folder / f"{name}.html").write_text(f'<!doctype html><meta charset="utf-8">{body}')
    return f"{name}.html"


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
    """Chromium with one page; `events` are those of `EVENTS` since it was opened."""

    def __init__(self) -> None:
        self.events: list[dict[str, Any]] = []
        self._ended = ExitStack()

    def __enter__(self) -> Self:
        context = self._ended.enter_context(chromium()).new_context()
        self._session = context.new_cdp_session(context.new_page())
        for name in EVENTS:
            self._session.on(name, lambda params, name=name: self.events.append({"method": name, "params": params}))
        for domain in ("Page", "Runtime", "Log", "Network"):
            self.call(f"{domain}.enable")
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        self._ended.close()

    def call(self, method: str, **parameters: Any) -> dict[str, Any]:
        """Call a method of the protocol, and wait for its result."""
        return self._session.send(method, parameters)

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

    def open(self, page: Path, size: tuple[int, int], *, phone: bool = False) -> None:
        """Open a file in a page of so many pixels."""
        self.call(
            "Emulation.setDeviceMetricsOverride", width=size[0], height=size[1], deviceScaleFactor=1, mobile=phone
        )
        self.events.clear()
        self.call("Page.navigate", url=page.as_uri())

    def cut(self, *, scrolled: bool = False) -> list[str]:
        """Tags and words of what leaves the page's sides; not what scrolls in a box of its own, unless `scrolled`."""
        return list(self.js(f"({_CUT})({json.dumps(scrolled)})"))
