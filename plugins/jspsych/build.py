"""Bundle the plugins into dist/, for `npm pack` and for tests.

What draws lives in the Python package, for its own pages: the classes in `web/page`, and `FocusView` in `live`. Its
shaders, constants of the cube and texts are written to build/shared.js, and all is bundled by deno.
"""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

HERE = Path(__file__).resolve().parent
ROOT = HERE.parents[1]
PAGE = ROOT / "src" / "focalgradient" / "web" / "page"
VENV = ROOT / ".venv" / "bin" / "python"

TEXTS = ("card", "card_done", "blind_spot", "blind_spot_left", "distance_right", "yes", "no")
"""Of the pages that measure the distance."""

EXTERNAL = ("jspsych", "@jspsych/plugin-html-button-response", "@jspsych/plugin-virtual-chinrest")


def shared() -> str:
    """Source of what the plugins take from the Python package."""
    sys.path.insert(0, str(ROOT / "src"))
    from focalgradient.design.words import LANGUAGES, load_words
    from focalgradient.live import page_shaders
    from focalgradient.psf import DISC_K
    from focalgradient.render.wireframe import WIDTH
    from focalgradient.stimuli.cube_frames import LEVEL, REACH, SHRINK, TWIST

    texts = {
        language: {f"web.{name}": load_words(language).entries[f"web.{name}"] for name in TEXTS}
        for language in LANGUAGES
    }
    cube = {"level": LEVEL, "reach": REACH, "shrink": SHRINK, "twist": TWIST, "width": WIDTH, "blur_k": DISC_K}
    parts = {"SHADERS": page_shaders(), "TEXTS": texts, "CUBE": cube}
    return "".join(f"export const {name} = {json.dumps(value, ensure_ascii=False)};\n" for name, value in parts.items())


def deno(*arguments: str | Path) -> None:
    """Run deno with the packages that the page's lock file pins; raises CalledProcessError where it fails."""
    places = [str(Path(sys.executable).parent), str(VENV.parent), os.environ.get("PATH", "")]
    program = shutil.which("deno", path=os.pathsep.join(places))
    if program is None:
        raise FileNotFoundError("deno is missing: run 'make' in the checkout, or install it")
    subprocess.run([program, *map(str, arguments)], cwd=PAGE, check=True, stdout=subprocess.DEVNULL)


def write_shared() -> None:
    """Write build/shared.js."""
    (HERE / "build").mkdir(exist_ok=True)
    (HERE / "build" / "shared.js").write_text(shared(), encoding="utf-8")


def bundle(out: Path = HERE / "dist") -> None:
    """Write the module, its CommonJS form, and the script for pages, which brings all but jsPsych's own window."""
    write_shared()
    out.mkdir(parents=True, exist_ok=True)
    plain = ["bundle", "--quiet", "--frozen", "--platform", "browser"]
    apart = [word for name in EXTERNAL for word in ("--external", name)]
    for name, kind in (("index.js", "esm"), ("index.cjs", "cjs")):
        deno(*plain, "--format", kind, *apart, "-o", out / name, HERE / "src" / "index.js")
    deno(*plain, "--minify", "--format", "iife", "-o", out / "index.browser.min.js", HERE / "src" / "browser.js")


if __name__ == "__main__":
    if VENV.exists() and Path(sys.prefix).resolve() != VENV.parents[1].resolve():
        os.execv(VENV, [str(VENV), __file__])
    try:
        bundle()
    except (ImportError, FileNotFoundError) as error:
        sys.exit(
            f"The plugins cannot be bundled ({error}): run 'make' in the checkout, which makes .venv with all of it."
        )
