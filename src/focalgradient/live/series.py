"""Focus series: pictures precomputed at planes of focus, of which two neighbours are mixed in linear radiance."""

from __future__ import annotations

import json
import math
import os
from dataclasses import astuple, dataclass, replace
from functools import cache, partial
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from focalgradient.arrays import FloatArray
from focalgradient.display import Display
from focalgradient.errors import InputError, check_number, warn
from focalgradient.files import printable, read_array, read_json, write_whole
from focalgradient.live.kept import MARK, SUMMARY, Kept, digest_of, plane_name
from focalgradient.live.planes import Bound, choose, mix
from focalgradient.memory import require
from focalgradient.optics import Optics, check_optics, refocused
from focalgradient.progress import Progress, silent
from focalgradient.render import blur_picture
from focalgradient.render.blurred import checked_picture

__all__ = ["HALF_MAX", "FocusSeries"]

SMALLEST_STEP = 1 / 128
"""Minimum distance of two planes in pixels of blur radius. Interpolation errors reach 3 8-bit steps between planes 0.23
px apart for text and a photograph-like picture, 0.06 px for white noise, and 0.01 px where parts of a textured disc's
outline come into focus in succession."""

SMALLEST_SPECTRAL_STEP = 0.25
"""The same with wavelengths, each of which takes as long as a series without them (our choice)."""

LONGEST_FAILURE = 0.5
"""Length of an interval, in pixels of blur radius, up to which a halving that does not reduce the error counts."""

MAX_INTERVALS = 128
"""Maximum number of intervals between planes: 129 planes of 1920 x 1080 pixels are 1 GB as textures."""

BOUND_FRACTION = 2 / 3
"""Fraction of the bounds allowed for the error halfway between two planes. Elsewhere between them it was up to 1.3
times as large, where the outline of a card is gradually hidden; rounding to 8 bits adds part of a step."""

TILE, PROBE_COUNT = 128, 5
"""Side in pixels of the picture's parts, and number of foci, at which the density of planes is estimated."""

HALF_MAX = 6e4
"""Maximum radiance in a 16-bit float."""

