"""The house: which room may import which, how light the front door is, and that no file is tied to one machine."""

import ast
import functools
import os
import re
import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import pytest
from recorded import record_ratings

ROOT = Path(__file__).parents[1]
PACKAGE = ROOT / "src" / "focalgradient"

# What each room may import of the others; a room without a line here fails the tests until it is given one. The arrows
# run one way: optics and views know nobody above them, true depth stays with the scenes and never meets the depth core,
# and only the front door (`import focalgradient`) and the command line see several rooms.
ROOMS = {
    room: set(others.split())
    for room, others in {
        "arrays": "",
        "citation": "",
        "errors": "",
        "files": "errors",
        "loops": "",
        "memory": "errors",
        "parallel": "errors",
        "progress": "",
        "quantities": "errors",
        "plausibility": "errors",
        "optics": "arrays errors plausibility quantities",
        "paper": "errors optics",
        "psf": "arrays errors",
        "view": "arrays errors optics plausibility",
        "depth": "arrays errors files loops optics parallel plausibility progress psf quantities view",
        "scenes": "arrays errors loops parallel quantities",
        "render": "arrays errors loops optics parallel progress psf quantities scenes view",
        "eye": "arrays depth errors files loops optics parallel plausibility progress psf quantities render scenes "
        "view",
        "retina": "arrays binocular errors eye files progress quantities render view",
        "binocular": "arrays errors files optics progress render scenes view",
        "srgb": "",
        "live": "arrays display errors eye files memory optics progress render srgb",
        "display": "arrays errors files plausibility quantities srgb",
        "luminance": "arrays errors files",
        "stimuli": "arrays design display errors eye files optics parallel photographs plausibility plotting progress "
        "psf quantities render scenes tables tasks video",
        "tables": "errors files",
        "words": "errors files",
        "analyses": "errors",
        "scales": "analyses arrays errors files statistics words",
        "tasks": "display errors files quantities scales statistics words",
        "experiments": "dataset design display errors files scales statistics stimuli tasks",
        "design": "errors files scales tables tasks words",
        "dataset": "design errors files parallel quantities scales tables tasks",
        "observers": "arrays dataset depth design display errors eye files parallel progress quantities render scales "
        "scenes statistics stimuli tasks",
        "published": "arrays dataset design display errors eye files observers progress quantities scales statistics "
        "stimuli tasks",
        "calibration": "arrays depth errors optics psf quantities view",
        "photographs": "arrays calibration depth errors files memory optics plausibility progress psf quantities srgb "
        "tables view",
        "video": "depth display errors files optics plausibility progress psf quantities srgb view",
        "examples": "depth design display optics photographs power progress render scenes video view",
        "options": "depth errors files psf quantities",
        "lab": "dataset design display errors files live luminance optics options quantities render scales scenes "
        "stimuli tables tasks termination",
        "web": "dataset design display errors files live psf render scales stimuli tasks",
        "user_tables": "analyses errors files",
        "statistics": "analyses arrays errors files parallel progress quantities user_tables",
        "power": "design errors files observers parallel progress quantities scales statistics tasks user_tables",
        "report": "dataset design errors files observers plotting power progress scales statistics tasks user_tables",
        "plotting": "arrays depth errors eye luminance optics scenes statistics view",
        "cli": "__init__ binocular calibration dataset depth design display errors examples eye files lab live "
        "luminance memory observers optics options parallel photographs plausibility plotting power progress "
        "psf quantities render report scenes statistics stimuli tasks termination user_tables video view web",
        "termination": "",
    }.items()
}
ROOMS["__init__"] = {*ROOMS} - {"cli"}  # the front door, which loads each when it is first touched
ROOMS["__main__"] = {"cli"}

# What a room may import inside a function only: a result draws itself through the room of figures, which knows results.
WHEN_CALLED = {
    "depth": {"plotting"},
}

# Libraries that live in one place: a room, or a folder beside src.
HOMES = {
    "matplotlib": {"plotting", "analysis"},
    "click": {"cli", "options", "analysis"},
    "colour": {"eye"},
    "cv2": {"photographs", "stimuli", "video", "depth", "benchmarks"},
    "PIL": {"photographs", "stimuli", "lab"},
    # Experiments declare designs, to be copied.
    "pydantic": {"dataset", "design", "lab", "photographs", "published", "stimuli", "tables", "web", "experiments"},
    "rawpy": {"photographs"},
    "skimage": {"analysis", "benchmarks"},
    "psychopy": {"lab"},
    "psycopg": {"web"},
    "pyglet": {"lab"},
    "distributed": {"parallel"},
    "mitsuba": {"render"},
    "starlette": {"web", "benchmarks"},  # whose client stands in for browsers
    "uvicorn": {"web"},
    "arviz": {"statistics"},
    "bambi": {"statistics"},
    "pymc": {"statistics"},
    "psignifit": {"statistics"},
    "questplus": {"design"},
}

