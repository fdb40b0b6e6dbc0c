"""Builds a page that shows Eq. 1 live on a picture with depth: one HTML file, which needs no server and no network.

    python docs/blur_page.py --out blur.html
    python docs/blur_page.py --out mine.html --picture room.png --depth room-depth.npy --field 30

Without --picture it renders a scene of its own (extra render). Its parts stand in the folder ``blur_page``.
"""

from __future__ import annotations

import argparse
import base64
import json
import math
import sys
import warnings
import zlib
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from focalgradient import Lens
from focalgradient.errors import FocalGradientWarning, InputError
from focalgradient.files import read_text, write_whole
from focalgradient.live import FocusSeries, packed, page_script, page_shaders
from focalgradient.photographs import read_distances, read_picture
from focalgradient.render import render
from focalgradient.scenes import naturalistic

PARTS = Path(__file__).parent / "blur_page"

WIDTH = 480
"""Pixels: a page of some megabytes."""

FOCAL_LENGTH = 0.050
STOPS = [1.4, 2, 2.8, 4, 5.6, 8, 11, 16, 22, 32]
"""Whole f-numbers: the first whose blur is within `LARGEST`, and every second after it, are shown."""

LARGEST, SMALLEST, MOST = 8.0, 0.5, 3
"""Radius in pixels of the largest blur, at the widest aperture and at the narrowest, and number of apertures."""

ERROR = (0.5, 5.0)
"""Error of mixing two planes of focus, in steps of 8 bits: bound of the median pixel, and of the worst one."""

NEAR_QUANTILE = 0.9
"""Of the vergences, which is in focus at first: something near."""

OWN_FIELD, OWN_SEED, SAMPLES = 0.4, 1, 256
"""Of the scene that is rendered: width as a tangent, seed, rays a pixel."""


def page(
    light: NDArray[np.floating],
    metres: NDArray[np.floating],
    pixel_angle: float,
    source: str,
    focal_length: float = FOCAL_LENGTH,
) -> str:
    """Give the page for a picture.

    Parameters
    ----------
    light
        Sharp linear light, H x W x 3, 1 being white.
    metres
        Distance of each pixel, H x W; ``inf`` is allowed.
    pixel_angle
        Radians that a pixel subtends.
    source
        Where the picture comes from, a sentence.
    focal_length
        Of the lens that blurs it, in metres.
    """
    vergence = 1 / metres.astype(float)
    low, high = float(vergence.min()), float(vergence.max())
    if not high > low:
        raise InputError("the picture lies in one plane, but the page wants things at several distances.")
    reach = {stop: focal_length / stop / 2 * (high - low) / pixel_angle for stop in STOPS}
    widest = next((number for number, stop in enumerate(STOPS) if reach[stop] <= LARGEST), len(STOPS) - 1)
    stops = [stop for stop in STOPS[widest::2] if stop == STOPS[widest] or reach[stop] >= SMALLEST][:MOST]
    beyond = 0.1 * (high - low)
    sharp = np.clip(light, 0, 1)
    with warnings.catch_warnings():  # the page states the error itself
        warnings.simplefilter("ignore", FocalGradientWarning)
        series = [
            FocusSeries.of(
                sharp,
                metres,
                Lens(focal_length, stop, 1 / high),
                pixel_angle=pixel_angle,
                focus=(max(low - beyond, 0.0), high + beyond),
                median_error=ERROR[0],
                largest_error=ERROR[1],
            )
            for stop in stops
        ]
    height, width = vergence.shape
    levels = np.rint(65535 * (vergence - low) / (high - low)).astype("<u2")
    facts = {
        "w": width,
        "h": height,
        "low": low,
        "high": high,
        "pixelAngle": pixel_angle,
        "focalLength": focal_length,
        "stops": stops,
        "lamp": _lamp(sharp, vergence),
        "focus": float(np.quantile(vergence, NEAR_QUANTILE)),
        "depth": base64.b64encode(zlib.compress(levels.tobytes(), 9)).decode(),
        "series": [packed(one) for one in series],
        "shaders": page_shaders(),
    }
    made = read_text(PARTS / "page.html", "the page's frame")
    parts = {name: read_text(PARTS / name, "a part of the page") for name in ("style.css", "page.js")}
    for name, part in {**parts, "focus.js": page_script()}.items():
        made = made.replace(f"/*{name}*/", part)
    worst = max(one.error[1] for one in series)
    error = (
        f"{max(one.error[0] for one in series):.1f} steps of 8 bits in the median pixel and {worst:.0f} in the worst"
    )
    return made.replace("/*facts*/", json.dumps(facts)).replace("ERROR", error).replace("SOURCE", source)


