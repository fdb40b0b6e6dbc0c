"""Display of a focus series in a PsychoPy window: a shader interpolates between the two planes nearest in focus."""

from __future__ import annotations

import ctypes
from typing import Any

import numpy as np
from numpy.typing import NDArray
from psychopy.visual import shaders
from pyglet import gl

from focalgradient.display import Display
from focalgradient.errors import InputError
from focalgradient.live import Dialect, FocusSeries, fragment_shader, gamma_of, texels_of

__all__ = ["FocusView"]

CORNERS = """#version 120
varying vec2 where;
void main() {
    gl_Position = gl_Vertex;
    where = gl_MultiTexCoord0.xy;
}
"""

FORMATS = {
    np.dtype(np.uint8): (gl.GL_SRGB8_ALPHA8, gl.GL_UNSIGNED_BYTE),
    np.dtype(np.float16): (gl.GL_RGBA16F_ARB, gl.GL_HALF_FLOAT_ARB),
}
"""OpenGL formats of the textures by pixel type; the graphics card decodes the first to linear light."""


COVERING = (0.0, 0.0, 1.0, 1.0)
"""Left, top, width and height, as fractions of the picture, of a map that covers it."""


class _Program:
    """Compiled shader program with the locations of its uniforms."""

    def __init__(self, *, srgb: bool, varies: bool):
        self.number = shaders.compileProgram(CORNERS, fragment_shader(Dialect.WINDOW, srgb=srgb, varies=varies))
        names = ("planes", "last", "places", "frame", "place", "gamma", "gain")
        self.planes, self.last, self.places, self.frame, self.place, self.gamma, self.gain = (
            gl.glGetUniformLocation(self.number, name.encode()) for name in names
        )


