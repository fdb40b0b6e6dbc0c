"""CAMERA.toml: a calibrated camera, as written by `focalgradient calibrate`."""

from __future__ import annotations

import json
import os
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from pydantic import Field, InstanceOf

from focalgradient.arrays import FloatArray
from focalgradient.calibration import Calibration
from focalgradient.calibration import Field as FocusField
from focalgradient.errors import InputError, located
from focalgradient.files import read_toml
from focalgradient.photographs.planes import plane_name
from focalgradient.photographs.tables import Sensor
from focalgradient.psf import Psf, psf_from, shape_class
from focalgradient.tables import Table, load_table

__all__ = ["Calibrated", "camera_toml", "load_camera"]


ROUNDING_TOLERANCE = 1e-4
"""Tolerance of correlations and their eigenvalues: the file stores seven digits of some tens of numbers each."""


class Calibrated(Table):
    """Sensor and blur calibration of a camera, from which its views are made."""

    sensor: Sensor
    calibration: InstanceOf[Calibration]

    @property
    def focus(self) -> float | None:
        """The single focus distance (m), as marked or, if unmarked, as estimated; None if there are several."""
        (mark, vergence), *others = self.calibration.focus.items()
        return None if others else mark or 1 / vergence - self.calibration.offset

    def fill(self, data: dict[str, Any]) -> dict[str, Any]:
        """Return the `data` of a settings file, with missing values taken from the calibration."""
        sensor = self.sensor.model_dump(exclude_none=True)
        camera = data.get("camera", {})
        views = data.get("view", [])
        if self.focus is not None and isinstance(views, list):
            lacking = {"focus_distance_m": self.focus}
            views = [lacking | view if isinstance(view, dict) else view for view in views]
        return data | {"camera": sensor | camera if isinstance(camera, dict) else camera, "view": views}


_Number = Annotated[float, Field(allow_inf_nan=False, description="a number")]
_Positive = Annotated[float, Field(gt=0, allow_inf_nan=False, description="a positive number")]


class _Body(Sensor):
    edge_scatter_um: float = Field(0.0, ge=0, allow_inf_nan=False, description="a number of 0 or more")
    psf: str | dict[str, str | int | float] | None = Field(
        None, description='the name of a shape of blur, or a table such as {shape = "polygon", blades = 6}'
    )
    blur_k: _Positive
    own_blur_um2: _Number
    offset_m: _Number
    model_error: float = Field(ge=0, lt=1, description="a fraction from 0 to below 1")


class _Aperture(Table):
    f_number: _Positive
    effective: _Positive


class _Focus(Table):
    focus_distance_m: float | None = Field(None, gt=0, description="a positive number of metres, or inf")
    vergence_dioptres: _Positive


class _Uncertainty(Table):
    covariance: list[list[_Number]] = Field(description="a square matrix with one row per parameter")
    informed: list[_Number] = Field(description="one number per parameter")


class _FieldTable(Table):
    focus: list[_Number] = Field(min_length=5, max_length=5, description="five numbers")
    blur: list[_Number] = Field(min_length=5, max_length=5, description="five numbers")
    bounds: list[_Number] = Field(min_length=4, max_length=4, description="four numbers")
    split_band_scale: _Positive
    tilt: list[_Number] | None = Field(None, min_length=2, max_length=2, description="two numbers")


class _CameraFile(Table):
    camera: _Body = Field(description="a table [camera]")
    apertures: list[_Aperture] = Field(alias="aperture", min_length=1, description="one or more [[aperture]] tables")
    focus: list[_Focus] = Field(min_length=1, description="one or more [[focus]] tables")
    uncertainty: _Uncertainty = Field(description="a table [uncertainty]")
    field: _FieldTable | None = Field(None, description="a table [field]")


def load_camera(path: str | os.PathLike[str]) -> Calibrated:
    """Read a file written by `focalgradient calibrate`.

    Raises
    ------
    InputError
        If it cannot be read, or is not such a file.
    """
    path = Path(path)
    file = load_table(path, read_toml(path), _CameraFile)
    body = file.camera
    count = 3 + len(file.apertures) + len(file.focus)
    covariance = file.uncertainty.covariance
    if len(file.uncertainty.informed) != count or [len(row) for row in covariance] != [count] * count:
        raise InputError(
            f"{path}: uncertainty does not have a row and a column for each of the {count} parameters: write the file "
            "again with focalgradient calibrate."
        )
    for name, key, marks in (
        ("aperture", "f_number", [one.f_number for one in file.apertures]),
        ("focus", "focus_distance_m", [one.focus_distance_m for one in file.focus]),
    ):
        if len(set(marks)) < len(marks):
            raise InputError(f"{path}: two [[{name}]] tables have the same {key}: remove one.")
    _check_covariance(path, np.array(covariance))
    calibration = Calibration(
        focal_length=body.focal_length_mm * 1e-3,
        pixel_pitch=body.pixel_pitch_um * 1e-6,
        k=body.blur_k,
        own=body.own_blur_um2 * 1e-12,
        offset=body.offset_m,
        f_numbers={aperture.f_number: aperture.effective for aperture in file.apertures},
        focus={focus.focus_distance_m: focus.vergence_dioptres for focus in file.focus},
        model_error=body.model_error,
        covariance=np.array(covariance),
        informed=np.array(file.uncertainty.informed),
        telecentric=body.telecentric,
        psf=_psf(path, body),
        edge_scatter=body.edge_scatter_um * 1e-6,
        **({} if file.field is None else {"field": _field(file.field)}),
    )
    return Calibrated(sensor=body.only, calibration=calibration)


