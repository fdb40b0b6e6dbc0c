"""Calibrated camera: its optics at the calibrated settings, with their uncertainty."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Annotated, Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from focalgradient.arrays import FloatArray
from focalgradient.errors import InputError
from focalgradient.optics import Lens
from focalgradient.psf import Psf, psf_of
from focalgradient.quantities import Range
from focalgradient.view import from_centre

__all__ = ["Calibration", "Field", "Prediction", "Reading", "disc_radius"]


LEAST_INFORMED = 0.5
"""Proportion of a prior's variance that the views must remove; below it a parameter is dominated by its prior."""

SAME_MARK = 0.03
"""Relative tolerance of an f-number or focus distance to be identified with a mark: about a twelfth of a stop.
"""


@dataclass(frozen=True, slots=True)
class Reading:
    """Blur of the edges of a target in one view.

    Parameters
    ----------
    distance
        Distance of the target in metres, from the user's reference plane.
    f_number, focus_distance
        Values as marked; the focus distance (m) is None if unknown. Readings with equal values share one focus.
    width
        Standard deviation on the sensor, in metres, of the Gaussian fitted to the edges.
    width_sd
        Standard error of the width, in metres.
    scatter
        Scatter of single edge segments around the width, in metres.
    """

    distance: Annotated[float, Range("metres", positive=True)]
    f_number: Annotated[float, Range("f-stops", positive=True)]
    focus_distance: float | None
    width: Annotated[float, Range("metres", 0)]
    width_sd: Annotated[float, Range("metres", positive=True)]
    scatter: Annotated[float, Range("metres", 0)] = 0.0


_FLAT = (0.0,) * 5


@dataclass(frozen=True, slots=True)
class Field:
    """Variation of focus and blur over the field, as polynomials of x, y, x^2, x y, y^2.

    Coordinates are relative to the centre of the frame, right and down, in units of half its longer side.

    Parameters
    ----------
    focus
        Coefficients of the correction that is added to the estimated vergence, in dioptres.
    blur
        Coefficients of the relative increase of blur over that in the centre.
    bounds
        Minimum and maximum x, then y, covered by the calibration; the polynomials are constant beyond.
    split_band_scale
        Ratio of the measured scatter of a calibrated map, beyond noise, to that given by the split-band test.
    tilt
        Standard deviation of the slope of focus along x and y (D), which slanted sheets leave undetermined.

    Examples
    --------
    >>> curved = Field(focus=(0.0, 0.0, 0.1, 0.0, 0.1))
    >>> curved.corrected(np.full((3, 3), 2.0), 1.0).round(3).tolist()[0]
    [2.089, 2.044, 2.089]
    """

    focus: tuple[float, ...] = _FLAT
    blur: tuple[float, ...] = _FLAT
    bounds: tuple[float, ...] = (-1.0, 1.0, -1.0, 1.0)
    split_band_scale: float = 1.0
    tilt: tuple[float, ...] = (0.0, 0.0)

    @staticmethod
    def coordinates(shape: tuple[int, int]) -> tuple[FloatArray, FloatArray]:
        """Return the coordinates x (1 x W) and y (H x 1) of the pixels of a frame."""
        x, y = (2 * way / max(shape) for way in from_centre(shape))
        return x, y

    @staticmethod
    def terms(x: ArrayLike, y: ArrayLike) -> FloatArray:
        """Return the five polynomial terms at `x`, `y` along the first axis; the arguments are broadcast."""
        x, y = np.broadcast_arrays(np.asarray(x, float), np.asarray(y, float))
        return np.stack([x, y, x**2, x * y, y**2])

    def corrected(self, vergence: NDArray[np.floating], focus: float) -> FloatArray:
        """Correct vergence (D, H x W), estimated in a frame focused at `focus` (D), for variation over the field."""
        if not any(self.focus) and not any(self.blur):
            return np.asarray(vergence, float)
        x, y = self.coordinates((vergence.shape[0], vergence.shape[1]))
        left, right, top, bottom = self.bounds
        terms = self.terms(np.clip(x, left, right), np.clip(y, top, bottom))
        more = np.tensordot(self.focus, terms, 1)
        return focus + (vergence - focus) * (1 - np.tensordot(self.blur, terms, 1)) + more


