"""One R that runs script after script, as loading lme4 takes longer than most of them."""

from __future__ import annotations

import atexit
import functools
import shutil
import subprocess
from pathlib import Path

import pytest

needs_r = pytest.mark.skipif(shutil.which("Rscript") is None, reason="Rscript is not installed")

LOOP = r"""
lines <- file("stdin", "r")
while (length(folder <- readLines(lines, 1))) {
  file <- readLines(lines, 1)
  attached <- search()
  setwd(folder)
  sink("r-output.txt")
  said <- tryCatch({ source(file, local = new.env(), print.eval = TRUE); "done" }, error = conditionMessage)
  sink()
  for (name in setdiff(search(), attached)) detach(name, character.only = TRUE)  # each script attaches what it needs
  cat(gsub("\n", " ", said), "\n", sep = "")
}
"""


@functools.cache
def _process() -> subprocess.Popen[str]:
    process = subprocess.Popen(["Rscript", "-e", LOOP], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
    atexit.register(process.kill)
    return process


def run_r(folder: Path, script: str) -> str:
    """What a script prints that lies in a folder, run there."""
    process = _process()
    assert process.stdin is not None
    assert process.stdout is not None
    process.stdin.write(f"{folder}\n{script}\n")
    process.stdin.flush()
    said = process.stdout.readline().strip()
    assert said == "done", said
    return (folder / "r-output.txt").read_text("utf-8")


@functools.cache
def has_package(name: str) -> bool:
    """Whether R finds the package; it is not loaded for that."""
    command = ["Rscript", "-e", f'quit(status = !nzchar(system.file(package = "{name}")))']
    return subprocess.run(command, capture_output=True, check=False).returncode == 0
