"""The examples of docs/extending.md, each built from nothing as a package and unpacked as pip does."""

from __future__ import annotations

import os
import re
import subprocess
import sys
import zipfile
from pathlib import Path

ROOT = Path(__file__).parents[1]


def build(heading: str, file: str, folder: Path) -> Path:
    """The package of a section, whose first block is its module and whose second is its pyproject.toml."""
    text = (ROOT / "docs" / "extending.md").read_text(encoding="utf-8")
    section = text.split(f"## {heading}\n")[1].split("\n## ")[0]
    source, project = re.findall(r"^```\w+\n(.*?)^```$", section, re.DOTALL | re.MULTILINE)
    (folder / file).write_text(source, encoding="utf-8")
    (folder / "pyproject.toml").write_text(project, encoding="utf-8")
    command = [sys.executable, "-m", "hatchling", "build", "-t", "wheel"]
    subprocess.run(command, cwd=folder, check=True, capture_output=True)
    (wheel,) = folder.glob("dist/*.whl")
    zipfile.ZipFile(wheel).extractall(folder / "site")
    return folder / "site"


def python(installed: Path, *command: object) -> subprocess.CompletedProcess[str]:
    """What Python does where the package is installed."""
    path = os.pathsep.join([str(installed), str(ROOT / "src")])
    given = [sys.executable, *map(str, command)]
    return subprocess.run(given, env=os.environ | {"PYTHONPATH": path}, capture_output=True, text=True, check=False)


def command(installed: Path, *words: object) -> subprocess.CompletedProcess[str]:
    """What the command line does where the package is installed."""
    return python(installed, "-c", "from focalgradient.cli import main; main()", *words)
