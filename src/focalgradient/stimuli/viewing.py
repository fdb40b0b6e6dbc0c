"""A picture of known depth as seen through a lens or an eye, and the files that show it on a display."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from importlib.util import find_spec
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from focalgradient.display import Display
from focalgradient.errors import InputError, warn
from focalgradient.eye import Eye, SpectralBasis, chromatic_stimulus, parts_needed, retinal_image
from focalgradient.eye.chromatic import PRIMARIES_NM
from focalgradient.files import printable
from focalgradient.optics import Optics
from focalgradient.photographs.depth_pictures import DepthPair, DepthPicture
from focalgradient.plausibility import named
from focalgradient.progress import Progress, part_of, silent
from focalgradient.psf import Psf
from focalgradient.render import blur_picture
from focalgradient.stimuli.sets import npy, png_of
from focalgradient.video import Frame, Source

__all__ = ["Seen", "Viewing", "viewed_files", "with_frames"]

CLIPPED = 1e-3
"""Fraction of values above the display's white beyond which a warning is issued."""

RESIDUALS = ("residual", "unlimited", "scene_shown", "alike")
"""Residual errors of `focalgradient.eye.ChromaticStimulus`."""


class Seen(NamedTuple):
    """A picture as seen: linear radiance, radius of its largest blur disc in pixels, and residual errors if shown.

    The largest blur of an astigmatic eye is that in its more blurred meridian. ``residuals`` are those of
    `focalgradient.eye.ChromaticStimulus`, if ``light`` is what a display must show.
    """

    light: NDArray[np.float32]
    largest_blur_px: float
    residuals: dict[str, list[float]] | None = None


