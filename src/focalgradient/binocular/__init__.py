"""Views for two eyes: each with its own blur, disparity known at every pixel, and ways to show the pair."""

from focalgradient.binocular.pair import EyeView, StereoPair
from focalgradient.binocular.stereo import INTEROCULAR, stereo
from focalgradient.binocular.warp import Warped, monocular, warp

__all__ = ["INTEROCULAR", "EyeView", "StereoPair", "Warped", "monocular", "stereo", "warp"]
