"""Makes `docs/play.webp`, a film of the page: `python docs/play/film.py` (a minute; Chromium and playwright)."""

from __future__ import annotations

import io
import math
import shutil
from collections.abc import Iterator
from pathlib import Path

from PIL import Image
from playwright.sync_api import Page, sync_playwright

HERE = Path(__file__).parent
FILM = HERE.parent / "play.webp"
PER_S = 6
SIZE = (480, 360)
HOW = ["--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--no-sandbox"]


def scenes() -> Iterator[tuple[str, str]]:
    """Yield the panel that each frame shows and its settings."""
    for n in range(3 * PER_S):  # a point moves from near to far
        yield "lens", f"panels[0].distance.set({-0.9 + 2.2 * n / (3 * PER_S)})"
    for n in range(4 * PER_S):  # the plane of focus moves from near to far and back
        focus = 1.4 + 0.35 * math.cos(2 * math.pi * n / (4 * PER_S))
        yield "disparity", f"panels[1].state.focusVergence = {focus}"
    for n in range(3 * PER_S):  # a control without depth
        yield "disparity", f"panels[1].state.control = {str(n >= PER_S).lower()}"


def frame(page: Page, panel: str, given: str) -> Image.Image:
    """Return one frame: the pictures of a panel on white."""
    page.evaluate(f"() => {{ {given}; for (const panel of panels) if (panel.id === '{panel}') panel.drawn(); }}")
    seen = Image.open(io.BytesIO(page.locator(f"#{panel}").screenshot())).convert("RGB")
    seen.thumbnail(SIZE)
    whole = Image.new("RGB", SIZE, "white")
    whole.paste(seen, ((SIZE[0] - seen.width) // 2, (SIZE[1] - seen.height) // 2))
    return whole


def main() -> None:
    """Record the film."""
    with sync_playwright() as browsers:
        browser = browsers.chromium.launch(executable_path=shutil.which("chromium"), args=HOW)
        page = browser.new_page(viewport={"width": 760, "height": 700}, reduced_motion="reduce", locale="en-GB")
        page.goto((HERE / "index.html").as_uri())
        page.evaluate("() => ready")
        page.add_style_tag(content=".controls, .what { display: none !important }")
        frames = [frame(page, panel, given) for panel, given in scenes()]
        browser.close()
    how = {"duration": 1000 // PER_S, "loop": 0, "quality": 55, "method": 4}
    frames[0].save(FILM, save_all=True, append_images=frames[1:], **how)
    print(f"{len(frames) / PER_S:.0f} s, {FILM.stat().st_size / 1000:.0f} kB")


if __name__ == "__main__":
    main()
