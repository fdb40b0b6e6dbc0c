"""Two drawings whose depth nobody doubts: a wall of tiles seen from the front, and a tiled corridor.

They are shown in practice and as catch trials: the right answer is "clearly flatter" and "clearly deeper" than a scene.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from focalgradient.design.depth_rating import EXAMPLES
from focalgradient.errors import InputError

__all__ = ["DRAWINGS", "example_picture"]

DRAWINGS = tuple(EXAMPLES.values())
"""Their names, as scenes."""

LIGHT, DARK, MORTAR = 170.0, 95.0, 60.0  # 8-bit values of the tiles and of the lines between them
DEEP = 12.0  # widths of the corridor that are drawn, up to its end wall
LAMP = 0.12  # share of the light that is left at the end wall


def example_picture(name: str, shape: tuple[int, int]) -> NDArray[np.uint8]:
    """Draw one of them: 8-bit values, H x W, of the given height and width in pixels.

    The corridor is seen from its middle in perspective: a point of its walls is at the picture's half height over its
    distance from the middle. Tiles have one size on all walls, and far ones are darker.

    Raises
    ------
    InputError
        If there is no drawing of that name.

    Examples
    --------
    >>> example_picture("example-deep", (60, 80)).shape
    (60, 80)
    """
    if name not in DRAWINGS:
        raise InputError(f"there is no drawing {name!r}: give one of {', '.join(DRAWINGS)}.")
    height, width = shape
    half = height / 2
    y, x = np.meshgrid(
        (np.arange(height) + 0.5 - height / 2) / half, (np.arange(width) + 0.5 - width / 2) / half, indexing="ij"
    )
    if name == EXAMPLES["flatter"]:
        return _tiles(3 * x + 0.5, 3 * y + 0.5).astype(np.uint8)
    room = width / height
    out = np.maximum(np.abs(y), np.abs(x) / room)
    depth = np.minimum(1 / np.maximum(out, 1e-6), DEEP)
    side = np.abs(x) / room >= np.abs(y)
    across = np.where(side, y * depth, x * depth)
    wall = depth >= DEEP
    tiles = np.where(wall, _tiles(3 * x * depth, 3 * y * depth), _tiles(2 * depth, 3 * across + 0.5))
    return np.asarray(tiles * (LAMP + (1 - LAMP) / depth**0.7), np.uint8)


def _tiles(one: NDArray[np.float64], other: NDArray[np.float64]) -> NDArray[np.float64]:
    """Grey of a checkerboard of tiles of side 1 with lines between them."""
    board = np.where((np.floor(one) + np.floor(other)) % 2 == 0, LIGHT, DARK)
    line = (np.minimum(one % 1, 1 - one % 1) < 0.03) | (np.minimum(other % 1, 1 - other % 1) < 0.03)
    return np.where(line, MORTAR, board)
