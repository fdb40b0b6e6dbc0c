"""Stereoscopic views: one view per eye with its own blur, disparity at every pixel, and presentation formats."""

from focalgradient.binocular.pair import EyeView, StereoPair
from focalgradient.binocular.stereo import INTEROCULAR, stereo
from focalgradient.binocular.warp import Warped, monocular, warp

__all__ = ["INTEROCULAR", "EyeView", "StereoPair", "Warped", "monocular", "stereo", "warp"]
