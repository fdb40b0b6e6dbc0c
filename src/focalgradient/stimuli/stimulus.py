"""Stimulus as arrays: picture, true depth and true blur, with parameters and control measures."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from focalgradient.arrays import FloatArray
from focalgradient.errors import InputError, check_arguments, check_fields, check_number, check_seed
from focalgradient.optics import Side, distance_of_blur
from focalgradient.psf import Disc, Psf, PsfName, psf_from, psf_of
from focalgradient.quantities import Range
from focalgradient.stimuli.layers import check_equalise
from focalgradient.stimuli.sharpness import sharpest_place

__all__ = [
    "PUPIL",
    "Amount",
    "Angle",
    "Contrast",
    "Degrees",
    "Drawing",
    "Frame",
    "Luminance",
    "Metres",
    "Millimetres",
    "Region",
    "Resolution",
    "Shape",
    "Stimulus",
    "depth_of_blur",
]

Region = NDArray[np.bool_]

ARCMIN = math.radians(1 / 60)

MAX_SIDE_PX = 4096
"""Maximum side of a picture in pixels, for which Fourier transforms need up to 2 GB."""

MIN_MAGNITUDE, MAX_MAGNITUDE = 1e-6, 1e6
"""Range of the magnitude of non-zero quantities: far beyond eyes and displays, but numerically safe."""


@dataclass(frozen=True, slots=True)
class Amount(Range):
    """Range of a quantity of a stimulus, whose magnitude must be numerically safe.

    >>> Amount("millimetres", positive=True).check("pupil_mm", 1e-300)
    Traceback (most recent call last):
    focalgradient.errors.InputError: pupil_mm is 1e-300, but must be 1e-06 to 1e+06 in size: give it in millimetres.
    """

    def check(self, name: str, value: Any) -> None:
        """Raise `InputError` unless `value`, that of the parameter `name`, is a number within the range."""
        Range.check(self, name, value)
        if abs(value) > MAX_MAGNITUDE or (self.positive and value < MIN_MAGNITUDE):
            least = f"{MIN_MAGNITUDE:g} to " if self.positive else "at most "
            raise InputError(
                f"{name} is {value:g}, but must be {least}{MAX_MAGNITUDE:g} in size: give it in {self.words}."
            )


Angle = Annotated[float, Amount("degrees")]
Degrees = Annotated[float, Amount("degrees", positive=True)]
Resolution = Annotated[float, Amount("pixels per degree", positive=True)]
METRES, PUPIL = Amount("metres", positive=True), Amount("millimetres", most=100, positive=True)
Metres = Annotated[float, METRES]
Millimetres = Annotated[float, Amount("millimetres", 0)]
Luminance = Annotated[float, Amount("shares of white", positive=True)]
Shape = Psf | PsfName | dict[str, Any]
Contrast = Annotated[float, Amount("standard deviation / mean", 0)]


@dataclass(frozen=True, slots=True, eq=False)
class Stimulus:
    """A stimulus: arrays of one shape, H x W, with parameters and control measures.

    Parameters
    ----------
    name
        Name of the function that made it.
    picture
        Linear luminance as a fraction of the display's white, 0 to 1, float64.
    sharp
        Luminance without blur, as seen through a pinhole.
    depth_m
        True distance of each pixel in metres along the axis; may be ``inf``; NaN where there is no surface.
    blur_arcmin
        True blur of each pixel: standard deviation along an axis, for any shape.
    masks
        Regions by name.
    pixel_angle
        Pixel angle (rad) at the centre of the picture.
    parameters
        Arguments of the function.
    controlled
        Properties equalised and measured: ``equalised``; ``mean_luminance`` and ``rms_contrast`` of the picture and of
        each region; ``range``; ``sharpest``, the largest gradient relative to the largest that the blur allows (see
        `sharpness`), and ``sharpest_px``, its column and row; ``occlusion_agrees_with_blur``, if surfaces occlude each
        other.
    source
        Bibliography keys of papers that use it.
    """

    name: str
    picture: FloatArray
    sharp: FloatArray
    depth_m: FloatArray
    blur_arcmin: FloatArray
    masks: Mapping[str, Region]
    pixel_angle: float
    parameters: Mapping[str, Any]
    controlled: Mapping[str, Any]
    source: tuple[str, ...]

    @property
    def shape(self) -> tuple[int, int]:
        """Height and width in pixels."""
        height, width = self.picture.shape
        return height, width

    @property
    def blur_px(self) -> FloatArray:
        """Standard deviation of the blur in pixels at the picture's centre, H x W."""
        return self.blur_arcmin * ARCMIN / self.pixel_angle


