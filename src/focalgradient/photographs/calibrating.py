"""Calibration of a camera from photographs of a target, or of scenes with depth maps, and how well it predicts them."""

from __future__ import annotations

import math
import os
import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import count
from typing import Any, Literal

import numpy as np

from focalgradient.calibration import (
    Calibration,
    Field,
    FieldFit,
    Prediction,
    Priors,
    Reading,
    calibrate,
    calibrate_pairs,
    check_predictions,
    cross_validate,
    disc_radius,
    fit_field,
    pair_priors,
    refuse_slips,
    shape_k,
)
from focalgradient.errors import FocalGradientWarning, InputError, check_one_of, warn
from focalgradient.files import printable
from focalgradient.photographs.cameras import Calibrated
from focalgradient.photographs.known_scenes import (
    KnownScenes,
    SceneCalibration,
    calibrate_scenes,
    load_known_scenes,
    names_depth,
)
from focalgradient.photographs.targets import Targets, TargetShot, load_targets
from focalgradient.progress import Progress, silent
from focalgradient.psf import Disc, Psf, psf_of

__all__ = ["TargetCalibration", "calibrate_camera"]

BLUR_DEVIATION = 0.05
"""Deviation of one photograph's blur from that of its repetitions above which it is reported, as a fraction."""

BLUR_TOLERANCE = 0.1
"""Tolerance between the blur derived from a depth map and that of the pair, as a fraction; beyond it the pair's is
kept: twice `BLUR_DEVIATION`.
"""

LEFT_OUT: tuple[Literal["distance", "view"], ...] = ("distance", "view")
"""What cross-validation leaves out in turn."""


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class TargetCalibration:
    """Camera calibrated from a target, with the prediction of each photograph from the others.

    Parameters
    ----------
    calibrated
        Sensor and calibration of the camera, for `camera_toml` and `depth_from_photographs`.
    shots, readings
        Photographs whose blur was measured (of a pair: the one with the wider aperture), and their blur.
    by_view, by_distance
        Prediction of each photograph's target from the other photographs, and from those at other distances only; None
        if these do not determine it.
    field
        Variation of focus and blur over the field; None by method ``"edges"``.
    """

    calibrated: Calibrated
    shots: Sequence[TargetShot]
    readings: Sequence[Reading]
    by_view: Sequence[Prediction | None]
    by_distance: Sequence[Prediction | None]
    field: FieldFit | None = None

    def __repr__(self) -> str:
        return f"TargetCalibration({len(self.readings)} photographs, {self.calibrated.calibration!r})"

    def record(self) -> dict[str, Any]:
        """Return the parameters, for JSON: as `Calibration.record`."""
        return self.calibrated.calibration.record()

    def summary(self) -> str:
        """Return tables of the parameters and of the predictions, and of blur over the field."""
        camera = self.calibrated.calibration
        shape = [] if camera.psf is None else [f"Shape of the blur: {camera.psf} (psf {camera.psf.name})"]
        return "\n".join([*self._parameters(), "", *self._predictions(), *shape, *self._over_the_field()])

    def _parameters(self) -> list[str]:
        """Return the camera's table, and whether the distances determine the offset."""
        distances = len({reading.distance for reading in self.readings})
        few = (
            f"{distances} distance{'s do' if distances > 1 else ' does'} not determine the offset: it depends on "
            "its prior and those of k and of the f-numbers. Three or more distances would determine it."
        )
        return [self.calibrated.calibration.summary(), *([few] if distances < 3 else [])]

    def _predictions(self) -> list[str]:
        """Return a table of each photograph's distance as predicted from the others, and the RMS errors."""
        camera = self.calibrated.calibration
        lines = [
            f"{'Predicted from the others':34}{'blur px':>8}{'true m':>8}{'without it':>20}{'without its distance':>24}"
        ]
        squares: dict[str, list[float]] = {"without it": [], "without its distance": []}
        for shot, reading, *predictions in zip(self.shots, self.readings, self.by_view, self.by_distance, strict=True):
            cells = []
            for errors, prediction in zip(squares.values(), predictions, strict=True):
                cells.append(
                    "-" if prediction is None else f"{prediction.distance:.3f} +- {prediction.distance_sd:.3f}"
                )
                if prediction is not None:
                    errors.append((prediction.vergence - 1 / (reading.distance + camera.offset)) ** 2)
            name, width = f"{shot.image.name} f/{reading.f_number:g}", reading.width / camera.pixel_pitch
            lines.append(f"{name:34.34}{width:>8.2f}{reading.distance:>8.3f}{cells[0]:>20}{cells[1]:>24}")
        for name, found in squares.items():
            if found:
                rms = math.sqrt(sum(found) / len(found))
                lines.append(f"Root mean square error, each view predicted {name}: {rms:.3f} D")
            else:
                lines.append(f"Views predicted {name}: none, because the others do not determine it.")
        return lines

    def _over_the_field(self) -> list[str]:
        """Return sentences on the field, as estimated from depth maps of the target."""
        found = self.field
        if found is None:
            return []
        if not math.isfinite(found.left):
            return ["Field: the maps of the target are too sparse to show how focus varies over the frame."]
        uneven = any((*found.field.focus, *found.field.blur))
        order = "varies over the frame, as stated in [field]" if uneven else "is even over the frame"
        return [
            f"Field: blur {order}: left-out parts of the frame scatter by {found.left:.3f} D around it, "
            f"{found.left_without:.3f} D around a constant.",
            f"Cross-validated: {found.coverage:.1%} of the left-out pixels within two standard deviations "
            f"(model error {found.field.split_band_scale:.2f} times the split-band test's).",
        ]


