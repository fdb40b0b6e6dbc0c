"""Variation of focus and blur over the field, estimated from flat sheets as second-order polynomials.

Depth maps of a flat target by the default method are slanted and curved. The slant is that of the sheet: measured
slants are proportional to 1 / distance. It is fitted for each sheet and not stored, except for the possible tilt of the
sensor. The curvature is due to blur that varies over the field, as with vignetting: it changes sign with the side of
focus. If sheets at different defocus separate the two, curvature of the focus is fitted as well. Terms are included if
they reduce the prediction error of left-out parts of the frame. The residual scatter beyond noise is compared with the
split-band test of the same maps, so that the standard deviations of a calibrated camera match the measured ones.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from focalgradient.arrays import FloatArray
from focalgradient.calibration.camera import Calibration, Field, disc_radius
from focalgradient.calibration.robust import fit_terms
from focalgradient.depth.common_error import field_modes, spread_over
from focalgradient.depth.depth_map import DepthMap
from focalgradient.depth.settings import used_blur
from focalgradient.depth.validity import LEAST_BLUR
from focalgradient.psf import Disc, Psf, psf_of
from focalgradient.view import View

__all__ = ["FieldFit", "apply_calibration", "fit_field"]


GRID = 12
"""Number of cells of the frame, in each direction, whose medians are fitted."""

LEAST_SHARE = 0.05
"""Minimum valid fraction of a cell."""

LEAST_CELLS = 24
"""Minimum number of cells for fitting a field: four times the number of second-order terms."""

LEAST_VALID = 0.25
"""Minimum valid fraction of a map: isolated valid spots near hard edges mostly contain the errors of edges."""

SPAN = 0.6
"""Minimum extent of the cells in each direction, as a fraction of the frame."""

TILT_SHARE = 0.3
"""Standard deviation of the sensor's tilt, as a fraction of a sheet's slant: for two sheets of one camera, the slant
was proportional to 1 / distance within a tenth.
"""

MAX_ERROR_RATIO = 0.95
"""Maximum ratio of left-out errors at which a more complex polynomial is preferred."""

UNCALIBRATED_ERROR = 0.045
"""Relative error of edge widths at distances that were not calibrated: 4 and 6 % for printed squares at 1 and 2.5 m
(calibrated at 0.5 and 1.5 m), 9 % for one edge at 2.5 m, 1 % at two others.
"""

SCALE_LIMITS = (0.25, 2.0)
"""Limits of the ratio of residual scatter to the split-band estimate; one sheet cannot support values beyond."""


@dataclass(frozen=True, slots=True, eq=False)
class FieldFit:
    """Field estimated from maps of the target."""

    field: Field
    centres: FloatArray  # D, vergence estimated at the centre of the frame for each map; NaN without enough valid cells
    centre_sd: FloatArray
    left: float  # D: scatter of left-out cells around the field
    left_without: float  # D: scatter around a constant
    coverage: float  # fraction of left-out pixels within two standard deviations; NaN without any


CELL = np.dtype([(name, float) for name in ("x", "y", "vergence", "defocus")] + [("which", int), ("fold", bool)])
"""Fields of a cell: medians of its valid pixels (vergence and defocus in D), number of its map, half that it is in."""

_Cells = Any
"""A record array of `CELL`."""


def _cells(maps: Sequence[DepthMap], focus: Sequence[float]) -> _Cells:
    rows = []
    for number, (depth, vergence_focus) in enumerate(zip(maps, focus, strict=True)):
        height, width = depth.shape
        x, y = Field.coordinates(depth.shape)
        for i in range(GRID):
            for j in range(GRID):
                part = np.s_[i * height // GRID : (i + 1) * height // GRID, j * width // GRID : (j + 1) * width // GRID]
                valid = depth.valid[part]
                if valid.mean() < LEAST_SHARE:
                    continue
                middle = float(np.median(depth.vergence[part][valid]))
                place = float(x[0, part[1]].mean()), float(y[part[0], 0].mean())
                rows.append((*place, middle, middle - vergence_focus, number, (i // 2 + j // 2) % 2))
    return np.array(rows, CELL).view(np.recarray)


@dataclass(frozen=True, slots=True)
class _Terms:
    """Terms fitted in addition to a constant for each map."""

    tilt: bool = False  # slant of each sheet
    blur: bool = False  # curvature proportional to defocus
    focus: bool = False  # curvature of the focus

    def columns(self, cells: _Cells) -> FloatArray:
        """Return the design matrix (cells x terms): constants, slants, blur, focus."""
        own = (cells.which == np.arange(int(cells.which.max()) + 1)[:, None]).astype(float)
        curved = Field.terms(cells.x, cells.y)[2:]
        every = np.concatenate([own, own * cells.x, own * cells.y, curved * cells.defocus, curved])
        return every[self.fitted(len(own))].T

    def fitted(self, maps: int) -> NDArray[np.bool_]:
        """Return which of all coefficients are fitted."""
        return np.repeat([True, self.tilt, self.blur, self.focus], [maps, 2 * maps, 3, 3])

    def parts(self, fit: FloatArray, maps: int) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return slants (2 x maps), curvature of blur and curvature of focus from coefficients; 0 if not fitted."""
        every = np.zeros(3 * maps + 6)
        every[self.fitted(maps)] = fit
        slants, blur, focus = np.split(every[maps:], [2 * maps, 2 * maps + 3])
        return slants.reshape(2, maps), blur, focus


