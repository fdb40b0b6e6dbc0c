"""Chromatically correct stimuli: the picture on a flat display that gives an eye the retinal image of real depth.

Blur rendered alike in all colours is not the blur of an eye, which differs between wavelengths; and an eye that looks
at the display adds its own chromatic blur, in focus, to whatever is shown. The picture to show is the solution of an
inverse problem (Cholewiak, Love, Srinivasan, Ng & Banks 2017, "ChromaBlur", ACM Trans. Graph. 36, 210): the display's
red, green and blue whose retinal image, of the display in focus, comes closest to that of the scene.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Annotated

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import fft

from focalgradient.arrays import FloatArray
from focalgradient.errors import InputError, checked
from focalgradient.eye.colours import PRIMARIES
from focalgradient.eye.model_eye import Eye
from focalgradient.eye.ranges import PixelAngle
from focalgradient.eye.retinal_image import caught_by_cones, parts_needed
from focalgradient.eye.spectral import CLASSES, SpectralBasis
from focalgradient.progress import Progress, silent
from focalgradient.quantities import Range

__all__ = ["ChromaticStimulus", "chromatic_stimulus"]

SURROUND = 64
"""Mirrored margin of the picture in pixels, so that blur does not wrap."""

RIDGE = 1e-2
"""Weight of the difference between picture and retinal image of the scene, relative to the error in cone catches: it
limits the amplification of detail of which the eye passes less than a tenth. Our choice: with a tenth of it, blue is on
or off in scenes nearer than the display, and the residual of the S cones is 5 to 15 % less."""

STEPS = 60
"""Maximum number of iterations (alternating directions): the residual then changes by less than 1 %."""


@dataclass(frozen=True, slots=True, eq=False)
class ChromaticStimulus:
    """Picture to show, and residual of the eye's image of it.

    ``shown`` is the picture, H x W x 3, linear red, green and blue from 0 to 1. Residuals are the root mean square,
    over pixels, of the difference between what L, M and S cones catch of it and of the scene, as shares of what they
    catch of the display's white: ``residual`` of ``shown``; ``unlimited`` of the best picture, were negative light and
    light above white possible; ``scene_shown`` of the scene's own retinal image shown as it is, to which the eye adds
    its chromatic blur again; ``alike`` of blur drawn alike in all colours.
    """

    shown: NDArray[np.float32]
    residual: tuple[float, float, float]
    unlimited: tuple[float, float, float]
    scene_shown: tuple[float, float, float]
    alike: tuple[float, float, float]


@checked
def chromatic_stimulus(
    picture: ArrayLike,
    distance: ArrayLike,
    eye: Eye,
    *,
    screen: Annotated[float, Range("metres", positive=True)],
    pixel_angle: PixelAngle,
    wavelengths: int | None = None,
    primaries: str = PRIMARIES,
    basis: SpectralBasis | None = None,
    progress: Progress | None = None,
) -> ChromaticStimulus:
    """Solve for the picture on a display at `screen` (D) that gives the eye the retinal image of the scene.

    Parameters
    ----------
    picture
        The scene as it is where nothing is blurred: linear red, green and blue of the display, H x W x 3, 0 to 1.
    distance
        Distance in metres of what each pixel shows, H x W.
    eye
        The eye, accommodated to the screen for a sharp image of the picture.
    screen
        Distance of the display in metres.
    pixel_angle
        Angle in radians that one pixel subtends.
    wavelengths
        Number of parts of the spectrum, each in its own focus (see `retinal_image`); None: as pupil and distances need.
    primaries
        The display's name in colour-science.
    basis
        Spectra of the display's red, green and blue as they reach the cones, instead of those of `primaries`:
        ``SpectralBasis.of_display().through_lens(70)`` for an eye of 70 years.
    progress
        Called with the share done, 0 to 1, and a few words.

    Returns
    -------
    ChromaticStimulus
        Picture to show, and residual difference.

    Raises
    ------
    InputError
        If the screen's distance is not positive, or for the errors of `retinal_image`.

    Examples
    --------
    A step of grey that lies half a dioptre beyond the display, at 1 m, on which the eye is focused.

    >>> edge = np.full((32, 48, 3), 0.3)
    >>> edge[:, 24:] = 0.7
    >>> eye = Eye(0.004, 1.0)
    >>> found = chromatic_stimulus(edge, np.full((32, 48), 2.0), eye, screen=1.0, pixel_angle=np.radians(1 / 60))
    >>> max(found.residual) < 0.3 * max(found.alike)
    True
    """
    say = progress or silent
    basis = basis or SpectralBasis.of_display(primaries)
    if basis.components != 3:
        raise InputError(f"basis has {basis.components} spectra, but a display has 3: red, green and blue.")
    if wavelengths is None:
        distances = np.append(np.asarray(distance, dtype=float), screen)
        wavelengths = parts_needed(distances, eye, pixel_angle=pixel_angle, basis=basis)
    wanted, by_primary = caught_by_cones(
        picture, distance, eye, basis, pixel_angle, wavelengths, lambda share, words: say(0.6 * share, words)
    )
    # Catches are in units of each cone class's catch of the display's white.
    white = by_primary.sum(axis=0)
    wanted = wanted / white
    shape = wanted.shape[:2]
    reach = min(SURROUND, *shape)
    size = tuple(fft.next_fast_len(n + 2 * reach, real=True) for n in shape)
    inside = tuple(slice(reach, reach + n) for n in shape)
    around = tuple((reach, total - n - reach) for n, total in zip(shape, size, strict=True))
    target = fft.rfft2(np.pad(wanted, (*around, (0, 0)), mode="symmetric"), axes=(0, 1))
    through = _through_display(eye, 1 / screen, size, pixel_angle, wavelengths, basis) / white
    say(0.7, "finding what to show")
    plain = np.linalg.inv(by_primary / white)  # from cone catches to light of the display without blur
    free, shown = _solved(through, target, target @ plain, size)

    def residual(light: FloatArray) -> tuple[float, float, float]:
        seen = _filtered(through, fft.rfft2(light, axes=(0, 1)), size)
        off = np.sqrt(np.mean((seen[inside] - wanted) ** 2, axis=(0, 1)))
        return float(off[0]), float(off[1]), float(off[2])

    own = np.clip(fft.irfft2(target @ plain, size, axes=(0, 1)), 0, 1)
    alike, _ = caught_by_cones(picture, distance, replace(eye, chromatic_scale=0.0), basis, pixel_angle, 1)
    grey = np.clip(np.pad(alike @ np.linalg.inv(by_primary), (*around, (0, 0)), mode="symmetric"), 0, 1)
    say(1.0, "done")
    return ChromaticStimulus(
        shown[inside].astype(np.float32), residual(shown), residual(free), residual(own), residual(grey)
    )


def _through_display(
    eye: Eye, vergence: float, size: tuple[int, ...], pixel_angle: float, wavelengths: int, basis: SpectralBasis
) -> NDArray[np.complex128]:
    """Return each cone class's catch (last axis) of each primary through the eye, by frequency of an image."""
    down, right = fft.fftfreq(size[0])[:, None] / pixel_angle, fft.rfftfreq(size[1])[None] / pixel_angle
    total = np.zeros((size[0], size[1] // 2 + 1, 3, 3), complex)
    for number, band in enumerate(CLASSES):
        for component, cones in enumerate(basis.cones(eye, band, wavelengths=wavelengths)):
            total[:, :, component, number] = cones.optical_transfer(down, right, vergence)
    total *= basis.class_catches.T
    return total


def _filtered(through: NDArray[np.complex128], light: NDArray[np.complex128], size: tuple[int, ...]) -> FloatArray:
    """Return the cone catches of an image with the spectrum `light`."""
    return np.asarray(fft.irfft2((light[..., None, :] @ through)[..., 0, :], size, axes=(0, 1)))


def _solved(
    through: NDArray[np.complex128],
    target: NDArray[np.complex128],
    first: NDArray[np.complex128],
    size: tuple[int, ...],
) -> tuple[FloatArray, FloatArray]:
    """Return the least-squares light, unconstrained and constrained to 0 to 1.

    The latter by the alternating direction method of multipliers (Boyd et al. 2011): least squares at each frequency,
    and limits at each pixel, in turn.
    """
    back = through.conj().swapaxes(-1, -2)
    normal, pulled = through @ back, (target[..., None, :] @ back)[..., 0, :]

    found = ((pulled + RIDGE * first)[..., None, :] @ np.linalg.inv(normal + RIDGE * np.eye(3)))[..., 0, :]
    free = np.asarray(fft.irfft2(found, size, axes=(0, 1)))
    limited, slack = np.clip(free, 0, 1), np.zeros_like(free)
    weight = 0.05
    inverse = np.linalg.inv(normal + (RIDGE + weight) * np.eye(3))
    for _ in range(STEPS):
        to = RIDGE * first + weight * fft.rfft2(limited - slack, axes=(0, 1))
        light = fft.irfft2(((pulled + to)[..., None, :] @ inverse)[..., 0, :], size, axes=(0, 1))
        before, limited = limited, np.clip(light + slack, 0, 1)
        slack += light - limited
        if np.abs(limited - before).max() < 1e-4:
            break
    return free, limited