@dataclass(frozen=True, slots=True)
class Prediction:
    """Predicted position of the target of one view: vergence (D) and distance (m, user's plane), with SDs."""

    vergence: float
    vergence_sd: float
    distance: float
    distance_sd: float


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Calibration:
    """Camera parameters estimated from a target.

    Parameters
    ----------
    focal_length, pixel_pitch
        Values in metres, as given; blur is relative to them.
    k
        Ratio of edge sigma to disc radius.
    own
        Residual blur variance on the sensor in m^2, present also in focus; negative if the camera sharpens.
    offset
        Optical distance minus distance from the user's reference plane, in metres.
    f_numbers
        Effective f-number by marked f-number.
    focus
        True focus vergence in dioptres, by marked focus distance in metres (None: not marked).
    model_error
        Remaining relative error of the widths.
    covariance
        Joint covariance of `parameters`.
    informed
        Fraction of the prior variance (0 to 1) that the views removed, for each parameter.
    telecentric
        True for lenses telecentric on the image side: the angle of a pixel is then pitch / focal length.
    psf
        Shape of the blur of the target, with parameter `k`; None: measured along edges.
    field
        Variation of focus and blur over the field.
    edge_scatter
        Scatter of single edge segments on the sensor, in metres: part of the standard deviation of depth by edges.
    """

    focal_length: float
    pixel_pitch: float
    k: float
    own: float
    offset: float
    f_numbers: Mapping[float, float]
    focus: Mapping[float | None, float]
    model_error: float
    covariance: FloatArray
    informed: FloatArray
    telecentric: bool = False
    psf: Psf | None = None
    field: Field = Field()
    edge_scatter: float = 0.0

    def __repr__(self) -> str:
        """Return focal length, k, and the number of calibrated marks."""
        return (
            f"Calibration({1e3 * self.focal_length:.4g} mm, k = {self.k:.3g}, {len(self.f_numbers)} apertures, "
            f"{len(self.focus)} foci)"
        )

    def summary(self) -> str:
        """Return a table of the parameters, each with its SD and whether views or prior determine it."""
        sd, pitch = self.sd, self.pixel_pitch * 1e6
        rows = [
            ("k, sigma / disc radius", self.k, self.k * sd[0]),
            ("own blur, px^2", self.own * 1e12 / pitch**2, sd[1] / pitch**2),
            ("offset, m", self.offset, sd[2]),
        ]
        for mark, effective in self.f_numbers.items():
            rows.append((f"f-number marked {mark:g}", effective, effective * sd[len(rows)]))
        for focus, vergence in self.focus.items():
            n, name = len(rows), "true focus, m as measured" + ("" if focus is None else f" (marked {focus:g})")
            error = math.sqrt(sd[2] ** 2 + sd[n] ** 2 / vergence**4 + 2 * self.covariance[2, n] / vergence**2)
            rows.append((name, 1 / vergence - self.offset, error))
        lines = [f"{'':34}{'value':>9}{'sd':>8}  known from"]
        for (name, value, error), share in zip(rows, self.informed, strict=True):
            digits, whose = ".2f" if name.startswith(("own", "f-")) else ".3f", "dominated by the prior"
            whose = "the views" if share >= LEAST_INFORMED else whose
            lines.append(f"{name:34}{value:>9{digits}}{error:>8{digits}}  {whose} ({share:.0%})")
        return "\n".join([*lines, f"Model error of the blur's width: {self.model_error:.1%}"])

    def record(self) -> dict[str, Any]:
        """Return the parameters, for JSON: units are in the names, ``sd`` is in the order of `parameters`."""
        return {
            "k": self.k,
            "own_blur_um2": self.own * 1e12,
            "offset_m": self.offset,
            "f_numbers": [{"marked": mark, "effective": value} for mark, value in self.f_numbers.items()],
            "focus": [{"marked_m": mark, "vergence_dioptres": value} for mark, value in self.focus.items()],
            "sd": self.sd.tolist(),
            "share_known_from_the_views": self.informed.tolist(),
            "model_error_of_blur": self.model_error,
        }

    @property
    def parameters(self) -> FloatArray:
        """Log k, own (um^2), offset (m), log of each f-number, each focus vergence (D)."""
        stops, focus = list(self.f_numbers.values()), list(self.focus.values())
        return np.array([math.log(self.k), self.own * 1e12, self.offset, *np.log(stops), *focus])

    @property
    def sd(self) -> FloatArray:
        """Standard deviation of each of `parameters`."""
        return np.sqrt(np.diag(self.covariance))

    def lens(self, f_number: float, focus_distance: float | None = None) -> Lens:
        """Return the lens at the marks `f_number` and `focus_distance` (m).

        Raises
        ------
        InputError
            If the camera was not calibrated at these marks.
        """
        stop, focus = self._place(f_number, focus_distance)
        lens = Lens(self.focal_length, list(self.f_numbers.values())[stop], 1 / list(self.focus.values())[focus])
        return replace(lens, residual_blur_variance=self.own / self._throw(lens) ** 2)

    def _throw(self, lens: Lens) -> float:
        """Return the metres on the sensor per radian."""
        return self.focal_length if self.telecentric else lens.sensor_distance

    def _place(self, f_number: float, focus_distance: float | None) -> tuple[int, int]:
        """Return the indices of the f-number and of the focus vergence."""
        stops, marks = list(self.f_numbers), list(self.focus)
        with np.errstate(all="ignore"):  # invalid f-numbers match no mark
            off = np.abs(np.log(np.array(stops) / f_number))
        stop = int(np.argmin(off))
        if not off[stop] < SAME_MARK:
            known = ", ".join(f"f/{mark:g}" for mark in stops)
            raise InputError(
                f"f/{f_number:g} was not calibrated, only {known}: take the target's picture at that f-number too."
            )
        if len(marks) == 1 and (focus_distance is None or marks[0] is None):
            return stop, 0
        apart = [_apart(mark, focus_distance) for mark in marks]
        place = int(np.argmin(apart))
        if apart[place] < SAME_MARK:
            return stop, place
        known = ", ".join("no mark" if mark is None else f"{mark:g} m" for mark in marks)
        given = "no focus distance is given" if focus_distance is None else f"focus is given as {focus_distance:g} m"
        raise InputError(f"{given}, but the camera was calibrated at {known}: give the focus distance as marked then.")

    def predict(self, reading: Reading) -> Prediction:
        """Predict the position of the target of `reading`, on the side of focus where it lies.

        >>> camera = Calibration(
        ...     0.05, 5e-6, 0.5, 0.0, 0.1, {4.0: 4.0}, {None: 1.0}, 0.0, np.zeros((5, 5)), np.zeros(5)
        ... )
        >>> width = 0.5 * 0.05 / 8 * 0.5 * camera.lens(4.0).sensor_distance  # half a dioptre beyond focus
        >>> round(camera.predict(Reading(2.0, 4.0, None, width, 0.0)).distance, 3)
        1.9
        """
        lens = self.lens(reading.f_number, reading.focus_distance)
        per_dioptre = self.k * lens.aperture_diameter / 2 * self._throw(lens)
        blur = math.sqrt(max(reading.width**2 - self.own, 0.0))
        side = math.copysign(1.0, lens.focus_vergence - 1 / (reading.distance + self.offset))
        vergence = lens.focus_vergence - side * blur / per_dioptre
        setting = [(reading.f_number, reading.focus_distance)]
        random = reading.width * reading.width_sd / (max(blur, 0.1 * reading.width) * per_dioptre)
        systematic, in_distance = (
            float(self.systematic_sd(setting, vergence, "gaussian", of=of)) for of in ("vergence", "distance")
        )
        return Prediction(
            vergence,
            math.hypot(systematic, random),
            1 / vergence - self.offset if vergence > 0 else math.inf,
            math.hypot(in_distance, random / vergence**2) if vergence > 0 else math.inf,
        )

    def systematic_sd(
        self,
        settings: Sequence[tuple[float, float | None]],
        vergence: ArrayLike,
        psf: Psf | str,
        *,
        of: Literal["vergence", "distance"] = "vergence",
    ) -> FloatArray:
        """Return the standard deviation of recovered depth due to calibration errors, common to all pixels.

        Parameters
        ----------
        settings, vergence, psf, of
            As for `systematic_modes`.
        """
        return np.sqrt((self.systematic_modes(settings, vergence, psf, of=of) ** 2).sum(axis=0))

    def systematic_modes(
        self,
        settings: Sequence[tuple[float, float | None]],
        vergence: ArrayLike,
        psf: Psf | str,
        *,
        of: Literal["vergence", "distance"] = "vergence",
    ) -> FloatArray:
        """Return the changes in recovered depth due to independent calibration errors of one standard deviation each.

        Parameters
        ----------
        settings
            Marked f-number and focus distance (m) of each view. One view: absolute blur; several: compared blur.
        vergence
            Recovered vergence, D; any shape.
        psf
            Shape of the blur: for a Gaussian the error of `k` is included.
        of
            Returned quantity: vergence (D), or the user's distance (m).

        Returns
        -------
        ndarray
            K x the shape of `vergence`, for K parameters and views.
        """
        shape = psf_of(psf)
        places = [self._place(*setting) for setting in settings]
        count = len(self.f_numbers)
        vergence = np.asarray(vergence, float)

        def measured(parameters: FloatArray, at: FloatArray) -> FloatArray:
            """Return the measured quantity: blur variance (um^2), or for compared views its differences."""
            errors = parameters[-len(places) :]
            squares = []
            for (stop, focus), error in zip(places, errors, strict=True):
                k = math.exp(parameters[0]) if shape.scale_parameter is not None else self.k
                lens_vergence = parameters[3 + count + focus]
                f_number = math.exp(parameters[3 + stop])
                radius = disc_radius(self.focal_length, f_number, lens_vergence, at, self.telecentric)
                squares.append((k * radius * (1 + error)) ** 2 * 1e12)
            return np.stack([squares[0] + parameters[1]] if len(places) == 1 else [s - squares[0] for s in squares[1:]])

        # in addition to the parameters, the blur of each view has an error of its own
        joint = np.concatenate([self.parameters, np.zeros(len(places))])
        spread = np.zeros((joint.size, joint.size))
        spread[: -len(places), : -len(places)] = self.covariance
        spread[range(-len(places), 0), range(-len(places), 0)] = self.model_error**2
        step = 1e-4  # D

        def slope_at(at: FloatArray) -> FloatArray:
            return (measured(joint, at + step) - measured(joint, at - step)) / (2 * step)

        # in exact focus blur is stationary, so that the slope is taken next to it
        flat = (slope_at(vergence) ** 2).sum(axis=0) < 1e-12
        vergence = np.where(flat, vergence + 10 * step, vergence)
        slope = slope_at(vergence)
        gain = slope / np.maximum((slope**2).sum(axis=0), 1e-12)
        moved = []
        for shift in np.diag(np.maximum(1e-4 * np.abs(joint), 1e-5)):
            change = (measured(joint + shift, vergence) - measured(joint - shift, vergence)) / (2 * shift.max())
            moved.append(-(gain * change).sum(axis=0))
        jacobian = np.stack(moved)
        if of == "distance":
            jacobian = -jacobian / np.maximum(vergence, 1e-6) ** 2
            jacobian[2] -= 1.0
        values, vectors = np.linalg.eigh(spread)
        return np.tensordot((vectors * np.sqrt(np.maximum(values, 0))).T, jacobian, 1)


def _apart(mark: float | None, given: float | None) -> float:
    """Return the relative difference of two focus distances; infinite if one is unknown."""
    if mark == given:
        return 0.0
    return abs(mark / given - 1) if mark and given else math.inf


def disc_radius(
    focal_length: float, f_number: float, focus: float, vergence: ArrayLike, telecentric: bool = False
) -> FloatArray:
    """Return the radius of the blur disc on the sensor in metres, as `Lens`, but for any vergence.

    Parameters
    ----------
    focal_length
        Focal length in metres.
    f_number
        F-number: focal length divided by aperture diameter.
    focus, vergence
        Vergence in focus, and of the point, in dioptres; `vergence` may have any shape, which is that of the result.
    telecentric
        True for lenses telecentric on the image side: blur is then relative to the focal length.

    Examples
    --------
    >>> round(float(disc_radius(0.05, 2, 1.0, 0.5)) * 1e6)  # 25/76 mm, by similar triangles
    329
    """
    throw = focal_length if telecentric else 1 / (1 / focal_length - focus)
    return focal_length / (2 * f_number) * np.abs(focus - np.asarray(vergence)) * throw
