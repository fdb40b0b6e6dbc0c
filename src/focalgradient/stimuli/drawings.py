"""Drawings with unambiguous depth: a frontal wall of tiles, and a tiled corridor.

They are shown in practice and as catch trials, where the correct answers are "clearly flatter" and "clearly deeper"
than a scene.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from focalgradient.arrays import FloatArray
from focalgradient.design.depth_rating import EXAMPLES
from focalgradient.errors import check_one_of

__all__ = ["DRAWINGS", "example_picture", "noise_mask"]

DRAWINGS = tuple(EXAMPLES.values())
"""Names of the drawings, used as scene names."""

LIGHT, DARK, MORTAR = 170.0, 95.0, 60.0  # 8-bit values of the tiles and of the gaps between them
CORRIDOR_LENGTH = 12.0  # length of the corridor, up to its end wall, in corridor widths
END_ILLUMINATION = 0.12  # relative illumination of the end wall


@lru_cache(maxsize=4)
def example_picture(name: str, shape: tuple[int, int]) -> NDArray[np.uint8]:
    """Draw the named drawing: 8-bit values, H x W, with the given height and width in pixels; not to be written to.

    The corridor is seen in perspective from its middle: a wall point is displayed at half the picture height divided by
    its distance from the centre. Tiles have the same physical size on all walls, and distant ones are darker.

    Raises
    ------
    InputError
        If there is no drawing of this name.

    Examples
    --------
    >>> example_picture("example-deep", (60, 80)).shape
    (60, 80)
    """
    check_one_of("drawing", name, DRAWINGS)
    height, width = shape
    half = height / 2
    y, x = np.meshgrid(
        (np.arange(height) + 0.5 - height / 2) / half, (np.arange(width) + 0.5 - width / 2) / half, indexing="ij"
    )
    if name == EXAMPLES["flatter"]:
        return _kept(_tiles(3 * x + 0.5, 3 * y + 0.5))
    room = width / height
    out = np.maximum(np.abs(y), np.abs(x) / room)
    depth = np.minimum(1 / np.maximum(out, 1e-6), CORRIDOR_LENGTH)
    side = np.abs(x) / room >= np.abs(y)
    across = np.where(side, y * depth, x * depth)
    wall = depth >= CORRIDOR_LENGTH
    tiles = np.where(wall, _tiles(3 * x * depth, 3 * y * depth), _tiles(2 * depth, 3 * across + 0.5))
    return _kept(tiles * (END_ILLUMINATION + (1 - END_ILLUMINATION) / depth**0.7))


def _kept(light: FloatArray) -> NDArray[np.uint8]:
    """Return 8-bit values that cannot be changed, as they are drawn once."""
    picture = light.astype(np.uint8)
    picture.setflags(write=False)
    return picture


MASK_DEG = 0.1
"""Side of the squares of a mask, in degrees."""


def noise_mask(shape: tuple[int, int], pixels_per_degree: float, seed: int | tuple[int, ...]) -> NDArray[np.uint8]:
    """Draw a mask of random grey squares with sides of `MASK_DEG`: 8-bit values, H x W.

    >>> noise_mask((6, 8), 20.0, seed=1)[0]
    array([255, 255, 228, 228,  34,  34, 121, 121], dtype=uint8)
    """
    side = max(1, round(MASK_DEG * pixels_per_degree))
    squares = [length // side + 1 for length in shape]
    small = np.random.default_rng(seed).integers(0, 256, squares, dtype=np.uint8)
    return small.repeat(side, 0).repeat(side, 1)[: shape[0], : shape[1]]


def _tiles(one: FloatArray, other: FloatArray) -> FloatArray:
    """Return the grey levels of a checkerboard with unit tiles and gaps between them."""
    board = np.where((np.floor(one) + np.floor(other)) % 2 == 0, LIGHT, DARK)
    line = (np.minimum(one % 1, 1 - one % 1) < 0.03) | (np.minimum(other % 1, 1 - other % 1) < 0.03)
    return np.where(line, MORTAR, board)
