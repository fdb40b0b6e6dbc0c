"""Validation against the BIDS standard, by the BIDS validator."""

from __future__ import annotations

import json
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path

from focalgradient.errors import InputError
from focalgradient.files import printable

__all__ = ["VALIDATOR", "bids_problems", "checking_bids"]

VALIDATOR = "bids-validator-deno"
"""Program that validates against the BIDS standard."""


def bids_problems(root: Path) -> list[str] | None:
    """Return the errors that the BIDS validator reports, one line each; None if it is not installed.

    Raises
    ------
    InputError
        If the validator fails.
    """
    with checking_bids(root) as ended:
        return ended()


@contextmanager
def checking_bids(root: Path) -> Iterator[Callable[[], list[str] | None]]:
    """Start the BIDS validator; yield a function that waits for its errors: see `bids_problems`."""
    program = shutil.which(VALIDATOR, path=str(Path(sys.executable).parent)) or shutil.which(VALIDATOR)
    if program is None:
        yield lambda: None
        return
    with (
        _utf8_path(root) as folder,
        subprocess.Popen(
            [program, folder, "--ignoreWarnings", "--max-rows", "-1", "--format", "json"],
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            encoding="utf-8",
        ) as running,
    ):
        try:
            yield partial(_bids_answer, program, running)
        finally:
            running.kill()  # no effect if it has ended


@contextmanager
def _utf8_path(root: Path) -> Iterator[str]:
    """Yield a path of a folder in UTF-8, which the validator requires: if the path is not, that of a link to it."""
    if printable(root.absolute()) == str(root.absolute()):
        yield str(root)
        return
    with tempfile.TemporaryDirectory(prefix="focalgradient-") as folder:
        link = Path(folder, "dataset")
        link.symlink_to(root.absolute(), target_is_directory=True)
        yield str(link)


def _bids_answer(program: str, running: subprocess.Popen[str]) -> list[str]:
    output, wrong = running.communicate()
    try:
        found = json.loads(output)["issues"]
    except (ValueError, KeyError) as error:
        last = (wrong.strip().splitlines() or ["no message"])[-1]
        raise InputError(f"{program} did not finish ({last}): reinstall {VALIDATOR}.") from error
    return [
        ", ".join(str(issue[key]) for key in ("location", "code", "subCode", "issueMessage") if issue.get(key))
        for issue in found["issues"]
        if issue["severity"] == "error"
    ]
