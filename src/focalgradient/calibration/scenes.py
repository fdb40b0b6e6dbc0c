"""Calibration of a camera from ordinary scenes of known depth: from a depth camera, a phone, or stereo.

Depth maps of the scenes, computed with the marks on the lens, differ from the truth by few parameters. With V_0 the
marked focus, a the ratio of true to marked aperture, b(x, y) the variation of blur over the field, V_f the true focus
and d the distance,

    V - V_0 = a (1 + b(x, y)) (1 / (d + offset) - V_f - e)

where e is the deviation of the focus in one scene. Views with one focus determine only the magnitude of the left side;
its sign is taken from the depth camera. One robust fit over all scenes estimates all parameters, under the priors of
`Priors`. The depth camera has errors proportional to distance, and large errors near depth discontinuities and in
filled holes: pixels near discontinuities are excluded, and other outliers are downweighted (Cauchy weights).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import maximum_filter, minimum_filter

from focalgradient.arrays import FloatArray
from focalgradient.calibration.camera import Calibration, Field
from focalgradient.calibration.field import apply_calibration
from focalgradient.calibration.fit import Priors
from focalgradient.depth.depth_map import DepthMap
from focalgradient.errors import InputError
from focalgradient.psf import Psf
from focalgradient.view import View

__all__ = ["LEAST_SCENE_SHARE", "KnownScene", "SceneFit", "SceneScore", "fit_scenes", "score_scene"]


STRIDE = 8
"""Spacing of the sampled pixels, in pixels: the default window, within which errors are correlated."""

LEAST_SCENE_SHARE = 0.01
"""Minimum fraction of a scene's pixels with a valid depth from blur."""

LEAST_PIXELS = 30
"""Minimum number of pixels per scene."""

JUMP, BESIDE_JUMP = 0.05, 6
"""Relative difference in distance between neighbours that counts as a depth discontinuity, and margin in pixels that is
excluded around it: depth cameras blur and displace boundaries by a few pixels.
"""

LEAST_BLUR = 0.7
"""Minimum blur radius in the most blurred view (pixels) of the pixels used: below, only its square is known."""

DEPTH_ERROR = 0.01
"""Relative error of a depth camera, in addition to its quantisation: 1 to 3 % beyond 3 m, less at closer range."""

REPEAT, REPEAT_WEIGHT = 0.012, 2.0
"""Prior standard deviation (D) of the focus between scenes (measured in 29 rooms of one camera), and its weight as a
number of scenes.
"""

CORRELATED = 16.0
"""Number of pixels at `STRIDE` that count as one: depth errors are correlated over about four windows each way."""

BLUR_SD = 0.05
"""Prior standard deviation of each relative coefficient of blur over the field."""

CAUCHY = 2.0
"""Residual, in standard deviations, at which the weight is one half."""

ROUNDS = 30
"""Maximum number of iterations of the fit."""


@dataclass(frozen=True, slots=True, eq=False)
class KnownScene:
    """Scene with a depth map computed from the lens marks, and one from a depth camera.

    Parameters
    ----------
    depth
        Depth map by the default method from `views`, whose lenses are as marked.
    views
        Views with the same focus and at least two f-numbers.
    distance
        Distance by the depth camera at the pixels of the first view, in metres; NaN if missing.
    step
        Quantisation step of `distance` in metres.
    """

    depth: DepthMap
    views: Sequence[View]
    distance: FloatArray
    step: float = 0.0


@dataclass(frozen=True, slots=True)
class SceneScore:
    """Agreement between a calibrated camera and a depth camera in one scene: medians, and fractions of pixels."""

    pixels: int
    bias: float  # D
    median_error: float  # relative
    mean_error: float  # relative
    within_2_sd: float


@dataclass(frozen=True, slots=True, eq=False)
class SceneFit:
    """Camera estimated from scenes of known depth.

    Parameters
    ----------
    calibration
        Camera; the variance of its focus includes that between scenes.
    repeat
        Standard deviation of the focus between scenes, in dioptres.
    scatter
        Robust scatter of the pixels around the fit, in dioptres.
    """

    calibration: Calibration
    repeat: float
    scatter: float


@dataclass(frozen=True, slots=True, eq=False)
class _Pixels:
    scene: NDArray[np.intp]
    marked: FloatArray  # V - V_0 by the marks
    distance: FloatArray
    sd: FloatArray
    terms: FloatArray  # 5 x N