@dataclass(frozen=True, slots=True)
class Frame:
    """Validated size of a picture: `width_deg` and `height_deg` (degrees), and central `pixels_per_degree`."""

    width_deg: Degrees
    height_deg: Degrees
    pixels_per_degree: Resolution

    def __post_init__(self) -> None:
        check_fields(self)
        height, width = self.shape
        if min(height, width) < 8 or max(height, width) > MAX_SIDE_PX:
            raise InputError(
                f"width_deg {self.width_deg:g} and height_deg {self.height_deg:g} at {self.pixels_per_degree:g} pixels "
                f"per degree make {width} x {height} pixels, but each side must have 8 to {MAX_SIDE_PX}."
            )

    @property
    def pixel_angle(self) -> float:
        """Pixel angle in radians."""
        return math.radians(1 / self.pixels_per_degree)

    @property
    def shape(self) -> tuple[int, int]:
        """Height and width in pixels, even."""
        height, width = (2 * round(side * self.pixels_per_degree / 2) for side in (self.height_deg, self.width_deg))
        return height, width

    def pixels(self, arcmin: float) -> float:
        """Return a number of minutes of arc in pixels."""
        return arcmin * ARCMIN / self.pixel_angle

    def blur(self, name: str, arcmin: Any) -> float:
        """Return the standard deviation in pixels of the blur `name`; raise `InputError` if it is too large."""
        check_number(name, arcmin, "arcmin", least=0)
        if self.pixels(arcmin) > max(self.shape) / 4:
            raise InputError(
                f"{name} is {arcmin:g} arcmin, {self.pixels(arcmin):.3g} pixels, but the picture has "
                f"{self.shape[1]} x {self.shape[0]}: give at most a quarter of its larger side."
            )
        return self.pixels(arcmin) if self.pixels(arcmin) > MIN_MAGNITUDE else 0.0

    def grid(self, rim: int = 0) -> tuple[FloatArray, FloatArray]:
        """Return pixel coordinates relative to the centre, with a margin of `rim` pixels: down, H x 1; right, 1 x W."""
        height, width = (np.arange(-rim, side + rim, dtype=float) - (side - 1) / 2 for side in self.shape)
        return height[:, None], width[None]


def _check_light(mean: float, contrast: float, seed: int, peak: float) -> None:
    """Validate RMS contrast (`peak` multiples of which must stay within 0 to 1) at a mean luminance, and seed."""
    check_seed(seed)
    if mean * (1 + peak * contrast) > 1 + 1e-9 or peak * contrast > 1 + 1e-9:
        most = min(1 / peak, (1 / mean - 1) / peak)
        raise InputError(
            f"contrast is {contrast:g} at a mean of {mean:g}, with which luminance would leave 0 to 1: give at most "
            f"{max(most, 0):.3g}, or another mean."
        )


