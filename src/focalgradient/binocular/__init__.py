"""Stereoscopic views: one view per eye with its own blur, disparity at every pixel, and presentation formats."""

from focalgradient.binocular.pair import PRESENTATIONS, EyeView, Presentation, StereoPair
from focalgradient.binocular.stereo import INTEROCULAR, stereo
from focalgradient.binocular.warp import Warped, monocular, warp

__all__ = [
    "INTEROCULAR",
    "PRESENTATIONS",
    "EyeView",
    "Presentation",
    "StereoPair",
    "Warped",
    "monocular",
    "stereo",
    "warp",
]
