"""``focalgradient eye --through-focus``: image quality and point spreads of an eye against the target's vergence."""

from __future__ import annotations

import csv
import io
import math
import platform
import re
import time
from collections.abc import Callable, Mapping
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from focalgradient.cli.program import show, summary_json, warnings_given, writable, write_set
from focalgradient.files import printable

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from focalgradient.eye import Cones
    from focalgradient.eye.quality import ThroughFocus

__all__ = ["through_focus"]

FILES = ("through_focus.png", "through_focus.csv", "summary.json")
SPAN, STEP = 2.0, 0.05
"""Range in dioptres beyond the foci of the eye and of its lens's zones, and step of the vergences."""

PICTURES = (-1.0, -0.5, 0.0, 0.5, 1.0)
"""Distances in dioptres from the best focus at which point spreads are drawn, of an eye without zones of power."""

SIDE, MINUTES = 160, 0.2
"""Pixels across a point spread, and minutes of arc of each: frequencies up to 150 cycles per degree, near the cut-off
of a pupil of 5 mm."""


def through_focus(cones: Cones, out: Path, settings: Mapping[str, Any]) -> None:
    """Write the image quality of an eye in white light against the target's vergence."""
    start = time.perf_counter()
    writable(out, FILES)
    with warnings_given() as given:
        from focalgradient.eye.quality import image_quality

        middle = round(cones.focus_vergence / STEP) * STEP
        foci = (0.0, *(() if cones.eye.lens is None else cones.eye.lens.additions))
        low, high = (round(end / STEP) for end in (min(foci) - SPAN, max(foci) + SPAN))
        quality = image_quality(cones, middle + STEP * np.arange(low, high + 1))
        spreads = {change: point_spread(cones, quality.best + change) for change in _pictures(foci)}
        figure = draw(quality, spreads, settings)
    found = {
        "focus_D": cones.focus_vergence,
        "best_D": quality.best,
        "visual_strehl": float(quality.visual_strehl.max()),
        "depth_of_focus_D": quality.depth_of_focus(),
        "depth_of_focus_is_cut_off": quality.is_cut_off(),
    }
    summary = {
        "simulated": True,
        "settings": settings,
        "found": found,
        "warnings": given,
        "versions": {name: version(name) for name in ("focalgradient", "numpy", "scipy")}
        | {"python": platform.python_version()},
    }
    writers: dict[str, bytes | Callable[[Path], object]] = {
        "through_focus.png": figure.savefig,
        "through_focus.csv": table(quality),
        "summary.json": summary_json(summary | {"seconds": time.perf_counter() - start}),
    }
    write_set(out, writers, "summary.json")
    written = [printable(out / name) for name in writers]
    show(
        summary | {"written": written},
        f"Best focus: {found['best_D']:.2f} D, visual Strehl ratio {found['visual_strehl']:.2f}",
        f"Depth of focus (80 % of it): {'at least ' * quality.is_cut_off()}{found['depth_of_focus_D']:.2f} D",
        f"Written: {', '.join(written)}",
    )


def _pictures(foci: tuple[float, ...]) -> tuple[float, ...]:
    """Return the distances from the best focus (D) of the point spreads: over the `foci` if there are several."""
    low, high = min(foci), max(foci)
    if low == high:
        return PICTURES
    return tuple(round(one, 2) for one in np.linspace(low, high, len(PICTURES)).tolist())


