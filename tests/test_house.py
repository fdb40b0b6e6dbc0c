"""What a newcomer meets first: the set-up behind `make`, and README's example."""

import os
import re
import shutil
import stat
import subprocess
import tomllib
from importlib import metadata
from pathlib import Path

import pytest
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

import focalgradient

ROOT = Path(__file__).parents[1]

needs_sh = pytest.mark.skipif(not (shutil.which("sh") and shutil.which("cksum")), reason="no POSIX shell")

# Stands for the system's Python and, once "made", for the one of .venv: it writes down what it is asked to do.
PYTHON = """
case "$*" in
    *sys.version_info*) exit {fits} ;;
    *python_version*) echo {version} ;;
    *ensurepip*) exit {ensurepip} ;;
    "-m venv"*) echo venv >>calls; rm -rf .venv; mkdir -p .venv/bin; cp "$0" .venv/bin/python ;;
    *" -r "*) echo pinned >>calls; [ ! -e broken ] || {{ cat broken >&2; exit 1; }} ;;
    hatch_build.py) echo bundled >>pages ;;
    *" -e "*) echo itself >>calls ;;
esac
"""
APT_GET = 'echo "apt-get $*" >>calls; [ ! -e broken ]'


class House:
    """A copy of the set-up alone, in a folder of its own, with programs that only pretend."""

    def __init__(self, folder: Path):
        self.folder = folder
        (folder / "bin").mkdir()
        (folder / "requirements").mkdir()
        shutil.copy(ROOT / "requirements" / "setup.sh", folder / "requirements")
        for name in ("pyproject.toml", "requirements/python.txt", "requirements/debian.txt"):
            (folder / name).write_text("a==1\nb-c==2 ; of some\n" if name.endswith("python.txt") else "")
        (folder / "requirements/laboratory.txt").write_text("# windows\n")
        self.python("python3")
        self.program("id", "echo 0")
        self.program("dpkg-query", 'case "$*" in *present*) echo "ii " ;; *) exit 1 ;; esac')
        self.program("apt-get", APT_GET)
        self.program("uv", "exit 127")  # as where there is none
        self.program("uname", "case $1 in -s) echo Linux ;; *) echo x86_64 ;; esac")

    def program(self, name: str, script: str) -> None:
        file = self.folder / "bin" / name
        file.write_text(f"#!/bin/sh\n{script}\n")
        file.chmod(file.stat().st_mode | stat.S_IXUSR)

    def python(self, name: str, version: str = "3.11.2", *, fits: bool = True, ensurepip: bool = True) -> None:
        self.program(name, PYTHON.format(version=version, fits=int(not fits), ensurepip=int(not ensurepip)))

    def set_up(self, purpose: str = "test", **environment: str) -> tuple[int, list[str], str]:
        """Exit status, what was done, what was said."""
        calls = self.folder / "calls"
        calls.unlink(missing_ok=True)
        path = f"{self.folder / 'bin'}{os.pathsep}{os.environ['PATH']}"
        clean = {name: value for name, value in os.environ.items() if name != "PYTHON"}
        run = subprocess.run(
            ["sh", "requirements/setup.sh", purpose],
            cwd=self.folder,
            env=clean | {"PATH": path} | environment,
            capture_output=True,
            text=True,
        )
        return run.returncode, calls.read_text().splitlines() if calls.exists() else [], run.stderr


@pytest.fixture
def house(tmp_path: Path) -> House:
    folder = tmp_path / "a house"  # a path with a space
    folder.mkdir()
    return House(folder)


@needs_sh
def test_set_up_happens_once(house: House) -> None:
    status, calls, said = house.set_up()
    assert (status, calls) == (0, ["venv", "pinned", "itself"])
    assert said.count("\n") == 1
    assert said.startswith("set-up: installs the packages that requirements/python.txt pins (2, less")
    assert house.set_up("test") == house.set_up("reproduce") == (0, [], "")
    status, calls, said = house.set_up("setup")
    assert (status, calls, said.count("\n")) == (0, [], 1)
    assert "all is there" in said
    assert (house.folder / "pages").read_text().count("bundled") == 4  # each time: its sources may have changed


def test_nothing_else_depends_on_a_package_of_the_tests() -> None:
    """By the metadata of what is installed: without these packages the others are complete."""
    text = (ROOT / "requirements" / "laboratory.txt").read_text(encoding="utf-8")
    left = {line for line in text.splitlines() if not line.startswith("#")}
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    roots = project["project"]["dependencies"] + project["dependency-groups"]["dev"]
    wanted = [Requirement(asked) for asked in roots if canonicalize_name(Requirement(asked).name) not in left]
    needs = {canonicalize_name(one.metadata["Name"]): one.requires or () for one in metadata.distributions()}
    seen: set[str] = set()
    while wanted:
        asked = wanted.pop()
        name = canonicalize_name(asked.name)
        if name in seen or name not in needs or (asked.marker and not asked.marker.evaluate({"extra": ""})):
            continue
        seen.add(name)
        wanted += [Requirement(needed) for needed in needs[name]]
    assert not seen & left
    assert "psychopy" in left
    assert "numba" in seen


