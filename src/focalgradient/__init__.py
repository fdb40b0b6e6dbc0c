"""focalgradient: depth from blur, for cameras, eyes and experiments (after Pentland 1987)."""

from importlib.metadata import version

from focalgradient.depth import DepthMap, recover_depth
from focalgradient.errors import FocalGradientWarning, InputError
from focalgradient.optics import Lens, paper_distance
from focalgradient.view import View

__version__ = version("focalgradient")
__all__ = ["DepthMap", "FocalGradientWarning", "InputError", "Lens", "View", "paper_distance", "recover_depth"]
