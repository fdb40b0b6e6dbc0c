"""Natural views of an eye: two by colour, and many over time.

Each is a `View` whose optics are the cones that saw it. Walls, pictures and scenes are blurred by waves, with
diffraction; scenes also by rays, in each wavelength of a band, where the blur model of the cones is geometric.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, replace
from typing import TypedDict, Unpack

import numpy as np
from numpy.typing import ArrayLike, NDArray

from focalgradient.arrays import FloatArray
from focalgradient.errors import InputError, check_list, check_number, described, is_number
from focalgradient.eye.chromatic import REFERENCE_NM
from focalgradient.eye.cones import S_FINEST_CPD, Cones, sampling
from focalgradient.eye.local_colour import LocalColours, estimate_colours
from focalgradient.eye.model_eye import TimeCourse
from focalgradient.eye.photons import Photons
from focalgradient.eye.protocol import EyeModel, check_eye
from focalgradient.eye.ranges import ordered_times
from focalgradient.eye.spectral import CLASSES, SpectralBasis, SpectralPicture, band_picture
from focalgradient.parallel import in_order
from focalgradient.progress import Progress, silent
from focalgradient.psf import pixel_transfer
from focalgradient.quantities import Range
from focalgradient.render import Rendered, blur_picture, blur_scene, cast
from focalgradient.render.raycast import check_frame
from focalgradient.scenes import Mesh, Scene
from focalgradient.scenes.texture import BELOW_NYQUIST, random_field
from focalgradient.view import View

__all__ = ["accommodation_views", "band_views", "cone_catches", "eye_views"]

SKIRT = 64
"""Extent of a point spread in pixels beyond four radii of its disc, where a pupil is not clear."""

PINHOLE_SHARE = 4
"""Rays through a full pupil per ray through a pinhole, which samples the square of a pixel only. Our choice."""

CONTRAST = 0.2
"""Standard deviation over mean of a wall's texture. Our choice."""

CONES = 3
"""Number of cone classes: the number of components of a basis that can be distinguished."""

SceneInput = Scene | float | tuple[ArrayLike | SpectralPicture, ArrayLike]
"""Scene, distance of a wall, or picture with the distance of each pixel."""


class Forming(TypedDict, total=False):
    """How views are formed: keywords of `eye_views`, with its defaults."""

    noise: float | Photons
    samples: int
    seed: int
    colours: LocalColours | None
    executor: Executor | None
    progress: Progress | None


class FormingBands(Forming, total=False):
    """How views in different lights are formed: keywords of `eye_views`, with its defaults."""

    correlation: float
    gain: float


