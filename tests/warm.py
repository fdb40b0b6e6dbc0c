"""A command in a fork of a process that has imported all it needs, so that many runs of it take seconds.

`Warm` starts such a process, which imports nothing more than one undisturbed run of the command did and runs nothing
itself; each run is a fork with its own standard error, that handles signals and ends as a fresh process does.
"""

from __future__ import annotations

import atexit
import importlib
import json
import os
import select
import signal
import socket
import subprocess
import sys
import tempfile
import threading
from contextlib import ExitStack, suppress
from pathlib import Path
from typing import Any

LIMIT_S = 600
"""Seconds that one run may take."""


class Run:
    """One run under way: its process, and once it is over its exit code, standard error and processor seconds."""

    def __init__(self, link: socket.socket, job: dict[str, Any]) -> None:
        ours, theirs = os.pipe()
        socket.send_fds(link, [json.dumps(job).encode()], [theirs])
        os.close(theirs)
        self._link, self._words = link, []
        self._reader = threading.Thread(target=self._read, args=(ours,))
        self._reader.start()
        self.process = int(link.recv(100))

    def _read(self, number: int) -> None:
        with os.fdopen(number, encoding="utf-8", errors="replace") as file:
            self._words.append(file.read())

    def kill(self, way: signal.Signals) -> None:
        """Send a signal, if it is still there."""
        if not select.select([self._link], [], [], 0)[0]:
            os.kill(self.process, way)

    def wait(self) -> tuple[int, str, float]:
        """Exit code (negative: the signal), standard error, processor seconds without those of its processes."""
        code, seconds = json.loads(self._link.recv(100))
        self._reader.join(LIMIT_S)
        return code, "".join(self._words), seconds


class Warm:
    """Runs of one command."""

    def __init__(self) -> None:
        self._modules: list[str] = []
        self._stack = ExitStack()

    def __enter__(self) -> Warm:
        ours, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        ours.settimeout(LIMIT_S)
        number = theirs.fileno()
        self._server = subprocess.Popen([sys.executable, __file__, str(number)], pass_fds=[number])
        theirs.close()
        self._link = ours
        self._record = Path(self._stack.enter_context(tempfile.TemporaryDirectory()), "modules")
        return self

    def __exit__(self, *_: object) -> None:
        self._link.close()
        self._server.wait(LIMIT_S)
        self._stack.close()

    def begin(self, folder: Path, args: tuple[str, ...], limit: int | None = None, before: str = "") -> Run:
        """Begin a run in a folder, where no file may have more than `limit` bytes; `before` is code run first."""
        if not self._modules and self._record.exists():
            self._modules = json.loads(self._record.read_text())
        job = {"folder": str(folder), "args": args, "limit": limit, "before": before, "modules": self._modules}
        return Run(self._link, job | {"record": "" if self._modules else str(self._record)})


def serve(link: socket.socket) -> None:
    """Fork for each job that comes over the link."""
    known: set[str] = set()
    while True:
        given, numbers, *_ = socket.recv_fds(link, 1 << 20, 1)
        if not given:
            return
        job = json.loads(given)
        for name in job["modules"]:
            if name not in known and name not in sys.modules:
                with suppress(Exception):
                    importlib.import_module(name)
            known.add(name)
        process = os.fork()
        if not process:
            link.close()
            _become(job, numbers[0])
            return
        os.close(numbers[0])
        link.send(str(process).encode())
        _, status, used = os.wait4(process, 0)
        link.send(json.dumps([os.waitstatus_to_exitcode(status), used.ru_utime + used.ru_stime]).encode())


def _become(job: dict[str, Any], error: int) -> None:
    """Be a process that was given one command."""
    nothing = os.open(os.devnull, os.O_RDWR)
    for number, place in ((nothing, 0), (nothing, 1), (error, 2)):
        os.dup2(number, place)
    for number in {nothing, error}:
        os.close(number)
    signal.signal(signal.SIGINT, signal.default_int_handler)  # a shell's background jobs ignore it
    os.chdir(job["folder"])
    if job["record"]:
        atexit.register(lambda: Path(job["record"]).write_text(json.dumps(list(sys.modules))))
    from focalgradient.cli import main

    exec(job["before"], {})
    if job["limit"] is not None:
        import resource

        resource.setrlimit(resource.RLIMIT_FSIZE, (job["limit"],) * 2)
    sys.argv[1:] = job["args"]
    main(prog_name="focalgradient")


if __name__ == "__main__":
    given_link = socket.socket(fileno=int(sys.argv[1]))
    given_link.setblocking(True)  # a default timeout of the tests' process, as PsychoPy sets one, came with it
    serve(given_link)
