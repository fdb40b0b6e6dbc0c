"""The turning Necker cube, each of its lines blurred by the depth of one of its two readings."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any, get_args

import numpy as np
from PIL import Image
from psychopy import logging
from psychopy.tools.attributetools import attributeSetter, setAttribute
from psychopy.tools.monitorunittools import convertToPix
from psychopy.visual import ImageStim
from psychopy.visual.basevisual import MinimalStim

from focalgradient.design.necker import Direction, Gradient
from focalgradient.errors import InputError, check_number
from focalgradient.render import necker_frame
from focalgradient.scenes import NeckerCube
from focalgradient.stimuli.cube_frames import room_of, shown
from psychopy_focalgradient.window import Gamma, display_of

__all__ = ["NeckerStim"]


LINE_DEG, LINE_PX = 0.05, 2.0
"""Width of a line where none is given: that of `NeckerCube`, in degrees, but at least this number of pixels."""


class NeckerStim(MinimalStim):  # type: ignore[misc]
    """A wireframe cube on black, drawn by the closed form of its blurred lines at whatever `phase` it is given.

    Parameters
    ----------
    win
        The window. Its monitor must have a width and a distance.
    gradient
        ``"none"``: sharp. ``"rigid"``: blurred as the cube; ``"nonrigid"``: as the cube reversed in depth.
    strengthMM
        Diameter in millimetres of the pupil that blurs.
    phase
        Turns done: ``t * 0.125`` turns the cube once in eight seconds.
    size
        Angle in degrees of an edge that faces the viewer at the distance of the cube's middle.
    direction
        Where the near side moves: ``"right"`` or ``"left"``.
    perspective, distanceM, tiltDeg
        Edge over distance; distance from the eye in metres; lean of the axis in degrees.
    lineWidthDeg
        Width of the sharp lines in degrees. None: 0.05, or two of the window's pixels where these are wider.
    pos, units
        Middle of the cube in the window, by default in degrees; rounded to whole pixels.
    gamma
        Of the display: see `psychopy_focalgradient.window.display_of`.
    drawDepth
        Place in the order of automatic drawing, as ``depth`` is that of other stimuli: the greatest is drawn first.
    name, autoLog
        As of every stimulus.

    Raises
    ------
    focalgradient.errors.InputError
        If an argument is out of range, or the window's geometry is not known.
    """

    def __init__(
        self,
        win: Any,
        gradient: Gradient = "rigid",
        strengthMM: float = 4,
        phase: float = 0,
        *,
        size: float = 8,
        direction: Direction = "right",
        perspective: float = 0.4,
        distanceM: float = 0.5,
        tiltDeg: float = 20,
        lineWidthDeg: float | None = None,
        pos: tuple[float, float] = (0, 0),
        units: str = "deg",
        gamma: Gamma | None = None,
        drawDepth: float = 0,
        name: str | None = None,
        autoLog: bool | None = None,
    ):
        self._initParams = ["gradient", "strengthMM", "phase", "size", "direction", "pos", "units", "name"]
        super().__init__(name=name, autoLog=False)
        self.win = win
        self.units = units or win.units
        self.display = display_of(win, gamma)
        self.depth = drawDepth
        self.size = size
        if lineWidthDeg is None:
            lineWidthDeg = max(LINE_DEG, LINE_PX / self.display.pixels_per_degree)
        for what, value in (("size", size), ("tiltDeg", tiltDeg), ("lineWidthDeg", lineWidthDeg)):
            check_number(what, value, "degrees")
        self._cube = NeckerCube(
            size=math.radians(size),
            perspective=perspective,
            distance=distanceM,
            tilt=math.radians(tiltDeg),
            line_width=math.radians(lineWidthDeg),
        )
        self._image: Any = None
        self.__dict__.update(gradient=gradient, strengthMM=strengthMM, direction=direction, phase=phase, pos=pos)
        self._draw_frame()
        self.__dict__["autoLog"] = autoLog if autoLog is not None else win.autoLog
        if self.autoLog:
            logging.exp(f"Created {self.name} = {self}")

    @attributeSetter
    def phase(self, value: float) -> None:
        """Turns done, live, at every frame."""
        self._change("phase", value)

    def setPhase(self, value: float, operation: str = "", log: bool | None = None) -> None:
        """Set `phase`, without an entry in the log where `log` is False."""
        setAttribute(self, "phase", value, log, operation)

    @attributeSetter
    def gradient(self, value: Gradient) -> None:
        """The reading by whose depth lines are blurred."""
        self._change("gradient", value)

    def setGradient(self, value: Gradient, log: bool | None = None) -> None:
        """Set `gradient`, without an entry in the log where `log` is False."""
        setAttribute(self, "gradient", value, log)

    @attributeSetter
    def strengthMM(self, value: float) -> None:
        """Diameter in millimetres of the pupil that blurs."""
        self._change("strengthMM", value)

    def setStrengthMM(self, value: float, operation: str = "", log: bool | None = None) -> None:
        """Set `strengthMM`, without an entry in the log where `log` is False."""
        setAttribute(self, "strengthMM", value, log, operation)

    @attributeSetter
    def direction(self, value: Direction) -> None:
        """Where the near side moves."""
        self._change("direction", value)

    def setDirection(self, value: Direction, log: bool | None = None) -> None:
        """Set `direction`, without an entry in the log where `log` is False."""
        setAttribute(self, "direction", value, log)

    @attributeSetter
    def pos(self, value: tuple[float, float]) -> None:
        """Middle of the cube in the window, in `units`."""
        self.__dict__["pos"] = value
        self._place()

    def setPos(self, value: tuple[float, float], operation: str = "", log: bool | None = None) -> None:
        """Set `pos`, without an entry in the log where `log` is False."""
        setAttribute(self, "pos", value, log, operation)

    def draw(self, win: Any = None) -> None:
        """Draw into the window's current buffer."""
        if self._drawn != self._settings:
            self._draw_frame()
        self._image.draw(win)

    @property
    def _settings(self) -> tuple[Any, ...]:
        return self.phase, self.gradient, self.strengthMM, self.direction

    def _change(self, name: str, value: Any) -> None:
        before, self.__dict__[name] = self.__dict__[name], value
        if name != "phase":
            try:
                self._draw_frame()
            except InputError:
                self.__dict__[name] = before
                raise

    def _draw_frame(self) -> None:
        if self.direction not in get_args(Direction):
            raise InputError(f"direction is {self.direction!r}, but must be 'right' or 'left'.")
        angle, aperture = self.display.pixel_pitch / self.display.distance, self.strengthMM / 1000
        cube = replace(self._cube, direction=self.direction)
        light = necker_frame(
            cube,
            self.phase,
            shape=room_of(cube, aperture, angle),
            pixel_angle=angle,
            gradient=self.gradient,
            aperture=aperture,
        )
        self.pixels = shown(light, self.display)
        picture = Image.fromarray(self.pixels)
        if self._image is None or tuple(self._image.size) != picture.size:
            self._image = ImageStim(self.win, picture, size=picture.size, units="pix", interpolate=False, autoLog=False)
            self._place()
        else:
            self._image.setImage(picture, log=False)
        self._drawn = self._settings

    def _place(self) -> None:
        """Put each pixel of the picture on one of the window's."""
        wanted = convertToPix(np.zeros(2), np.asarray(self.pos, float), self.units, self.win)
        odd = (np.asarray(self.win.size) - self._image.size) % 2 / 2  # the window's middle lies between pixels
        self._image.setPos(np.round(np.asarray(wanted) - odd) + odd, log=False)