def _away_from_jumps(distance: FloatArray) -> NDArray[np.bool_]:
    """Return a mask of pixels without a discontinuity or hole of the depth camera's map within `BESIDE_JUMP` pixels."""
    log = np.log(np.where(np.isfinite(distance) & (distance > 0), distance, 1.0))
    jump = (maximum_filter(log, 3) - minimum_filter(log, 3) > JUMP) | ~np.isfinite(distance)
    return np.asarray(~maximum_filter(jump, 2 * BESIDE_JUMP + 1), bool)


def _pixels(scenes: Sequence[KnownScene]) -> _Pixels:
    rows = []
    for number, scene in enumerate(scenes):
        usable = scene.depth.valid & _away_from_jumps(scene.distance)
        i, j = (place[usable[::STRIDE, ::STRIDE]] * STRIDE for place in np.indices(usable[::STRIDE, ::STRIDE].shape))
        distance = scene.distance[i, j]
        lens = scene.views[0].optics
        slope = max(view.optics.aperture_diameter for view in scene.views) / 2 / scene.views[0].pixel_angle
        kept = slope * np.abs(1 / distance - lens.focus_vergence) > LEAST_BLUR
        i, j, distance = i[kept], j[kept], distance[kept]
        x, y = Field.coordinates(scene.depth.shape)
        marked = np.copysign(scene.depth.vergence[i, j] - lens.focus_vergence, 1 / distance - lens.focus_vergence)
        camera = np.hypot(DEPTH_ERROR / distance, scene.step / math.sqrt(12) / distance**2)
        sd = np.hypot(scene.depth.vergence_sd[i, j], camera)
        terms = Field.terms(x[0, j], y[i, 0])
        if len(i) >= LEAST_PIXELS:
            rows.append(np.concatenate([np.full((1, len(i)), number), marked[None], distance[None], sd[None], terms]))
    if not rows:
        raise InputError(
            f"no scene has {LEAST_PIXELS} places with both depth by blur and a measured distance, away from outlines "
            "and focus: add scenes with texture, at other distances than the focus."
        )
    table = np.concatenate(rows, axis=1)
    return _Pixels(table[0].astype(int), table[1], table[2], table[3], table[4:])


def fit_scenes(
    scenes: Sequence[KnownScene],
    focal_length: float,
    pixel_pitch: float,
    f_numbers: Sequence[float],
    focus_distance: float,
    priors: Priors,
    psf: Psf,
) -> SceneFit:
    """Fit one camera to scenes of known depth.

    Parameters
    ----------
    scenes
        Scenes with a common focus mark.
    focal_length, pixel_pitch
        Values in metres.
    f_numbers, focus_distance
        Marked f-numbers of all scenes, and marked focus distance in metres.
    priors
        Priors; `k_sd` and `f_number_sd` together are that of the common scale of the apertures, `focus_sd` that of the
        focus.
    psf
        Shape of the blur with which the maps were made.

    Raises
    ------
    InputError
        If no scene has enough pixels.
    """
    pixels = _pixels(scenes)
    marked_focus = float(scenes[0].views[0].optics.focus_vergence)
    names = np.unique(pixels.scene)
    place = np.searchsorted(names, pixels.scene)
    scale_sd, focus_sd = math.hypot(priors.k_sd, priors.f_number_sd), priors.focus_sd * max(marked_focus, 0.05)
    # parameters: log scale, focus, offset, five terms of blur over the field, focus deviation of each scene
    prior_mean = np.concatenate([[0.0, marked_focus, priors.offset], np.zeros(5 + len(names))])
    theta = prior_mean.copy()
    repeat, extra, alike = REPEAT, 0.0, np.ones(len(names))
    for _ in range(ROUNDS):
        prior_sd = np.concatenate(
            [[scale_sd, focus_sd, priors.offset_sd], np.full(5, BLUR_SD), repeat / np.sqrt(alike)]
        )
        residual, jacobian = _residuals(pixels, place, theta)
        sd = np.hypot(pixels.sd, extra)
        weight = 1 / (1 + (residual / (CAUCHY * sd)) ** 2) / sd**2 / CORRELATED
        normal = jacobian.T @ (weight[:, None] * jacobian) + np.diag(prior_sd**-2.0)
        step = np.linalg.solve(normal, -jacobian.T @ (weight * residual) - (theta - prior_mean) / prior_sd**2)
        theta = theta + step
        covariance = np.linalg.inv(normal)
        own, own_variance = theta[8:], np.diag(covariance)[8:]
        alike = 1 / (1 + (own / (CAUCHY * repeat)) ** 2)  # downweights scenes whose depth is wrong as a whole
        repeat = math.sqrt(
            (REPEAT_WEIGHT * REPEAT**2 + float((alike * (own**2 + own_variance)).sum())) / (REPEAT_WEIGHT + alike.sum())
        )
        scatter = 1.48 * float(np.median(np.abs(residual)))
        extra = math.sqrt(max(scatter**2 - float(np.median(pixels.sd)) ** 2, 0.0))
        if np.abs(step[:3]).max() < 1e-7:
            break
    marks = sorted(set(f_numbers))
    source = [0, 0, 2, *[0] * len(marks), 1]
    sign = np.array([0, 0, 1, *[-1] * len(marks), 1])
    joint = np.outer(sign, sign) * covariance[np.ix_(source, source)]
    informed = abs(sign) * np.clip(1 - np.diag(joint) / prior_sd[source] ** 2, 0, 1)
    joint[-1, -1] += repeat**2
    inside = pixels.terms[:2]
    field = Field(
        blur=tuple(float(value) for value in theta[3:8]),
        bounds=(float(inside[0].min()), float(inside[0].max()), float(inside[1].min()), float(inside[1].max())),
    )
    calibration = Calibration(
        focal_length=focal_length,
        pixel_pitch=pixel_pitch,
        k=psf.stated().get("k", 0.5),
        own=0.0,
        offset=float(theta[2]),
        f_numbers={mark: mark * math.exp(-theta[0]) for mark in marks},
        focus={focus_distance: float(theta[1])},
        model_error=0.0,
        covariance=joint,
        informed=informed,
        telecentric=priors.telecentric,
        psf=psf,
        field=field,
    )
    return SceneFit(calibration, repeat, scatter)


