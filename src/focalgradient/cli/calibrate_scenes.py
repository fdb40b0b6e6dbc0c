"""``focalgradient calibrate SCENES.toml``: calibration from ordinary photographs with depth maps of their scenes."""

from __future__ import annotations

import math
import warnings
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from focalgradient.cli.program import placing, progress, show, warnings_given, writable
from focalgradient.errors import FocalGradientWarning, InputError
from focalgradient.files import printable, refuse_overwriting
from focalgradient.psf import Psf

if TYPE_CHECKING:
    from focalgradient.calibration import KnownScene, SceneFit, SceneScore
    from focalgradient.photographs.known_scenes import KnownScenes

__all__ = ["calibrate_scenes"]

LEAST_HELD_OUT = 4
"""Minimum number of scenes for testing a fit to one half of them on the other half."""


def calibrate_scenes(path: Path, out: Path, psf: Psf) -> None:
    """Fit a camera to scenes of known depth, print it with predictions of left-out scenes, and write it."""
    from focalgradient.calibration import LEAST_SCENE_SHARE
    from focalgradient.photographs import Calibrated, camera_toml, load_known_scenes

    known = load_known_scenes(path)
    refuse_overwriting([path, *known.files], [out])
    writable(out.parent, (out.name,))
    shots, scenes, names = known.scenes, [], []
    with progress(len(shots) + 1) as say, warnings_given():
        for group in shots:
            name = printable(group[0].depth.parent.name + "/" + group[0].depth.name)
            say(name)
            scene = _quietly(known, group, psf)
            if scene is not None and scene.depth.valid.mean() >= LEAST_SCENE_SHARE:
                scenes.append(scene)
                names.append(name)
        if not scenes:
            raise InputError(
                "no scene gave depth from blur: use scenes with texture, without saturation, at two f-numbers that "
                "differ by at least two stops."
            )
        say("fitting the camera")
        fit = known.fit(scenes, psf)
        held_out = _held_out(known, scenes, psf)
        if len(scenes) < LEAST_HELD_OUT:
            warnings.warn(
                f"only {len(scenes)} of {len(shots)} scenes gave depth from blur, too few to test the calibration on "
                "left-out scenes: add scenes.",
                FocalGradientWarning,
                stacklevel=1,
            )
    text = camera_toml(Calibrated(sensor=known.camera.only, calibration=fit.calibration))
    with placing([out], out) as hidden:
        hidden[out].write_bytes(text.encode())
    show(
        _found(fit, names, held_out) | {"scenes": len(shots), "written": printable(out)},
        *_lines(fit, names, len(shots)),
        *_predicted(names, held_out),
        f"Written: {printable(out)}",
    )


def _quietly(known: KnownScenes, group: Sequence[Any], psf: Psf) -> KnownScene | None:
    """Return the depth of a scene, without warnings; None if its views cannot be compared."""
    from focalgradient.photographs.known_scenes import UnusableSceneError

    with warnings.catch_warnings():
        warnings.simplefilter("ignore", FocalGradientWarning)
        try:
            return known.read(list(group), psf)
        except UnusableSceneError:
            return None


def _held_out(known: KnownScenes, scenes: Sequence[KnownScene], psf: Psf) -> list[SceneScore | None]:
    """Score each scene's prediction by a fit to the half of the scenes that it does not belong to."""
    from focalgradient.calibration import score_scene

    found: list[SceneScore | None] = [None] * len(scenes)
    if len(scenes) < LEAST_HELD_OUT:
        return found
    shots = known.scenes[0]
    marks = [(shot.f_number, shot.focus_distance_m) for shot in shots]
    for half in (0, 1):
        try:
            fit = known.fit(list(scenes[1 - half :: 2]), psf)
        except InputError:
            continue
        for place in range(half, len(scenes), 2):
            found[place] = score_scene(scenes[place], fit, marks)
    return found


def _lines(fit: SceneFit, names: Sequence[str], count: int) -> list[str]:
    """Return lines with the camera's parameters and standard deviations."""
    camera = fit.calibration
    (mark, vergence), sd = next(iter(camera.focus.items())), camera.sd
    focus_sd = math.sqrt(max(sd[-1] ** 2 - fit.repeat**2, 0.0))
    lines = [
        f"{len(names)} of {count} scenes gave depth from blur.",
        f"Focus marked {mark:g} m: {vergence:.4f} +- {focus_sd:.4f} D, which is {1 / vergence - camera.offset:.3f} m "
        f"from the plane of the depth maps; it varies between scenes by {fit.repeat:.3f} D (SD).",
        f"Offset of the entrance pupil: {camera.offset:+.3f} +- {sd[2]:.3f} m",
    ]
    for number, (f_mark, effective) in enumerate(camera.f_numbers.items(), 3):
        lines.append(f"f-number marked {f_mark:g}: {effective:.3f} +- {effective * sd[number]:.3f}")
    field = " ".join(f"{value:+.3f}" for value in camera.field.blur)
    lines.append(f"Blur over the field, of x, y, x^2, x y, y^2 (relative): {field}")
    lines.append(f"Scatter of pixels around the fit: {fit.scatter:.3f} D")
    return lines


def _predicted(names: Sequence[str], scores: Sequence[SceneScore | None]) -> list[str]:
    """Return a table of scenes as predicted from the other half, and its medians."""
    known = [score for score in scores if score is not None]
    if not known:
        return []
    lines = [f"{'Predicted by the other half':34}{'bias, D':>9}{'median error':>14}{'within 2 sd':>13}"]
    for name, score in zip(names, scores, strict=True):
        if score is not None:
            lines.append(f"{name:34.34}{score.bias:>+9.3f}{score.median_error:>14.1%}{score.within_2_sd:>13.1%}")
    bias, error, within = (
        float(np.median([getattr(score, key) for score in known])) for key in ("bias", "median_error", "within_2_sd")
    )
    lines.append(f"{'Median of scenes':34}{bias:>+9.3f}{error:>14.1%}{within:>13.1%}")
    return lines


def _found(fit: SceneFit, names: Sequence[str], scores: Sequence[SceneScore | None]) -> dict[str, Any]:
    """Return the parameters for programs."""
    camera = fit.calibration
    return {
        "k": camera.k,
        "offset_m": camera.offset,
        "f_numbers": [{"marked": mark, "effective": value} for mark, value in camera.f_numbers.items()],
        "focus": [{"marked_m": mark, "vergence_dioptres": value} for mark, value in camera.focus.items()],
        "focus_repeat_dioptres": fit.repeat,
        "sd": list(camera.sd),
        "share_known_from_the_views": list(camera.informed),
        "blur_over_the_field": list(camera.field.blur),
        "scatter_dioptres": fit.scatter,
        "held_out": [
            None
            if score is None
            else {
                "scene": name,
                "bias_dioptres": score.bias,
                "median_relative_error": score.median_error,
                "mean_relative_error": score.mean_error,
                "within_2_sd": score.within_2_sd,
            }
            for name, score in zip(names, scores, strict=True)
        ],
    }