def _fit(cells: _Cells, terms: _Terms, use: NDArray[np.bool_]) -> tuple[FloatArray, FloatArray]:
    """Return robust coefficients, and the residuals of all cells."""
    columns = terms.columns(cells)
    fit, _ = fit_terms(columns, cells.vergence, use.astype(float), rounds=5)
    return fit, cells.vergence - columns @ fit


def _left_out(cells: _Cells, terms: _Terms) -> FloatArray:
    """Return the residuals of cells predicted from the other half of the frame's cells (a chessboard of cell pairs)."""
    left = np.empty(cells.x.size)
    for fold in (False, True):
        left[cells.fold == fold] = _fit(cells, terms, cells.fold != fold)[1][cells.fold == fold]
    return left


def _spread(values: FloatArray) -> float:
    return 1.48 * float(np.median(np.abs(values)))


def fit_field(maps: Sequence[DepthMap], views: Sequence[Sequence[View]]) -> FieldFit:
    """Fit the field to depth maps of a flat target, given the views of each map (one focus each).

    The field is flat if the maps contain too little information.
    """
    focus = [pair[0].optics.focus_vergence for pair in views]
    cells = _cells(maps, focus)
    count = np.bincount(cells.which, minlength=len(maps)) if cells.x.size else np.zeros(len(maps), int)
    dense = np.array([depth.valid.mean() >= LEAST_VALID for depth in maps], bool)
    kept = np.isin(cells.which, np.flatnonzero((count >= LEAST_CELLS) & dense))
    nothing = np.full(len(maps), np.nan)
    if not kept.any():
        return FieldFit(Field(), nothing, nothing, np.nan, np.nan, np.nan)
    places = np.unique(cells.which[kept])
    cells = cells[kept]
    cells.which = np.searchsorted(places, cells.which)
    best, error = _Terms(), _spread(_left_out(cells, _Terms()))
    without = error
    x, y = Field.coordinates(maps[0].shape)
    if all(np.ptp(part) > SPAN * np.ptp(whole) for part, whole in ((cells.x, x), (cells.y, y))):
        several = len(places) > 1 and np.ptp(cells.defocus) > 0.5 * np.abs(cells.defocus).max()
        more = [_Terms(True), _Terms(True, True), *([_Terms(True, True, True)] if several else [])]
        for terms in more:
            now = _spread(_left_out(cells, terms))
            if now < MAX_ERROR_RATIO * error:
                best, error = terms, now
    fit, rest = _fit(cells, best, np.ones(cells.x.size, bool))
    slants, blur, focus_curve = best.parts(fit, len(places))
    # the map estimates V = centre + slant + f + b (V - focus); the last two terms are to be removed
    bounds = (cells.x.min(), cells.x.max(), cells.y.min(), cells.y.max())
    field = Field(
        tuple(float(v) + 0.0 for v in (0.0, 0.0, *-focus_curve)),
        tuple(float(v) for v in (0.0, 0.0, *blur)),
        tuple(float(value) for value in bounds),
        tilt=tuple(float(v) for v in TILT_SHARE * np.abs(slants).mean(axis=1) / np.sqrt(len(places))),
    )
    slant_of = dict(zip(places.tolist(), slants.T.tolist(), strict=True))
    centres, centre_sd = nothing.copy(), nothing.copy()
    for number, place in enumerate(places):
        mine = cells.which == number
        centres[place] = fit[number]
        centre_sd[place] = 1.25 * _spread(rest[mine]) / np.sqrt(mine.sum() / 2)  # errors of neighbours are correlated
    ratios = [
        _excess(maps[place], views[place], field, centres[place], slant_of[int(place)], parity)
        for place in places
        for parity in (0, 1)
    ]
    scale = _scale(ratio for ratio, _ in ratios)
    # Each half of the frame with the ratio of the other.
    within = [covered(_scale([ratios[number ^ 1][0]])) for number, (_, covered) in enumerate(ratios)]
    return FieldFit(replace(field, split_band_scale=scale), centres, centre_sd, error, without, float(np.mean(within)))


