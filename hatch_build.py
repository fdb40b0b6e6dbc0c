"""Bundles the page that runs experiments in a browser, with the packages that page/deno.lock pins, into web/static."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface

WEB = Path("src", "focalgradient", "web")
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
    bundle(Path(__file__).parent)