def calibrate_camera(
    targets: str | os.PathLike[str] | Targets | KnownScenes,
    *,
    method: Literal["edges", "equalise"] = "edges",
    psf: Psf | str | None = None,
    progress: Progress | None = None,
) -> TargetCalibration | SceneCalibration:
    r"""Calibrate a camera from photographs of a target at known distances, or of scenes with depth maps.

    Parameters
    ----------
    targets
        TARGETS.toml, or its content (`load_targets`, `load_known_scenes`): photographs, each with the distance of the
        target or with a depth map of the scene.
    method
        How the blur of a target is measured: along its edges, or by equalising pairs of different f-number over the
        whole frame, as in the default method of depth, for which any texture is suitable.
    psf
        Shape of the blur for method ``"equalise"`` and for scenes. None: the most likely of disc, Gaussian-edged disc
        and Gaussian; for scenes, a disc.
    progress
        Called before each stage with the fraction of the work done and a description.

    Returns
    -------
    TargetCalibration or SceneCalibration
        The camera (``calibrated``), and how well it predicts photographs or scenes that were left out.

    Raises
    ------
    InputError
        If a file cannot be used, the photographs contradict the stated values, or no camera explains them.

    Warns
    -----
    FocalGradientWarning
        If a photograph is blurred differently from its repetitions, or the calibration cannot be tested.

    Examples
    --------
    A knife edge at three distances, through f/4 focused at 1 m and with pixels of 20 um:

    >>> import tempfile
    >>> from pathlib import Path
    >>> from scipy.special import ndtr
    >>> from focalgradient import Lens
    >>> text = "[camera]\nfocal_length_mm = 50\npixel_pitch_um = 20\noffset_sd_m = 0.001\n"
    >>> lens, column = Lens(0.05, 4.0, 1.0), np.arange(80) - 40 - 0.1 * np.arange(60)[:, None]
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     for distance in (1.3, 1.6, 2.2):
    ...         sd = 0.546 * float(lens.blur_radius(distance)) * lens.sensor_distance / 20e-6
    ...         light = 0.2 + 0.6 * ndtr(column / sd) + 1e-3 * np.random.default_rng(0).standard_normal((60, 80))
    ...         np.save(Path(folder, f"{distance}.npy"), light)
    ...         text += f'[[view]]\nimage = "{distance}.npy"\ndistance_m = {distance}\nf_number = 4\n'
    ...         text += "focus_distance_m = 1.0\n"
    ...     _ = Path(folder, "targets.toml").write_text(text)
    ...     found = calibrate_camera(Path(folder, "targets.toml"))
    >>> abs(1 / found.calibrated.calibration.focus[1.0] - 1) < 0.02
    True
    """
    if not isinstance(targets, Targets | KnownScenes):
        targets = load_known_scenes(targets) if names_depth(targets) else load_targets(targets)
    shape = None if psf is None else psf_of(psf)
    say = progress or silent
    if isinstance(targets, KnownScenes):
        return calibrate_scenes(targets, shape or Disc(), say)
    check_one_of("method", method, ("edges", "equalise"))
    if shape is not None and method == "edges":
        raise InputError(
            "psf requires method='equalise', because edges are fitted with a Gaussian: add it, or leave psf out."
        )
    pairs = targets.pairs if method == "equalise" else []
    shots = [wide for wide, _ in pairs] or targets.shots
    stages, done = len(shots) + len(pairs) + 2 + bool(pairs), count()

    def stage(words: str) -> None:
        say(next(done) / stages, words)

    if pairs:
        stage("comparing shapes of blur")
        shape = shape or targets.shape(pairs)
    fit = calibrate if shape is None else _fit_of_pairs(pairs, shape)
    readings = []
    for number, shot in enumerate(shots):
        stage(printable(shot.image.name))
        readings.append(targets.read(shot) if shape is None else targets.read_pair(pairs[number], shape))
    sensor, priors = targets.camera, targets.priors
    lengths = sensor.focal_length_mm * 1e-3, sensor.pixel_pitch_um * 1e-6
    stage("checking stated values")
    refuse_slips(readings, *lengths, priors if shape is None else pair_priors(priors, shape_k(shape)))
    camera, found = fit(readings, *lengths, priors), None
    if pairs:
        found = _field_of_pairs(targets, pairs, camera, readings, stage)
        camera = replace(fit(readings, *lengths, priors), field=found.field)  # by the maps' readings, where available
    stage("fitting the camera")
    by_distance, by_view = (cross_validate(readings, *lengths, priors, leave=one, fit=fit) for one in LEFT_OUT)
    _warn_of_deviating_blur(shots, readings)
    check_predictions(readings, by_distance, by_view, camera.offset)
    calibrated = Calibrated(sensor=sensor.only, calibration=camera)
    return TargetCalibration(calibrated, shots, readings, by_view, by_distance, found)


