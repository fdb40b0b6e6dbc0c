"""Depth from photographs: settings from a file or EXIF, views, depth map, and a record of how it was made."""

from __future__ import annotations

import math
import os
import platform
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import nullcontext
from dataclasses import dataclass, replace
from importlib.metadata import version
from pathlib import Path
from typing import Any, Literal, Unpack

import numpy as np

from focalgradient.calibration import apply_calibration
from focalgradient.depth.common_error import CORNERS, KnownPoint, checked_points, with_known_points
from focalgradient.depth.depth_map import DepthMap
from focalgradient.depth.recover import recover_depth
from focalgradient.depth.settings import AUTO, METHODS, SOURCES, BlurSource, MethodName, blur_source, used_blur
from focalgradient.errors import InputError, warn
from focalgradient.files import printable
from focalgradient.memory import require
from focalgradient.photographs.cameras import Calibrated, load_camera
from focalgradient.photographs.exif import GivenOptics, from_exif
from focalgradient.photographs.images import read_photographs
from focalgradient.photographs.other_encoding import encoding_difference
from focalgradient.photographs.photograph import Photograph
from focalgradient.photographs.settings import GIVEN, Settings, load_settings, make_views
from focalgradient.plausibility import given_as
from focalgradient.progress import Progress, silent
from focalgradient.psf import Disc, Gaussian, Psf, psf_from, psf_of
from focalgradient.view import View

__all__ = ["PhotographedDepth", "depth_from_photographs", "limits_beside_focus"]

FEW_VALID = 5e-4
"""Share of valid pixels, printed as 0.0 %, below which a summary states that its median is of few pixels."""

LARGE_SD = 0.1
"""Total standard deviation, as a fraction of vergence, above which that of distance (first-order) is not stated: at 0.1
the 95 % range of distance extends 0.16 of the distance to the near side and 0.24 to the far one."""

NORMAL_95 = 1.96
"""Half width of the 95 % range of a normal distribution, in standard deviations."""

BYTES_PER_PIXEL = 100
"""Memory of depth in bytes per pixel, apart from the images: 93 measured from 13 to 25 megapixels (1.6 and 2.7 GB),
with the default method and two views full of occlusion boundaries."""

READING_SHARE = 1 / 6
"""Share of the work assigned to reading the photographs, for progress."""