def _residuals(pixels: _Pixels, place: NDArray[np.intp], theta: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the residual of each pixel (D), and its derivatives by the parameters."""
    scale = math.exp(theta[0])
    optical = np.maximum(pixels.distance + theta[2], 1e-3)
    defocus = 1 / optical - theta[1] - theta[8 + place]
    field = 1 + theta[3:8] @ pixels.terms
    law = scale * field * defocus
    jacobian = np.zeros((law.size, theta.size))
    jacobian[:, 0] = law
    jacobian[:, 1] = -scale * field
    jacobian[:, 2] = -scale * field / optical**2
    jacobian[:, 3:8] = (scale * defocus * pixels.terms).T
    jacobian[np.arange(law.size), 8 + place] = -scale * field
    return law - pixels.marked, jacobian


def score_scene(scene: KnownScene, fit: SceneFit, marks: Sequence[tuple[float, float]]) -> SceneScore | None:
    """Score a fit on a scene that was not used for it; None if the scene has too few pixels.

    The scene's map, computed with the marks on the lens, is converted to the fitted camera, which is exact for views
    with one focus.
    """
    camera = fit.calibration
    marked = scene.views[0].optics.focus_vergence
    lenses = [camera.lens(*mark) for mark in marks]
    share = lenses[0].aperture_diameter / scene.views[0].optics.aperture_diameter
    vergence = lenses[0].focus_vergence + (scene.depth.vergence - marked) / share
    views = [replace(view, optics=lens) for view, lens in zip(scene.views, lenses, strict=True)]
    moved = replace(scene.depth, vergence=vergence, vergence_sd=scene.depth.vergence_sd / share)
    found = apply_calibration(moved, views, camera, marks)
    true = 1 / (scene.distance + camera.offset)
    on_side = (true < marked) == (np.nanmedian(true) < marked)  # depth is estimated on one side of focus only
    use = found.valid & on_side & _away_from_jumps(scene.distance)
    if use.sum() < LEAST_PIXELS * STRIDE**2:
        return None
    true = true[use]
    off = found.vergence[use] - true
    relative = np.abs((found.distance[use] / scene.distance[use]) - 1)
    camera_sd = DEPTH_ERROR * true
    sd = np.hypot(found.total_sd[use], camera_sd)
    return SceneScore(
        int(use.sum()),
        float(np.median(off)),
        float(np.median(relative)),
        float(np.mean(np.minimum(relative, 1.0))),
        float((np.abs(off) < 2 * sd).mean()),
    )
