"""What an encoding that is only assumed leaves open: depth of a part of the views, were they encoded otherwise.

A file that says nothing of it is taken for sRGB if it has 8 bits, and for linear if it has more. Cameras add tone
curves of their own, and scientific cameras write linear values. A curve changes the contrast of all views alike, most
of which cancels where views are compared. What does not is measured on the views at hand, by reading a part of them
otherwise.
"""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from focalgradient.depth.depth_map import DepthMap
from focalgradient.depth.settings import AUTO, used_blur
from focalgradient.errors import InputError
from focalgradient.photographs.encodings import Encoding
from focalgradient.srgb import linear_to_srgb, srgb_to_linear
from focalgradient.view import View

__all__ = ["encoding_difference"]

SIDE = 320
"""Side in pixels of the part."""

LEAST = 400
"""Pixels that must be valid both ways."""


def encoding_difference(
    views: Sequence[View], depth: DepthMap, encoding: Encoding, near: float | None, far: float | None, align: bool
) -> float | None:
    """Median change of vergence (D), were the views' files of the other encoding; None where it is not known.

    Parameters
    ----------
    views, depth
        The views, in 0 to 1, and their map by the default method.
    encoding
        As which the files were read.
    near, far, align
        As the map was made.
    """
    from focalgradient.depth.recover import recover_depth

    if not depth.valid.any():
        return None
    part = tuple(
        slice(start, start + SIDE)
        for middle, n in zip((np.median(where) for where in np.nonzero(depth.valid)), depth.shape, strict=True)
        for start in [int(np.clip(middle - SIDE // 2, 0, max(0, n - SIDE)))]
    )
    # What is read as the other encoding would have been undone, or not been.
    recode = linear_to_srgb if encoding == "srgb" else srgb_to_linear
    others = [
        replace(
            view,
            image=np.ascontiguousarray(recode(np.clip(view.image[part], 0, 1)), np.float32),
            mask=None if view.mask is None or view.mask[part].all() else np.ascontiguousarray(view.mask[part]),
        )
        for view in views
    ]
    psf = used_blur(depth.details) or AUTO
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            other = recover_depth(others, near=near, far=far, psf=psf, align=align)
        except InputError:
            return None
    both = other.valid & depth.valid[part]
    return float(np.median((other.vergence - depth.vergence[part])[both])) if both.sum() >= LEAST else None