def depth_of_blur(blur_arcmin: ArrayLike, side: Side, *, focus_m: float, pupil_mm: float) -> FloatArray:
    """Return the distance (m) whose blur has this standard deviation: 4 sd = pupil x defocus.

    Parameters
    ----------
    blur_arcmin
        Standard deviation along an axis, for any shape.
    side
        ``"beyond"`` or ``"nearer"`` than the focus.
    focus_m, pupil_mm
        Focus distance, and pupil diameter.

    Raises
    ------
    InputError
        If the blur exceeds that of infinity on the far side of focus.

    Examples
    --------
    >>> depth_of_blur(0.0, "beyond", focus_m=0.5, pupil_mm=4).item()
    0.5
    >>> round(depth_of_blur(3.4377, "beyond", focus_m=0.5, pupil_mm=4).item(), 4)  # 1 mrad: 1 D
    1.0
    """
    METRES.check("focus_m", focus_m)
    PUPIL.check("pupil_mm", pupil_mm)
    blur = np.asarray(blur_arcmin, float)
    distance = distance_of_blur(2 * blur * ARCMIN, side, pupil_mm / 1000, 1 / focus_m)
    if np.isnan(distance).any():
        most = pupil_mm / 1000 / focus_m / 4 / ARCMIN
        raise InputError(
            f"a blur of {blur.max():.3g} arcmin exceeds that of infinity for a pupil of {pupil_mm:g} mm focused at "
            f"{focus_m:g} m, which is {most:.3g}: give less blur, a nearer focus_m, a larger pupil_mm, or "
            "depth on the nearer side of the focus."
        )
    return distance


@dataclass(frozen=True, slots=True)
class Drawing:
    """Validated arguments of a function that draws a stimulus: all of them, the picture's size, and the blur's shape.

    `equalised` names the properties to equalise, and `source` the papers.
    """

    name: str
    source: tuple[str, ...]
    parameters: dict[str, Any]
    frame: Frame
    psf: Psf
    equalised: tuple[str, ...]

    @classmethod
    def begin(
        cls,
        function: Callable[..., Stimulus],
        given: Mapping[str, Any],
        *source: str,
        peak: float | None = None,
        frame: Frame | None = None,
    ) -> Drawing:
        """Validate the arguments `given` to a function beside their types.

        Parameters
        ----------
        function, given, source
            The drawing function, its arguments, and the bibliography keys of papers.
        peak
            Maximum luminance in multiples of RMS contrast above the mean; None: it does not depend on contrast.
        frame
            Size of the picture; None: that of the arguments.
        """
        check_arguments(function, given)
        parameters = dict(given)
        if frame is None:
            frame = Frame(*(given[name] for name in ("width_deg", "height_deg", "pixels_per_degree")))
        if peak is not None:
            _check_light(given["mean"], given["contrast"], given.get("seed", 0), peak)
        psf: Psf = Disc()
        if "psf" in given:
            stated = given["psf"]
            psf = psf_from(stated) if isinstance(stated, dict) else psf_of(stated)
            parameters["psf"] = stated if isinstance(stated, str) else {"shape": psf.name, **psf.stated()}
        return cls(function.__name__, source, parameters, frame, psf, check_equalise(given.get("equalise", ())))

    def stimulus(
        self,
        *,
        picture: FloatArray,
        sharp: FloatArray,
        depth: FloatArray,
        blur: FloatArray,
        masks: Mapping[str, Region],
        allowed_px: FloatArray | None = None,
        lines: bool = False,
        **stated: Any,
    ) -> Stimulus:
        """Return the drawn stimulus with its control measures.

        Parameters
        ----------
        picture, sharp, masks
            Fields of `Stimulus`.
        depth, blur
            Distance in metres, and blur in arcmin.
        allowed_px, lines
            For `sharpness`: smallest blur of each pixel in pixels (None: `blur`), and whether lines are drawn.
        stated
            Other properties that `controlled` states.
        """
        regions = {"picture": np.ones(picture.shape, bool), **masks}
        means = {region: float(picture[inside].mean()) for region, inside in regions.items() if inside.any()}
        contrasts = {
            region: float(picture[regions[region]].std() / mean) if mean > 0 else 0.0 for region, mean in means.items()
        }
        allowed_px = blur * self.frame.pixels(1.0) if allowed_px is None else allowed_px
        controlled = {
            "equalised": list(self.equalised),
            **stated,
            "mean_luminance": means,
            "rms_contrast": contrasts,
            "range": [float(picture.min()), float(picture.max())],
            **sharpest_place(picture, allowed_px, self.psf, span=float(np.ptp(sharp)), lines=lines),
        }
        angle = self.frame.pixel_angle
        return Stimulus(self.name, picture, sharp, depth, blur, masks, angle, self.parameters, controlled, self.source)
