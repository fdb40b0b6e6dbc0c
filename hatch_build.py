"""Bundles the page that runs experiments in a browser, with the packages that page/deno.lock pins, into web/static."""

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
SOURCES = "sources.sha256"  # of the sources that static is made of: the server compares it
SCRIPTS, COPIED = ("page.js", "experimenter.js"), ("index.html", "experimenter.html", "page.css")


def bundle(root: Path) -> None:
    """Make web/static; raises OSError or CalledProcessError where deno is missing or cannot fetch."""
    page, static = root / WEB / "page", root / WEB / "static"
    deno = shutil.which("deno", path=os.pathsep.join([str(Path(sys.executable).parent), os.environ.get("PATH", "")]))
    if deno is None:
        raise FileNotFoundError("deno is missing")
    static.mkdir(exist_ok=True)
    for name in SCRIPTS:
        command = [deno, "bundle", "--quiet", "--frozen", "--platform", "browser", "--minify", "-o", str(static / name)]
        subprocess.run([*command, name], cwd=page, check=True, stdout=subprocess.DEVNULL)
    for name in COPIED:
        shutil.copyfile(page / name, static / name)
    (static / SOURCES).write_text(_sources(page), encoding="utf-8")


def current(root: Path) -> bool:
    """Return whether web/static is made of the present sources."""
    made = root / WEB / "static" / SOURCES
    return made.exists() and made.read_text(encoding="utf-8") == _sources(root / WEB / "page")


def _sources(page: Path) -> str:
    return hashlib.sha256(b"".join(path.read_bytes() for path in sorted(page.iterdir()))).hexdigest()


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