DISTANCE = "distance.npy"


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class FocusSeries:
    """Pictures of one scene at several planes of focus, dense enough to interpolate any focus between two.

    Parameters
    ----------
    vergences
        Vergences of the planes of focus in dioptres, increasing.
    planes
        Linear picture at each plane (white = 1), H x W or H x W x 3, 16-bit.
    distance
        Distance of each pixel in metres, H x W.
    errors
        Error of mixing neighbours halfway, relative to the picture blurred at that focus, in 8-bit steps of sRGB:
        median and maximum over the picture, N - 1 x 2; NaN if unknown.
    pixel_angle
        Visual angle of a pixel in radians for which the pictures were blurred; None if unknown.
    """

    vergences: tuple[float, ...]
    planes: tuple[NDArray[np.float16], ...]
    distance: NDArray[np.floating]
    errors: FloatArray
    pixel_angle: float | None = None

    @classmethod
    def of(
        cls,
        picture: ArrayLike,
        distance: ArrayLike,
        optics: Optics,
        *,
        pixel_angle: float,
        focus: tuple[float, float] | None = None,
        median_error: float = 1.0,
        largest_error: float = 3.0,
        wavelengths: int | None = None,
        folder: str | os.PathLike[str] | None = None,
        progress: Progress | None = None,
    ) -> FocusSeries:
        """Make the series of a picture with known depth, or read it if it was stored with the same inputs.

        Parameters
        ----------
        picture
            Sharp linear picture (white = 1), H x W or H x W x 3.
        distance
            Distance of each pixel in metres, H x W; may be ``inf``.
        optics
            A `Lens`, an `Eye`, an eye's `Cones`, or other optics with a method ``refocused(vergence)``.
        pixel_angle
            Angle in radians subtended by one pixel.
        focus
            Vergences of the farthest and the nearest focus in dioptres. None: those of the picture.
        median_error, largest_error
            Maximum interpolation error in 8-bit steps of sRGB, of the median pixel and of the worst pixel.
        wavelengths
            Number of wavebands into which the display's spectrum is divided for an `Eye`, each with its own focus.
            None: no dispersion.
        folder
            Folder for storage, picture by picture: interrupted runs are resumed, and other inputs replace the series.
        progress
            Callback that receives the fraction done, 0 to 1, and a short description; first with the expected number of
            planes and their memory as textures.

        Raises
        ------
        InputError
            If an argument is out of range, the optics cannot be refocused, or memory is insufficient.

        Warns
        -----
        FocalGradientWarning
            If the bound is exceeded: where the blurred picture itself changes abruptly with focus, or because there are
            129 planes at most.

        Notes
        -----
        Intervals between planes are bisected until the mixture halfway is within two thirds of the bounds: the rest is
        reserved for larger errors elsewhere between the planes, and for rounding to 8 bits.

        Examples
        --------
        >>> from focalgradient import Lens
        >>> cards = np.where(np.arange(32) < 16, 0.5, 1.0) * np.ones((16, 1))
        >>> light = np.random.default_rng(1).uniform(0.2, 0.8, (16, 32))
        >>> series = FocusSeries.of(light, cards, Lens(0.016, 4.0, 1.0), pixel_angle=1e-3)
        >>> series.vergences[0], series.vergences[-1], bool(series.error[1] <= 3)
        (1.0, 2.0, True)
        >>> series.at(1.7).shape
        (16, 32)
        """
        light, far = np.asarray(picture, np.float32), np.asarray(distance, float)
        source = _Source(light, far, optics, pixel_angle, wavelengths)
        source.check()
        ends = _ends(far, focus)
        for name, value in (("median_error", median_error), ("largest_error", largest_error)):
            check_number(name, value, "8-bit steps", positive=True)
        pixel = 1 / source.pixels if source.pixels > 0 else math.inf
        step = SMALLEST_STEP if wavelengths is None else SMALLEST_SPECTRAL_STEP
        smallest = max(step * pixel, (ends[1] - ends[0]) / (MAX_INTERVALS + 0.5))
        bound = Bound(BOUND_FRACTION * median_error, BOUND_FRACTION * largest_error, smallest, LONGEST_FAILURE * pixel)
        where = None if folder is None else Path(folder)
        settings = {"pixel_angle": pixel_angle, "ends": ends, "wavelengths": wavelengths, "bound": astuple(bound)}
        digest = "" if where is None else digest_of(optics, (light, far), **settings)
        kept = Kept(where, digest, source.blurred)
        if where is not None and (where / SUMMARY).exists():
            return cls.read(where)
        say = progress or silent
        expected = source.expected(ends, bound)
        texels = light.shape[0] * light.shape[1] * (4 if light.min() >= 0 and light.max() <= 1 else 8)
        require(expected * light.size * 4.0, f"A focus series of {expected} planes", "reduce the picture")
        say(0.0, f"about {expected} planes of focus, {expected * texels / 2**20:.0f} MB as textures")
        done = [ends[0]]

        def accepted(near: float, halfway: float) -> None:
            kept.forget(halfway)
            done.append(near)
            share = (near - ends[0]) / (ends[1] - ends[0])
            say(share, f"{len(done)} of about {1 + round((len(done) - 1) / share)} planes of focus")

        chosen = choose(kept, ends, bound, accepted)
        kept.finish(chosen.vergences)
        made = cls(
            chosen.vergences, tuple(kept(vergence) for vergence in chosen.vergences), far, chosen.errors, pixel_angle
        )
        if where is not None:
            made._finish(where)
        if len(chosen.errors) and (made.error[0] > median_error or made.error[1] > largest_error):
            warn(
                f"mixing two planes of focus has errors of up to {made.error[1]:.1f} steps of 8 bits (median "
                f"{made.error[0]:.2f}) in {made._beyond(largest_error):.0%} of the range of focus, where the picture "
                f"changes abruptly with focus or would need more than {MAX_INTERVALS + 1} planes: set "
                f"largest_error to what suffices instead of {largest_error:g}."
            )
        return made

    @classmethod
    def uniform(
        cls, picture: ArrayLike, optics: Optics, *, pixel_angle: float, defocus: tuple[float, float], **others: Any
    ) -> FocusSeries:
        """Make the series of a flat picture: uniform defocus of any value.

        Parameters
        ----------
        picture, optics, pixel_angle, others
            As for `of`. The picture is flat and, if the range allows, at the optics' own focus.
        defocus
            Smallest and largest defocus in dioptres, positive where the picture lies beyond the plane of focus. They
            are the vergences of the series: ``series.at(0.5)`` is defocused by 0.5 D.

        Examples
        --------
        >>> from focalgradient import Lens
        >>> spot = np.zeros((15, 15))
        >>> spot[7, 7] = 1.0
        >>> series = FocusSeries.uniform(spot, Lens(0.04, 4.0, 1.0), pixel_angle=1e-3, defocus=(0.0, 0.5))
        >>> float(series.at(0.0)[7, 7]), round(float(series.at(0.5)[7, 7]), 2)  # a disc of 2.5 pixels' radius
        (1.0, 0.05)
        """
        check_optics(optics)
        low, high = defocus
        if not (math.isfinite(low) and math.isfinite(high) and low <= high):
            raise InputError(
                f"defocus is {defocus!r}, but must be two finite numbers: give the smallest and the largest defocus in "
                "dioptres."
            )
        place = max(optics.focus_vergence, -low, 0.0)
        light = np.asarray(picture)
        flat = np.full(light.shape[:2], 1 / place if place > 0 else math.inf)
        made = cls.of(light, flat, optics, pixel_angle=pixel_angle, focus=(place + low, place + high), **others)
        return replace(made, vergences=tuple(vergence - place for vergence in made.vergences))

    @classmethod
    def read(cls, folder: str | os.PathLike[str]) -> FocusSeries:
        """Read a series stored in a folder.

        Raises
        ------
        InputError
            If there is none, or a file is missing or inconsistent with the others.
        """
        where = Path(folder)
        summary = read_json(where / SUMMARY, "the summary of a focus series")
        wrong = f"{printable(where / SUMMARY)} is not the summary of a focus series: make the series again."
        try:
            vergences = tuple(float(value) for value in summary["focus_dioptre"])
            errors = np.asarray([[np.nan if e is None else e for e in row] for row in summary["errors"]], float)
            errors = errors.reshape(-1, 2)
            angle = summary.get("pixel_angle_rad")
            pixel_angle = None if angle is None else float(angle)
        except (KeyError, TypeError, ValueError) as error:
            raise InputError(wrong) from error
        rising = all(near > far for far, near in pairwise(vergences)) and np.isfinite(vergences).all()
        known = pixel_angle is None or 0 < pixel_angle < math.inf
        if not (vergences and rising and known and len(errors) == len(vergences) - 1):
            raise InputError(wrong)
        distance = read_array(where / DISTANCE, "the distances of a focus series")
        planes = tuple(
            read_array(where / plane_name(vergence), "a picture of a focus series") for vergence in vergences
        )
        return cls(vergences, planes, distance, errors, pixel_angle).checked(where)

    def save(self, folder: str | os.PathLike[str]) -> None:
        """Store the series in a folder, which is created if necessary."""
        where = Path(folder)
        where.mkdir(parents=True, exist_ok=True)
        for vergence, plane in zip(self.vergences, self.planes, strict=True):
            write_whole(where / plane_name(vergence), partial(np.save, arr=plane))
        self._finish(where)

    def _finish(self, where: Path) -> None:
        write_whole(where / DISTANCE, partial(np.save, arr=self.distance))
        summary = {
            "written_by": MARK,
            "focus_dioptre": self.vergences,
            "errors": [[None if math.isnan(value) else value for value in row] for row in self.errors.tolist()],
            "pixel_angle_rad": self.pixel_angle,
            "size_px": [self.distance.shape[1], self.distance.shape[0]],
            "texture_bytes": self.texture_bytes,
        }
        write_whole(where / SUMMARY, json.dumps(summary, indent=1).encode())

    def checked(self, where: Path) -> FocusSeries:
        """Return the series, or raise `InputError` if its files are inconsistent."""
        shape = self.planes[0].shape
        for vergence, plane in zip(self.vergences, self.planes, strict=True):
            fits = shape in (self.distance.shape, (*self.distance.shape, 3)) and plane.shape == shape
            if not (fits and plane.dtype.kind == "f" and np.isfinite(plane).all()):
                raise InputError(
                    f"the picture at {vergence:g} D in {printable(where)} is inconsistent with the other files: make "
                    "the series again."
                )
        if self.distance.dtype.kind != "f" or not (self.distance > 0).all():
            raise InputError(f"the distances in {printable(where)} must all be positive: make the series again.")
        return self

    def __repr__(self) -> str:
        """Return the number of planes, their range, size and error."""
        height, width = self.distance.shape
        return (
            f"FocusSeries({len(self.vergences)} planes of {width} x {height} pixels, {self.vergences[0]:.3g} to "
            f"{self.vergences[-1]:.3g} D, error {self.error[0]:.2g} in the median and {self.error[1]:.2g} at most, "
            f"{self.texture_bytes / 2**20:.0f} MB as textures)"
        )

    @property
    def error(self) -> tuple[float, float]:
        """Largest median error and largest error of interpolation, in 8-bit steps; NaN if unknown."""
        return (float(self.errors[:, 0].max()), float(self.errors[:, 1].max())) if len(self.errors) else (0.0, 0.0)

    def _beyond(self, bound: float) -> float:
        """Return the fraction of the focus range in which the interpolation error exceeds the bound (8-bit steps)."""
        apart = np.diff(self.vergences)
        return float(apart[self.errors[:, 1] > bound].sum() / apart.sum())

    @property
    def within_white(self) -> bool:
        """Whether all radiance lies between black and white, so that 8-bit sRGB textures suffice."""
        return all(plane.min() >= 0 and plane.max() <= 1 for plane in self.planes)

    @property
    def texture_bytes(self) -> int:
        """Memory in bytes of the planes as textures: 4 bytes per pixel (sRGB), or 8 if radiance exceeds white."""
        return len(self.planes) * self.distance.size * (4 if self.within_white else 8)

    def place_of(self, focus: ArrayLike) -> FloatArray:
        """Return the fractional plane index of each focus (D, any shape): 1.25 is a quarter from plane 1 to plane 2.

        Foci beyond the ends are clipped.
        """
        places = np.arange(len(self.vergences), dtype=float)
        return np.asarray(np.interp(np.asarray(focus, float), self.vergences, places))

    def at(self, focus: ArrayLike) -> NDArray[np.float32]:
        """Return the picture at a focus in dioptres, in linear radiance, of the planes' shape.

        Parameters
        ----------
        focus
            A number, or H x W: the focus of each pixel; clipped to the range of the series.

        Raises
        ------
        InputError
            If it is not finite, or of another shape.
        """
        wanted = np.asarray(focus, float)
        if wanted.shape not in ((), self.distance.shape) or not np.isfinite(wanted).all():
            raise InputError(
                f"focus has shape {wanted.shape}, but must be a finite number of dioptres, or one for each pixel: "
                f"{self.distance.shape}."
            )
        place = self.place_of(wanted)
        first = np.clip(np.floor(place).astype(int), 0, max(len(self.planes) - 2, 0))
        after = np.minimum(first + 1, len(self.planes) - 1)
        if not wanted.ndim:
            return mix(self.planes[int(first)], self.planes[int(after)], float(place - first))
        picture = np.empty(self.planes[0].shape, np.float32)
        for number in np.unique(first):
            part = first == number
            pair = self.planes[number], self.planes[min(number + 1, len(self.planes) - 1)]
            picture[part] = mix(pair[0][part], pair[1][part], (place - first)[part])
        return picture

    def encoded(self, focus: ArrayLike, display: Display | None = None) -> NDArray[np.uint8]:
        """Return the picture at a focus (see `at`) as 8-bit values for a display (None: sRGB)."""
        return (display or Display()).encode(self.at(focus))

    def vergence_at(self, x: float, y: float, radius: float = 0.0) -> float | None:
        """Return the vergence (D) at a position, the median within `radius` pixels each way; None outside the picture.

        `x` and `y` are in pixels from the upper left corner of the picture.
        """
        height, width = self.distance.shape
        if not (0 <= x < width and 0 <= y < height):
            return None
        row, column, reach = int(y), int(x), round(radius)
        part = self.distance[max(row - reach, 0) : row + reach + 1, max(column - reach, 0) : column + reach + 1]
        return float(np.median(1 / part))

    def nearest(self, vergence: float) -> int:
        """Return the index of the plane whose focus is closest to a vergence in dioptres."""
        return int(np.argmin(np.abs(np.asarray(self.vergences) - vergence)))


