"""A picture whose depth is known, seen through a pupil and refocused at every frame."""

from __future__ import annotations

import math
import os
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from numpy.typing import ArrayLike, NDArray
from psychopy import logging
from psychopy.tools.attributetools import attributeSetter, setAttribute
from psychopy.tools.monitorunittools import convertToPix
from psychopy.visual.basevisual import MinimalStim

from focalgradient.errors import InputError, check_number
from focalgradient.lab.focus_view import FocusView
from focalgradient.live import FocusSeries, read_series
from focalgradient.optics import Lens, Optics
from focalgradient.photographs import read_distances, read_picture
from focalgradient.photographs.pictures import picture_of
from psychopy_focalgradient.window import Gamma, display_of

__all__ = ["FocalGradientStim"]

NODAL_M = 0.017
"""Focal length in metres of the lens that stands for the pupil, about an eye's: discs depend on the pupil alone."""

FARTHEST_D = 1e-6
"""Least focus in dioptres that the lens is made with, before the series sets it."""

BEYOND = 1e-6
"""Dioptres beyond the planes of focus above which a warning is logged: rounding."""

ANGLE_TOLERANCE = 0.01
"""Relative difference in visual angle between a series and the window above which a warning is logged."""

PARAMETERS = ("image", "pupilMM", "focus", "focusRange", "pos", "size", "units", "gamma", "name")
"""Arguments that the log states."""

OF_PICTURE = ("pupilMM", "focusRange", "size")
"""Those that a folder's planes of focus already have."""

Source = str | os.PathLike[str] | ArrayLike


