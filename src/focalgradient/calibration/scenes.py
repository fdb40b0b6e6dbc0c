"""A camera from ordinary scenes of known depth: a depth camera's map, a phone's, or one by stereo.

Depth maps of the scenes, made with the marks on the lens, differ from the truth by few numbers. With V_0 the marked
focus, a the true aperture over the marked one, b(x, y) how blur varies over the field, V_f the true focus and d the
distance,

    V - V_0 = a (1 + b(x, y)) (1 / (d + offset) - V_f - e)

where e is what the focus differs by from one scene to another. Views of one focus show the size of the left side only:
its sign is the depth camera's. One robust fit over all scenes gives all, under the priors of `Priors`. The depth camera
errs by a share of distance, and at outlines and where its holes were filled: pixels near its jumps are left out, and
what else does not fit counts little (Cauchy's weights).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from focalgradient.calibration.camera import Calibration, Field
from focalgradient.calibration.fit import Priors
from focalgradient.depth.depth_map import DepthMap
from focalgradient.errors import InputError
from focalgradient.psf import Psf
from focalgradient.view import View

__all__ = ["LEAST_SCENE_SHARE", "KnownScene", "SceneFit", "SceneScore", "fit_scenes", "score_scene"]

FloatArray = NDArray[np.float64]

STRIDE = 8
"""Pixels from one that is used to the next: the default window, within which errors are alike."""

LEAST_SCENE_SHARE = 0.01
"""Share of a scene's pixels that must have a valid depth by blur for it to be used."""

LEAST_PIXELS = 30
"""Pixels that a scene must give."""

JUMP, BESIDE_JUMP = 0.05, 6
"""Relative difference of distance between neighbours that is a jump of the depth camera's map, and the pixels about it
that are left out: depth cameras blur and displace outlines by a few pixels."""

LEAST_BLUR = 0.7
"""Blur radius in the most blurred view (pixels) from which on a pixel is used: below, only its square is known."""

DEPTH_ERROR = 0.01
"""Relative error of a depth camera, beside its step: 1 to 3 % beyond 3 m, less nearer."""

REPEAT, REPEAT_WEIGHT = 0.012, 2.0
"""Standard deviation (D) of the focus from one scene to another as expected (measured on 29 rooms of one camera), and
how many scenes that is worth."""

CORRELATED = 16.0
"""Pixels at `STRIDE` that count as one: errors of depth are alike over a surface, about four windows each way."""

BLUR_SD = 0.05
"""Standard deviation of each coefficient of blur over the field: prior, a share."""

CAUCHY = 2.0
"""Residual, in standard deviations, from which its weight falls below a half."""

ROUNDS = 30
"""Iterations of the fit at most."""


@dataclass(frozen=True, slots=True, eq=False)
class KnownScene:
    """One scene: its depth by the marks on the lens, and by a depth camera.

    Parameters
    ----------
    depth
        By the default method, of `views`, whose lenses are as marked.
    views
        Of one focus, at two f-numbers or more.
    distance
        As the depth camera measured it, on the first view's pixels, in metres; NaN where it did not.
    step
        Quantisation step of `distance` in metres.
    """

    depth: DepthMap
    views: Sequence[View]
    distance: FloatArray
    step: float = 0.0


@dataclass(frozen=True, slots=True)
class SceneScore:
    """How a calibrated camera's depth of one scene agrees with the depth camera's: medians and shares of pixels."""

    pixels: int
    bias: float  # D
    median_error: float  # relative
    mean_error: float  # relative
    within_2_sd: float


@dataclass(frozen=True, slots=True, eq=False)
class SceneFit:
    """What scenes of known depth say of a camera.

    Parameters
    ----------
    calibration
        The camera. The variance of its focus includes what it differs by from scene to scene.
    focus_offsets
        What each scene's focus differs by, in dioptres; NaN of scenes that show too little.
    repeat
        Their standard deviation, in dioptres.
    scatter
        Robust scatter of the pixels about the fit, in dioptres.
    """

    calibration: Calibration
    focus_offsets: FloatArray
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
    """Where no jump of a depth camera's map, and no hole, lies within `BESIDE_JUMP` pixels."""
    from scipy.ndimage import maximum_filter, minimum_filter

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
        All of one focus mark.
    focal_length, pixel_pitch
        In metres.
    f_numbers, focus_distance
        As marked: of all scenes; in metres.
    priors
        `k_sd` and `f_number_sd` together are the prior of one scale of the apertures, `focus_sd` that of the focus.
    psf
        Shape of the blur that the maps were made by.

    Raises
    ------
    InputError
        If no scene shows enough.
    """
    pixels = _pixels(scenes)
    marked_focus = float(scenes[0].views[0].optics.focus_vergence)
    names = np.unique(pixels.scene)
    place = np.searchsorted(names, pixels.scene)
    scale_sd, focus_sd = math.hypot(priors.k_sd, priors.f_number_sd), priors.focus_sd * max(marked_focus, 0.05)
    # Log scale, focus, offset, five terms of blur over the field, each scene's focus.
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
        alike = 1 / (1 + (own / (CAUCHY * repeat)) ** 2)  # a scene whose depth is wrong as a whole counts little
        repeat = math.sqrt(
            (REPEAT_WEIGHT * REPEAT**2 + float((alike * (own**2 + own_variance)).sum())) / (REPEAT_WEIGHT + alike.sum())
        )
        scatter = 1.48 * float(np.median(np.abs(residual)))
        extra = math.sqrt(max(scatter**2 - float(np.median(pixels.sd)) ** 2, 0.0))
        if np.abs(step[:3]).max() < 1e-7:
            break
    offsets = np.full(len(scenes), np.nan)
    offsets[names] = theta[8:]
    marks = sorted(set(f_numbers))
    change = np.zeros((3 + len(marks) + 1, 8))
    change[2, 2] = 1
    change[3 : 3 + len(marks), 0] = -1
    change[-1, 1] = 1
    joint = change @ covariance[:8, :8] @ change.T
    prior = np.maximum(np.diag(change @ np.diag(prior_sd[:8] ** 2) @ change.T), 1e-30)
    informed = np.clip(1 - np.diag(joint) / prior, 0, 1)
    informed[:2] = 0
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
    return SceneFit(calibration, offsets, repeat, scatter)


def _residuals(pixels: _Pixels, place: NDArray[np.intp], theta: FloatArray) -> tuple[FloatArray, FloatArray]:
    """What the law leaves of each pixel (D), and its derivatives by the parameters."""
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
    """Return how a fit predicts a scene that was left out of it; None where the scene shows too little.

    The scene's map, made by the marks on the lens, is brought to the fitted camera: for views of one focus that is
    exact.
    """
    from focalgradient.calibration.field import apply_calibration

    camera = fit.calibration
    marked = scene.views[0].optics.focus_vergence
    lenses = [camera.lens(*mark) for mark in marks]
    share = lenses[0].aperture_diameter / scene.views[0].optics.aperture_diameter
    vergence = lenses[0].focus_vergence + (scene.depth.vergence - marked) / share
    views = [replace_optics(view, lens) for view, lens in zip(scene.views, lenses, strict=True)]
    moved = replace(scene.depth, vergence=vergence, vergence_sd=scene.depth.vergence_sd / share)
    found = apply_calibration(moved, views, camera, marks)
    true = 1 / (scene.distance + camera.offset)
    on_side = (true < marked) == (np.nanmedian(true) < marked)  # the other side is not searched
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


def replace_optics(view: View, optics: object) -> View:
    """Return a view with other optics."""
    return View(view.image, optics, view.pixel_angle, mask=view.mask)  # type: ignore[arg-type]