# What `import focalgradient` must not load: each is imported by the one room that needs it, when it is needed. Of what
# is left NumPy takes most of the time.
HEAVY = {*HOMES, "llvmlite", "multiprocessing", "numba", "pandas", "scipy", "statsmodels", "tqdm"}


def room_of(file: Path) -> str:
    """The room of a file of the package; the folder of a file outside it."""
    if file.is_relative_to(PACKAGE):
        return file.relative_to(PACKAGE).with_suffix("").parts[0]
    return file.relative_to(ROOT).parts[0]


def imports(source: str | ast.AST, package: str = "") -> Iterator[str]:
    """Dotted names of what a source imports anywhere, or uses of `fg`, the package; `package` resolves the relative."""
    for node in ast.walk(ast.parse(source) if isinstance(source, str) else source):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            above = package.split(".")[: 1 - node.level or None] if node.level else []
            origin = ".".join([*above, node.module] if node.module else above)
            yield from (f"{origin}.{alias.name}" for alias in node.names)
        elif isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name) and node.value.id == "fg":
            yield f"focalgradient.{node.attr}"


class Facts(NamedTuple):
    """What the tests ask of a file: all imports, those of its first level, those that run, and texts by line."""

    imports: list[str]
    early: list[str]
    run: set[str]
    texts: list[tuple[int, str]]


@functools.cache
def facts(file: Path) -> Facts:
    """Read a file. Its tree is not kept: 700 of them make each collection of garbage slow."""
    tree = ast.parse(file.read_text(encoding="utf-8"))
    package = ".".join(file.relative_to(ROOT / "src").parts[:-1]) if file.is_relative_to(PACKAGE) else ""
    first = [node for node in tree.body if isinstance(node, ast.Import | ast.ImportFrom | ast.If)]
    whole, early, texts = [*imports(tree, package)], [name for node in first for name in imports(node)], []
    for node in ast.walk(tree):
        if isinstance(node, ast.Constant) and isinstance(node.value, str):
            texts.append((node.lineno, node.value))
        elif isinstance(node, ast.If) and ast.unparse(node.test) == "TYPE_CHECKING":
            node.body = [ast.Pass()]
    return Facts(whole, early, {*imports(tree, package)}, texts)


def imported(file: Path) -> list[tuple[str, str]]:
    """(library, what of it) for each import of a file: for this package the room, for others the dotted rest."""
    found = []
    for name in facts(file).imports:
        library, _, rest = name.partition(".")
        part = rest.partition(".")[0]
        found.append((library, (part if part in ROOMS else "__init__") if library == "focalgradient" else rest))
    return found


def test_imports_are_found_wherever_they_stand() -> None:
    source = "import a.b\nfrom c import d\ndef f():\n    from . import e\n    from ..g.h import i\n    fg.j.k()\n"
    assert sorted(imports(source, "p.q")) == ["a.b", "c.d", "focalgradient.j", "p.g.h.i", "p.q.e"]


def test_every_room_has_a_rule_and_every_rule_a_room() -> None:
    assert {room_of(file) for file in PACKAGE.rglob("*.py")} == set(ROOMS)


def test_rooms_import_only_what_they_may() -> None:
    trespasses = [
        f"{file.relative_to(ROOT)} imports {room}"
        for file in sorted(PACKAGE.rglob("*.py"))
        for library, room in imported(file)
        if library == "focalgradient"
        and room not in ROOMS[room_of(file)] | {room_of(file)} | WHEN_CALLED.get(room_of(file), set())
    ]
    assert not trespasses


def test_rooms_load_nothing_early_that_they_may_import_when_called_only() -> None:
    early = [
        f"{file.relative_to(ROOT)} imports {name}"
        for room, others in WHEN_CALLED.items()
        for file in sorted(PACKAGE.rglob("*.py"))
        if room_of(file) == room
        for name in facts(file).early
        if name.split(".")[:2] in [["focalgradient", other] for other in others]
    ]
    assert not early