@pytest.mark.slow
@needs_sh
def test_set_up_that_was_cut_off_starts_over(house: House) -> None:
    (house.folder / "broken").write_text("ERROR: hashes differ")
    status, calls, said = house.set_up()
    assert (status, calls) == (1, ["venv", "pinned"])
    assert "hashes differ" in said
    assert "call make again" in said
    (house.folder / "broken").unlink()
    assert house.set_up()[:2] == (0, ["venv", "pinned", "itself"])


@needs_sh
def test_trouble_is_said_in_one_sentence_with_the_remedy(house: House) -> None:
    house.python("old", "3.9.1", fits=False)
    house.python("bare", ensurepip=False)
    for environment, sentence in [
        ({"PYTHON": "old"}, r"needs Python 3\.11 or newer, but old is 3\.9\.1: .*make PYTHON=python3\.12 test"),
        ({"PYTHON": "absent"}, r"but absent is missing: install"),
        ({"PYTHON": "bare"}, r"bare cannot make virtual environments: .*python3-venv"),
    ]:
        status, calls, said = house.set_up(**environment)
        assert (status, calls, said.count("\n")) == (1, [], 1)
        assert re.search(sentence, said)
    (house.folder / "broken").write_text("WARNING: connection broken by\nERROR: No matching distribution found")
    status, _, said = house.set_up()
    assert status == 1
    assert said.splitlines()[1:] == [
        "set-up: the package index cannot be reached: check the network connection (or the proxy) and call make again."
    ]


@pytest.mark.slow
@needs_sh
def test_missing_debian_packages_are_installed_or_asked_for(house: House) -> None:
    house.set_up()
    (house.folder / "requirements" / "debian.txt").write_text("# why\npresent  # a reason\nxvfb # windows: a screen\n")
    assert house.set_up("reproduce") == (0, [], "")  # it opens no windows
    status, calls, said = house.set_up("setup")
    assert (status, calls) == (0, [])
    assert (
        "as only windows of experiments, tests and path-traced scenes need them: the Debian packages xvfb"
        in said.splitlines()[0]
    )
    status, calls, said = house.set_up()
    assert status == 0
    install = "apt-get -o DPkg::Lock::Timeout=600 install -y -qq --no-install-recommends xvfb"  # waits for dpkg's lock
    assert calls == ["apt-get update -qq", install]

    house.program("id", "echo 1000")
    house.program("sudo", 'case "$*" in "-n true") ;; *) echo sudo >>calls; "$@" ;; esac')
    assert house.set_up()[1] == ["sudo", calls[0], "sudo", calls[1]]

    house.program("sudo", "exit 1")
    status, calls, said = house.set_up("test")
    assert (status, calls, said.count("\n")) == (1, [], 1)
    assert "sudo apt-get install --no-install-recommends xvfb" in said
    (house.folder / "requirements" / "debian.txt").write_text("libllvm # path tracing\nxvfb # windows: a screen\n")
    status, calls, said = house.set_up("reproduce")
    assert (status, calls, said.count("\n")) == (0, [], 1)
    assert "going on" in said
    assert "xvfb" not in said

    house.program("uname", "echo Darwin")
    assert "xvfb" not in house.set_up("test")[2]


def test_every_package_asked_for_is_pinned_with_a_hash() -> None:
    text = (ROOT / "requirements" / "python.txt").read_text(encoding="utf-8").replace("\\\n", " ")
    pins: dict[str, list[str]] = {}
    for line in text.splitlines():
        pin = re.match(r"([a-z0-9-]+)==(\S+) .*--hash=sha256:[0-9a-f]{64}", line)
        assert pin, f"not a pin: {line}"
        pins.setdefault(pin[1], []).append(pin[2])
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    for asked in map(Requirement, project["project"]["dependencies"] + project["dependency-groups"]["dev"]):
        assert all(version in asked.specifier for version in pins[asked.name]), f"compile the pins anew for {asked}"


def test_every_place_states_one_version() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    assert "version" not in project
    assert "version" in project["dynamic"]
    stated = (ROOT / "CITATION.cff").read_text(encoding="utf-8")
    assert f"\nversion: {focalgradient.__version__}\n" in stated
    assert f"version = {{{focalgradient.__version__}}}" in focalgradient.__citation__
    for field in ("doi", "title"):  # of the paper: the two files cannot differ
        value = re.search(rf"\n {{4}}{field}: (.*)\n", stated)
        assert value[1] in focalgradient.__citation__


def test_examples_in_readme_run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    examples = re.findall(r"```python\n(.*?)```", (ROOT / "README.md").read_text(encoding="utf-8"), re.DOTALL)
    assert examples
    for example in examples:
        exec(compile(example, "README.md", "exec"), {})