def band_views(
    scene: SceneInput,
    eye: EyeModel,
    shape: tuple[int, int],
    pixel_angle: float,
    *,
    s_finest_cpd: float = S_FINEST_CPD,
    illuminant: str = "D65",
    wavelengths: int | None = None,
    **forming: Unpack[FormingBands],
) -> list[Rendered]:
    """Return the views of the L and M cones together and of the S cones, at one moment.

    Parameters
    ----------
    scene
        A scene; or the distance in metres of a textured wall; or a picture of known depth, as
        ``(picture, distance)``: a `SpectralPicture`; or linear radiance, H x W (grey, in the light of `illuminant`) or
        H x W x 3 (red, green and blue of a display); and distances in metres, H x W. It is seen as `retinal_image`
        sees it, by waves, every wavelength in its own focus; both cone classes see what it shows, so that
        `correlation` and `gain` stay 1. The optics of views of a colour picture are `ColouredCones`: the eye's L, M
        and S cones show the spectrum of the texture at each place.
    eye
        Pupil, accommodation and chromatic aberration: an `Eye`, or a class of your own (`EyeModel`).
    shape, pixel_angle
        Height and width in pixels, and the visual angle in radians of one.
    correlation, gain
        Correlation of the S cones' textures with the others', and their contrast relative to the others'.
    s_finest_cpd
        Highest frequency in cycles per degree that S cones resolve.
    illuminant, wavelengths
        Light, and number of wavelengths that represent it in each band; None: enough for the pupil (`Cones.of`).
    noise
        Standard deviation of every pixel's noise over the mean; or the `Photons` that make it.
    samples, seed
        Rays a pixel of a scene (by waves, as here, a quarter of them, through a pinhole), and the seed of rays,
        textures and noise.
    colours
        The colours of a colour picture where they are known; None: as its L, M and S cones show them
        (`estimate_colours`).
    progress
        Called with the share done, 0 to 1, and a few words.

    Returns
    -------
    list of Rendered
        The views, first that of L+M, with the true distance at every pixel.

    Raises
    ------
    InputError
        If the scene is none or cannot be ray cast, picture and shape do not agree, or a number is out of range.

    Examples
    --------
    >>> from focalgradient import Eye
    >>> eye = Eye(pupil_diameter=0.004, accommodation=1.0)
    >>> reds, blues = band_views(0.5, eye, (64, 64), pixel_angle=np.radians(1 / 60))
    >>> reds.view.optics.light, blues.view.optics.light, float(reds.distance[0, 0])
    ('L+M', 'S', 0.5)
    """
    check_eye("eye", eye)
    cones = [
        Cones.of(eye, "L+M", illuminant=illuminant, wavelengths=wavelengths),
        Cones.of(eye, "S", illuminant=illuminant, wavelengths=wavelengths, finest_cpd=s_finest_cpd),
    ]
    return eye_views(scene, cones, shape, pixel_angle, **forming)


def accommodation_views(
    scene: SceneInput,
    eye: EyeModel,
    times: Sequence[float],
    course: TimeCourse,
    shape: tuple[int, int],
    pixel_angle: float,
    *,
    illuminant: str = "D65",
    wavelengths: int | None = None,
    **forming: Unpack[Forming],
) -> list[Rendered]:
    """Return the views of the L and M cones at `times` (s, in order) of a time `course` of accommodation.

    Two views a quarter of a second apart are extremes of the paper's oscillation at 2 Hz; the whole series may be
    given to `recover_depth` as well. The other parameters are those of `band_views`.

    Examples
    --------
    >>> from focalgradient.eye import Eye, Oscillation
    >>> eye = Eye(pupil_diameter=0.004, accommodation=1.0)
    >>> pair = accommodation_views(0.5, eye, [0.125, 0.375], Oscillation(), (64, 64), np.radians(1 / 60))
    >>> round(pair[0].view.optics.focus_vergence - pair[1].view.optics.focus_vergence, 6)
    0.5
    """
    check_eye("eye", eye)
    changes = course.at(ordered_times(check_list("times", times, "seconds")))
    moments = [eye.refocused(eye.focus_vergence + change) for change in changes.tolist()]
    cones = [Cones.of(one, "L+M", illuminant=illuminant, wavelengths=wavelengths) for one in moments]
    return eye_views(scene, cones, shape, pixel_angle, correlation=1.0, gain=1.0, **forming)


