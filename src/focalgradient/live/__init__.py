"""Interactive refocusing: focus series, i.e. pictures at several planes of focus, and their blending on screen."""

from focalgradient.live.blurred_folder import read_series
from focalgradient.live.following import TIME_CONSTANT, Focusing, Transition
from focalgradient.live.page import packed, page_script, page_shaders
from focalgradient.live.series import FocusSeries
from focalgradient.live.shader import Dialect, Texels, fragment_shader, gamma_of, texels_of

__all__ = [
    "TIME_CONSTANT",
    "Dialect",
    "FocusSeries",
    "Focusing",
    "Texels",
    "Transition",
    "fragment_shader",
    "gamma_of",
    "packed",
    "page_script",
    "page_shaders",
    "read_series",
    "texels_of",
]
