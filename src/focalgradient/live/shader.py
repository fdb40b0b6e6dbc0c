"""The shader that shows a focus series: one program for a window of OpenGL and for a page with WebGL 2."""

from __future__ import annotations

import math
from enum import Enum
from importlib.resources import files
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from focalgradient.display import Display
from focalgradient.errors import InputError
from focalgradient.live.series import HALF_MAX, FocusSeries
from focalgradient.srgb import linear_to_srgb

__all__ = ["Dialect", "Texels", "fragment_shader", "gamma_of", "texels_of"]


class Dialect(Enum):
    """The language in which a program for the graphics card is written: what comes before `focus.glsl`."""

    WINDOW = """#version 120
#extension GL_EXT_texture_array : require
#define TEXEL texture2D
#define LAYER texture2DArray
#define SHOWN gl_FragColor
varying vec2 where;
"""
    PAGE = """#version 300 es
precision highp float;
precision highp sampler2DArray;
#define TEXEL texture
#define LAYER texture
#define SHOWN shown
in vec2 where;
out vec4 shown;
"""


def fragment_shader(dialect: Dialect, *, srgb: bool, varies: bool, lamp: bool = False) -> str:
    """Return the source of the fragment shader.

    Parameters
    ----------
    dialect
        The language.
    srgb
        Whether the display's encoding is sRGB; else each gun has an exponent, the uniform ``gamma``.
    varies
        Whether focus varies over the picture, by the texture ``places``; else it is the uniform ``place``.
    lamp
        Whether a disc of light, the uniform ``lamp``, is added.

    Examples
    --------
    >>> fragment_shader(Dialect.PAGE, srgb=True, varies=False).splitlines()[0]
    '#version 300 es'
    """
    chosen = [name for name, wanted in (("SRGB", srgb), ("VARIES", varies), ("LAMP", lamp)) if wanted]
    defined = "".join(f"#define {name}\n" for name in chosen)
    return dialect.value + defined + files("focalgradient.live").joinpath("focus.glsl").read_text(encoding="utf-8")


def gamma_of(display: Display) -> tuple[float, float, float] | None:
    """Return the exponents of a display's guns, the shader's uniform ``gamma``; None for sRGB.

    Raises
    ------
    InputError
        If the display dithers, which the shader does not.

    Examples
    --------
    >>> gamma_of(Display(gamma=2.2)), gamma_of(Display())
    ((2.2, 2.2, 2.2), None)
    """
    if display.dither:
        raise InputError("display has dither=True, but a focus series is shown without: give dither=False.")
    if isinstance(display.gamma, tuple):
        return display.gamma
    return None if display.gamma == "sRGB" else (float(display.gamma),) * 3


class Texels(NamedTuple):
    """Planes as they are sent to a graphics card, N x H x W x 4, and the gain by which their light is raised."""

    values: NDArray[np.uint8] | NDArray[np.float16]
    gain: float


def texels_of(series: FocusSeries, *, srgb: bool = True) -> Texels:
    """Return the planes as 8-bit sRGB for a display of that encoding, else as 16-bit linear light.

    Light above white is kept in 16 bits, too: it is cut off only when two planes have been mixed. It is raised by a
    power of 2, as some graphics cards take numbers below 6e-5 for 0, which is 3 steps of 8 bits at a gamma of 2.2.

    >>> flat = FocusSeries((0.0,), (np.full((1, 2), 0.5, np.float16),), np.ones((1, 2)), np.zeros((0, 2)))
    >>> texels_of(flat).values[0, 0, 0].tolist()
    [188, 188, 188, 255]
    >>> texels_of(flat, srgb=False).values[0, 0, 0].tolist(), texels_of(flat, srgb=False).gain
    ([512.0, 512.0, 512.0, 1.0], 1024.0)
    """
    shape = (len(series.planes), *series.distance.shape, 4)
    eight = srgb and series.within_white
    most = max(float(np.abs(plane).max()) for plane in series.planes)
    gain = 1.0 if eight else 2.0 ** max(0, min(10, math.floor(math.log2(HALF_MAX / max(most, 1.0)))))
    texels: NDArray[np.uint8] | NDArray[np.float16] = (
        np.full(shape, 255, np.uint8) if eight else np.ones(shape, np.float16)
    )
    for texel, plane in zip(texels, series.planes, strict=True):
        colours = (plane if plane.ndim == 3 else plane[..., None]).astype(np.float32)
        texel[..., :3] = np.rint(255 * linear_to_srgb(colours)) if eight else gain * colours
    return Texels(texels, gain)
