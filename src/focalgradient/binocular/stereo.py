"""Stereo rendering: from a scene, or a picture with depth, to the views of two eyes.

The eyes lie at -I/2 and I/2, a distance I apart, both looking straight ahead through one window: the plane of zero
disparity at vergence V0, as on a screen. A point at vergence V that the midpoint sees at x (a tangent, to the right)
appears at x + I/2 (V - V0) in the left eye's view and at x - I/2 (V - V0) in the right eye's: its disparity is I (V -
V0).
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from focalgradient.arrays import FloatArray, Mask
from focalgradient.binocular.pair import EyeView, StereoPair
from focalgradient.binocular.warp import monocular, sample, warp
from focalgradient.errors import InputError, check_number, described, warn
from focalgradient.optics import Lens, Optics, check_optics, own_blur
from focalgradient.progress import Progress, part_of, silent
from focalgradient.render import blur_picture, cast
from focalgradient.render.blurred import checked_picture
from focalgradient.scenes.objects import Scene

__all__ = ["INTEROCULAR", "stereo"]

INTEROCULAR = 0.063
"""Mean adult interocular distance in metres (Dodgson, Proc SPIE 5291, 2004)."""

Distances = float | ArrayLike | Callable[[FloatArray], ArrayLike]
"""Distances in metres: one value, one per pixel, or a function of the true distances."""

PINHOLE = Lens(0.017, math.inf, 1.0)
"""Pinhole lens for rendering without blur."""

MAX_INPAINTED_FRACTION = 0.25
"""Fraction of inpainted pixels in a view above which a warning is issued."""


class _Seen(NamedTuple):
    """One eye's radiance, true distance (m), distance for blur (m), vergence for disparity (D), inpainting mask."""

    light: NDArray[np.float32]
    distance: FloatArray
    blurred: FloatArray
    placed: FloatArray
    is_invented: Mask


@dataclass(frozen=True, slots=True)
class _Eyes:
    """Optics and positions of the eyes, plane of zero disparity (D), and blur."""

    optics: tuple[Optics, Optics]
    interocular: float
    vergence: float
    pixel_angle: float
    blur: bool
    blur_distance: Distances | None
    say: Progress

    def disparity(self, vergence: FloatArray) -> FloatArray:
        """Return the disparity in radians of a vergence in dioptres."""
        return np.asarray(self.interocular * (vergence - self.vergence))

    def cast(self, scene: Scene, rays: dict[str, Any]) -> StereoPair:
        """Return the pair, with each eye's view ray cast from its own position."""
        if self.blur_distance is not None and not callable(self.blur_distance) and np.ndim(self.blur_distance) > 0:
            raise InputError(
                "blur_distance is an array, but each eye sees the scene from its own position: give a function."
            )
        eyes = []
        for number, (optics, side) in enumerate(zip(self.optics, (-0.5, 0.5), strict=True)):
            place, own = side * self.interocular, own_blur(optics)
            by_rays = self.blur and self.blur_distance is None and (own is None or not own.forms_views)
            aside: dict[str, Any] = {"place": place, "ahead": -place * self.vergence}
            seen = cast(scene, optics if by_rays else PINHOLE, **rays, **aside, progress=part_of(self.say, number, 2))
            shown = _distances(self.blur_distance, seen.distance, "blur_distance")
            light = seen.view.image.astype(np.float32)
            if self.blur and not by_rays:
                light = blur_picture(light, shown, optics, pixel_angle=self.pixel_angle)
            eyes.append(_Seen(light, seen.distance, shown, 1 / seen.distance, np.zeros(light.shape, bool)))
        return self._pair(eyes)

    def moved(self, light: NDArray[np.float32], far: FloatArray, given: Distances | None, camera: float) -> StereoPair:
        """Return the pair, with the pixels of a picture shifted by the disparity of the distances `given` or true."""
        shown = _distances(self.blur_distance, far, "blur_distance")
        placed = 1 / _distances(given, far, "disparity_distance")
        eyes = []
        for number, (optics, side) in enumerate(zip(self.optics, (-0.5, 0.5), strict=True)):
            shift = (camera - side) * self.disparity(placed) / self.pixel_angle
            source, is_invented = warp(shift, placed)
            true, blurred, moved_placed = (_nearest(distances, source) for distances in (far, shown, placed))
            picture = sample(light, shift, source)
            if self.blur:
                part = part_of(self.say, number, 2)
                picture = blur_picture(picture, blurred, optics, pixel_angle=self.pixel_angle, progress=part)
            eyes.append(_Seen(picture, true, blurred, moved_placed, is_invented))
            if (share := float(is_invented.mean())) > MAX_INPAINTED_FRACTION:
                warn(
                    f"{share:.0%} of the {('left', 'right')[number]} eye's view is not in the picture and was "
                    "inpainted: move zero disparity nearer to the scene (vergence of the screen), or give a wider "
                    "picture."
                )
        return self._pair(eyes)

    def _pair(self, eyes: list[_Seen]) -> StereoPair:
        """Combine the views, with the ground truth of their pixels."""
        placed = [eye.placed - self.vergence for eye in eyes]
        views = [
            EyeView(
                eye.light,
                optics,
                eye.distance,
                self.disparity(eye.placed),
                np.abs(optics.focus_vergence - 1 / eye.blurred) * (optics.aperture_diameter / 2 * self.blur),
                monocular(placed[number], placed[1 - number], self.interocular / self.pixel_angle, 1 - 2 * number),
                eye.is_invented,
            )
            for number, (eye, optics) in enumerate(zip(eyes, self.optics, strict=True))
        ]
        return StereoPair(views[0], views[1], self.pixel_angle, self.interocular, self.vergence)


