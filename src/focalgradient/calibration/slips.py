"""Detection of likely errors in the stated values of target photographs: units, exchanged values, a wrong distance.

Distances, f-numbers and focus marks are typed by people. If the law of blur does not fit the readings, each likely
error is corrected in turn and the camera is fitted again; an error whose correction makes the camera clearly more
probable is reported.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np

from focalgradient.calibration.camera import Prediction, Reading
from focalgradient.calibration.fit import Priors, improbability
from focalgradient.errors import InputError, warn

__all__ = ["Slip", "check_predictions", "likeliest_slips", "prediction_errors", "refuse_slips"]

UNITS = {"centimetres": 0.01, "millimetres": 0.001, "inches": 0.0254, "feet": 0.3048}
"""Metres per unit in which lengths may have been given by mistake."""

DIGITS = (0.001, 0.01, 0.1, 10.0)
"""Factors of a likely error in a single distance: another unit, or a misplaced decimal point."""

LENGTHS = (0.5, 1 / 1.5, 1 / 1.6, 1.5, 1.6, 2.0)
"""Factors of a likely error in the focal length: full-frame equivalents for sensors of other sizes."""

PITCHES = (0.5, 2.0)
"""Factors of a likely error in the pixel pitch: reduced or half-resolution pictures."""

UNRESOLVED = 0.5
"""Width in pixels below which an edge is unresolved, and its width uncertain by this amount."""

NEAREST = 3.0
"""Minimum corrected distance in focal lengths; a nearer target would be imaged at half its size or more."""

MIN_GAIN = 18.0
"""Minimum decrease in minus twice the log posterior for reporting an error; none of 150 correct (simulated) cameras
reaches it.
"""

IMPOSSIBLE = 1e6
"""Minus twice the log posterior assigned if no camera fits at all."""

SINGLE_VALUE_PENALTY = 8.0
"""Penalty for an error in a single value, of which there are many: a prior of e^-4 (our choice)."""

MAX_GAIN_DIFFERENCE = 6.0
"""Maximum difference to the best explanation for reporting a further error."""

MOST_SLIPS = 3
"""Maximum number of possible errors listed if the readings cannot distinguish them."""

CONTRADICTION_SD = 3.0
"""Number of stated standard deviations at which predictions from a single distance contradict the one left out."""


@dataclass(frozen=True, slots=True)
class _Stated:
    """Stated values of a camera and its target."""

    readings: Sequence[Reading]
    focal_length: float
    pixel_pitch: float
    priors: Priors

    def changed(self, change: Callable[[float], float], *names: str, **only: float) -> _Stated:
        """Return the values with known fields `names` changed, of readings whose fields are as in `only`."""
        readings = []
        for reading in self.readings:
            known = {name: value for name in names if (value := getattr(reading, name)) is not None}
            is_meant = all(getattr(reading, key) == wanted for key, wanted in only.items())
            readings.append(replace(reading, **{name: change(value) for name, value in known.items() if is_meant}))
        return replace(self, readings=readings)

    def scaled(self, factor: float, *names: str) -> _Stated:
        """Return the values with the fields `names` of each reading multiplied by a factor."""
        return self.changed(lambda value: factor * value, *names)

    def exchanged(self, name: str, values: dict[float, float], **only: float) -> _Stated:
        """Return the values with the field `name` changed as in `values`, of readings whose fields are as in `only`."""
        return self.changed(lambda value: values.get(value, value), name, **only)

    def improbability(self) -> float:
        """Return minus twice the log posterior density of the best camera; infinite if none is possible."""
        least = UNRESOLVED * self.pixel_pitch
        readings = [r if r.width > least else replace(r, width_sd=max(r.width_sd, least)) for r in self.readings]
        with suppress(InputError), np.errstate(all="ignore"):
            return improbability(readings, self.focal_length, self.pixel_pitch, self.priors)
        return math.inf


@dataclass(frozen=True, slots=True)
class Slip:
    """Likely error in the stated values, with the gain from its correction.

    Parameters
    ----------
    text
        Description and remedy, completing "the blur fits better with".
    gain
        Decrease in minus twice the log posterior density.
    """

    text: str
    gain: float


def likeliest_slips(
    readings: Sequence[Reading], focal_length: float, pixel_pitch: float, priors: Priors | None = None
) -> list[Slip]:
    """Return the errors whose correction explains the `readings` clearly better, most likely first.

    Parameters
    ----------
    readings, focal_length, pixel_pitch, priors
        As for `calibrate`.

    Returns
    -------
    list of Slip
        Empty if no correction is clearly better than the stated values. Errors that the readings cannot distinguish are
        all included.

    Examples
    --------
    >>> from focalgradient import Lens
    >>> lens = Lens(0.05, 4.0, 1.0)
    >>> width = lambda d: 0.546 * float(lens.blur_radius(d)) * lens.sensor_distance
    >>> seen = [Reading(100 * d, 4.0, 1.0, width(d), 1e-7) for d in (1.4, 2.0, 3.0, 5.0)]
    >>> likeliest_slips(seen, 0.05, 5e-6)[0].text
    'distances in centimetres: give distance_m in metres'
    """
    stated = _Stated(readings, focal_length, pixel_pitch, priors or Priors())
    before = min(stated.improbability(), IMPOSSIBLE)
    if before < MIN_GAIN:  # no correction can improve an almost perfect fit by that much
        return []
    found = []
    for candidates, cost in ((_candidates(stated), 0.0), (_single_values(stated), SINGLE_VALUE_PENALTY)):
        for text, corrected in candidates:
            if min(reading.distance for reading in corrected.readings) > NEAREST * corrected.focal_length:
                found.append(Slip(text, before - corrected.improbability() - cost))
    found = [slip for slip in found if slip.gain > MIN_GAIN]
    if found:  # any of these may also imitate one distance that was measured wrongly
        found += (Slip(text, before - others.improbability() - cost) for text, others, cost in _without_each(stated))
    found.sort(key=lambda slip: -slip.gain)
    return [slip for slip in found if slip.gain > found[0].gain - MAX_GAIN_DIFFERENCE]


def refuse_slips(
    readings: Sequence[Reading], focal_length: float, pixel_pitch: float, priors: Priors | None = None
) -> None:
    """Raise `InputError` if a likely error in the stated values explains the readings much better; name the error.

    Parameters
    ----------
    readings, focal_length, pixel_pitch, priors
        As for `likeliest_slips`.
    """
    slips = likeliest_slips(readings, focal_length, pixel_pitch, priors)
    if slips:
        likely = "; or with ".join(slip.text for slip in slips[:MOST_SLIPS])
        raise InputError(f"the photographs contradict the stated values: their blur fits better with {likely}.")


def check_predictions(
    readings: Sequence[Reading],
    by_distance: Sequence[Prediction | None],
    by_view: Sequence[Prediction | None],
    offset: float,
) -> None:
    """Test a calibration by its predictions of left-out photographs.

    Parameters
    ----------
    readings
        Readings of all photographs.
    by_distance, by_view
        Prediction of each by `cross_validate`, leaving out its distance, and only itself.
    offset
        Offset of the calibration in metres.

    Raises
    ------
    InputError
        If left-out photographs are predicted worse than without a calibration.

    Warns
    -----
    FocalGradientWarning
        If there is no prediction to be tested.
    """
    distances, untested = len({reading.distance for reading in readings}), True
    for predictions in (by_distance, by_view):
        predicted, stated, by_mean = prediction_errors(readings, predictions, offset)
        untested = untested and math.isnan(predicted)
        # A single distance determines others poorly, which the stated SD includes.
        if predicted > by_mean and (distances > 2 or predicted > CONTRADICTION_SD * stated):
            raise InputError(
                f"left-out photographs are predicted worse than without a calibration (error {predicted:.2g} D; with "
                f"the mean vergence of the others {by_mean:.2g} D), and no single input error explains it: check "
                "distance_m, f_number and focus_distance_m of each photograph, focal_length_mm and pixel_pitch_um, and "
                "that the focus was not touched."
            )
    if untested:
        cause = (
            f"all of them ({len(readings)}) show the target at one distance: add photographs at another"
            if distances == 1
            else "without any one of them its f-number or the side of focus is unknown: add photographs at another "
            "distance, at each f-number, or give focus_distance_m"
        )
        warn(f"the photographs cannot show whether their distances, f-numbers and pixel pitch are right, as {cause}.")


def prediction_errors(
    readings: Sequence[Reading], predictions: Sequence[Prediction | None], offset: float
) -> tuple[float, float, float]:
    """Return three errors of left-out targets (D, root mean square): observed, as stated, and of the others' mean.

    The first is the prediction error; the second is the stated standard deviation of the predictions; the third is the
    error when predicting the mean vergence of targets at other distances, without a calibration. All are NaN without
    predictions, or if all targets have the same distance. `offset` is that of the calibration (m).
    """
    vergence = np.array([1 / max(reading.distance + offset, 1e-3) for reading in readings])
    distances = np.array([reading.distance for reading in readings])
    errors = [
        (prediction.vergence - true, prediction.vergence_sd, vergence[distances != distance].mean() - true)
        for prediction, true, distance in zip(predictions, vergence, distances, strict=True)
        if prediction is not None and (distances != distance).any()
    ]
    if not errors:
        return math.nan, math.nan, math.nan
    predicted, stated, by_mean = np.sqrt(np.mean(np.square(errors), axis=0))
    return float(predicted), float(stated), float(by_mean)


def _candidates(stated: _Stated) -> Iterator[tuple[str, _Stated]]:
    """Yield likely errors in words, with the corrected values."""
    readings = stated.readings
    for unit, metres in UNITS.items():
        yield f"distances in {unit}: give distance_m in metres", stated.scaled(metres, "distance")
        if any(reading.focus_distance for reading in readings):
            text = f"focus marks in {unit}: give focus_distance_m in metres"
            yield text, stated.scaled(metres, "focus_distance")
            text = f"distances and focus marks in {unit}: give distance_m and focus_distance_m in metres"
            yield text, stated.scaled(metres, "distance", "focus_distance")
    for name, key, unit in (
        ("distance", "distance_m", " m"),
        ("f_number", "f_number", ""),
        ("focus_distance", "focus_distance_m", " m"),
    ):
        values = sorted({getattr(reading, name) for reading in readings if getattr(reading, name) is not None})
        words = {value: f"f/{value:g}" if name == "f_number" else f"{value:g}{unit}" for value in values}
        what = name.replace("_", "-" if name == "f_number" else " ")
        for one, other in combinations(values, 2):
            text = f"the {what}s {words[one]} and {words[other]} exchanged: check {key} of these photographs"
            yield text, stated.exchanged(name, {one: other, other: one})
        if len(values) > 3:
            turned = dict(zip(values, values[::-1], strict=True))
            yield f"the {what}s in reverse order: check {key}", stated.exchanged(name, turned)
    for factor in PITCHES:
        pitch = 1e6 * factor * stated.pixel_pitch
        text = f"a pixel pitch of {pitch:.3g} um: check pixel_pitch_um, of the photographs as they are given"
        yield text, replace(stated.scaled(factor, "width", "width_sd"), pixel_pitch=stated.pixel_pitch * factor)
    for factor in LENGTHS:
        length = 1e3 * factor * stated.focal_length
        text = f"a focal length of {length:.3g} mm: check focal_length_mm, which is not the full-frame equivalent"
        yield text, replace(stated, focal_length=stated.focal_length * factor)


def _single_values(stated: _Stated) -> Iterator[tuple[str, _Stated]]:
    """Yield errors of one distance, or at one distance or f-number: unit, decimal place, exchanged photographs."""
    readings = stated.readings
    distances, stops = (sorted({getattr(r, name) for r in readings}) for name in ("distance", "f_number"))
    if len(distances) < 2:
        return
    for distance in distances:
        for factor in DIGITS:
            text = f"{factor * distance:g} m for the distance of {distance:g} m: measure it again"
            yield text, stated.exchanged("distance", {distance: factor * distance})
        for one, other in combinations(stops, 2):
            text = f"f/{one:g} and f/{other:g} exchanged at {distance:g} m: check f_number of these photographs"
            yield text, stated.exchanged("f_number", {one: other, other: one}, distance=distance)
    for stop in stops if len(stops) > 1 else ():
        for one, other in combinations(distances, 2):
            text = f"{one:g} m and {other:g} m exchanged at f/{stop:g}: check distance_m of these photographs"
            yield text, stated.exchanged("distance", {one: other, other: one}, f_number=stop)


def _without_each(stated: _Stated) -> Iterator[tuple[str, _Stated, float]]:
    """Yield an error of any size in each distance: the values without its readings, and the cost of that freedom."""
    distances = sorted({reading.distance for reading in stated.readings})
    for distance in distances if len(distances) > 2 else ():
        others = [reading for reading in stated.readings if reading.distance != distance]
        expected = len(stated.readings) - len(others)  # chi-square of correct readings
        text = f"another distance than {distance:g} m: measure it again"
        yield text, replace(stated, readings=others), SINGLE_VALUE_PENALTY + expected
