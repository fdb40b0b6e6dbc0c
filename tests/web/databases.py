"""A PostgreSQL of Debian's, started in a temporary folder, with a schema of its own for each study."""

from __future__ import annotations

import itertools
import os
import shutil
import signal
import subprocess
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

__all__ = ["FOUND", "Cluster", "cluster"]

FOUND = next(iter(sorted(Path("/usr/lib/postgresql").glob("*/bin/postgres"), reverse=True)), None)
"""The program; None where Debian's package postgresql is not installed."""

_number = itertools.count(1)


class Cluster:
    """A server of databases; it can be stopped and started again."""

    def __init__(self, folder: Path):
        assert FOUND is not None
        self.folder, self.programs = folder, FOUND.parent
        self.as_user: dict[str, Any] = {"user": "postgres", "group": "postgres"} if os.getuid() == 0 else {}
        if self.as_user:  # PostgreSQL refuses to run as root
            shutil.chown(folder, "postgres", "postgres")
        self._run("initdb", "--no-sync", "--auth=trust", "--username=postgres", "-D", str(folder / "db"))
        self.start()

    def _run(self, program: str, *options: str) -> None:
        done = subprocess.run(
            [str(self.programs / program), *options],
            cwd=self.folder,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.PIPE,
            text=True,
            **self.as_user,
        )
        assert done.returncode == 0, done.stderr

    def start(self) -> None:
        """Start it: it listens at a socket in its folder, and nowhere else."""
        options = ["-D", str(self.folder / "db"), "-k", str(self.folder), "-c", "listen_addresses="]
        log = (self.folder / "log").open("ab")
        self.process = subprocess.Popen(
            [str(self.programs / "postgres"), *options], cwd=self.folder, stdout=log, stderr=log, **self.as_user
        )
        log.close()
        for _ in range(300):
            if subprocess.run([str(self.programs / "pg_isready"), "-q", "-h", str(self.folder)]).returncode == 0:
                return
            time.sleep(0.1)
        raise AssertionError((self.folder / "log").read_text())

    def stop(self) -> None:
        """End it at once, with all connections."""
        self.process.send_signal(signal.SIGINT)
        self.process.wait(timeout=60)

    def address(self) -> str:
        """Of a new schema."""
        import psycopg

        schema, base = f"study{next(_number)}", f"postgresql://postgres@/postgres?host={self.folder}"
        with psycopg.connect(base, autocommit=True) as connection:
            connection.execute(f"create schema {schema}")  # type: ignore[call-overload]
        return f"{base}&options=-csearch_path%3D{schema}"


@contextmanager
def cluster() -> Iterator[Cluster]:
    """A server of databases in a folder that is removed afterwards."""
    with tempfile.TemporaryDirectory(prefix="pg-", dir="/tmp", ignore_cleanup_errors=True) as folder:
        Path(folder).chmod(0o755)
        made = Cluster(Path(folder))
        try:
            yield made
        finally:
            made.stop()
