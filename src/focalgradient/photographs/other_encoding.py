"""Sensitivity of depth to an assumed encoding, from a part of the views decoded with the other encoding.

A file that does not state its encoding is assumed to be sRGB if it has 8 bits, and linear otherwise. Cameras apply
their own tone curves, and scientific cameras write linear values. A tone curve changes the contrast of all views in the
same way, which mostly cancels when views are compared. The remainder is measured on the views at hand by decoding a
part of them with the other encoding.
"""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from focalgradient.depth.depth_map import DepthMap
from focalgradient.depth.recover import recover_depth
from focalgradient.depth.settings import AUTO, used_blur
from focalgradient.errors import InputError
from focalgradient.photographs.encodings import Encoding
from focalgradient.srgb import linear_to_srgb, srgb_to_linear
from focalgradient.view import View

__all__ = ["encoding_difference"]

PART_SIDE_PX = 320
"""Side in pixels of the part that is decoded again."""

MIN_VALID_PIXELS = 400
"""Minimum number of pixels that must be valid with both encodings."""


def encoding_difference(
    views: Sequence[View], depth: DepthMap, encoding: Encoding, near: float | None, far: float | None, align: bool
) -> float | None:
    """Return the median change of vergence (D) if the files had the other encoding; None if unknown.

    Parameters
    ----------
    views, depth
        The views, with values from 0 to 1, and their depth map by the default method.
    encoding
        Encoding with which the files were decoded.
    near, far, align
        As for the depth map.
    """
    if not depth.valid.any():
        return None
    part = tuple(
        slice(start, start + PART_SIDE_PX)
        for middle, n in zip((np.median(where) for where in np.nonzero(depth.valid)), depth.shape, strict=True)
        for start in [int(np.clip(middle - PART_SIDE_PX // 2, 0, max(0, n - PART_SIDE_PX)))]
    )
    # Undo, or apply, the sRGB decoding.
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
    is_valid_in_both = other.valid & depth.valid[part]
    if is_valid_in_both.sum() < MIN_VALID_PIXELS:
        return None
    return float(np.median((other.vergence - depth.vergence[part])[is_valid_in_both]))