def _lamp(light: NDArray[np.floating], vergence: NDArray[np.floating]) -> list[int]:
    """Column and row where the point of light stands first: a dark, far place, well inside the frame."""
    height, width = vergence.shape
    bright = np.asarray(light.max(axis=2) + 0.5 * vergence / vergence.max(), np.float32)
    around = np.asarray(cv2.blur(bright, (41, 41)))
    inside = around[height // 6 : -height // 6, width // 6 : -width // 6]
    row, column = np.unravel_index(int(inside.argmin()), inside.shape)
    return [int(column) + width // 6, int(row) + height // 6]


def _own() -> tuple[NDArray[np.floating], NDArray[np.floating], float]:
    """A rendered picture, its depth, and the angle of a pixel."""
    angle = OWN_FIELD / WIDTH
    made = render(
        naturalistic(OWN_SEED, field=OWN_FIELD),
        Lens(FOCAL_LENGTH, math.inf, 1.0),
        (WIDTH * 2 // 3, WIDTH),
        angle,
        engine="path",
        samples=SAMPLES,
    )
    assert made.colour is not None
    return made.colour / np.quantile(made.colour, 0.998), made.distance, angle


def _given(options: argparse.Namespace) -> tuple[NDArray[np.floating], NDArray[np.floating], float]:
    """The picture and the depth of the command line, made smaller to `WIDTH`."""
    if options.depth is None or options.field is None:
        raise InputError("--picture needs --depth and --field, the width of the picture in degrees: give them.")
    light = read_picture(options.picture).light
    light = np.repeat(light[..., None], 3, axis=2) if light.ndim == 2 else light
    angle = 2 * math.tan(math.radians(options.field) / 2) / light.shape[1]
    metres = read_distances(
        options.depth,
        options.depth_unit,
        scale=options.depth_scale,
        baseline=options.baseline,
        pixel_angle=angle,
        offset=options.disparity_offset,
    ).metres
    if metres.shape != light.shape[:2]:
        raise InputError(f"the picture has {light.shape[:2]} pixels but the depth {metres.shape}: make them agree.")
    smaller = max(1.0, light.shape[1] / WIDTH)
    size = (round(light.shape[1] / smaller), round(light.shape[0] / smaller))
    # Light is averaged; depth is not, so that no surface appears between two others.
    reduced = np.asarray(cv2.resize(light, size, interpolation=cv2.INTER_AREA), np.float32)
    nearest = np.asarray(cv2.resize(metres, size, interpolation=cv2.INTER_NEAREST_EXACT), float)
    return reduced, nearest, angle * smaller


def main(given: Sequence[str] | None = None) -> int:
    """Build the page."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    add: Any = parser.add_argument
    add("--out", required=True, type=Path, metavar="FILE", help="the page")
    add("--picture", type=Path, help="a sharp picture, as for 'focalgradient blur'")
    add("--depth", type=Path, help="the distance of each of its pixels")
    add("--depth-unit", choices=("m", "mm", "dioptres", "disparity"), default="m")
    add("--depth-scale", type=float, metavar="S", help="units in a step of the depth")
    add("--baseline", type=float, metavar="M", help="for disparity in pixels")
    add("--disparity-offset", type=float, default=0.0, metavar="PX", help="added to each disparity")
    add("--field", type=float, metavar="DEG", help="width of the picture, in degrees")
    add("--focal-length", type=float, default=1e3 * FOCAL_LENGTH, metavar="MM", help="of the lens that blurs it (50)")
    options = parser.parse_args(given)
    try:
        own = options.picture is None
        light, metres, angle = _own() if own else _given(options)
        source = "The picture was rendered." if own else f"The picture is {options.picture.name}."
        made = page(light, metres, angle, source, 1e-3 * options.focal_length)
        write_whole(options.out, made.encode())
    except InputError as error:
        print(f"Error: {' '.join(str(error).split())}", file=sys.stderr)
        return 2
    print(f"Written: {options.out} ({options.out.stat().st_size / 1e6:.1f} MB)")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
