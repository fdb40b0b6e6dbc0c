"""Depth near occlusion boundaries seen by an eye, with views from wave optics and from rays.

    python benchmarks/eye_at_outlines.py [--seeds N] [--kinds bands moments] [--models wave disc] [--scenes NAME ...]

An eye with a pupil of 4 mm, focused at FOCUS, sees a step between two walls, and the spheres of `focalgradient.scenes`,
in frames of 192 x 256 arcmin; noise 1 %, textures of the bands correlated at 0.95. Errors (D) are those of valid pixels
by distance from the nearest boundary, in blur radii: the radius of the more blurred surface at that boundary in the
more blurred view. A boundary is a change of vergence above JUMP between neighbouring pixels.
"""

from __future__ import annotations

import argparse
from dataclasses import replace

import numpy as np
from scipy import ndimage

from focalgradient import recover_depth
from focalgradient.eye import Cones, Eye, Oscillation, eye_views
from focalgradient.eye.cones import S_FINEST_CPD
from focalgradient.scenes import Scene, spheres, step

PIXEL, SHAPE = np.radians(1 / 60), (192, 256)
FOCUS, PUPIL, NOISE, CORRELATION = 1.0, 0.004, 0.01, 0.95
PAIR = (0.125, 0.375)
"""Times of the views in seconds: the extremes of an oscillation of 0.5 D at 2 Hz."""

JUMP = 0.1
"""Minimum change between neighbouring pixels (D) of a boundary: 0.7 pixel of blur, above all surface slopes except at
rims.
"""


def scenes(seed: int) -> dict[str, Scene]:
    """Return steps on either side of focus and across it, and spheres."""
    return {
        "step 1.8/0.4 D": step(1 / 1.8, 1 / 0.4, seed=seed),
        "step 1.8/1.2 D": step(1 / 1.8, 1 / 1.2, seed=seed),
        "step 0.8/0.2 D": step(1 / 0.8, 1 / 0.2, seed=seed),
        "spheres": spheres(seed, field=SHAPE[1] * PIXEL),
    }


def radii_away(distance: np.ndarray, cones: list[Cones]) -> np.ndarray:
    """Return the distance from each pixel to the nearest boundary, in blur radii; infinite without boundaries."""
    vergence = 1 / distance
    jumps = ndimage.maximum_filter(vergence, 3) - ndimage.minimum_filter(vergence, 3) > JUMP
    blur = np.max([np.abs(one.focus_vergence - vergence) * PUPIL / 2 / PIXEL for one in cones], axis=0)
    blur = np.maximum(ndimage.maximum_filter(blur, 3), 1.0)
    if not jumps.any():
        return np.full(distance.shape, np.inf)
    away, (row, column) = ndimage.distance_transform_edt(~jumps, return_indices=True)
    return away / blur[row, column]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, default=2)
    parser.add_argument("--kinds", nargs="+", default=["bands", "moments"], choices=["bands", "moments"])
    parser.add_argument("--models", nargs="+", default=["wave", "disc"], choices=["wave", "disc"])
    parser.add_argument("--scenes", nargs="+")
    given = parser.parse_args()
    eye = Eye(PUPIL, FOCUS)
    print(
        "scene           views    by      valid %  |  within 1 radius  1 to 2   beyond 2: median   95 %  off .05 D %"
        "  in 2 sd %"
    )
    for name in given.scenes or scenes(0):
        for kind in given.kinds:
            if kind == "bands":
                cones = [Cones.of(eye, "L+M"), Cones.of(eye, "S", finest_cpd=S_FINEST_CPD)]
            else:
                cones = [Cones.of(one, "L+M") for one in eye.through(PAIR, Oscillation())]
            for model in given.models:
                taken = [replace(one, model=model) for one in cones]
                errors, over, away, claimed = [], [], [], []
                for seed in range(given.seeds):
                    views = eye_views(
                        scenes(seed)[name], taken, SHAPE, PIXEL, noise=NOISE, correlation=CORRELATION, seed=seed
                    )
                    depth = recover_depth([one.view for one in views])
                    error = np.abs(depth.vergence - 1 / views[0].distance)
                    errors.append(error[depth.valid])
                    over.append((error / depth.vergence_sd)[depth.valid])
                    away.append(radii_away(views[0].distance, taken)[depth.valid])
                    claimed.append(depth.valid.mean())
                error, ratio, far = (np.concatenate(some) for some in (errors, over, away))
                near, middle, clear = far < 1, (far >= 1) & (far < 2), far >= 2

                def median(some: np.ndarray) -> float:
                    return float(np.median(some)) if some.size else np.nan

                print(
                    f"{name:15} {kind:8} {model:6} {100 * np.mean(claimed):7.0f}  | {median(error[near]):14.3f} "
                    f"{median(error[middle]):8.3f} {median(error[clear]):17.3f} "
                    f"{np.quantile(error[clear], 0.95) if clear.any() else np.nan:8.3f} "
                    f"{100 * np.mean(error[clear] > 0.05):10.1f} {100 * np.mean(ratio[clear] <= 2):10.1f}",
                    flush=True,
                )


if __name__ == "__main__":
    main()