@dataclass(frozen=True, slots=True, eq=False)
class Viewing:
    """Optics through which pictures of known depth are seen, and how their light is blurred.

    Parameters
    ----------
    optics
        A lens or an eye.
    psf
        Shape of a lens's blur; None: the optics' own, or a disc.
    chromatic
        Whether each waveband has its own focus, as in an eye; otherwise all light has one.
    wavelengths
        With `chromatic`: number of wavelength samples; None: enough for pupil and distances.
    illuminant
        With `chromatic`: illuminant of surfaces, as for `focalgradient.eye.SpectralBasis.of_srgb`; None: a display's
        light.
    age
        With `chromatic`: age in years of the eye's lens, which filters the light; None: that of the cone fundamentals.
    screen
        With `chromatic`: distance in metres of a display that is to show what gives the eye this retinal image; None:
        the retinal image itself.
    white
        Linear value that the display shows as white.

    Raises
    ------
    InputError
        If parameters contradict each other.

    Examples
    --------
    A point of light 0.5 D beyond the focus of a 10 mm aperture: a disc with a radius of 2.5 pixels.

    >>> from focalgradient import Lens
    >>> from focalgradient.photographs import picture_of
    >>> point = np.zeros((15, 15), np.float32)
    >>> point[7, 7] = 1.0
    >>> picture = DepthPicture("point", picture_of(point, "linear"), np.full((15, 15), 2.0), 0.0, 1e-3)
    >>> seen = Viewing(Lens(0.04, 4.0, 1.0)).see(picture)
    >>> seen.largest_blur_px, round(float(seen.light.sum()), 3)
    (2.5, 1.0)
    """

    optics: Optics
    psf: Psf | None = None
    chromatic: bool = False
    wavelengths: int | None = None
    illuminant: str | None = None
    age: float | None = None
    screen: float | None = None
    white: float = 1.0

    def __post_init__(self) -> None:
        colour, screen, psf, focus = (named(name) for name in ("chromatic", "screen", "psf", "focus"))
        is_eye, is_shown = isinstance(self.optics, Eye), self.screen is not None
        if self.wavelengths is not None and not self.chromatic:
            raise InputError(f"{named('wavelengths')} is the number of wavelength samples of {colour}: add {colour}.")
        if self.illuminant is not None and (is_shown or not self.chromatic):
            raise InputError(
                f"{named('illuminant')} requires surfaces seen in colour: add {colour}, and leave out {screen}, whose "
                "light is a display's."
            )
        if is_shown and not (self.chromatic and math.isfinite(self.screen or 0)):
            raise InputError(f"{screen} requires an eye and a display at {focus}: add {colour}, and a finite {focus}.")
        if self.chromatic and not is_eye:
            raise InputError(f"{colour} is the chromatic aberration of an eye: give {named('eye')} instead of a lens.")
        if self.psf is not None and is_eye:
            raise InputError(
                f"{psf} is the shape of a lens's blur, but an eye has its own: give {named('lens')}, or leave {psf} "
                "out."
            )

    @property
    def foci(self) -> int:
        """Number of foci at which a `resolved` viewing blurs a picture."""
        return 1 if not self.chromatic else self.wavelengths or len(PRIMARIES_NM)

    @property
    def basis(self) -> SpectralBasis | None:
        """Spectra of a picture's red, green and blue as the eye's lens passes them; None: those of a display."""
        if self.illuminant is None and self.age is None:
            return None
        lit = SpectralBasis.of_display() if self.illuminant is None else SpectralBasis.of_srgb(self.illuminant)
        return lit if self.age is None else lit.through_lens(self.age)

    def resolved(self, picture: DepthPicture) -> Viewing:
        """Return the viewing with the number of wavelength samples that a picture needs.

        Warns
        -----
        FocalGradientWarning
            If colour-science is not installed, so that red, green and blue have one focus each.
        """
        if not self.chromatic or self.wavelengths is not None:
            return self
        if self.illuminant is None and find_spec("colour") is None:
            warn(
                "colour-science is not installed, so red, green and blue are each blurred at one focus, which is "
                "in error by up to 0.1 of white: install focalgradient[eye]."
            )
            return self
        metres = picture.metres if self.screen is None else np.append(picture.metres, self.screen)
        eye: Any = self.optics
        count = parts_needed(metres, eye, pixel_angle=picture.pixel_angle, basis=self.basis)
        return replace(self, wavelengths=count)

    def see(self, picture: DepthPicture, progress: Progress | None = None) -> Seen:
        """Return a picture as seen through the optics; `resolved` finds the number of wavelengths first.

        Raises
        ------
        InputError
            If a value is out of range, or colour-science is not installed for the requested wavelengths.
        """
        light, metres, angle = picture.light, picture.metres, picture.pixel_angle
        optics = self.optics
        foci = optics.meridian_vergences if isinstance(optics, Eye) else (optics.focus_vergence,)
        defocus = max(float(np.abs(focus - 1 / metres).max()) for focus in foci)
        largest = float(defocus * self.optics.aperture_diameter / 2 / angle)
        if not self.chromatic:
            seen = blur_picture(light, metres, self.optics, pixel_angle=angle, psf=self.psf, progress=progress)
            return Seen(seen, largest)
        eye: Any = self.optics
        colours = np.repeat(light[..., None], 3, axis=2) if light.ndim == 2 else light
        count = self.resolved(picture).wavelengths
        if count is None and self.screen is None:
            say = progress or silent
            parts = [part_of(say, number, len(PRIMARIES_NM)) for number in range(len(PRIMARIES_NM))]
            bands = [
                blur_picture(colours[..., n], metres, eye.in_light(nm), pixel_angle=angle, progress=parts[n])
                for n, nm in enumerate(PRIMARIES_NM)
            ]
            return Seen(np.stack(bands, axis=-1), largest)
        how: dict[str, Any] = {"pixel_angle": angle, "wavelengths": count, "basis": self.basis, "progress": progress}
        if self.screen is None:
            return Seen(retinal_image(colours, metres, eye, **how), largest)
        found = chromatic_stimulus(colours / self.white, metres, eye, screen=self.screen, **how)
        residuals = {name: list(getattr(found, name)) for name in RESIDUALS}
        return Seen((self.white * found.shown).astype(np.float32), largest, residuals)