def _ends(far: FloatArray, focus: tuple[float, float] | None) -> tuple[float, float]:
    low, high = (float(1 / far.max()), float(1 / far.min())) if focus is None else focus
    if not (math.isfinite(low) and math.isfinite(high) and low <= high):
        raise InputError(
            f"focus is {focus!r}, but must be the vergences of the farthest and the nearest plane: give dioptres."
        )
    return float(low), float(high)


WHOLE = (slice(None), slice(None))


@dataclass(frozen=True, slots=True, eq=False)
class _Source:
    """What a series is made of: a picture with its depth (m), seen through optics."""

    light: NDArray[np.float32]
    far: FloatArray
    optics: Optics
    pixel_angle: float
    wavelengths: int | None

    def check(self) -> None:
        """Validate the inputs of a series, by blurring a part of the picture, and its range."""
        check_optics(self.optics)
        refocused(self.optics, max(self.optics.focus_vergence, 0.0))
        checked_picture(self.light, self.far, channels=3)
        if np.abs(self.light).max() > HALF_MAX:
            raise InputError(f"picture contains values beyond {HALF_MAX:g}, but 1 is white: scale it down.")
        blur_picture(self.light[:1, :1], self.far[:1, :1], self.optics, pixel_angle=self.pixel_angle)

    @property
    def pixels(self) -> float:
        """Blur radius in pixels per dioptre."""
        return self.optics.aperture_diameter / 2 / self.pixel_angle

    def blurred(self, vergence: float, part: tuple[slice, slice] = WHOLE) -> NDArray[np.float32]:
        """Return a part of the picture, focused at a vergence (D)."""
        light, far, focused = self.light[part], self.far[part], refocused(self.optics, vergence)
        if self.wavelengths is None:
            blurred = blur_picture(light, far, focused, pixel_angle=self.pixel_angle)
            # Overshoot beyond black or white, where the picture has none, does not justify 16-bit textures.
            return np.clip(blurred, min(float(light.min()), 0.0), max(float(light.max()), 1.0))
        from focalgradient.eye import retinal_image

        colours = np.repeat(light[..., None], 3, axis=2) if light.ndim == 2 else light
        return retinal_image(colours, far, focused, pixel_angle=self.pixel_angle, wavelengths=self.wavelengths)

    def expected(self, ends: tuple[float, float], bound: Bound) -> int:
        """Return the number of planes expected for the bound, from the density at the most demanding of some foci.

        Each of `PROBE_COUNT` foci is tried in the part of the picture with the most contrast near focus.
        """
        if not ends[1] > ends[0]:
            return 1
        grey, vergence = self.light if self.light.ndim == 2 else self.light.mean(axis=2), 1 / self.far
        corners = [(i, j) for i in range(0, grey.shape[0], TILE) for j in range(0, grey.shape[1], TILE)]
        parts = [(slice(i, i + TILE), slice(j, j + TILE)) for i, j in corners]
        contrast = np.array([float(grey[part].std()) for part in parts])
        depth = np.array([float(np.median(vergence[part])) for part in parts])
        span, density = ends[1] - ends[0], []
        for share in (np.arange(PROBE_COUNT) + 0.5) / PROBE_COUNT:
            focus = ends[0] + share * span
            part = parts[int(np.argmax(contrast / (1 + self.pixels * np.abs(depth - focus))))]
            picture = cache(partial(self.blurred, part=part))
            # Start with planes one or two pixels of blur apart.
            halvings = max(0, math.floor(math.log2(max(span * self.pixels, 1.0))))
            while True:
                step = span / 2**halvings
                first = ends[0] + step * math.floor((focus - ends[0]) / step)
                if step < 2 * bound.smallest_step or bound.holds(picture, first, first + step):
                    break
                halvings += 1
            density.append(2**halvings)
        return 1 + max(density)
