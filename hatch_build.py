"""Bundles the pages: that of experiments in a browser, into web/static, and the paper's figures, docs/play/play.js.

Packages are those that page/deno.lock pins. The figures' bundle is kept with the sources, so that they open in a clone.
"""

from __future__ import annotations

import hashlib
import os
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface

WEB = Path("src", "focalgradient", "web")
SHARED = Path("src", "focalgradient", "live", "gl.js")
PLAY = Path("docs", "play")
SOURCES = "sources.sha256"  # of the sources that static is made of: the server compares it
SCRIPTS, COPIED = ("page.js", "experimenter.js"), ("index.html", "experimenter.html", "page.css")


def bundle(root: Path) -> None:
    """Make web/static; raises OSError or CalledProcessError where deno is missing or cannot fetch."""
    static = root / WEB / "static"
    static.mkdir(exist_ok=True)
    for name in SCRIPTS:
        _deno(root, WEB / "page" / name, static / name)
    for name in COPIED:
        shutil.copyfile(root / WEB / "page" / name, static / name)
    (static / SOURCES).write_text(_sources(root), encoding="utf-8")


def bundle_play(root: Path) -> None:
    """Make docs/play/play.js; raises as `bundle`."""
    made = root / PLAY / "play.js"
    _deno(root, PLAY / "page.js", made, "--format", "iife")
    made.write_text(f"// {_play_sources(root)}\n{made.read_text(encoding='utf-8')}", encoding="utf-8")


def _deno(root: Path, source: Path, made: Path, *options: str) -> None:
    deno = shutil.which("deno", path=os.pathsep.join([str(Path(sys.executable).parent), os.environ.get("PATH", "")]))
    if deno is None:
        raise FileNotFoundError("deno is missing")
    command = [deno, "bundle", "--quiet", "--frozen", "--platform", "browser", "--minify", *options, "-o", str(made)]
    subprocess.run([*command, str(root / source)], cwd=root / WEB / "page", check=True, stdout=subprocess.DEVNULL)


def current(root: Path) -> bool:
    """Return whether web/static is made of the present sources."""
    made = root / WEB / "static" / SOURCES
    return made.exists() and made.read_text(encoding="utf-8") == _sources(root)


def play_is_current(root: Path) -> bool:
    """Return whether docs/play/play.js is made of the present sources."""
    made = root / PLAY / "play.js"
    return made.exists() and made.read_text(encoding="utf-8").startswith(f"// {_play_sources(root)}\n")


def _sources(root: Path) -> str:
    return _hash(*sorted((root / WEB / "page").iterdir()), root / SHARED)


def _play_sources(root: Path) -> str:
    own = [path for path in sorted((root / PLAY).glob("*.js")) if path.name not in ("play.js", "data.js")]
    return _hash(*own, root / WEB / "page" / "numbers.js", root / SHARED)


def _hash(*paths: Path) -> str:
    return hashlib.sha256(b"".join(path.read_bytes() for path in paths)).hexdigest()


class Hook(BuildHookInterface):  # type: ignore[type-arg]
    """Before anything is packed: a wheel must have the page, a checkout may go without it."""

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Bundle the page."""
        try:
            bundle(Path(self.root))
        except (OSError, subprocess.CalledProcessError) as error:
            if version != "editable" and not (Path(self.root) / WEB / "static" / "page.js").exists():
                raise
            self.app.display_warning(f"the page for browsers was not bundled ({error}): 'focalgradient serve' needs it")


if __name__ == "__main__":
    checkout = Path(__file__).parent
    if not current(checkout):
        bundle(checkout)
    if not play_is_current(checkout):
        bundle_play(checkout)