def eye_views(
    scene: SceneInput,
    cones: Sequence[Cones],
    shape: tuple[int, int],
    pixel_angle: float,
    *,
    correlation: float = 1.0,
    gain: float = 1.0,
    noise: float | Photons = 0.0,
    samples: int = 64,
    seed: int = 0,
    colours: LocalColours | None = None,
    executor: Executor | None = None,
    progress: Progress | None = None,
) -> list[Rendered]:
    """Return the view of each of the `cones`; the textures of different lights have this `correlation`.

    Parameters are those of `band_views`; and `executor`, which forms the views: they do not depend on it, and None is
    this process.

    Examples
    --------
    Both pairs of views at once: two cone classes at two moments.

    >>> from focalgradient import Eye
    >>> eyes = [Eye(0.004, accommodation) for accommodation in (0.75, 1.25)]
    >>> cones = [Cones.of(eye, band) for eye in eyes for band in ("L+M", "S")]
    >>> len(eye_views(0.5, cones, (64, 64), np.radians(1 / 60), correlation=0.9))
    4
    """
    Range("shares", -1, 1).check("correlation", correlation)
    Range("multiples of the other cones' contrast", 0).check("gain", gain)
    cones = check_list("cones", cones, "Cones")
    if not cones:
        raise InputError("cones is empty, but must hold Cones: make them with Cones.of(eye, band).")
    for one in cones:
        if not isinstance(one, Cones):
            raise InputError(f"cones holds {described(one)}, but must hold Cones: make them with Cones.of(eye, band).")
        check_frame(one, shape, pixel_angle, samples, seed)
    _check_scene(scene, shape, (correlation, gain))
    shares = (correlation, math.sqrt(1 - correlation**2))
    views = []
    for number, one in enumerate(cones):
        mixed = one.light != cones[0].light
        mix = (gain * shares[0], gain * shares[1]) if mixed else (1.0, 0.0)
        views.append(_Source(scene, one, shape, pixel_angle, mix, noise, samples, seed, number))
    seen = []
    for rendered in in_order(executor, _formed, views):
        seen.append(rendered)
        (progress or silent)(len(seen) / len(cones), "forming the views")
    if isinstance(scene, tuple) and (isinstance(scene[0], SpectralPicture) or np.ndim(scene[0]) == 3):
        if colours is None:
            colours = _colours(SpectralPicture.of(scene[0]), scene[1], cones[0].eye, pixel_angle, noise, seed)
        own = [colours.seen_by(one) for one in cones]
        seen = [replace(one, view=replace(one.view, optics=sees)) for one, sees in zip(seen, own, strict=True)]
    return seen


def cone_catches(
    picture: SpectralPicture,
    distance: ArrayLike,
    eye: EyeModel,
    pixel_angle: float,
    *,
    noise: float | Photons = 0.0,
    seed: int = 0,
) -> FloatArray:
    """Return the catches of L, M and S cones of a picture of known depth (H x W x 3, relative to white).

    Parameters are those of `band_views`. It is what `estimate_colours` needs.

    >>> from focalgradient import Eye
    >>> grey = SpectralPicture.of(np.full((16, 16), 0.5))
    >>> cone_catches(grey, np.ones((16, 16)), Eye(0.004, 1.0), 3e-4).mean(axis=(0, 1)).round(3).tolist()
    [0.5, 0.5, 0.5]
    """
    seen = []
    for number, band in enumerate(CLASSES):
        image = band_picture(picture, distance, eye, band, pixel_angle=pixel_angle)
        cones = Cones(eye, band, (REFERENCE_NM,))
        seen.append(_noisy(image, cones, pixel_angle, noise, np.random.default_rng([seed, 4, number])))
    return np.stack(seen, axis=-1)


def _colours(
    picture: SpectralPicture,
    distance: ArrayLike,
    eye: EyeModel,
    pixel_angle: float,
    noise: float | Photons,
    seed: int,
) -> LocalColours:
    """Return the colours of a picture for an eye that knows the light."""
    if picture.basis.components == 1:
        return LocalColours.known(picture.basis, [1.0], picture.shape)
    basis = picture.basis if picture.basis.components == CONES else SpectralBasis.of_srgb()
    catches = cone_catches(picture, distance, eye, pixel_angle, noise=noise, seed=seed)
    return estimate_colours(catches, basis, eye, pixel_angle)


Seen = tuple[FloatArray, FloatArray]
"""Image without noise, and the distance of each pixel in metres: H x W each."""


@dataclass(frozen=True, slots=True)
class _Source:
    """Source of a view; `number` is its index among the views, which its noise depends on."""

    scene: SceneInput
    cones: Cones
    shape: tuple[int, int]
    pixel_angle: float
    mix: tuple[float, float]
    noise: float | Photons
    samples: int
    seed: int
    number: int


