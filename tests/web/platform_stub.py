"""A platform that serves an exported study and keeps what its page sends, by the platforms' published interfaces."""

from __future__ import annotations

import json
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from browser import Quiet, serving
from playwright.sync_api import BrowserContext, Route

JATOS = """
const query = Object.fromEntries(new URLSearchParams(location.search));
const post = async (path, text) => {
  const answer = await fetch(path, { method: "POST", body: text });
  if (!answer.ok) throw answer.status;
};
let batch = {};
globalThis.jatos = {
  urlQueryParameters: query,
  studyResultId: 7,
  onLoad: (act) => fetch("batch").then((answer) => answer.json()).then((found) => ((batch = found), act())),
  appendResultData: (text) => post("append", text),
  batchSession: {
    getAll: () => batch,
    set: (name, value) => post("batch", JSON.stringify([name, value])).then(() => (batch[name] = value)),
  },
  endStudy: () => post("end", ""),
  endStudyAndRedirect: (address) => post("end", address),
};
"""


class Platform:
    """What was sent to it; `away` makes it answer nothing but 503, `over` refuse all for good."""

    def __init__(self) -> None:
        self.text, self.batch, self.ended = "", dict[str, Any](), list[str]()
        self.files: dict[str, str] = {}
        self.closed: list[Any] = []
        self.away, self.over, self.address = False, False, ""

    def take(self, path: str, body: str) -> int:
        """What JATOS does with a message of its script."""
        if self.away:
            return 503
        if path.endswith("/append"):
            self.text += body
        elif path.endswith("/batch"):
            name, value = json.loads(body)
            self.batch[name] = value
        elif path.endswith("/end"):
            self.ended.append(body)
        return 200

    def datapipe(self, route: Route) -> None:
        """What DataPipe does with a request."""
        asked = route.request.post_data_json
        assert route.request.headers["content-type"] == "application/json"
        if self.away:
            return route.fulfill(status=503, json={"error": "OSF_UPLOAD_ERROR", "message": "the OSF is away"})
        if self.over or asked["experimentID"] != "abc123":
            error = {"error": "EXPERIMENT_NOT_FOUND", "message": "There is no such experiment."}
            return route.fulfill(status=400, json=error)
        if route.request.url.endswith("/api/condition/"):
            return route.fulfill(json={"message": "Success", "condition": 1})
        if asked["filename"] in self.files:
            return route.fulfill(status=400, json={"error": "OSF_FILE_EXISTS", "message": "The file already exists."})
        self.files[asked["filename"]] = asked["data"]
        return route.fulfill(status=201, json={"message": "Success"})

    def pavlovia(self, route: Route) -> None:
        """What Pavlovia does with a request."""
        request = route.request
        path = request.url.partition("/api/v2/experiments/lab%2Fstudy")[2]
        if request.method == "POST" and path == "/sessions":
            about = {"status2": "RUNNING", "saveFormat": "CSV", "saveIncompleteResults": True}
            return route.fulfill(json={"token": "T", "experiment": about})
        if request.method == "POST" and path == "/sessions/T/results":
            self.files[request.post_data_json["key"]] = request.post_data_json["value"]
            return route.fulfill(json={})
        if request.method == "DELETE" and path == "/sessions/T":
            self.closed.append(request.post_data_json)
            return route.fulfill(json={})
        return route.fulfill(status=404)

    def beside(self, context: BrowserContext) -> None:
        """Answer for DataPipe and Pavlovia; whatever else is asked for elsewhere is refused and fails the test."""
        context.route("https://pipe.jspsych.org/**", self.datapipe)
        context.route("https://pavlovia.org/**", self.pavlovia)


@contextmanager
def platform(folder: Path) -> Iterator[Platform]:
    """Serve a folder's files, and what JATOS would beside them."""
    stub = Platform()

    class Handler(Quiet):
        def _answer(self, status: int, body: bytes, kind: str) -> None:
            self.send_response(status)
            self.send_header("Content-Type", kind)
            self.send_header("Content-Length", str(len(body)))
            self.end_headers()
            self.wfile.write(body)

        def do_GET(self) -> None:
            if self.path == "/jatos.js":
                return self._answer(200, JATOS.encode(), "text/javascript")
            if self.path == "/batch":
                return self._answer(200, json.dumps(stub.batch).encode(), "application/json")
            if self.path == "/config.json":
                about = {"experiment": {"name": "study", "fullpath": "lab/study"}}
                content = json.dumps({**about, "pavlovia": {"URL": "https://pavlovia.org"}})
                return self._answer(200, content.encode(), "application/json")
            return super().do_GET()

        def do_POST(self) -> None:
            body = self.rfile.read(int(self.headers["Content-Length"] or 0)).decode()
            self._answer(stub.take(self.path, body), b"{}", "application/json")

    with serving(folder, Handler) as stub.address:
        yield stub