def test_arrows_run_one_way() -> None:
    reached = {room: set(others) for room, others in ROOMS.items()}
    for _ in ROOMS:
        reached = {room: others.union(*(reached[other] for other in others)) for room, others in reached.items()}
    assert not [room for room, others in reached.items() if room in others]


def test_no_circle_of_files() -> None:
    """Imports inside functions count."""
    files = {}
    for file in PACKAGE.rglob("*.py"):
        parts = file.relative_to(ROOT / "src").with_suffix("").parts
        files[".".join(parts[:-1] if parts[-1] == "__init__" else parts)] = file
    reached = {}
    for name, file in files.items():
        found = {one if one in files else one.rpartition(".")[0] for one in facts(file).run}
        reached[name] = found & files.keys() - {name}
    while ends := [name for name, others in reached.items() if not others]:  # what imports nothing is in no circle
        for name in ends:
            del reached[name]
        for others in reached.values():
            others.difference_update(ends)
    assert not reached


def test_libraries_stay_at_home() -> None:
    folders = (PACKAGE, ROOT / "analysis", ROOT / "benchmarks", ROOT / "experiments")
    strays = [
        f"{file.relative_to(ROOT)} imports {library}"
        for folder in folders
        for file in sorted(folder.rglob("*.py"))
        for library, _ in imported(file)
        if library in HOMES and room_of(file) not in HOMES[library]
    ]
    assert not strays


def test_only_command_lines_speak_of_options() -> None:
    """The library's sentences name parameters; those of `lab`, whose programs have command lines, options."""
    quoted, option = (
        re.compile(r"'focalgradient [^']*(?:'|$)|focalgradient \w+ [A-Z]+ --\w+"),
        re.compile(r"[\s(]--[a-z]"),
    )
    found = [
        f"{file.relative_to(ROOT)}, line {line}: {text!r}"
        for file in sorted(PACKAGE.rglob("*.py"))
        if room_of(file) not in ("cli", "lab", "options")
        for line, text in facts(file).texts
        if text.count("\n") < 2 and option.search(quoted.sub("", text))
    ]
    assert not found


def test_front_door_is_light() -> None:
    program = f"import sys, focalgradient; print(*{HEAVY}.intersection(sys.modules))"
    assert subprocess.check_output([sys.executable, "-c", program], text=True).split() == []


def test_a_report_of_ratings_loads_no_eye_no_depth_and_no_laboratory(tmp_path: Path) -> None:
    program = (
        "import sys; from focalgradient.report import make_report; make_report(sys.argv[1]); "
        "print(*(name for name in sys.modules if name.startswith('focalgradient.')))"
    )
    root = record_ratings(tmp_path / "data", 3)
    # Tasks of files that earlier tests loaded are passed on to processes, and may need the laboratory.
    plain = {name: value for name, value in os.environ.items() if name != "FOCALGRADIENT_TASKS"}
    loaded = subprocess.check_output([sys.executable, "-c", program, str(root)], text=True, env=plain).split()
    rooms = {name.split(".")[1] for name in loaded}
    assert "report" in rooms
    assert not rooms & {"eye", "retina", "depth", "lab", "web", "observers", "render", "stimuli"}


def test_psychopy_waits_for_a_window() -> None:
    program = "import sys, focalgradient.lab; print(*{'psychopy', 'pyglet'}.intersection(sys.modules))"
    assert subprocess.check_output([sys.executable, "-c", program], text=True).split() == []


@pytest.mark.skipif(not (shutil.which("git") and (ROOT / ".git").exists()), reason="not a git checkout")
def test_no_file_of_the_repository_names_one_machine_or_a_package_index() -> None:
    tied = re.compile(
        r"(?<![\w.:/])/(?:home|Users|root|work|srv|tmp)/\w|[A-Z]:\\+Users\\+\w+\\"
        r"|--(?:extra-)?index[-]url|--find[-]links|https?://\S+/simple\b|files\.pythonhosted\.org"
    )
    list_files = ["git", "-c", "safe.directory=*", "ls-files", "-z", "--cached", "--others", "--exclude-standard"]
    listing = subprocess.check_output(list_files, cwd=ROOT, text=True)
    found = []
    for name in filter(None, listing.split("\0")):
        file = ROOT / name
        content = file.read_bytes() if file.is_file() else b""
        if b"\0" in content:
            continue  # not text
        found += [f"{name}: {match.group()}" for match in tied.finditer(content.decode("utf-8", "replace"))]
    assert not found