PathLike = str | os.PathLike[str]


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class PhotographedDepth:
    """Depth map of photographs, with the settings and views from which it was made.

    Parameters
    ----------
    depth
        The depth map, on the pixels of the first photograph; distances are relative to `Settings.plane`.
    settings, photographs, views
        Camera settings, image files and views, in one order.
    options
        Method, limits (``near_m``, ``far_m``), alignment, measured points (``at``) and completion, as given; and the
        blur (``psf``) as used.
    """

    depth: DepthMap
    settings: Settings
    photographs: Sequence[Photograph]
    views: Sequence[View]
    options: Mapping[str, Any]

    def __repr__(self) -> str:
        return f"PhotographedDepth({len(self.views)} photographs, {self.depth!r})"

    @property
    def medians(self) -> dict[str, float]:
        """Medians over the valid pixels; units are in the names. NaN if no pixel is valid."""
        depth = self.depth
        values = {
            "distance_m": depth.distance,
            "vergence_dioptres": depth.vergence,
            "vergence_sd_dioptres": depth.vergence_sd,
            "common_sd_dioptres": depth.common_sd,
            "distance_sd_m": depth.distance_sd,
        }
        any_valid = bool(depth.valid.any())
        return {name: float(np.median(value[depth.valid])) if any_valid else math.nan for name, value in values.items()}

    def summary(self) -> str:
        """Return the median depth, its standard deviations, and the change of depth under the other encoding."""
        medians, details, count = self.medians, self.depth.details, len(self.views)
        distance, own, common = (medians[name] for name in ("distance_m", "vergence_sd_dioptres", "common_sd_dioptres"))
        if self.settings.relative:
            place = 1 + (medians["vergence_dioptres"] - 1) * (count - 1)
            lines = [f"Median place in the stack: {place:.2f} of {count} (order only)"]
        else:
            valid = int(self.depth.valid.sum())
            is_few = valid < FEW_VALID * self.depth.valid.size
            few = f" (of {valid} valid pixel{'s' * (valid > 1)} only)" if is_few else ""
            lines = [f"Median distance: {distance:.4g} m from {self.settings.plane}{few}"]
            if not valid:
                lines = ["No pixel is valid: there is no median distance"]
        if (difference := details.get("encoding_difference_D")) is not None:
            taken, other = ("sRGB", "linear") if self.photographs[0].encoding == "srgb" else ("linear", "sRGB")
            lines.append(
                f"The files do not state their encoding of light and are assumed to be {taken}; if they were {other}, "
                f"depth would differ by {difference:+.2g} D (give encoding, or encoding under [camera], if known)"
            )
        if not (self.settings.relative or math.isnan(own)):
            parts = dict(details.get("common_sd_D", {}))
            corners = [f"at its corners field {corner:.2g}" for corner in [parts.pop(CORNERS, None)] if corner]
            everywhere = ", ".join(f"{name.replace('_', ' ')} {value:.2g}" for name, value in parts.items())
            causes = "; ".join(filter(None, [everywhere, *corners]))
            shared = f"; {common:.2g} D of the whole frame ({causes})" if common > 0 else ""
            total = self._total_in_metres(medians)
            lines.append(f"Standard deviation (median): {own:.2g} D between pixels{shared}{total}")
        return "\n".join(lines)

    def _total_in_metres(self, medians: Mapping[str, float]) -> str:
        """Return the total standard deviation; where it is large, the 95 % range of distance, which is asymmetric."""
        if not math.isfinite(medians["distance_sd_m"]):
            return ""
        vergence, sd = medians["vergence_dioptres"], float(np.median(self.depth.total_sd[self.depth.valid]))
        if sd <= LARGE_SD * vergence:
            return f", total {medians['distance_sd_m']:.2g} m"
        offset, least = medians["distance_m"] - 1 / vergence, vergence - NORMAL_95 * sd
        nearest = 1 / (vergence + NORMAL_95 * sd) + offset
        farthest = f"{1 / least + offset:.3g} m" if least > 0 else "infinity"
        return f", total {sd:.2g} D: distance {nearest:.3g} m to {farthest} (95 %)"

    def record(self, warnings: Sequence[str] = ()) -> dict[str, Any]:
        """Return everything known about the map except its pixels, for JSON; `warnings` are those issued meanwhile.

        Units are in the names. ``settings`` has the camera, the views and the options; ``calibration`` the optics as
        calibrated, with the error that all pixels share.
        """
        depth, valid, unknown = self.depth, self.depth.valid, self.settings.placeholders
        camera = self.settings.camera.model_dump()
        views = [
            {
                "image": printable(photograph.path.name),
                "f_number": None if "f_numbers" in unknown else shot.f_number,
                "focus_distance_m": None if unknown else shot.focus_distance_m,
                "flat": None if shot.flat is None else printable(shot.flat.name),
                "pixel_angle_rad": None if unknown else view.pixel_angle,
                "encoding": photograph.encoding,
                "pixel_type": photograph.pixel_type,
                "share_saturated": photograph.saturated,
            }
            for photograph, shot, view in zip(self.photographs, self.settings.shots, self.views, strict=True)
        ]
        packages = ("focalgradient", "numpy", "scipy")
        return {
            "settings": {
                "camera": {name: None if name in unknown else value for name, value in camera.items()},
                "views": views,
                **self.options,
            },
            "distances_from": depth.plane,
            "offset_m": depth.offset,
            "medians": self.medians,
            "calibration": self._calibration(),
            "share_valid": float(valid.mean()),
            "side_of_focus": {
                "reading": depth.details.get("side"),
                "share_of_valid_told_by_views": float(depth.side_known[valid].mean()) if valid.any() else math.nan,
            },
            "details": depth.details,
            "warnings": list(warnings),
            "versions": {name: version(name) for name in packages} | {"python": platform.python_version()},
        }

    def _calibration(self) -> dict[str, Any] | None:
        """Return the optics as calibrated, and the common error that remains in addition to `vergence_sd`."""
        camera, lenses, marks = self.settings.calibration, self.settings.lenses(), self.settings.marks
        if camera is None:
            return None
        if self.options["method"] == "edges":  # views are independent, and the most blurred one is most informative
            marks = [min(marks)]
        vergence = self.depth.vergence[self.depth.valid]
        vergence = vergence[:: 1 + vergence.size // 10_000]
        used = used_blur(self.depth.details)
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


def depth_from_photographs(
    inputs: PathLike | Sequence[PathLike],
    *,
    method: MethodName = "equalise",
    near: float | None = None,
    far: float | None = None,
    psf: BlurSource | str | Mapping[str, Any] = AUTO,
    known_points: Iterable[KnownPoint] = (),
    align: bool = False,
    dense: bool = False,
    calibration: PathLike | Calibrated | None = None,
    begun: Callable[[int, int], object] | None = None,
    progress: Progress | None = None,
    **optics: Unpack[GivenOptics],
) -> PhotographedDepth:
    r"""Recover depth from photographs of one scene and the optics that took them.

    Parameters
    ----------
    inputs
        A settings file (VIEWS.toml) that names the photographs and their optics; or the photographs, whose optics are
        those given and, where not given, those in their EXIF metadata.
    method, align, dense
        As for `focalgradient.recover_depth`.
    near, far
        Limits of the search in metres, from the plane of `distances_from`. Close to the focus of a calibrated camera a
        limit selects one side of it (`limits_beside_focus`).
    psf
        As for `focalgradient.recover_depth`, or a shape and its parameters, such as ``{"shape": "polygon",
        "blades": 5}``. A shape without `k` has that of the settings or of the calibration. ``"auto"``: that of the
        calibration, otherwise as for `focalgradient.recover_depth`.
    known_points
        Measured points: column and row in pixels of the first photograph, and distance in metres from the plane of
        `distances_from`.
    calibration
        Camera calibrated by `calibrate_camera`, or its file; f-numbers and focus distances are then marks on the lens.
    begun
        Called with the number of photographs and of the pixels of each when all have been read.
    progress
        Called at each stage with the fraction of the work done and a description.
    **optics
        Values that take precedence over EXIF, as for `from_exif`; not with a settings file, which states them.

    Returns
    -------
    PhotographedDepth
        The depth map (H x W, vergence in dioptres), and the settings, photographs and views that gave it.

    Raises
    ------
    InputError
        If a file cannot be used, the optics are unknown or implausible, or the views are uninformative about depth.

    Warns
    -----
    FocalGradientWarning
        As for `focalgradient.recover_depth`; if no focus distance is known, so that only the order of depth is
        estimated (method ``"autofocus"``); if a camera calibrated by equalisation is used for edges.

    Examples
    --------
    A textured wall at 1.25 m through f/16 and f/4, focused at 1 m:

    >>> import tempfile
    >>> import focalgradient as fg
    >>> light = np.random.default_rng(0).random((96, 96))
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     files = [Path(folder, f"{number}.npy") for number in (16, 4)]
    ...     for number, file in zip((16, 4), files):
    ...         lens = fg.Lens(0.05, number, 1.0)
    ...         seen = fg.render.blur_picture(light, np.full((96, 96), 1.25), lens, pixel_angle=3e-4)
    ...         np.save(file, seen + 1e-3 * np.random.default_rng(number).standard_normal((96, 96)))
    ...     lens = {"focal_length_mm": 50.0, "f_numbers": (16, 4), "focus_distances_m": (1.0,)}
    ...     found = depth_from_photographs(files, near=1.0, pixel_pitch_um=15.79, **lens)
    >>> abs(found.medians["distance_m"] - 1.25) < 0.03
    True
    """
    say = progress or silent
    points = checked_points(known_points, near, far)
    files = [Path(inputs)] if isinstance(inputs, str | os.PathLike) else [Path(path) for path in inputs]
    tables = [path for path in files if path.suffix.lower() == ".toml"]
    calibrated = calibration if isinstance(calibration, Calibrated | None) else load_camera(calibration)
    with given_as(GIVEN) if tables else nullcontext():
        say(0.0, "reading the views")
        if tables:
            settings, photographs = _read_table(files, tables[0], calibrated, align, optics)
        else:
            settings, photographs = _read_photographs(files, calibrated, align, method, optics)
        pixels = photographs[0].luminance.size
        if begun is not None:
            begun(len(photographs), pixels)
        require(BYTES_PER_PIXEL * pixels, f"depth of {pixels / 1e6:.3g} million pixels", "crop or reduce the images")
        views = make_views(settings, photographs)
        offset = settings.offset
        nearest, farthest = (None if limit is None else limit + offset for limit in (near, far))
        nearest, farthest = limits_beside_focus(nearest, farthest, settings)
        depth = recover_depth(
            views,
            method=method,
            near=nearest,
            far=farthest,
            psf=_blur(psf, method, settings),
            align=align or settings.relative,  # the effect of focus on magnification is then unknown
            dense=dense,
            progress=lambda share, words: say(READING_SHARE + (1 - READING_SHARE) * share, words),
        )
        assumed = {photograph.encoding if photograph.assumed else None for photograph in photographs}
        if method == "equalise" and len(assumed) == 1 and (encoding := assumed.pop()) is not None:
            difference = encoding_difference(views, depth, encoding, nearest, farthest, align)
            found = {} if difference is None else {"encoding_difference_D": difference}
            depth = replace(depth, details=depth.details | found)
        depth = _referred(depth, views, settings, offset)
        if points:
            depth = with_known_points(depth, points)
    blur = depth.details.get("psf"), depth.details.get("psf_parameters")
    options = {"method": method, "near_m": near, "far_m": far, "psf": blur[0], "align": align, "at": points}
    options |= {"dense": dense, "psf_parameters": blur[1]}
    return PhotographedDepth(depth, settings, photographs, views, options)


def _read_table(
    files: Sequence[Path], table: Path, calibrated: Calibrated | None, align: bool, optics: Mapping[str, Any]
) -> tuple[Settings, list[Photograph]]:
    """Read a settings file, and the photographs that it names."""
    if len(files) > 1:
        raise InputError(f"{table} is a settings file, which names its images itself: give it alone.")
    if given := [name for name, value in optics.items() if not (value is None or value is False or value == ())]:
        raise InputError(f"{given[0]} cannot go with {table}, which gives the optics itself: set it there.")
    settings = load_settings(table, calibrated)
    return settings, settings.read_shots(settings.shots, crop=align)


def _read_photographs(
    files: Sequence[Path], calibrated: Calibrated | None, align: bool, method: MethodName, optics: GivenOptics
) -> tuple[Settings, list[Photograph]]:
    """Read photographs, and their settings from EXIF."""
    least = METHODS[method].least
    if len(files) < least:
        what = f"{printable(files[0])} is one file" if files else "no file is given"
        if files and files[0].is_dir():
            what = f"{printable(files[0])} is {'a' if any(files[0].iterdir()) else 'an empty'} folder"
        elif files and not files[0].exists():
            what = f"{printable(files[0])} does not exist"
        raise InputError(
            f"{what}, but depth needs at least {least} photographs, or a settings file whose name ends in .toml: give "
            "these, or method='edges' for one photograph of sharp edges."
        )
    encoding = optics.get("encoding") or (None if calibrated is None else calibrated.sensor.encoding)
    photographs = read_photographs(files, encoding, crop=align)
    given: GivenOptics = {**optics, "encoding": encoding}
    order_only = method == "autofocus"
    return from_exif(files, calibrated=calibrated, least=least, order_only=order_only, **given), photographs


def _blur(psf: BlurSource | str | Mapping[str, Any], method: MethodName, settings: Settings) -> BlurSource:
    """Return the blur shape that was requested, or else calibrated; warn if the method was not calibrated."""
    camera = settings.calibration
    if isinstance(psf, Mapping):
        return psf_from(psf, settings.given_k(str(psf.get("shape"))))
    if isinstance(psf, str) and psf not in SOURCES:
        return psf_of(psf, settings.given_k(psf), SOURCES)
    source = blur_source(psf)
    if source != AUTO or camera is None:
        return source
    if camera.psf is None:  # a Gaussian is the model with which the target's edges were measured
        return Gaussian(camera.k) if method == "edges" else AUTO
    if method == "edges":
        warn(
            "the camera was calibrated by equalising, which does not measure the blur along edges: depth by edges may "
            "err by more than is stated; calibrate it by edges, too (calibrate_camera, method='edges')."
        )
    return camera.psf


def limits_beside_focus(near: float | None, far: float | None, settings: Settings) -> tuple[float | None, float | None]:
    """Return limits of the search next to a calibrated focus: a limit at the marked focus selects that side of it.

    The calibrated focus differs slightly from its mark, so a limit at the mark would leave both sides open. All
    distances are in metres from the entrance pupil; without a calibration, or with several foci, limits are returned
    unchanged.
    """
    camera = settings.calibration
    foci = {lens.focus_distance for lens in settings.lenses()}
    if camera is None or len(foci) > 1:
        return near, far
    focus = foci.pop()
    error = max(2 * float(camera.sd[-1]), 0.02 / focus)  # D
    if near is not None and far is not None and near < focus < far:
        inside = [abs(1 / limit - 1 / focus) for limit in (near, far)]
        if min(inside) > error or min(inside) > 0.25 * max(inside):
            return near, far
        return (focus, far) if inside[0] < inside[1] else (near, focus)
    if far is not None and near is None and far > focus and 1 / focus - 1 / far < error:
        far = focus
    if near is not None and far is None and near < focus and 1 / near - 1 / focus < error:
        near = focus
    return near, far


def _referred(depth: DepthMap, views: Sequence[View], settings: Settings, offset: float) -> DepthMap:
    """Refer a map to the user's plane of distances, and apply the calibration if there is one."""
    if settings.relative:  # ordinal depth: vergence is 1 at the first photograph's focus, and 2 at the last one's
        count = len(views)
        also = "".join(f", and {name}" for name in settings.placeholders[1:] if name != "telecentric")
        warn(
            f"no focus distance is known (give focus_distances_m once for each photograph{also}), so only the order "
            "of depth is estimated: vergence is 1 at the focus of the first photograph and 2 at that of the last of "
            f"{count}, assumed to be evenly spaced; distance is not estimated."
        )
        return replace(depth, details=depth.details | {"order_only": count}, plane="no plane: order only")
    if settings.calibration is None:
        return replace(depth, offset=offset, plane=settings.plane)
    return apply_calibration(depth, views, settings.calibration, settings.marks, offset, settings.plane)
