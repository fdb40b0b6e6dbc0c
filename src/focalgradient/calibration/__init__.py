"""Calibration of a camera's blur from views of a flat target with sharp edges at known distances.

The marks on a lens give its blur to within 10 %; a target is more accurate. Along its edges the blur on the sensor has
the variance w^2 = (k r)^2 + own, where ``r = (F / 2N) |V_f - V| v0`` is the radius of the blur disc (Pentland 1987,
Eqs. 12-16, in vergence) and V = 1 / (distance + offset). Unknown are k (sigma / disc radius), the residual blur
variance `own` (negative if the camera sharpens its pictures), the offset between the reference plane of distances and
the entrance pupil, the effective f-number N of each setting, and the focus vergence V_f.

Views do not determine all of these: only the product k / N is identifiable, and two distances leave the offset
undetermined. Therefore each parameter has a prior, as wide as a photographer's knowledge; the posterior mode is
returned with its joint covariance, and with the fraction of each prior variance that the views removed.
"""

from focalgradient.calibration.camera import Calibration, Field, Prediction, Reading, disc_radius
from focalgradient.calibration.dual_pixel import DualPixelFit, calibrate_dual_pixel
from focalgradient.calibration.field import FieldFit, apply_calibration, fit_field
from focalgradient.calibration.fit import EDGE_K, Priors, calibrate, cross_validate
from focalgradient.calibration.pairs import PairBlur, calibrate_pairs, likeliest_shape, pair_blur, pair_priors, shape_k
from focalgradient.calibration.scenes import (
    LEAST_SCENE_SHARE,
    KnownScene,
    SceneFit,
    SceneScore,
    fit_scenes,
    score_scene,
)
from focalgradient.calibration.slips import Slip, check_predictions, likeliest_slips, prediction_errors, refuse_slips
from focalgradient.calibration.target import TargetBlur, measure_target, read_target

__all__ = [
    "EDGE_K",
    "LEAST_SCENE_SHARE",
    "Calibration",
    "DualPixelFit",
    "Field",
    "FieldFit",
    "KnownScene",
    "PairBlur",
    "Prediction",
    "Priors",
    "Reading",
    "SceneFit",
    "SceneScore",
    "Slip",
    "TargetBlur",
    "apply_calibration",
    "calibrate",
    "calibrate_dual_pixel",
    "calibrate_pairs",
    "check_predictions",
    "cross_validate",
    "disc_radius",
    "fit_field",
    "fit_scenes",
    "likeliest_shape",
    "likeliest_slips",
    "measure_target",
    "pair_blur",
    "pair_priors",
    "prediction_errors",
    "read_target",
    "refuse_slips",
    "score_scene",
    "shape_k",
]
