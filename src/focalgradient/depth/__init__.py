"""Depth from blur: two or more views in, one depth map out."""

from focalgradient.depth.depth_map import DepthMap
from focalgradient.depth.recover import methods_for, recover_depth

__all__ = ["DepthMap", "methods_for", "recover_depth"]
