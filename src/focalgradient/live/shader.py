"""Shader that displays a focus series, for OpenGL windows and for web pages with WebGL 2."""

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
    """Shading language: the header that precedes `focus.glsl`."""

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
        Shading language.
    srgb
        Whether the display's encoding is sRGB; otherwise each gun has an exponent, the uniform ``gamma``.
    varies
        Whether focus varies over the picture, given by the texture ``places``; otherwise by the uniform ``place``.
    lamp
        Whether to add a disc of light, given by the uniform ``lamp``.

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
        If the display uses dithering, which the shader does not support.

    Examples
    --------
    >>> gamma_of(Display(gamma=2.2)), gamma_of(Display())
    ((2.2, 2.2, 2.2), None)
    """
    if display.dither:
        raise InputError(
            "display has dither=True, but a focus series is displayed without dithering: set dither=False."
        )
    if isinstance(display.gamma, tuple):
        return display.gamma
    return None if display.gamma == "sRGB" else (float(display.gamma),) * 3


class Texels(NamedTuple):
    """Planes as sent to the graphics card, N x H x W x 4, and the gain by which their radiance is multiplied."""

    values: NDArray[np.uint8] | NDArray[np.float16]
    gain: float


def texels_of(series: FocusSeries, *, srgb: bool = True) -> Texels:
    """Return the planes as 8-bit sRGB for a display with that encoding, otherwise as 16-bit linear radiance.

    Radiance above white is also stored in 16 bits, and clipped only after mixing. It is multiplied by a power of 2,
    because some graphics cards treat numbers below 6e-5 (3 8-bit steps at a gamma of 2.2) as 0.

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