def stereo(
    scene: Scene | ArrayLike,
    distance: ArrayLike | Optics | tuple[Optics, Optics] | None = None,
    eye: Optics | tuple[Optics, Optics] | None = None,
    *,
    pixel_angle: float,
    interocular: float = INTEROCULAR,
    vergence: float | None = None,
    blur: bool = True,
    blur_distance: Distances | None = None,
    disparity_distance: Distances | None = None,
    camera: float = 0.0,
    shape: tuple[int, int] | None = None,
    samples: int = 64,
    seed: int = 0,
    progress: Progress | None = None,
) -> StereoPair:
    """Render the views of two eyes from a scene, or from a picture with known depth.

    ``stereo(scene, eye, ...)`` ray casts each eye's view from its own position. ``stereo(picture, distance, eye, ...)``
    shifts the pixels of the picture, inpaints what it does not show, and blurs each eye's view according to depth.

    Parameters
    ----------
    scene
        A scene of planes and spheres; or a sharp picture of linear radiance, H x W or H x W x 3.
    distance
        With a picture: distance of each pixel in metres along the axis, H x W; may be ``inf``.
    eye
        A `Lens` or an `Eye`; or two, left and right, which may differ in focus, pupil or aberrations (monovision,
        anisometropia).
    pixel_angle
        Angle in radians subtended by one pixel.
    interocular
        Interocular distance in metres.
    vergence
        Vergence in dioptres of the plane of zero disparity, i.e. of the screen. None: the eyes' mean focus.
    blur
        Whether to blur the views.
    blur_distance
        Distances in metres that determine blur instead of the true ones: one value, one per pixel (with a picture), or
        a function of the true distances.
    disparity_distance
        Likewise for disparity and occlusion. A scene is then rendered from the midpoint, and its picture shifted.
    camera
        Position from which the picture was taken: -0.5 left eye, 0 midpoint, 0.5 right eye.
    shape, samples, seed
        With a scene: height and width in pixels, rays per pixel, and their seed.
    progress
        Callback that receives the fraction done, 0 to 1, and a short description.

    Returns
    -------
    StereoPair
        Both views with the true distance, disparity and blur of each pixel, and masks of monocular and inpainted
        pixels.

    Raises
    ------
    InputError
        If an argument is out of range, or the scene cannot be ray cast.

    Warns
    -----
    FocalGradientWarning
        If more than a quarter of a view had to be inpainted.

    Examples
    --------
    A wall half a dioptre nearer than the plane of zero disparity: 0.063 m x 0.5 D = 31.5 mrad, crossed.

    >>> from focalgradient import Lens
    >>> wall = np.full((32, 64), 1 / 1.5)
    >>> light = np.random.default_rng(1).uniform(0, 1, (32, 64))
    >>> pair = stereo(light, wall, Lens(0.017, 4.0, 1.0), pixel_angle=6.3e-3, vergence=1.0)
    >>> round(float(pair.left.disparity[0, 0]), 4)
    0.0315
    >>> bool(np.allclose(pair.left.light[:, 20:40], pair.right.light[:, 15:35]))  # 5 pixels farther right on the left
    True
    """
    if isinstance(scene, Scene) and eye is None:
        distance, eye = None, distance
    eyes = _eyes(eye)
    check_number("interocular", interocular, "metres", least=0.0)
    check_number("camera", camera, "distances between the eyes")
    zero = sum(optics.focus_vergence for optics in eyes) / 2 if vergence is None else vergence
    check_number("vergence", zero, "dioptres")
    check_number("pixel_angle", pixel_angle, "radians", positive=True)
    both = _Eyes(eyes, interocular, zero, pixel_angle, blur, blur_distance, progress or silent)
    if isinstance(scene, Scene):
        if distance is not None:
            raise InputError("distance is given with a scene, which defines its own: leave it out.")
        if shape is None:
            raise InputError("shape is missing: give the height and width of the views in pixels.")
        rays: dict[str, Any] = {"shape": shape, "pixel_angle": pixel_angle, "samples": samples, "seed": seed}
        if disparity_distance is None:
            return both.cast(scene, rays)
        middle = cast(scene, PINHOLE, **rays)
        light, far = middle.view.image.astype(np.float32), middle.distance
    elif distance is None:
        raise InputError(f"distance is missing for a picture ({described(scene)}): give metres for every pixel.")
    else:
        picture, far = checked_picture(scene, distance, channels=3)  # type: ignore[arg-type]
        light = picture.astype(np.float32)
    return both.moved(light, far, disparity_distance, camera)


def _eyes(eye: object) -> tuple[Optics, Optics]:
    pair = eye if isinstance(eye, tuple | list) else (eye, eye)
    if len(pair) != 2:
        raise InputError(
            f"eye contains {len(pair)} optics, but must be one for both eyes, or two: give left and right."
        )
    for optics in pair:
        check_optics(optics)
    return pair[0], pair[1]


def _distances(given: Distances | None, true: FloatArray, name: str) -> FloatArray:
    """Return the distances that replace the true ones; raise `InputError` unless all are positive."""
    if given is None:
        return true
    distances = np.asarray(given(true) if callable(given) else given, float)
    if distances.shape not in ((), true.shape) or not (distances > 0).all():
        raise InputError(
            f"{name} has shape {distances.shape}, but must be one positive distance in metres, or one for each pixel: "
            f"{true.shape}."
        )
    return np.broadcast_to(distances, true.shape).astype(float)


def _nearest(values: FloatArray, columns: FloatArray) -> FloatArray:
    """Return a map's values at fractional columns by nearest neighbour, which creates no intermediate depth."""
    nearest = np.clip(np.rint(columns).astype(int), 0, values.shape[1] - 1)
    return np.take_along_axis(values, nearest, axis=1)