class FocusView:
    """Picture that can be refocused at every frame, in a PsychoPy window.

    Parameters
    ----------
    window
        PsychoPy window, without a gamma table of its own.
    series
        Focus series, whose planes become textures.
    display
        Encoding of light by the display.
    pos
        Picture centre in pixels from the window's centre, x right and y up; rounded to whole pixels.

    Raises
    ------
    InputError
        If the picture or the number of planes exceeds the graphics card's limits, or the display dithers.

    Notes
    -----
    `focus` is in dioptres: a number, or a map of any size. A map covers the picture (a coarser map is interpolated), or
    lies where `place_map` positions it; a map around the gaze can thus be moved without uploading it again.
    """

    def __init__(self, window: Any, series: FocusSeries, display: Display, pos: tuple[float, float] = (0.0, 0.0)):
        self.window, self.series = window, series
        self.display = display
        self.mirrored = False
        """Whether left and right are exchanged about the window's centre, as in a single mirror."""
        window.backend.setCurrent()
        height, width = series.distance.shape
        self._check(len(series.planes), max(height, width))
        self._srgb = self._gamma is None
        self._programs = {varies: _Program(srgb=self._srgb, varies=varies) for varies in (False, True)}
        self._planes, self._places = self._new_texture(), self._new_texture()
        texels = texels_of(series, srgb=self._srgb)
        self._send_planes(texels.values)
        self._gain = texels.gain
        self.move(pos)
        self._frame = COVERING
        self._map_size = (1, 1)
        self._place, self._varies = 0.0, False
        self._send_places(np.zeros((1, 1), np.float32))
        self._focus: float | NDArray[np.float64] = series.vergences[0]

    @property
    def display(self) -> Display:
        """Encoding of light by the display; its replacement must have a gamma if and only if the present one has."""
        return self._display

    @display.setter
    def display(self, display: Display) -> None:
        self._display, self._gamma = display, gamma_of(display)

    @property
    def focus(self) -> float | NDArray[np.float64]:
        """Focus in dioptres: a number or a map."""
        return self._focus

    @focus.setter
    def focus(self, focus: float | NDArray[np.float64]) -> None:
        place = self.series.place_of(focus)
        if place.ndim not in (0, 2) or not np.isfinite(place).all():
            raise InputError(f"focus has shape {place.shape}, but must be one finite number, or a 2-D map of them.")
        self._focus, self._varies = focus, place.ndim == 2
        if self._varies:
            self._map_size = (place.shape[1], place.shape[0])
            self._send_places(np.ascontiguousarray(place, np.float32))
        else:
            self._place = float(place)

    def place_map(self, x: float, y: float) -> None:
        """Centre the focus map at a position in the picture, without interpolation.

        `x` and `y` are in pixels from the picture's upper left corner, and are rounded. Outside the map, focus is that
        of its nearest edge.
        """
        (wide, tall), (height, width) = self._map_size, self.series.distance.shape
        self._frame = (round(x - wide / 2) / width, round(y - tall / 2) / height, wide / width, tall / height)
        self._sample(gl.GL_TEXTURE_2D, self._places, gl.GL_NEAREST)

    def move(self, pos: tuple[float, float]) -> None:
        """Move the picture's centre, in the coordinates of `pos`."""
        height, width = self.series.distance.shape
        self._corners = self._corners_of(pos, width, height)

    def draw(self) -> None:
        """Draw the picture at the current focus."""
        program = self._programs[self._varies]
        gl.glUseProgram(program.number)
        for unit, (kind, texture) in enumerate(
            ((gl.GL_TEXTURE_2D_ARRAY, self._planes), (gl.GL_TEXTURE_2D, self._places))
        ):
            gl.glActiveTexture(gl.GL_TEXTURE0 + unit)
            gl.glBindTexture(kind, texture)
        gl.glUniform1i(program.planes, 0)
        gl.glUniform1f(program.last, len(self.series.planes) - 1.0)
        gl.glUniform1f(program.gain, self._gain)
        if self._varies:
            gl.glUniform1i(program.places, 1)
            gl.glUniform4f(program.frame, *self._frame)
        else:
            gl.glUniform1f(program.place, self._place)
        if self._gamma is not None:
            gl.glUniform3f(program.gamma, *self._gamma)
        gl.glColor4f(1.0, 1.0, 1.0, 1.0)
        gl.glBegin(gl.GL_QUADS)
        for (u, v), (x, y) in self._corners:
            gl.glTexCoord2f(u, v)
            gl.glVertex2f(-x if self.mirrored else x, y)
        gl.glEnd()
        gl.glUseProgram(0)
        for unit, kind in ((1, gl.GL_TEXTURE_2D), (0, gl.GL_TEXTURE_2D_ARRAY)):  # the state that PsychoPy expects
            gl.glActiveTexture(gl.GL_TEXTURE0 + unit)
            gl.glBindTexture(kind, 0)

    def close(self) -> None:
        """Delete the textures."""
        for texture in (self._planes, self._places):
            gl.glDeleteTextures(1, ctypes.byref(gl.GLuint(texture)))

    def _check(self, planes: int, side: int) -> None:
        for name, what, wanted in (
            (gl.GL_MAX_ARRAY_TEXTURE_LAYERS, "planes of focus", planes),
            (gl.GL_MAX_TEXTURE_SIZE, "pixels on its longer side", side),
        ):
            most = gl.GLint()
            gl.glGetIntegerv(name, ctypes.byref(most))
            if wanted > most.value:
                raise InputError(
                    f"the series has {wanted} {what}, but this graphics card supports at most {most.value}: make it "
                    "with a larger error or a smaller range of focus, or of a smaller picture."
                )

    def _new_texture(self) -> int:
        number = gl.GLuint()
        gl.glGenTextures(1, ctypes.byref(number))
        return number.value

    def _send_planes(self, texels: NDArray[Any]) -> None:
        count, height, width, _ = texels.shape
        inner, kind = FORMATS[texels.dtype]
        target = gl.GL_TEXTURE_2D_ARRAY
        gl.glBindTexture(target, self._planes)
        gl.glPixelStorei(gl.GL_UNPACK_ALIGNMENT, 1)
        gl.glTexImage3D(target, 0, inner, width, height, count, 0, gl.GL_RGBA, kind, texels.ctypes.data)
        self._sample(target, self._planes, gl.GL_NEAREST)

    def _send_places(self, places: NDArray[np.float32]) -> None:
        height, width = places.shape
        target = gl.GL_TEXTURE_2D
        gl.glBindTexture(target, self._places)
        gl.glPixelStorei(gl.GL_UNPACK_ALIGNMENT, 1)
        gl.glTexImage2D(target, 0, gl.GL_R32F, width, height, 0, gl.GL_RED, gl.GL_FLOAT, places.ctypes.data)
        # Graphics cards interpolate in steps of 1/256: a map at pixel resolution must not be interpolated.
        coarse = self._frame == COVERING and places.shape != self.series.distance.shape
        self._sample(target, self._places, gl.GL_LINEAR if coarse else gl.GL_NEAREST)

    def _sample(self, target: int, texture: int, how: int) -> None:
        gl.glBindTexture(target, texture)
        for name in (gl.GL_TEXTURE_MIN_FILTER, gl.GL_TEXTURE_MAG_FILTER):
            gl.glTexParameteri(target, name, how)
        for name in (gl.GL_TEXTURE_WRAP_S, gl.GL_TEXTURE_WRAP_T):
            gl.glTexParameteri(target, name, gl.GL_CLAMP_TO_EDGE)
        gl.glBindTexture(target, 0)

    def _corners_of(self, pos: tuple[float, float], width: int, height: int) -> list[Any]:
        """Return texture coordinates and positions of the corners; the window spans -1 to 1 in both directions."""
        across, up = (int(side) for side in self.window.size)
        left = round((across - width) / 2 + pos[0] + 1e-6)  # a centre between two pixels is rounded right and up
        below = round((up - height) / 2 + pos[1] + 1e-6)
        x0, x1 = (2 * edge / across - 1 for edge in (left, left + width))
        y0, y1 = (2 * edge / up - 1 for edge in (below, below + height))
        return [((0, 1), (x0, y0)), ((1, 1), (x1, y0)), ((1, 0), (x1, y1)), ((0, 0), (x0, y1))]
