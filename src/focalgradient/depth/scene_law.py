"""The one law of scenes that depth from blur assumes where the views leave the power of a texture open."""

__all__ = ["SCENE_SLOPE"]

SCENE_SLOPE = 2
"""Exponent of the power of natural scenes, which falls as 1 / frequency^2. In photographs, which
lenses soften, it falls by 2.5 in the median, on gravel and grass by 2.1 and 1.7 (`tests/depth/test_scene_law.py`)."""
