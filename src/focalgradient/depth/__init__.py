"""Depth from blur: two or more views in, one depth map out."""

from focalgradient.depth.depth_map import DepthMap
from focalgradient.depth.recover import recover_depth
from focalgradient.depth.settings import methods_for

__all__ = ["DepthMap", "methods_for", "recover_depth"]