class FocalGradientStim(MinimalStim):  # type: ignore[misc]
    """A picture seen through a pupil, its focus set anew at any frame by ``setFocus``.

    Planes of focus are made when the stimulus is, and become textures; a shader mixes the two next to the focus, one
    draw a frame. What the window holds is the picture blurred at that focus, exposed and encoded for the display, to a
    step of 8 bits; its first row is at the top, and each of its pixels is one of the window's.

    Parameters
    ----------
    win
        The window. Its monitor must have a width and a distance.
    image
        The sharp picture: a file (8-bit files are sRGB, all others linear light), an array H x W or H x W x 3 (integers
        are sRGB, floating-point numbers linear light, 1 being white), or a folder that ``focalgradient focus-series``
        made, with its depth in it. None: it is set before the stimulus is drawn.
    depth
        Distance in metres of what each pixel shows: a file (.npy, EXR, PFM, TIFF), an array H x W, or one number. None:
        that of the folder.
    pupilMM
        Diameter in millimetres of the pupil that blurs, by discs: the observer's own eye adds its diffraction.
    focus
        Vergence in dioptres of the plane of focus: 0.8 is 1.25 m away. Or a map of rows, which covers the picture.
    focusRange
        Least and greatest focus in dioptres; beyond it the picture of the end is shown, and a warning logged. None: the
        picture's own depths, and `focus`.
    pos, units
        Middle of the picture in the window, by default in degrees; rounded to whole pixels.
    size
        Width of the picture, or width and height, in the same units; None: a pixel of the picture on one of the window.
    gamma
        Of the display: see `psychopy_focalgradient.window.display_of`.
    optics
        What blurs instead of a pupil: a `focalgradient.Lens`, an ``Eye``, or others with ``refocused(vergence)``.
    wavelengths
        With an ``Eye``: parts of the light that are each in their own focus, 3 or more. None: all alike.
    folder
        Where the planes of focus are kept, to be read the next time.
    drawDepth
        Place in the order of automatic drawing, as ``depth`` is that of other stimuli: the greatest is drawn first.
    name, autoLog
        As of every stimulus.

    Raises
    ------
    focalgradient.errors.InputError
        If an argument is out of range, files do not fit each other, or the window's geometry is not known.
    """

    def __init__(
        self,
        win: Any,
        image: Source | None = None,
        depth: Source | None = None,
        pupilMM: float = 4,
        focus: ArrayLike = 0.8,
        *,
        focusRange: tuple[float, float] | None = None,
        pos: tuple[float, float] = (0, 0),
        size: float | tuple[float, float] | None = None,
        units: str = "deg",
        gamma: Gamma | None = None,
        optics: Optics | None = None,
        wavelengths: int | None = None,
        folder: str | os.PathLike[str] | None = None,
        drawDepth: float = 0,
        name: str | None = None,
        autoLog: bool | None = None,
    ):
        self._initParams = [*PARAMETERS]
        super().__init__(name=name, autoLog=False)
        self.win = win
        self.units = units or win.units
        self.display = display_of(win, gamma)
        self.gamma = self.display.gamma
        self.optics, self.wavelengths = optics, wavelengths
        self.folder = folder or None
        self.depth = drawDepth
        self._view: FocusView | None = None
        self._warned = self._compared = False
        self.__dict__.update(image=image, distance=depth, pupilMM=pupilMM, focusRange=focusRange, size=size, pos=pos)
        self.__dict__["focus"] = self._checked(focus)
        if image is not None:
            self.prepare()
        self.__dict__["autoLog"] = autoLog if autoLog is not None else win.autoLog
        if self.autoLog:
            logging.exp(f"Created {self.name} = {self}")

    # --- Picture -----------------------------------------------------------------------------------------------------

    @attributeSetter
    def focus(self, value: ArrayLike) -> None:
        """Vergence in dioptres of the plane of focus, a number or a map of rows; live, at every frame."""
        self.__dict__["focus"] = self._checked(value)
        if self._view is not None:
            self.win.backend.setCurrent()
            self._view.focus = self.__dict__["focus"]
            self._warn_beyond()

    def setFocus(self, value: ArrayLike, operation: str = "", log: bool | None = None) -> None:
        """Set `focus`, without an entry in the log where `log` is False."""
        setAttribute(self, "focus", value, log, operation)

    @attributeSetter
    def pos(self, value: tuple[float, float]) -> None:
        """Middle of the picture in the window, in `units`."""
        self.__dict__["pos"] = value
        if self._view is not None:
            self._view.move(self._pixels(value))

    def setPos(self, value: tuple[float, float], operation: str = "", log: bool | None = None) -> None:
        """Set `pos`, without an entry in the log where `log` is False."""
        setAttribute(self, "pos", value, log, operation)

    @attributeSetter
    def image(self, value: Source | None) -> None:
        """The sharp picture; its planes of focus are made by `prepare`, or when it is next drawn."""
        self._renew("image", value)

    def setImage(self, value: Source | None, log: bool | None = None) -> None:
        """Set `image`, without an entry in the log where `log` is False."""
        setAttribute(self, "image", value, log)

    @attributeSetter
    def distance(self, value: Source | None) -> None:
        """Distance in metres of what each pixel shows: the argument `depth`."""
        self._renew("distance", value)

    def setDistance(self, value: Source | None, log: bool | None = None) -> None:
        """Set `distance`, without an entry in the log where `log` is False."""
        setAttribute(self, "distance", value, log)

    @attributeSetter
    def pupilMM(self, value: float) -> None:
        """Diameter of the pupil in millimetres."""
        self._renew("pupilMM", value)

    def setPupilMM(self, value: float, log: bool | None = None) -> None:
        """Set `pupilMM`, without an entry in the log where `log` is False."""
        setAttribute(self, "pupilMM", value, log)

    @property
    def series(self) -> FocusSeries:
        """The planes of focus."""
        self.prepare()
        assert self._view is not None
        return self._view.series

    def _renew(self, name: str, value: Any) -> None:
        if self._view is not None and value is self.__dict__[name]:
            return
        self.__dict__[name] = value
        if self._view is not None:
            self.win.backend.setCurrent()
            self._view.close()
            self._view, self._warned = None, False

    def prepare(self) -> bool:
        """Make the planes of focus, where they are not there, and return whether they were not.

        It takes some seconds for a picture of 512 x 512 pixels, and a fraction of one for a folder.
        """
        if self._view is not None:
            return False
        series = self._series()
        self.win.backend.setCurrent()
        self._view = FocusView(self.win, series, self.display, self._pixels(self.pos))
        self._view.focus = self.__dict__["focus"]
        self._compared = False  # the focus may be set before the stimulus is drawn
        return True

    def _warn_beyond(self) -> None:
        """Log a warning, once for each series, where the focus lies beyond the planes."""
        self._compared = True
        focus = self.__dict__["focus"]
        least, most = self.series.vergences[0], self.series.vergences[-1]
        if not self._warned and (np.min(focus) < least - BEYOND or np.max(focus) > most + BEYOND):
            self._warned = True
            logging.warning(
                f"{self.name}: focus {np.min(focus):.3g} to {np.max(focus):.3g} D lies beyond the planes of focus "
                f"({least:.3g} to {most:.3g} D), so that the plane at the end is shown: give focusRange, or make the "
                "series with --nearest and --farthest."
            )

    def draw(self, win: Any = None) -> None:
        """Draw into the window's current buffer, which in a stereoscopic one is that of one eye."""
        if win is not None and win is not self.win:
            raise InputError(f"{self.name} was made for another window: make a stimulus for each window.")
        self.prepare()
        assert self._view is not None
        if not self._compared:
            self._warn_beyond()
        self.win.backend.setCurrent()
        self._view.draw()

    # --- How it is made ----------------------------------------------------------------------------------------------

    def _series(self) -> FocusSeries:
        is_folder = isinstance(self.image, str | os.PathLike) and Path(self.image).is_dir()
        self._initParams = [name for name in PARAMETERS if not (is_folder and name in OF_PICTURE)]
        if is_folder:
            if self.distance is not None:
                raise InputError(f"image is the focus series {self.image}, which has its own depth: leave out depth.")
            if self.size is not None:
                raise InputError(f"image is the focus series {self.image}, whose pixels stand: leave out size.")
            return self._of_this_angle(read_series(Path(self.image)))
        if self.distance is None:
            raise InputError("depth is missing: give a file, an array or a number of metres, or a focus series.")
        light = self._light()
        light, metres = self._sized(light, self._metres(light.shape[:2]))
        check_number("pupilMM", self.pupilMM, "millimetres", positive=True)
        ends = self._range(metres)
        return FocusSeries.of(
            light,
            metres,
            self.optics or Lens(NODAL_M, 1000 * NODAL_M / self.pupilMM, 1 / max(ends[0], FARTHEST_D)),
            pixel_angle=self.display.pixel_pitch / self.display.distance,
            focus=ends,
            wavelengths=self.wavelengths,
            folder=self.folder,
        )

    def _of_this_angle(self, series: FocusSeries) -> FocusSeries:
        """Return the series; log a warning where its pixels were blurred for another visual angle than the window's."""
        angle = self.display.pixel_pitch / self.display.distance
        if series.pixel_angle is not None and abs(series.pixel_angle / angle - 1) > ANGLE_TOLERANCE:
            half = series.distance.shape[1] / 2
            made, seen = (2 * math.degrees(math.atan(half * pixel)) for pixel in (series.pixel_angle, angle))
            logging.warning(
                f"{self.name}: the focus series {self.image} was made for a picture {made:.3g} degrees wide, but it is "
                f"{seen:.3g} degrees wide in this window, so that its blur is wrong by a factor of "
                f"{angle / series.pixel_angle:.3g}: make the series with --field {seen:.3g}."
            )
        return series

    def _light(self) -> NDArray[Any]:
        if self.image is None:
            raise InputError("image is missing: give a file, an array, or a folder that has a focus series.")
        if isinstance(self.image, str | os.PathLike):
            return read_picture(Path(self.image)).light
        pixels = np.asarray(self.image)
        return picture_of(pixels, "linear" if pixels.dtype.kind == "f" else "srgb").light

    def _metres(self, shape: tuple[int, ...]) -> NDArray[np.float64]:
        given = self.distance
        if isinstance(given, str) and _is_number(given):  # as a Builder's field of text gives it
            given = float(given)
        metres = (
            read_distances(Path(given)).metres if isinstance(given, str | os.PathLike) else np.asarray(given, float)
        )
        metres = np.broadcast_to(metres, shape) if metres.ndim == 0 else metres
        if metres.shape != shape:
            raise InputError(f"depth has the shape {metres.shape}, but the picture {shape}: give a distance a pixel.")
        return np.asarray(metres)

    def _sized(self, light: NDArray[Any], metres: NDArray[np.float64]) -> tuple[NDArray[Any], NDArray[np.float64]]:
        """The picture and its depth of `size` on the window: light averaged, distances those of the nearest pixel."""
        if self.size is None:
            return light, metres
        height, width = metres.shape
        given = np.atleast_1d(np.asarray(self.size, float))
        wanted = given if len(given) == 2 else np.array([given[0], given[0] * height / width])
        across, up = (
            max(1, round(abs(float(side)))) for side in convertToPix(np.zeros(2), wanted, self.units, self.win)
        )
        if (across, up) == (width, height):
            return light, metres
        how = cv2.INTER_AREA if across < width else cv2.INTER_LINEAR
        shrunk = cv2.resize(np.asarray(light, np.float32), (across, up), interpolation=how)
        return shrunk, np.asarray(cv2.resize(metres, (across, up), interpolation=cv2.INTER_NEAREST_EXACT), float)

    def _range(self, metres: NDArray[np.float64]) -> tuple[float, float]:
        if self.focusRange is not None:
            return self.focusRange
        vergences = 1 / metres
        asked = np.asarray(self.focus)
        return (
            float(min(vergences.min(), asked.min())),
            float(max(vergences.max(), asked.max())),
        )

    def _checked(self, focus: ArrayLike) -> float | NDArray[np.float64]:
        try:
            values = np.asarray(focus, float)
        except (TypeError, ValueError):
            values = np.array(math.nan)
        if values.ndim not in (0, 2) or not np.isfinite(values).all():
            raise InputError(f"focus is {focus!r}, but must be a finite number of dioptres, or a map of rows.")
        return values if values.ndim else float(values)

    def _pixels(self, pos: tuple[float, float]) -> tuple[float, float]:
        x, y = convertToPix(np.zeros(2), np.asarray(pos, float), self.units, self.win)
        return float(x), float(y)


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True
