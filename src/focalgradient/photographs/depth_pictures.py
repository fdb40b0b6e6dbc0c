"""Pictures with the distance of every pixel: read from files, and checked for mixed-up units."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from focalgradient.arrays import FloatArray
from focalgradient.errors import InputError, warn
from focalgradient.files import printable
from focalgradient.optics import Optics
from focalgradient.photographs.encodings import Encoding
from focalgradient.photographs.pictures import DepthUnit, Distances, Picture, picture_of, read_distances, read_picture
from focalgradient.plausibility import check_field, check_frame, check_pixel_pitch, named, picture_slip
from focalgradient.quantities import METRES

__all__ = ["DepthPair", "DepthPicture", "depth_pairs", "pixel_angle_of", "read_depth_picture"]

PICTURES = frozenset({".png", ".jpg", ".jpeg", ".tif", ".tiff", ".exr", ".npy"})
"""Extensions of pictures; any other file is a video, if its depth is a folder."""


class DepthPair(NamedTuple):
    """A picture, or the video of a frame; its depth file; and a stem for the names of files made from them."""

    picture: Path
    depth: Path
    stem: str


@dataclass(frozen=True, slots=True, eq=False)
class DepthPicture:
    """A sharp picture in linear radiance with the distance of every pixel.

    Parameters
    ----------
    name
        Its name in messages and records.
    picture
        Linear radiance, H x W or H x W x 3, with the encoding and the pixel type of the file.
    metres
        Distance of each pixel in metres, H x W, with holes filled.
    filled
        Fraction of the pixels whose distance was filled, 0 to 1.
    pixel_angle
        Angle in radians that one pixel subtends.
    """

    name: str
    picture: Picture
    metres: FloatArray
    filled: float
    pixel_angle: float

    @property
    def light(self) -> NDArray[np.float32]:
        """Linear radiance, H x W or H x W x 3."""
        return self.picture.light


def pixel_angle_of(
    width: int,
    *,
    field: float | None = None,
    pixel_pitch: float | None = None,
    focal_length: float | None = None,
    pixel_angle: float | None = None,
) -> float:
    """Return the angle (rad) that one pixel of a picture subtends.

    Parameters
    ----------
    width
        Width of the picture in pixels.
    field
        Width of the picture as an angle in radians.
    pixel_pitch, focal_length
        Instead of `field`: pixel pitch of the camera's sensor and focal length of its lens, in metres.
    pixel_angle
        Angle in radians of a pixel, such as a display's, if neither `field` nor `pixel_pitch` is given.

    Raises
    ------
    InputError
        If the angle is unknown, given twice or implausible.

    Examples
    --------
    >>> round(pixel_angle_of(320, field=math.radians(6)), 6)
    0.000328
    """
    if field is not None and pixel_pitch is not None:
        raise InputError(
            f"{named('field')} and {named('pixel_pitch')} both give the size of a pixel: give one of them."
        )
    if field is not None:
        if not 0 < field < math.pi:
            raise InputError(f"{named('field')} is {math.degrees(field):g} degrees, but must be less than 180.")
        check_field(field, width, focal_length)
        return 2 * math.tan(field / 2) / width
    if pixel_pitch is not None:
        if focal_length is None:
            raise InputError(
                f"{named('pixel_pitch')} of a camera's sensor requires a focal length: give {named('focal_length')}, "
                f"or {named('field')} instead."
            )
        check_pixel_pitch(pixel_pitch, pixel_pitch / focal_length)
        return pixel_pitch / focal_length
    if pixel_angle is None:
        raise InputError(
            f"the size of a pixel is unknown: give {named('field')}, or {named('pixel_pitch')}, or "
            f"{named('pixel_angle')}."
        )
    return pixel_angle


def read_depth_picture(
    picture: Path,
    depth: Path | float,
    *,
    field: float | None = None,
    pixel_pitch: float | None = None,
    focal_length: float | None = None,
    pixel_angle: float | None = None,
    encoding: Encoding | None = None,
    unit: DepthUnit | None = None,
    scale: float | None = None,
    baseline: float | None = None,
    offset: float = 0.0,
    optics: Sequence[Optics] = (),
    frame: NDArray[Any] | None = None,
) -> DepthPicture:
    """Read a picture and the depth of each of its pixels.

    Parameters
    ----------
    picture, encoding
        File and encoding of the picture, as for `read_picture`.
    depth, scale, baseline, offset
        Depth file, and the meaning of its values, as for `read_distances`; or the distance of a flat picture in metres.
    field, pixel_pitch, focal_length, pixel_angle
        Size of a pixel, as for `pixel_angle_of`; `pixel_angle` (rad) applies if neither `field` nor `pixel_pitch` is
        given.
    unit
        Unit of the depth values; None: metres, and distances that are implausible with the `optics` raise an error
        instead of a warning.
    optics
        Lenses or eyes through which the picture will be seen.
    frame
        Pixels as stored, H x W x 3, of a frame of the video `picture`, instead of those of a file; sRGB by default.

    Raises
    ------
    InputError
        If a file cannot be read, picture and depth differ in size, or a quantity is missing or implausible.

    Warns
    -----
    FocalGradientWarning
        If holes of the depth were filled, or the distances are implausible although their `unit` is given.

    Examples
    --------
    >>> from tempfile import TemporaryDirectory
    >>> with TemporaryDirectory() as folder:
    ...     np.save(Path(folder, "light.npy"), np.full((4, 6), 0.5))
    ...     np.save(Path(folder, "mm.npy"), np.full((4, 6), 2500.0))
    ...     found = read_depth_picture(Path(folder, "light.npy"), Path(folder, "mm.npy"), field=0.1, unit="mm")
    >>> float(found.metres[0, 0]), round(found.pixel_angle, 4)
    (2.5, 0.0167)
    """
    shown = read_picture(picture, encoding) if frame is None else picture_of(frame, encoding or "srgb")
    height, width = shown.light.shape[:2]
    angle = pixel_angle_of(
        width, field=field, pixel_pitch=pixel_pitch, focal_length=focal_length, pixel_angle=pixel_angle
    )
    if isinstance(depth, Path):
        found = read_distances(depth, unit or "m", scale=scale, baseline=baseline, pixel_angle=angle, offset=offset)
    elif unit in ("m", None) and scale is None and baseline is None and not offset:
        found = Distances(np.full((height, width), replace(METRES.si, infinite=True).value(depth, named("depth"))), 0.0)
    else:
        raise InputError(
            f"{named('depth')} is a number, the distance of a flat picture in metres: leave out {named('unit')}, "
            f"{named('scale')}, {named('baseline')} and {named('offset')}, or give a depth file."
        )
    if found.metres.shape != (height, width):
        rows, columns = found.metres.shape
        raise InputError(
            f"{printable(picture)} is {width} x {height} pixels but {printable(str(depth))} is {columns} x {rows}, but "
            "both must have the same size: scale or crop one of them."
        )
    ends = float(found.metres.min()), float(found.metres.max())
    for one in optics:
        slip = picture_slip(ends, one.aperture_diameter, one.focus_vergence, angle, max(height, width))
        if slip is not None and unit is None:
            raise InputError(f"{slip} If all is correct, give {named('unit')} m.")
        if slip is not None:
            warn(slip)
    check_frame(angle, (height, width))
    return DepthPicture(printable(picture), shown, found.metres, found.filled, angle)


def depth_pairs(picture: Path, depth: Path) -> list[DepthPair]:
    """Return each picture with its depth file: one pair, or one for each picture of a folder or frame of a video.

    Parameters
    ----------
    picture
        A picture; or a folder of pictures; or a video.
    depth
        Its depth file; or a folder with depth files of the same names; or, for a video, with one for each frame, in
        order of name.

    Raises
    ------
    InputError
        If a picture has no depth file, or only one of `picture` and `depth` stands for several.
    """
    if not picture.is_dir() and not depth.is_dir():
        return [DepthPair(picture, depth, picture.stem)]
    if not depth.is_dir():
        raise InputError(
            f"{named('picture')} is a folder but {named('depth')} is not: give a folder with the depth of each picture."
        )
    files = sorted(path for path in depth.iterdir() if path.is_file())
    if not picture.is_dir():
        if picture.suffix.lower() in PICTURES:
            raise InputError(
                f"{printable(depth)} is a folder but {named('picture')} {printable(picture)} is one picture: give the "
                "depth file of that picture."
            )
        if not files:
            raise InputError(f"{printable(depth)} contains no depth files: give one for each frame of the video.")
        return [DepthPair(picture, path, f"{picture.stem}-{number:06}") for number, path in enumerate(files)]
    depths = {path.stem: path for path in files}
    pictures = [path for path in sorted(picture.iterdir()) if path.is_file() and not path.name.startswith(".")]
    if not pictures:
        raise InputError(f"{printable(picture)} contains no pictures: give a folder of frames.")
    for path in pictures:
        if path.stem not in depths:
            raise InputError(f"{printable(path)} has no depth file of the same name in {printable(depth)}: add it.")
    return [DepthPair(path, depths[path.stem], path.stem) for path in pictures]