def _check_covariance(path: Path, covariance: FloatArray) -> None:
    """Raise `InputError` unless `covariance` is symmetric and positive semidefinite."""
    with np.errstate(all="ignore"):
        sd = np.sqrt(np.diag(covariance))
        scaled = covariance / np.where(sd > 0, sd, 1) / np.where(sd > 0, sd, 1)[:, None]
        valid = bool(np.isfinite(scaled).all() and np.abs(scaled - scaled.T).max() < ROUNDING_TOLERANCE)
    if not (valid and np.linalg.eigvalsh(scaled).min() > -ROUNDING_TOLERANCE):
        raise InputError(
            f"{path}: covariance is not symmetric and positive semidefinite: write the file again "
            "with focalgradient calibrate."
        )


def _psf(path: Path, body: _Body) -> Psf | None:
    with located(f"{path}: camera"):
        return None if body.psf is None else psf_from(body.psf, body.blur_k)


def _shape(camera: Calibration) -> str:
    """Return the shape as stated in the file: its name alone if its only parameter is `blur_k`."""
    shape = camera.psf
    assert shape is not None
    if shape_class(shape.name) is not type(shape):
        raise InputError(
            f"psf {shape.name!r} is registered for another shape than {type(shape).__name__}: give the class a "
            "different name."
        )
    values = {key: value for key, value in shape.stated().items() if key != "k" or value != camera.k}
    if not values:
        return f'"{shape.name}"'
    return "{" + ", ".join([f'shape = "{shape.name}"', *(f"{key} = {value!r}" for key, value in values.items())]) + "}"


def _field(table: _FieldTable) -> FocusField:
    focus, blur, bounds = (tuple(values) for values in (table.focus, table.blur, table.bounds))
    return FocusField(focus, blur, bounds, table.split_band_scale, tuple(table.tilt or (0.0, 0.0)))


def camera_toml(calibrated: Calibrated) -> str:
    """Return the text of CAMERA.toml."""
    camera, sensor = calibrated.calibration, calibrated.sensor
    sd = camera.sd
    stops = len(camera.f_numbers)
    scatter = f"edge_scatter_um = {camera.edge_scatter * 1e6:.4g}  # scatter of edges about the blur, on the sensor"
    lines = [
        "# Written by `focalgradient calibrate`; +- gives one standard deviation.",
        f"# Measured distances are relative to {plane_name(sensor.distances_from)}.",
        "# Distance from the entrance pupil = measured distance + offset_m; vergence = 1 / distance from the pupil.",
        "[camera]",
        *(f"{key} = {json.dumps(value)}" for key, value in sensor.model_dump(exclude_none=True).items()),
        *([] if camera.psf is None else [f"psf = {_shape(camera)}  # blur shape estimated from the target"]),
        f"blur_k = {camera.k:.5g}  # +- {camera.k * sd[0]:.2g}: sigma / disc radius"
        + (" along edges" if camera.psf is None else ", of the shape"),
        f"own_blur_um2 = {camera.own * 1e12:.5g}  # +- {sd[1]:.2g}: variance on the sensor; negative where sharpened",
        f"offset_m = {camera.offset:.5g}  # +- {sd[2]:.2g}",
        *([scatter] if camera.edge_scatter else []),
        f"model_error = {camera.model_error:.3g}  # relative error of the blur radius",
    ]
    for (mark, effective), s in zip(camera.f_numbers.items(), sd[3:], strict=False):
        lines += ["", "[[aperture]]", f"f_number = {mark!r}", f"effective = {effective:.5g}  # +- {effective * s:.2g}"]
    for (focus, vergence), s in zip(camera.focus.items(), sd[3 + stops :], strict=True):
        lines += ["", "[[focus]]"]
        if focus is not None:
            lines.append(f"focus_distance_m = {focus!r}  # as marked")
        truth = 1 / vergence - camera.offset
        lines.append(f"vergence_dioptres = {vergence:.6g}  # +- {s:.2g}: {truth:.4g} m measured")
    if camera.psf is not None:
        field = camera.field
        lines += [
            "",
            "[field]",
            "# Coefficients of x, y, x^2, x y, y^2 (from the centre of the frame, right and down, in units of half its",
            "# longer side): dioptres to add to estimates, relative increase of the blur radius; bounds of x and y;",
            "# standard deviation of the slope of the focus along x and y, in dioptres.",
            *(
                f"{name} = [{', '.join(f'{v:.6g}' for v in getattr(field, name))}]"
                for name in ("focus", "blur", "bounds", "tilt")
            ),
            f"split_band_scale = {field.split_band_scale:.4g}  # scatter of the target / predicted by the "
            "split-band test",
        ]
    lines += [
        "",
        "[uncertainty]",
        "# Of ln blur_k, own_blur_um2, offset_m, ln of each effective f-number, each focus vergence, in this order.",
        "# informed: reduction of the prior variance by the views, from 0 (prior only) to 1.",
        f"informed = [{', '.join(f'{share:.2f}' for share in camera.informed)}]",
        "covariance = [",
        *(f"    [{', '.join(f'{value:.6e}' for value in row)}]," for row in camera.covariance),
        "]",
    ]
    return "\n".join(lines) + "\n"
