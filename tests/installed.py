"""Tries the package as others get it: `python tests/installed.py [PYTHON ...] [EXTRA ...]`.

Builds the wheel and the source archive with the pinned build requirements, and installs the wheel into empty
environments of each Python that is named (else of this one): with no extra and with each, or with those that are named
(`none`: without extras; `lowest`: with the oldest packages that the project allows). README's example from Python and
the command line are tried there. With the extra `eye`, which README asks for, its blocks run from an empty folder, and
the source archive is tried in the same way. Needs the network, and uv or pip.
"""

from __future__ import annotations

import os
import re
import shlex
import shutil
import subprocess
import sys
import tarfile
import tempfile
import time
import tomllib
import zipfile
from collections.abc import Sequence
from pathlib import Path

from blocks import README, ROOT, Block, runnable

NO_PSYCHOPY = (3, 13)  # the first Python without it
WITH_PSYCHOPY = ("lab", "gaze")
NONE, OF_README = "none", "eye"  # no extra, and the extra that README's commands need
LOWEST = "lowest"  # README's extra with the oldest packages allowed, whose warnings of newer ones do not count
DESIGNS = ("depth_rating.toml", "necker.toml", "pinhole.toml")
PAGE = ("experimenter.html", "experimenter.js", "index.html", "page.css", "page.js")
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))


def build(folder: Path) -> tuple[Path, Path]:
    """Build wheel and source archive with the pinned build requirements, and look into them."""
    requires = PROJECT["build-system"]["requires"]
    assert all("==" in each for each in requires), requires
    own = environment(sys.executable, folder / "builder", requires)
    command = [str(own), "-m", "hatchling", "build", "-d", str(folder), "-t", "wheel", "-t", "sdist"]
    built = subprocess.run(command, cwd=ROOT, check=False, capture_output=True, text=True, env=surroundings(folder))
    assert built.returncode == 0, built.stderr
    wheel, archive = next(folder.glob("*.whl")), next(folder.glob("*.tar.gz"))
    names = files_of(wheel)
    assert all(f"focalgradient/design/files/{name}" in names for name in DESIGNS)
    assert all(f"focalgradient/web/static/{name}" in names for name in PAGE)
    assert "focalgradient/py.typed" in names
    assert not [name for name in names if not name.startswith(("focalgradient/", "focalgradient-"))]
    with tarfile.open(archive) as packed_source:
        files = packed_source.getnames()
    assert any(name.endswith("/src/focalgradient/lab/running.py") for name in files)
    assert any(name.endswith("/tests/installed.py") for name in files)
    assert not [name for name in files if "/.venv" in name or "/results/" in name]
    return wheel, archive


def files_of(wheel: Path) -> list[str]:
    """Names of the files that a wheel holds."""
    with zipfile.ZipFile(wheel) as packed:
        return packed.namelist()


def surroundings(folder: Path) -> dict[str, str]:
    """Environment variables that lead to nothing of the checkout and draw without a window."""
    kept = {name: value for name, value in os.environ.items() if not name.startswith(("PYTHON", "FOCALGRADIENT"))}
    return kept | {"FOCALGRADIENT_CACHE": str(folder / "cache"), "MPLBACKEND": "Agg"}


def environment(python: str, folder: Path, packages: Sequence[str]) -> Path:
    """Make an environment with these packages: its Python."""
    subprocess.run([python, "-m", "venv", "--without-pip", str(folder)], check=True)
    own = folder / ("Scripts" if sys.platform == "win32" else "bin") / "python"
    uv = shutil.which("uv")
    install = [uv, "pip", "install", "--quiet", "--python", str(own)] if uv else _pip(own)
    subprocess.run([*install, *packages], check=True)
    return own


def _pip(own: Path) -> list[str]:
    return [sys.executable, "-m", "pip", "--python", str(own), "install", "--quiet"]


def example() -> str:
    """README's example."""
    (found,) = [block.text for block in runnable(README) if block.kind == "python"]
    return found


def run(own: Path, *words: str, folder: Path) -> subprocess.CompletedProcess[str]:
    command, variables = [str(own), "-W", "error", *words], surroundings(folder)
    return subprocess.run(command, cwd=folder, capture_output=True, text=True, env=variables)


def ran(block: Block, own: Path, folder: Path) -> int:
    """Run a block as pasted, in `folder`, with the commands beside `own`; return the number of commands."""
    lines = block.text.splitlines() if block.kind == "sh" else []
    for line in lines:
        program, *words = shlex.split(line, comments=True)
        found = shutil.which(program, path=str(own.parent))
        assert found, f"{program} is not installed: {line}"
        done = subprocess.run([found, *words], cwd=folder, capture_output=True, text=True, env=surroundings(folder))
        assert done.returncode == 0, f"{line}\n{done.stderr}"
        assert "Traceback" not in done.stderr, f"{line}\n{done.stderr}"
    if block.kind == "python":
        done = run(own, "-c", block.text, folder=folder)
        assert done.returncode == 0, done.stderr
    return len(lines)