def _formed(of: _Source) -> Rendered:
    if isinstance(of.scene, tuple):
        image, distance = _of_picture(of.scene, of.cones, of.pixel_angle)
    elif isinstance(of.scene, Scene):
        image, distance = (_scene_by_waves if of.cones.by_waves else _by_rays)(of, of.scene)
    else:
        image, distance = _by_waves(of, of.scene)
    image = _noisy(image, of.cones, of.pixel_angle, of.noise, np.random.default_rng([of.seed, 3, of.number]))
    return Rendered(View(image.astype(np.float32), of.cones, of.pixel_angle), distance)


def _check_scene(scene: object, shape: tuple[int, int], mix: tuple[float, float]) -> None:
    """Raise `InputError` for an unknown kind of scene, or for textures mixed with a picture."""
    if not isinstance(scene, tuple):
        if isinstance(scene, Scene) or (is_number(scene) and scene > 0):  # type: ignore[operator]
            return
        raise InputError(
            f"scene is {described(scene)}, but must be a Scene, a wall's distance (positive, in metres) or (picture, "
            "distance): give one."
        )
    size = scene[0].shape if isinstance(scene[0], SpectralPicture) else np.shape(scene[0])
    if len(scene) != 2 or size[:2] != tuple(shape):
        raise InputError(
            f"scene is a tuple of {len(scene)}, the first of shape {size}, but must be (picture, "
            f"distance), both of the views' shape {tuple(shape)}: give shape=picture.shape[:2]."
        )
    if mix != (1.0, 1.0):
        raise InputError(
            "correlation or gain is not 1, but a picture shows each cone class its own texture: give a colour picture."
        )


def _of_picture(scene: tuple[ArrayLike | SpectralPicture, ArrayLike], cones: Cones, pixel_angle: float) -> Seen:
    """Return a picture of known depth as caught by the cones of a band, blurred by waves at each distance."""
    picture, distance = scene[0], np.asarray(scene[1], dtype=float)
    if isinstance(picture, SpectralPicture) or np.ndim(picture) == 3:
        seen = band_picture(
            SpectralPicture.of(picture),
            distance,
            cones.eye,
            cones.light,
            pixel_angle=pixel_angle,
            finest_cpd=cones.finest_cpd,
            model=cones.model,
        )
        return seen, distance
    return blur_picture(picture, distance, cones, pixel_angle=pixel_angle).astype(float), distance


def _by_rays(of: _Source, scene: Scene) -> Seen:
    """Return the scene by rays; its textures are mixed with others, and the remainder has no texture."""
    image = np.zeros(of.shape)
    for weight, painted in _parts(scene, of.mix):
        for eye, share in zip(of.cones.eyes(), of.cones.shares, strict=True):
            rendered = cast(painted, eye, of.shape, of.pixel_angle, samples=of.samples, seed=of.seed)
            image += weight * share * rendered.view.image
    _check_depth(rendered.distance)
    if np.isfinite(of.cones.finest_cpd):
        image = _filtered(image, of.pixel_angle, lambda frequency: sampling(frequency, of.cones.finest_cpd))
    return image, rendered.distance


