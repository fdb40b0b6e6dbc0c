"""Held-out scenes for `seams.py`, not used to choose constants of rendering: other seeds, other lenses, photographs.

Photographs with a depth-camera map are completed as two layers, split at the depth discontinuities, each extrapolated
behind the other and smoothed, with the photograph's own light; regions hidden in both are filled.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import cv2
import lens_rays
import numpy as np
from lens_rays import EVERYWHERE, FINE, WIDE, FloatArray, Layered, Sheet, blob, plane
from numpy.typing import NDArray
from scipy.ndimage import distance_transform_edt, gaussian_filter, median_filter
from skimage import data
from skimage.filters import threshold_otsu

WEIGHTS = np.array([0.2126, 0.7152, 0.0722])


def scenes(folder: str) -> list[Layered]:
    """Return sixteen scenes; without those of `indoor_pairs` if `folder` is "none"."""
    found = [
        lens_rays._balls_on_floor(101, 18, 9),
        lens_rays._curved(121, 5, 14, 4),
        lens_rays._cards(141, 18, 9, False),
        lens_rays._cards(142, 14, 5, True),
        lens_rays._contact(161, 0.15, 10),
        lens_rays._three(181, 16, 8),
        *(
            replace(scene, name=f"{scene.name}, {int(lens)} blades", lens=lens)
            for scene, lens in (
                (lens_rays._cards(143, 16, 7, False), 5.0),
                (lens_rays._balls_on_floor(102, 20, 10), 6.0),
                (lens_rays._curved(122, 4, 18, 18), 5.0),
            )
        ),
        *(
            replace(scene, name=f"{scene.name}, Gaussian", lens=2.0)
            for scene in (lens_rays._balls_on_floor(103, 16, 4), lens_rays._cards(144, 14, 14, False))
        ),
        _pasted("astronaut", "coffee", 201, 14, 7),
        _pasted("chelsea", "rocket", 202, 20, 20),
    ]
    if folder != "none":
        found += [_photograph(Path(folder) / name, focus) for name, focus in (("02", 0.3), ("09", 0.7), ("15", 1.0))]
    return found


def _linear(picture: NDArray[Any]) -> FloatArray:
    """Return the linear luminance of an sRGB photograph, enlarged if necessary to the size of a wide frame."""
    light = (picture / 255.0) ** 2.2
    grey: NDArray[Any] = light @ WEIGHTS if light.ndim == 3 else light
    more = max(1.0, WIDE[0] / grey.shape[0], WIDE[1] / grey.shape[1])
    grey = cv2.resize(grey, None, fx=more + 0.01, fy=more + 0.01) if more > 1 else grey
    top, left = (grey.shape[0] - WIDE[0]) // 2, (grey.shape[1] - WIDE[1]) // 2
    return 0.05 + 0.85 * np.asarray(grey[top : top + WIDE[0], left : left + WIDE[1]], float)


def _pasted(behind: str, before: str, seed: int, reach: float, focus: float) -> Layered:
    """Return two photographs of scikit-image on two curved layers, the near one of irregular shape."""
    random = np.random.default_rng(seed)
    things = []
    for number, name in enumerate((behind, before)):
        bend = gaussian_filter(random.standard_normal(WIDE), 25)
        vergence = plane(reach * number, *random.uniform(-0.03, 0.03, 2)) + 0.04 * reach * bend / bend.std()
        form = blob(random, 16, 0.5) if number else EVERYWHERE
        things.append(Sheet(vergence, _linear(getattr(data, name)()), form))
    return Layered(f"{before} on {behind}", tuple(things), focus)


def _photograph(folder: Path, focus: float) -> Layered:
    """Return a room with measured depth; vergence from 0 to 20 pixels, `focus` as a fraction of this range."""
    light = _linear(np.asarray(cv2.imread(str(folder / "narrow.jpg")))[:, :, ::-1])
    depth = np.asarray(cv2.imread(str(folder / "depth_mm.png"), cv2.IMREAD_UNCHANGED), float)
    top, left = (depth.shape[0] - WIDE[0]) // 2, (depth.shape[1] - WIDE[1]) // 2
    depth = depth[top : top + WIDE[0], left : left + WIDE[1]]
    vergence = median_filter(1000 / _continued(depth, depth > 0), 9)
    parted = vergence > threshold_otsu(vergence)  # type: ignore[no-untyped-call]
    near = median_filter(parted.astype(np.uint8), 9) > 0
    low, high = np.quantile(vergence, [0.02, 0.98])
    vergence = 20 * (vergence - low) / (high - low)
    form = gaussian_filter(np.kron(near, np.ones((FINE, FINE))), FINE) > 0.5
    things = []
    for where, there in ((~near, EVERYWHERE), (near, form)):
        inner = distance_transform_edt(where) > 3  # boundary pixels mix the light of both layers
        inner = inner if inner.any() else where
        smooth = gaussian_filter(_continued(vergence, inner), 6)
        things.append(
            Sheet(smooth, _continued(light, inner) if there is EVERYWHERE else _continued(light, where), there)
        )
    return Layered(f"room {folder.name}", tuple(things), 20 * focus)


def _continued(values: FloatArray, known: NDArray[np.bool_]) -> FloatArray:
    """Extrapolate values from the nearest known ones."""
    rows, columns = distance_transform_edt(~known, return_distances=False, return_indices=True)
    return np.asarray(values[rows, columns], float)