def readme_ran(own: Path, folder: Path) -> str:
    """Run README's blocks in order from an empty folder: what was run."""
    assert not list(folder.iterdir())
    counts = [ran(block, own, folder) for block in runnable(README)]
    assert sum(counts) >= 8
    return f"README's {len(counts)} blocks ({sum(counts)} commands)"


def installed_files(own: Path, folder: Path) -> set[str]:
    """Files of the package that `own` imports, without compiled ones; they are to lie in its own environment."""
    done = run(own, "-c", "import focalgradient; print(focalgradient.__file__)", folder=folder)
    package = Path(done.stdout.strip()).parent
    assert package.is_relative_to(own.parents[1]), package
    found = (path.relative_to(package.parent) for path in package.rglob("*") if path.is_file())
    return {path.as_posix() for path in found if "__pycache__" not in path.parts}


def tried(own: Path, extra: str, version: tuple[int, ...], folder: Path) -> str:
    """Run what a stranger would run: what was found."""
    done = run(own, "-c", example(), folder=folder)
    assert done.returncode == 0, done.stderr
    assert (folder / "depth.png").stat().st_size > 10_000
    command = ["-c", "from focalgradient.cli import main; main(prog_name='focalgradient')"]
    done = run(own, *command, "--version", folder=folder)
    assert re.fullmatch(r"focalgradient \d+\.\d+\.\d+\S*\n", done.stdout), done.stdout + done.stderr
    done = run(own, *command, "run", "depth-rating", "--print-design", folder=folder)
    assert "apertures = " in done.stdout, done.stderr
    done = run(own, *command, "run", "depth-rating", "--participant", "01", folder=folder)
    assert (done.returncode, done.stderr.count("\n")) == (2, 1), done.stderr
    missing = extra not in WITH_PSYCHOPY or version >= NO_PSYCHOPY
    assert ("PsychoPy is not installed" in done.stderr) == missing, done.stderr
    numpy = run(
        own, "-c", "import numpy, PIL; print('NumPy', numpy.__version__, 'Pillow', PIL.__version__)", folder=folder
    )
    return numpy.stdout.strip()


def tried_in(start: Path, python: str, file: Path, extra: str, files: set[str]) -> str:
    """Install a file with an extra into an empty environment in `start`, and try it: a line that states the result."""
    began = time.monotonic()
    version = subprocess.check_output([python, "-c", "import sys; print(*sys.version_info[:3])"], text=True).split()
    work, readme = start / "work", start / "readme"
    for folder in (work, readme):
        folder.mkdir(parents=True)
    if extra == LOWEST:
        oldest = [each.replace(">=", "==") for each in PROJECT["project"]["dependencies"]]
        own = environment(python, start / "venv", [f"{file}[{OF_README}]", *oldest])
        counts = [ran(block, own, readme) for block in runnable(README) if block.kind == "sh"]
        return f"{file.name} with {', '.join(oldest)}: ok, {sum(counts)} commands of README"
    own = environment(python, start / "venv", [str(file) if extra == NONE else f"{file}[{extra}]"])
    found = tried(own, extra, tuple(map(int, version)), work)
    different = files ^ installed_files(own, work)
    assert not different, f"{file.name}: {sorted(different)}"
    if extra == OF_README:
        found = f"{found}, {readme_ran(own, readme)}"
    what = f"Python {'.'.join(version)}, {file.name}, {'no extra' if extra == NONE else f'extra {extra}'}"
    return f"{what}: ok, {found} ({time.monotonic() - began:.0f} s)"


def main(words: Sequence[str]) -> None:
    extras = [NONE, LOWEST, *PROJECT["project"]["optional-dependencies"]]
    pythons = [word for word in words if word not in extras]
    extras = [word for word in words if word in extras] or extras
    with tempfile.TemporaryDirectory() as name:
        wheel, archive = build(Path(name, "dist"))
        print(f"{wheel.name} {wheel.stat().st_size / 1e6:.2f} MB, {archive.name} {archive.stat().st_size / 1e6:.2f} MB")
        files = {each for each in files_of(wheel) if each.startswith("focalgradient/")}
        for python in pythons or [sys.executable]:
            for extra in extras:
                for file in (wheel, archive) if extra == OF_README else (wheel,):
                    folder = Path(name, "try")
                    print(tried_in(folder, python, file, extra, files), flush=True)
                    shutil.rmtree(folder)


if __name__ == "__main__":
    main(sys.argv[1:])