def viewed_files(
    picture: DepthPicture, viewings: Mapping[str, Viewing], display: Display, progress: Progress
) -> tuple[dict[str, bytes], dict[str, Any]]:
    """Return a PNG file for the display and a .npy file of linear radiance for each viewing, and a record of them.

    Parameters
    ----------
    picture
        The picture.
    viewings
        Viewings by the stem of their files.
    display
        Display that the PNG files are for.
    progress
        Callback that receives the fraction done, 0 to 1, and a short description.

    Returns
    -------
    tuple
        Contents by file name; and size, pixel angle, distances (m) and largest blur (px) of each viewing, as JSON.

    Warns
    -----
    FocalGradientWarning
        If values are negative, or more than 0.1 % of a picture's values are brighter than white.
    """
    if (dark := float((picture.light < 0).mean())) > 0:
        warn(
            f"{picture.name}: {dark:.2%} of the values are negative and are shown as black: check how the picture was "
            "made."
        )
    files: dict[str, bytes] = {}
    resolved = {stem: viewing.resolved(picture) for stem, viewing in viewings.items()}
    found: list[Seen] = []
    for number, (stem, viewing) in enumerate(resolved.items()):
        seen = viewing.see(picture, part_of(progress, number, len(resolved)))
        shares = seen.light / np.float32(viewing.white)
        if (beyond := float((shares > 1).mean())) > CLIPPED:
            warn(
                f"{beyond:.1%} of the values are brighter than white and are clipped in the PNG: "
                f"give a larger {named('white')}."
            )
        files |= {f"{stem}.png": png_of(display.encode(shares)), f"{stem}.npy": npy(seen.light)}
        found.append(seen)
    facts: dict[str, Any] = {
        "picture": picture.name,
        "encoding": picture.picture.encoding,
        "pixel_type": picture.picture.pixel_type,
        "size_px": list(picture.light.shape[1::-1]),
        "pixel_arcmin": 60 * math.degrees(picture.pixel_angle),
        "distance_m": [float(picture.metres.min()), float(picture.metres.max())],
        "share_of_holes_filled": picture.filled,
        "largest_blur_px": [one.largest_blur_px for one in found],
    }
    if any(viewing.chromatic for viewing in resolved.values()):
        facts["wavelengths"] = [viewing.foci for viewing in resolved.values()]
    if residuals := [one.residuals for one in found if one.residuals is not None]:
        facts["residuals"] = residuals
    return files, facts


def with_frames(
    pairs: Sequence[DepthPair], video: Path | None = None
) -> Iterator[tuple[DepthPair, NDArray[np.uint8] | None]]:
    """Yield pictures with their depth files, and the frames of a video (H x W x 3, as stored).

    Parameters
    ----------
    pairs
        Pictures with their depth files, as returned by `focalgradient.photographs.depth_pairs`.
    video
        A video with one frame for each pair; None: the frames are None.

    Raises
    ------
    InputError
        If the video has fewer or more frames than there are pairs, or a frame cannot be decoded.
    """
    if video is None:
        yield from ((pair, None) for pair in pairs)
        return
    files = f"but {printable(pairs[0].depth.parent)} {len(pairs)} files: give one depth file per frame."
    with Source(video, lambda colours: colours) as source:
        frames = source.frames()
        for number, pair in enumerate(pairs):
            frame = next(frames, None)
            if frame is None:
                raise InputError(f"{printable(video)} has {number} frames {files}")
            if not isinstance(frame, Frame):
                raise InputError(f"frame {frame.first} of {printable(video)} {frame.reason}: repair the video.")
            yield pair, frame.image[..., ::-1]
        if next(frames, None) is not None:
            raise InputError(f"{printable(video)} has more frames {files}")