def point_spread(cones: Cones, vergence: float) -> NDArray[np.float64]:
    """Return the image of a point at a `vergence` (D) over SIDE x SIDE pixels; all of its light has a sum of 1."""
    whole = 2 * SIDE  # so that light beyond the picture's border does not wrap around
    frequency = np.fft.fftfreq(whole, math.radians(MINUTES / 60))
    along = np.fft.rfftfreq(whole, math.radians(MINUTES / 60))
    seen = cones.optical_transfer(frequency[:, None], along[None], vergence)
    middle = slice((whole - SIDE) // 2, (whole + SIDE) // 2)
    return np.fft.fftshift(np.fft.irfft2(seen, (whole, whole)))[middle, middle]


def table(quality: ThroughFocus) -> bytes:
    """Return the quality as a CSV file, one row per vergence."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(["vergence_D", "visual_strehl", *(f"mtf_{f:g}_cpd" for f in quality.frequency_cpd)])
    for vergence, strehl, mtf in zip(quality.vergences, quality.visual_strehl, quality.mtf, strict=True):
        writer.writerow([f"{vergence:.2f}", f"{strehl:.4f}", *(f"{value:.4f}" for value in mtf)])
    return text.getvalue().encode()


def draw(quality: ThroughFocus, spreads: Mapping[float, NDArray[np.float64]], settings: Mapping[str, Any]) -> Any:
    """Draw point spreads by distance from the best focus (D), and below them quality against the target's vergence."""
    from focalgradient.plotting import BLUE, GREEN, GREY, ORANGE, new_figure, style

    with style():
        figure = new_figure(200, 120, layout="constrained")
        above, below = figure.subfigures(2, 1, height_ratios=(1, 1.5), squeeze=False)[:, 0]
        half = SIDE * MINUTES / 2
        for column, (change, spread) in enumerate(spreads.items()):
            ax = above.add_subplot(1, len(spreads), column + 1)
            ax.imshow(np.sqrt(np.clip(spread / spread.max(), 0, 1)), cmap="gray", extent=(-half, half, half, -half))
            where = f"{abs(change):g} D {'nearer' if change > 0 else 'farther'}"
            ax.set_title(where if change else f"best focus, {_signed(quality.best)} D")
            ax.set(xticks=[-10, 0, 10], yticks=[-10, 0, 10] if not column else [])
            if not column:
                ax.set_ylabel("image of a point")
        mtf, strehl = below.subplots(1, 2, width_ratios=(3, 2))
        for f, values, colour in zip(quality.frequency_cpd, quality.mtf.T, (BLUE, GREEN, ORANGE), strict=True):
            mtf.plot(quality.vergences, values, color=colour, label=f"{f:g} c/deg")
        mtf.set(ylabel="modulation transfer", ylim=(0, 1))
        mtf.legend(loc="upper right")
        strehl.plot(quality.vergences, quality.visual_strehl, color="black")
        strehl.set(ylabel="visual Strehl ratio", ylim=(0, 1.05 * max(0.1, float(quality.visual_strehl.max()))))
        for ax in (mtf, strehl):
            ax.axvline(quality.best, color=GREY, linewidth=0.8, linestyle=(0, (4, 3)))
            ax.set(
                xlabel="vergence of the target (D, infinity at 0)", xlim=(quality.vergences[0], quality.vergences[-1])
            )
        figure.suptitle("\n".join(["Image of a simulated eye through focus", *_lines(_stated(settings))]))
        above.supxlabel("arcmin; square root of the light, each picture with its own maximum", fontsize="small")
        figure.draw_without_rendering()
    return figure


LONGEST = 90
"""Maximum length of a line of the title, in characters."""


def _lines(settings: Mapping[str, str]) -> list[str]:
    """Return the settings in lines of about equal length, none of them broken."""
    words = [f"{name} {value}" for name, value in settings.items()]
    whole = len(", ".join(words))
    even = whole / math.ceil(whole / LONGEST)
    lines = [words[0]]
    for one in words[1:]:
        if len(lines[-1]) + len(one) / 2 > even:
            lines[-1] += ","
            lines.append(one)
        else:
            lines[-1] += f", {one}"
    return lines


def _signed(value: float) -> str:
    """Format a vergence (D) with a minus sign."""
    return f"{round(value, 2) + 0:g}".replace("-", "−")


def _stated(settings: Mapping[str, Any]) -> dict[str, str]:
    """Return the settings of the eye that the title states."""
    shown = {"pupil": f"{settings['pupil_mm']:.1f} mm", "light": str(settings["illuminant"])}
    shown["looking at"] = f"{settings['accommodation_D']:g} D"
    units = {"refraction": "", "correction": "", "age": " years", "aberrations": "", "zones": "", "eye": ""}
    for name, unit in units.items():
        if settings.get(name) is not None:
            value = settings[name]
            shown[name] = f"{value:g}{unit}" if isinstance(value, float) else re.sub(r"-(?=\d)", "−", str(value))
    if "eccentricity_deg" in settings:
        shown["at"] = f"{settings['eccentricity_deg']:g}° in the {settings['meridian']} field"
    if settings.get("scatter"):
        shown["scatter"] = "CIE"
    return shown