def _scene_by_waves(of: _Source, scene: Scene) -> Seen:
    """Return the scene blurred by waves: pinhole picture and occluded parts, spread by the cones' own blur."""
    samples = max(1, of.samples // PINHOLE_SHARE)
    parts = _parts(scene, of.mix)
    image, distance = blur_scene(parts, of.cones, of.shape, of.pixel_angle, samples=samples, seed=of.seed)
    _check_depth(distance)
    return image.astype(float), distance


def _parts(scene: Scene, mix: tuple[float, float]) -> list[tuple[float, Scene]]:
    """Return weights and paintings of the scene: its textures, others, and an untextured remainder."""
    parts = ((mix[0], scene), (mix[1], _painted(scene, 7919, 1.0)), (1 - sum(mix), _painted(scene, 0, 0.0)))
    return [(weight, painted) for weight, painted in parts if abs(weight) > 1e-9]


def _check_depth(distance: FloatArray) -> None:
    if not np.isfinite(distance).any():
        raise InputError("the scene has nothing in the frame, and so no depth to see: put objects before the eye.")


def _painted(scene: Scene, other: int, contrast: float) -> Scene:
    """Return the scene with other textures, and their contrast multiplied by this factor."""
    things = []
    for thing in scene.objects:
        if isinstance(thing, Mesh):
            raise InputError(
                "the scene holds meshes, but an eye's views are ray cast: choose one of planes and spheres."
            )
        texture = replace(thing.texture, seed=thing.texture.seed + other, contrast=contrast * thing.texture.contrast)
        things.append(replace(thing, texture=texture))
    return replace(scene, objects=tuple(things))


def _by_waves(of: _Source, distance: float) -> Seen:
    """Return a wall with a natural texture, filtered by the cones' transfer; it is wider than the frame."""
    side = int(2 ** math.ceil(math.log2(1.5 * max(of.shape))))
    down, right = np.fft.fftfreq(side)[:, None], np.fft.rfftfreq(side)
    texture = sum(
        weight * random_field((side, side), _texture_stream(of.seed, part), finest=BELOW_NYQUIST)
        for part, weight in enumerate(of.mix)
    )
    seen = _whole_transfer(of.cones, side, of.pixel_angle, 1 / distance) * pixel_transfer(down, right)
    whole = 1 + CONTRAST * np.fft.irfft2(np.fft.rfft2(texture) * seen, (side, side))
    rows, columns = (slice((side - n) // 2, (side - n) // 2 + n) for n in of.shape)
    return whole[rows, columns], np.full(of.shape, float(distance))


def _texture_stream(seed: int, part: int) -> np.random.Generator:
    """Return the random stream of a texture, distinct from a caller's stream for noise of the same seed."""
    return np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(part,)))


def _whole_transfer(
    cones: Cones, side: int, pixel_angle: float, vergence: float
) -> FloatArray | NDArray[np.complex128]:
    """Return the transfer for points at `vergence` (D), at the frequencies of a real `side` x `side` image.

    For an aberrated pupil it is that of its point spread over as many pixels as needed, or the whole frame.
    """
    clear = not (getattr(cones.eye, "aberrations", ()) or getattr(cones.eye, "stiles_crawford", 0.0))
    radius = abs(cones.focus_vergence - vergence) * cones.aperture_diameter / 2 / pixel_angle
    few = side if clear else min(side, int(2 ** math.ceil(math.log2(4 * radius + SKIRT))))
    down, right = np.fft.fftfreq(few)[:, None] / pixel_angle, np.fft.rfftfreq(few)[None] / pixel_angle
    seen = cones.optical_transfer(down, right, vergence)
    if few == side:
        return seen
    spread = np.zeros((side, side))
    spread[:few, :few] = np.fft.fftshift(np.fft.irfft2(seen, (few, few)))
    return np.fft.rfft2(np.roll(spread, (-few // 2, -few // 2), (0, 1)))


def _filtered(image: FloatArray, pixel_angle: float, transfer: Callable[[FloatArray], FloatArray]) -> FloatArray:
    """Filter the image by a `transfer` of cycles per radian, mirrored at its borders."""
    around = min(64, *image.shape)
    wide = np.pad(image, around, mode="symmetric")
    radial = np.hypot(np.fft.fftfreq(wide.shape[0])[:, None], np.fft.rfftfreq(wide.shape[1]))
    through = np.fft.irfft2(np.fft.rfft2(wide) * transfer(radial / pixel_angle), wide.shape)
    return np.asarray(through[around:-around, around:-around])


def _noisy(
    image: FloatArray,
    cones: Cones,
    pixel_angle: float,
    noise: float | Photons,
    random: np.random.Generator,
) -> FloatArray:
    if not isinstance(noise, Photons):
        check_number("noise", noise, "shares of the mean", least=0)
        return image + noise * image.mean() * random.standard_normal(image.shape)
    caught = noise.caught(cones.light, cones.aperture_diameter, pixel_angle, getattr(cones.eye, "stiles_crawford", 0.0))
    scale = image.mean() / caught
    return image + np.sqrt(np.clip(image, 0, None) * scale) * random.standard_normal(image.shape)
