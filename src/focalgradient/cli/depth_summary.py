"""Summary of a depth map by ``focalgradient depth``: summary.json, and the printed lines."""

from __future__ import annotations

import math
import platform
from collections.abc import Mapping, Sequence
from importlib.metadata import version
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from focalgradient.depth.settings import used_blur
from focalgradient.files import printable
from focalgradient.psf import Disc, Psf

if TYPE_CHECKING:
    from focalgradient.depth.depth_map import DepthMap
    from focalgradient.photographs import Photograph, Settings
    from focalgradient.view import View

__all__ = ["printed", "summary_of"]


def printed(settings: Settings, result: DepthMap, summary: Mapping[str, Any], count: int) -> str:
    """Return lines with the median depth and its uncertainty, and the change of depth under the other encoding."""
    distance = summary["medians"]["distance_m"]
    middle = f"Median distance: {'unknown' if math.isnan(distance) else f'{distance:.4g} m from {settings.plane}'}"
    if settings.relative:
        place = 1 + (summary["medians"]["vergence_dioptres"] - 1) * (count - 1)
        middle = f"Median place in the stack: {place:.2f} of {count} (order only)"
    if (difference := result.details.get("encoding_difference_D")) is not None:
        srgb = summary["settings"]["views"][0]["encoding"] == "srgb"
        taken, other = ("sRGB", "linear") if srgb else ("linear", "sRGB")
        middle += (
            f"\nThe files do not state their encoding of light and are assumed to be {taken}; if they were {other}, "
            "depth would "
            f"differ by {difference:+.2g} D (give --encoding, or encoding under [camera], if known)"
        )
    return middle + _uncertainty(result, summary["medians"])


def _uncertainty(result: DepthMap, medians: Mapping[str, float]) -> str:
    """Return a line with the standard deviations between pixels and common to the frame."""
    own, common = medians["vergence_sd_dioptres"], medians["common_sd_dioptres"]
    if result.details.get("order_only") or math.isnan(own):
        return ""
    parts = ", ".join(
        f"{name.replace('_', ' ')} {value:.2g}" for name, value in result.details.get("common_sd_D", {}).items()
    )
    shared = f"; {common:.2g} D of the whole frame ({parts})" if common > 0 else ""
    in_metres = f", together {medians['distance_sd_m']:.2g} m" if math.isfinite(medians["distance_sd_m"]) else ""
    return f"\nStandard deviation (median): {own:.2g} D between pixels{shared}{in_metres}"


def summary_of(
    settings: Settings,
    seen: Sequence[View],
    photographs: Sequence[Photograph],
    options: Mapping[str, Any],
    result: DepthMap,
    given: Sequence[str],
) -> dict[str, Any]:
    """Return the content of summary.json, without the computing time."""
    valid = result.valid

    def median(values: np.ndarray[Any, Any]) -> float:
        return float(np.median(values[valid])) if valid.any() else math.nan

    views = [
        {
            "image": printable(photograph.path.name),
            "f_number": shot.f_number,
            "focus_distance_m": shot.focus_distance_m,
            "flat": None if shot.flat is None else printable(shot.flat.name),
            "pixel_angle_rad": view.pixel_angle,
            "encoding": photograph.encoding,
            "pixel_type": photograph.pixel_type,
            "share_saturated": photograph.saturated,
        }
        for photograph, shot, view in zip(photographs, settings.shots, seen, strict=True)
    ]
    packages = ("focalgradient", "numpy", "scipy")
    return {
        "settings": {"camera": settings.camera.model_dump(), "views": views, **options},
        "distances_from": settings.plane,
        "offset_m": result.offset,
        "medians": {
            "distance_m": median(result.distance),
            "vergence_dioptres": median(result.vergence),
            "vergence_sd_dioptres": median(result.vergence_sd),
            "common_sd_dioptres": median(result.common_sd),
            "distance_sd_m": median(result.distance_sd),
        },
        "calibration": _calibration(settings, options, result),
        "share_valid": float(valid.mean()),
        "side_of_focus": {
            "reading": result.details.get("side"),
            "share_of_valid_told_by_views": float(result.side_known[valid].mean()) if valid.any() else math.nan,
        },
        "details": result.details,
        "warnings": list(given),
        "versions": {name: version(name) for name in packages} | {"python": platform.python_version()},
    }


def _calibration(settings: Settings, options: Mapping[str, Any], result: DepthMap) -> dict[str, Any] | None:
    """Return the optics as calibrated, and the common error that remains in addition to `vergence_sd`."""
    camera = settings.calibration
    if camera is None:
        return None
    lenses = settings.lenses()
    marks = [(shot.f_number, shot.focus_distance_m) for shot in settings.shots]
    if options["method"] == "edges":  # views are independent, and the most blurred one is the most informative
        marks = [min(marks)]
    vergence = result.vergence[result.valid]
    vergence = vergence[:: 1 + vergence.size // 10_000]

    used = used_blur(result.details)
    shape = used if isinstance(used, Psf) else Disc()

    def median(of: Literal["vergence", "distance"]) -> float:
        return float(np.median(camera.systematic_sd(marks, vergence, shape, of=of))) if vergence.size else math.nan

    return {
        "offset_m": camera.offset,
        "effective_f_numbers": [lens.f_number for lens in lenses],
        "true_focus_distance_m": [lens.focus_distance - camera.offset for lens in lenses],
        "blur_k": camera.k,
        "own_blur_um2": camera.own * 1e12,
        "systematic_sd": {"vergence_dioptres": median("vergence"), "distance_m": median("distance")},
    }