def _fit_of_pairs(pairs: Sequence[tuple[TargetShot, TargetShot]], shape: Psf) -> Callable[..., Calibration]:
    """Return the fit to pairs by one shape of blur, with the parameters of `calibrate`."""
    f_numbers = [shot.f_number for pair in pairs for shot in pair]

    def fit(readings: Sequence[Reading], focal_length: float, pixel_pitch: float, priors: Priors) -> Calibration:
        found = calibrate_pairs(readings, f_numbers, focal_length, pixel_pitch, priors, shape_k(shape))
        return replace(found, psf=shape)

    return fit


def _field_of_pairs(
    targets: Targets,
    pairs: Sequence[tuple[TargetShot, TargetShot]],
    camera: Calibration,
    readings: list[Reading],
    stage: Callable[[str], object],
) -> FieldFit:
    """Fit focus and blur over the field to depth maps of the target; replace `readings` by similar ones of the maps."""
    places, maps, views = [], [], []
    for place, pair in enumerate(pairs):
        stage(f"depth of {printable(pair[0].image.name)}")
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", FocalGradientWarning)
            mapped = targets.map_pair(pair, camera)
        if mapped is not None:
            places.append(place)
            views.append(mapped[0])
            maps.append(mapped[1])
    if not maps:
        return FieldFit(Field(), np.zeros(0), np.zeros(0), math.nan, math.nan, math.nan)
    found = fit_field(maps, views)
    for place, centre, sd in zip(places, found.centres, found.centre_sd, strict=True):
        if math.isfinite(centre):
            wide = pairs[place][0]
            lens = camera.lens(wide.f_number, wide.focus_distance_m)
            width, per_dioptre = (
                camera.k
                * float(disc_radius(camera.focal_length, lens.f_number, lens.focus_vergence, at, camera.telecentric))
                for at in (centre, lens.focus_vergence + 1)
            )
            if abs(width / readings[place].width - 1) < BLUR_TOLERANCE:
                readings[place] = replace(readings[place], width=width, width_sd=per_dioptre * sd)
    return found


def _warn_of_deviating_blur(shots: Sequence[TargetShot], readings: Sequence[Reading]) -> None:
    """Warn of photographs whose blur differs from that of their repetitions: camera shake, or changed focus."""
    for shot, reading in zip(shots, readings, strict=True):
        kind = (reading.distance, reading.f_number, reading.focus_distance)
        alike = sorted(r.width for r in readings if (r.distance, r.f_number, r.focus_distance) == kind)
        deviation = reading.width / alike[len(alike) // 2] - 1
        if len(alike) > 2 and abs(deviation) > BLUR_DEVIATION:
            warn(
                f"{shot.image} is {abs(deviation):.0%} {'more' if deviation > 0 else 'less'} blurred than the others "
                "of its kind: check for camera shake, and leave it out."
            )
