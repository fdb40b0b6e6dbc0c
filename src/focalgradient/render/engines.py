"""Rendering of scenes, with ground truth, by interchangeable engines.

==========  ======================================================================================================
engine      radiance along a ray
==========  ======================================================================================================
``path``    Path tracing by Mitsuba, with global illumination: surfaces illuminate and shade each other. For pictures
        to be viewed.
``shaded``  Mitsuba; at the first surface that is not a mirror, albedo x (ambient + sun, unless in shadow).
        The only noise is that of the lens samples. For images to be measured.
``cast``    The same by the package's ray caster, for planes and spheres: needs no Mitsuba, and is fast.
``auto``    ``cast`` if the scene allows, otherwise ``shaded``.
==========  ======================================================================================================

All use the same finite thin lens: blur and occlusion follow from ray geometry.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import cache
from typing import Literal, TypedDict, Unpack, get_args

import numpy as np
from numpy.typing import NDArray

from focalgradient.errors import InputError, check_list, check_one_of, warn
from focalgradient.optics import Optics
from focalgradient.progress import Progress, part_of, silent
from focalgradient.render import pathtrace
from focalgradient.render.ground_truth import ground_truth
from focalgradient.render.mitsuba_backend import LLVM, REMEDY, variant
from focalgradient.render.raycast import cast, castable, check_frame
from focalgradient.render.rendered import LUMINANCE, Rendered
from focalgradient.scenes.objects import Scene, check_scene
from focalgradient.view import View

__all__ = ["Engine", "render", "render_bands", "render_series"]

Engine = Literal["auto", "path", "shaded", "cast"]


class Sampling(TypedDict, total=False):
    """How scenes are sampled: keywords of `render_series`, with its defaults."""

    engine: Engine
    samples: int
    seed: int
    progress: Progress | None


def render(
    scene: Scene,
    optics: Optics,
    shape: tuple[int, int],
    pixel_angle: float,
    **sampling: Unpack[Sampling],
) -> Rendered:
    """Render a scene through a finite thin lens, with ground truth and an estimate of sampling noise.

    The sensor is a plane: pixel (row i, column j) of H x W looks in the direction
    ((j - (W-1)/2) pixel_angle, (i - (H-1)/2) pixel_angle, 1). A pixel's value is the mean over its square.

    Parameters
    ----------
    scene
        The scene to render.
    optics
        A `Lens`, an eye, or any object with an `aperture_diameter` (m) and a `focus_vergence` (D, any sign).
    shape
        Height and width in pixels.
    pixel_angle
        Angle in radians subtended by one pixel on the axis: pixel pitch / sensor distance.
    engine
        Rendering engine, see above; by default ``"auto"``. Without Mitsuba, planes and spheres are ray cast instead,
        with one warning.
    samples
        Rays per pixel, in two independent halves (so at least 2; powers of 2 are best): 64 for measurement, the
        default; 256 for viewing.
    seed
        Random seed of the rays. With the same seed, two optics are sampled identically, so that a change of focus is
        the only difference.
    progress
        Callback that receives the fraction done, 0 to 1, and a short description.

    Returns
    -------
    Rendered
        View, ground truth and noise; in colour unless by ``cast``.

    Raises
    ------
    InputError
        If the engine is unknown or unavailable, the frame, pixel angle or number of samples is not positive, or the
        optics are not finite.

    Examples
    --------
    >>> from focalgradient import Lens
    >>> from focalgradient.scenes import plane
    >>> lens = Lens(focal_length=0.025, f_number=4, focus_distance=1.0)
    >>> rendered = render(plane(2.0), lens, (48, 64), pixel_angle=3e-4)
    >>> rendered.view.shape, float(rendered.distance[0, 0]), rendered.noise < 0.01
    ((48, 64), 2.0, True)
    """
    return render_series(scene, [optics], shape, pixel_angle, **sampling)[0]


def render_series(
    scene: Scene,
    optics: Sequence[Optics],
    shape: tuple[int, int],
    pixel_angle: float,
    *,
    engine: Engine = "auto",
    samples: int = 64,
    seed: int = 0,
    progress: Progress | None = None,
) -> list[Rendered]:
    """Render a scene through several optics, such as an accommodating eye, with the same rays.

    Parameters are as for `render`; there is one result per element of `optics`, in order, all with the same ground
    truth.

    Examples
    --------
    >>> from focalgradient import Lens
    >>> from focalgradient.scenes import plane
    >>> lenses = [Lens(focal_length=0.025, f_number=4, focus_distance=z) for z in (1.0, 1.1)]
    >>> near, far = render_series(plane(1.0), lenses, (48, 64), pixel_angle=3e-4)
    >>> float(near.view.image.std()) > float(far.view.image.std())  # the first has the wall in focus
    True
    """
    check_scene(scene)
    optics = check_list("optics", optics, "lenses or eyes")
    if not optics:
        raise InputError("optics is empty, but at least one lens or eye must be given.")
    for one in optics:
        check_frame(one, shape, pixel_angle, samples, seed)
    if samples < 2:
        raise InputError("samples is 1, but noise is estimated from two halves of the samples: give 2 or more.")
    chosen, how = _choose(engine, scene)
    results: list[Rendered] = []
    for one in optics:
        share = part_of(progress or silent, len(results), len(optics))
        frame = scene, one, shape, pixel_angle
        if chosen == "cast":
            parts = [
                cast(*frame, samples=samples // 2, seed=2 * seed + n, progress=part_of(share, n, 2)) for n in (0, 1)
            ]
            first, second = (part.view.image.astype(np.float32) for part in parts)
            distance, vergence = parts[0].distance, None
        else:
            first, second = pathtrace.halves(
                *frame, traced=chosen == "path", samples=samples, seed=seed, variant=how, progress=share
            )
            if results:
                distance, vergence = results[0].distance, results[0].vergence
            elif castable(scene):  # in double precision
                distance, vergence = cast(*frame, samples=1).distance, None
            else:
                distance, vergence = ground_truth(scene, shape, pixel_angle, how)
        mean, residual = (((first + way * second) / 2).astype(np.float32) for way in (1, -1))
        if chosen == "cast":
            results.append(Rendered(View(mean, one, pixel_angle), distance, residual=residual))
        else:
            view = View(_luminance(mean), one, pixel_angle)
            results.append(Rendered(view, distance, mean, _luminance(residual), vergence))
    return results


def render_bands(
    scene: Scene,
    optics: Sequence[Optics],
    shape: tuple[int, int],
    pixel_angle: float,
    **sampling: Unpack[Sampling],
) -> list[Rendered]:
    """Render a scene in red, green and blue, each band with its own optics (longitudinal chromatic aberration).

    Parameters are as for `render`, except that `optics` are three: for red, green and blue. Each result's view is the
    radiance in its band, and `colour` is omitted. All use the same rays. Combined, the three views are the colour
    picture formed by such a lens or eye.

    Examples
    --------
    >>> from focalgradient import Lens
    >>> from focalgradient.scenes import plane
    >>> lenses = [Lens(focal_length=0.025, f_number=4, focus_distance=z) for z in (1.2, 1.0, 0.8)]
    >>> bands = render_bands(plane(1.0), lenses, (48, 64), pixel_angle=3e-4)
    >>> int(np.argmax([band.view.image.std() for band in bands]))  # green is in focus
    1
    """
    if len(check_list("optics", optics, "three lenses or eyes")) != 3:
        raise InputError(
            f"optics contains {len(optics)} lenses or eyes, but must contain three: give one each for red, green "
            "and blue light."
        )
    results = render_series(scene, optics, shape, pixel_angle, **sampling)
    return [
        one if one.colour is None else replace(one, view=replace(one.view, image=one.colour[..., band]), colour=None)
        for band, one in enumerate(results)
    ]


def _choose(engine: Engine, scene: Scene) -> tuple[str, str]:
    """Return the engine to use and the Mitsuba variant."""
    check_one_of("engine", engine, get_args(Engine))
    chosen = engine
    if engine == "auto":
        chosen = "cast" if castable(scene) else "shaded"
    if chosen == "cast":
        return "cast", ""
    how = variant()
    if how is None:
        if not castable(scene):
            raise InputError(f"Mitsuba, which this scene needs, cannot be used here: {REMEDY}.")
        _warn_once(f"Mitsuba cannot be used here, so planes and spheres are ray cast instead: {REMEDY}.")
        return "cast", ""
    if how != LLVM:
        _warn_once(
            "Mitsuba runs without LLVM here, which is some four times as slow for path tracing and a hundred times for "
            "shading: install it with 'apt-get install libllvm19'."
        )
    return chosen, how


@cache
def _warn_once(words: str) -> None:
    """Issue a warning once."""
    warn(words)


def _luminance(colour: NDArray[np.float32]) -> NDArray[np.float32]:
    return colour @ np.array(LUMINANCE, np.float32)
