"""Frames of a moving stimulus: one parameter of any function that draws a stimulus goes through values."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from inspect import signature
from typing import Any

import numpy as np
from numpy.typing import NDArray

from focalgradient.errors import InputError
from focalgradient.stimuli.stimulus import Stimulus

__all__ = ["frames"]


def frames(
    draw: Callable[..., Stimulus], parameter: str, values: Iterable[Any], **others: Any
) -> Iterator[NDArray[np.float32]]:
    """Draw one picture after another, for `focalgradient.save_movie`, while one parameter changes.

    Parameters
    ----------
    draw
        Makes a stimulus: `fixated_cube`, `slanted_plane`, `miniature`, ...
    parameter
        What changes: ``"turn"`` turns the cube, ``"focus_m"`` sweeps the focus over a surface, ``"distance_m"`` walks
        towards it.
    values
        Of the parameter, one a frame.
    others
        All other parameters.

    Returns
    -------
    iterator of ndarray
        Linear luminance in shares of white, H x W, float32; one at a time.

    Raises
    ------
    InputError
        If the function has no such parameter, or refuses a value.

    Examples
    --------
    >>> from focalgradient.stimuli import fixated_cube
    >>> turning = frames(fixated_cube, "turn", np.arange(30) / 120)
    >>> next(turning).shape
    (480, 480)
    """
    known = signature(draw).parameters
    for name in (parameter, *others):
        if name not in known:
            raise InputError(f"{draw.__name__} has no parameter {name!r}, but {', '.join(known)}.")
    return (draw(**{**others, parameter: value}).picture.astype(np.float32) for value in values)
