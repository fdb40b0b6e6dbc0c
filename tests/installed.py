"""Tries the package as others get it: `python tests/installed.py [PYTHON ...] [EXTRA ...]`.

Builds the wheel and the source archive, and installs the wheel into empty environments of each Python that is named
(else of this one): with no extra and with each, or with those that are named (`none` is no extra). There README's
example from Python is run, and the command line is tried. Needs the network, and uv or pip.
"""

from __future__ import annotations

import re
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

ROOT = Path(__file__).parents[1]
NO_PSYCHOPY = (3, 13)  # the first Python without it
WITH_PSYCHOPY = ("lab", "gaze")
NONE = "none"
DESIGNS = ("depth_rating.toml", "necker.toml", "pinhole.toml")


def build(folder: Path) -> tuple[Path, Path]:
    """Build wheel and source archive, and look into them."""
    command = [sys.executable, "-m", "hatchling", "build", "-d", str(folder), "-t", "wheel", "-t", "sdist"]
    subprocess.run(command, cwd=ROOT, check=True, capture_output=True)
    wheel, archive = next(folder.glob("*.whl")), next(folder.glob("*.tar.gz"))
    with zipfile.ZipFile(wheel) as packed:
        names = packed.namelist()
    assert all(f"focalgradient/design/files/{name}" in names for name in DESIGNS)
    assert "focalgradient/py.typed" in names
    assert not [name for name in names if not name.startswith(("focalgradient/", "focalgradient-"))]
    with tarfile.open(archive) as packed_source:
        files = packed_source.getnames()
    assert any(name.endswith("/src/focalgradient/lab/running.py") for name in files)
    assert any(name.endswith("/tests/installed.py") for name in files)
    assert not [name for name in files if "/.venv" in name or "/results/" in name]
    return wheel, archive


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
    found = re.search(r"```python\n(.*?)```", (ROOT / "README.md").read_text(encoding="utf-8"), re.DOTALL)
    assert found
    return found[1]


def run(own: Path, *words: str, folder: Path) -> subprocess.CompletedProcess[str]:
    return subprocess.run([str(own), "-W", "error", *words], cwd=folder, capture_output=True, text=True)


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


def main(words: Sequence[str]) -> None:
    extras = [NONE, *tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]["optional-dependencies"]]
    pythons = [word for word in words if word not in extras]
    extras = [word for word in words if word in extras] or extras
    with tempfile.TemporaryDirectory() as name:
        wheel, archive = build(Path(name, "dist"))
        print(f"{wheel.name} {wheel.stat().st_size / 1e6:.2f} MB, {archive.name} {archive.stat().st_size / 1e6:.2f} MB")
        for python in pythons or [sys.executable]:
            said = subprocess.check_output([python, "-c", "import sys; print(*sys.version_info[:3])"], text=True)
            version = tuple(map(int, said.split()))
            for extra in extras:
                start, folder = time.monotonic(), Path(name, f"{version[1]}-{extra}")
                (folder / "work").mkdir(parents=True)
                own = environment(python, folder / "venv", [str(wheel) if extra == NONE else f"{wheel}[{extra}]"])
                found = tried(own, extra, version, folder / "work")
                what = f"Python {'.'.join(map(str, version))}, {'no extra' if extra == NONE else f'extra {extra}'}"
                print(f"{what}: ok, {found} ({time.monotonic() - start:.0f} s)", flush=True)
                shutil.rmtree(folder)


if __name__ == "__main__":
    main(sys.argv[1:])
