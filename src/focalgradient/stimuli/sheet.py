"""Contact sheet of a set: one row per scene, one column per condition."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image

from focalgradient.display import Display
from focalgradient.plotting.contact_sheet import contact_sheet
from focalgradient.plotting.figures import as_file, shortened

__all__ = ["sheet_note", "sheet_png"]

MAX_NAME_LETTERS = 12
"""Maximum number of letters of a scene's name beside its pictures."""


def sheet_png(folder: Path, content: Mapping[str, Any], note: str) -> bytes:
    """Return the contact sheet as a PNG file, from a manifest's scenes and pictures."""
    shown = {(one["scene"], one["fixation"], one["aperture"]): one["png"] for one in content["pictures"]}
    apertures = list(dict.fromkeys(aperture for *_, aperture in shown))
    blurred = [("nearest", one) for one in apertures[1:]] + [("farthest", one) for one in apertures[1:]]
    rows = {}
    for name, scene in content["scenes"].items():
        place = {end: tuple(scene[end]["position_px"]) for end in ("nearest", "farthest")}
        near, far = (scene[end]["distance_m"] for end in place)
        text = f"{shortened(name, MAX_NAME_LETTERS)}\n{near:.2f} m to\n{far:.2f} m"
        rows[text] = [(_pixels(folder / shown[name, "nearest", apertures[0]]), tuple(place.values()))]
        rows[text] += [(_pixels(folder / shown[name, end, one]), (place[end],)) for end, one in blurred]
    groups = [("no blur", 1), ("nearest in focus", len(apertures) - 1), ("farthest in focus", 1)]
    return as_file(contact_sheet(rows, [apertures[0], *(one for _, one in blurred)], groups, note), "png")


def sheet_note(controls: Mapping[str, Any], display: Display, size: int) -> str:
    """Return the caption of the contact sheet."""
    words = {
        "mean_luminance_percent": "mean luminance {:.2g} %",
        "shift_px": "shift {:.2g} px",
        "spectrum_percent": "amplitude in any octave {:.2g} % from what blur predicts",
    }
    measured = (text.format(controls[name]["worst"]) for name, text in words.items() if name in controls)
    return (
        f"Rings: point in focus. Shown at {display.degrees(size):.1f} degrees of visual angle, "
        f"{display.pixels_per_degree:.1f} pixels per degree.\n"
        f"Maximum differences between conditions of a scene: {', '.join(measured)}."
    )


def _pixels(path: Path) -> np.ndarray[Any, np.dtype[np.uint8]]:
    with Image.open(path, formats=("PNG",)) as image:
        return np.array(image)
