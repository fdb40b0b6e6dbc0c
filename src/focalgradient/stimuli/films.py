"""Frames of a moving stimulus, drawn while one parameter of a drawing function varies."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from inspect import signature
from typing import Any

import numpy as np
from numpy.typing import NDArray

from focalgradient.errors import check_one_of
from focalgradient.stimuli.stimulus import Stimulus

__all__ = ["frames"]


def frames(
    draw: Callable[..., Stimulus], parameter: str, values: Iterable[Any], **others: Any
) -> Iterator[NDArray[np.float32]]:
    """Yield pictures for `focalgradient.save_movie` while one parameter of a drawing function varies.

    Parameters
    ----------
    draw
        Drawing function: `fixated_cube`, `slanted_plane`, `miniature`, ...
    parameter
        Parameter that varies: ``"turn"`` rotates the cube, ``"focus_m"`` sweeps the focus over a surface,
        ``"distance_m"`` approaches it.
    values
        Value of the parameter in each frame.
    others
        All other parameters.

    Returns
    -------
    iterator of ndarray
        Linear luminance as a fraction of white, H x W, float32, drawn one at a time.

    Raises
    ------
    InputError
        If the function has no such parameter, or rejects a value.

    Examples
    --------
    >>> from focalgradient.stimuli import fixated_cube
    >>> turning = frames(fixated_cube, "turn", np.arange(30) / 120)
    >>> next(turning).shape
    (480, 480)
    """
    known = signature(draw).parameters
    for name in (parameter, *others):
        check_one_of(f"a parameter of {draw.__name__}", name, known)
    return (draw(**{**others, parameter: value}).picture.astype(np.float32) for value in values)