def _scale(squares: Iterable[float | None]) -> float:
    """Return the root mean square of the known ratios within `SCALE_LIMITS`; 1 if none is known."""
    known = [square for square in squares if square is not None]
    return float(np.clip(np.sqrt(np.mean(known)), *SCALE_LIMITS)) if known else 1.0


def _excess(
    depth: DepthMap, views: Sequence[View], field: Field, centre: float, slant: Sequence[float], parity: int
) -> tuple[float | None, Callable[[float], float]]:
    """Return the squared ratio of excess scatter to the split-band estimate in half of the frame, and its coverage."""
    model, noise = _parts(depth, views)
    height, width = depth.shape
    rows, columns = np.ogrid[:height, :width]
    half = ((rows * GRID // height // 2 + columns * GRID // width // 2) % 2 == parity) & depth.valid
    focus = views[0].optics.focus_vergence
    x, y = Field.coordinates(depth.shape)
    off = (field.corrected(depth.vergence, focus) - centre - slant[0] * x - slant[1] * y)[half].astype(float)

    def coverage(scale: float) -> float:
        sd = np.hypot(noise[half], scale * model[half])
        return float((np.abs(off) < 2 * sd).mean()) if off.size else np.nan

    square = float(np.mean(model[half] ** 2)) if off.size else 0.0
    if square <= 0:
        return None, coverage
    # matches the quantile that two standard deviations should cover, including outliers
    needed = np.sqrt(np.maximum((off / 2) ** 2 - noise[half] ** 2, 0)) / np.maximum(model[half], 1e-12)
    return min(float(np.quantile(needed, 0.95, method="higher")), 4.0) ** 2, coverage


def _radius(camera: Calibration, f_number: float, focus: float) -> float:
    """Return the radius of the blur disc on the sensor per dioptre of defocus, in metres."""
    return float(disc_radius(camera.focal_length, f_number, focus, focus + 1, camera.telecentric))


def _parts(depth: DepthMap, views: Sequence[View]) -> tuple[FloatArray, FloatArray]:
    """Return the SDs in dioptres due to the split-band test and due to noise (H x W each)."""
    tau = float(depth.details.get("split_band", {}).get("tau", 0.0))
    pixel_angle = views[0].pixel_angle
    slopes = [view.optics.aperture_diameter / 2 / pixel_angle for view in views]
    radius = np.max(
        [s * np.abs(view.optics.focus_vergence - depth.vergence) for s, view in zip(slopes, views, strict=True)], axis=0
    )
    model = np.minimum(tau * np.maximum(LEAST_BLUR, radius) / max(slopes), depth.vergence_sd)
    return model.astype(float), np.sqrt(np.maximum(depth.vergence_sd.astype(float) ** 2 - model**2, 0))


def apply_calibration(
    depth: DepthMap,
    views: Sequence[View],
    camera: Calibration,
    settings: Sequence[tuple[float, float | None]],
    offset: float | None = None,
    plane: str | None = None,
    psf: Psf | str | None = None,
) -> DepthMap:
    """Apply a calibration to a depth map: correct it over the field, and set total standard deviations.

    Parameters
    ----------
    depth
        Depth map recovered from `views`.
    views
        Views whose lenses are those of the calibration (`Calibration.lens`).
    camera
        Calibration.
    settings
        Marked f-number and focus distance (m) of each view.
    offset, plane
        Distance from the desired reference plane to the entrance pupil (m), and name of the plane; None: as calibrated.
    psf
        Shape of the blur with which the map was made; None: the one named in its details.

    Returns
    -------
    DepthMap
        ``vergence_sd`` includes noise and blur-model error (for depth by edges, the scatter of single target edges, and
        the deviation of edges at other distances from the law). ``common_errors`` are those of the calibration: errors
        of the *distance* from the calibration's plane, in which errors of the plane's position cancel.
    """
    method = depth.details.get("method")
    if method == "edges":  # each view is evaluated alone, and the most blurred one is the most accurate
        settings = [min(settings, key=lambda setting: setting[0])]
    vergence, sd = depth.vergence, depth.vergence_sd
    if method in ("equalise", "dual-pixels"):
        model, noise = _parts(depth, views)
        focus = float(np.mean([view.optics.focus_vergence for view in views]))
        vergence = camera.field.corrected(vergence, focus).astype(depth.vergence.dtype)
        sd = np.hypot(noise, camera.field.split_band_scale * model)
    if method == "edges":
        lens = camera.lens(*settings[0])
        per_dioptre = camera.k * _radius(camera, lens.f_number, lens.focus_vergence)  # width on the sensor
        law = max(camera.model_error, UNCALIBRATED_ERROR) * np.abs(lens.focus_vergence - vergence)
        sd = np.hypot(np.hypot(sd, camera.edge_scatter / per_dioptre), law)
        camera = replace(camera, model_error=0.0)  # already included in `sd`
    used = used_blur(depth.details) if psf is None else psf_of(psf)
    shape = used if isinstance(used, Psf) else Disc()  # only Psf shapes have a calibrated scale
    optical = np.maximum(np.asarray(vergence, float), 1e-6)
    # the calibration error varies slowly with vergence: computed at some vergences, interpolated between them
    levels = np.linspace(float(optical.min()), float(optical.max()) + 1e-3, 64)
    own = camera.systematic_modes(settings, levels, shape, of="distance") * levels**2
    common = spread_over(optical, levels, own)
    if method in ("equalise", "dual-pixels") and any(camera.field.tilt):
        x, y = Field.coordinates(depth.shape)
        tilts = [slope * part + np.zeros(depth.shape) for slope, part in zip(camera.field.tilt, (x, y), strict=True)]
        common = np.concatenate([common, np.array(tilts, np.float32)])
    elif not (any(camera.field.focus) or any(camera.field.blur)):  # not known from the target
        common = np.concatenate([common, field_modes(depth.shape, [view.optics for view in views])])
    details = dict(depth.details)
    if depth.valid.any():
        details["common_sd_D"] = {"calibration": float(np.median(np.hypot.reduce(common[:, depth.valid])))}
    return replace(
        depth,
        vergence=vergence,
        vergence_sd=sd.astype(depth.vergence_sd.dtype),
        common_errors=common,
        details=details,
        offset=camera.offset if offset is None else offset,
        plane=depth.plane if plane is None else plane,
    )
