"""Cone mosaic: sampling of a retinal image by cones, with or without photon noise, and interpolation to an image.

Cones lie on a golden-angle spiral about the fovea: the kth at k times 137.5 degrees, at the radius that contains k
cones by `cone_density`. Density is then that of the retina at every place, and neighbours are about evenly spaced
everywhere. A real mosaic is less regular, and closer to hexagonal.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Annotated, get_args

import numpy as np
from numpy.typing import ArrayLike
from scipy.ndimage import map_coordinates

from focalgradient.arrays import FloatArray
from focalgradient.errors import InputError, check_finite, check_number, checked
from focalgradient.eye.periphery import FARTHEST, TOWARDS, Meridian
from focalgradient.eye.ranges import PixelAngle
from focalgradient.quantities import Range, Seed
from focalgradient.retina.cone_density import cone_density
from focalgradient.view import View

__all__ = ["ConeMosaic"]


GOLDEN_ANGLE = math.pi * (3 - math.sqrt(5))
"""Angle between successive cones of the spiral, in radians."""

APERTURE = 0.7
"""Diameter of a cone's aperture over the distance between cones, as in ISETBio."""

STEP_DEG = 0.005
"""Spacing in degrees of the radii in the table of cumulative cone counts."""

RINGS = ((0.0, 1), (0.5, 6), (1.0, 12))
"""Sample points of a cone's aperture: radii over 5/6 of the aperture's radius, and the number of points at each."""


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class ConeMosaic:
    """Cones under a picture; made by `ConeMosaic.over`.

    Parameters
    ----------
    place
        Directions of N cones in radians from the picture's middle, x to the right and y down: N x 2.
    spacing
        Distance of neighbours in radians in a hexagonal mosaic with the local density of all cones: N.
    cell
        Solid angle in steradians for each cone of the class: N.
    shape, pixel_angle
        Height and width of the picture in pixels, and angle of a pixel in radians.

    Examples
    --------
    A tenth of a degree at the fovea, and at 10 degrees in the temporal field.

    >>> angle = np.radians(0.1) / 24
    >>> [round(len(ConeMosaic.over((24, 24), angle, eccentricity_deg=far)), -1) for far in (0, 10)]
    [140, 10]
    """

    place: FloatArray
    spacing: FloatArray
    cell: FloatArray
    shape: tuple[int, int]
    pixel_angle: float

    @classmethod
    @checked
    def over(
        cls,
        shape: tuple[int, int],
        pixel_angle: PixelAngle,
        *,
        eccentricity_deg: Annotated[float, Range("degrees", 0)] = 0.0,
        meridian: Meridian = "temporal",
        share: Annotated[float, Range("shares of the cones", most=1, positive=True)] = 1.0,
        seed: Seed = 0,
    ) -> ConeMosaic:
        """Return the cones of a right eye that lie under a picture.

        Parameters
        ----------
        shape, pixel_angle
            Height and width of the picture in pixels, and angle of a pixel in radians.
        eccentricity_deg, meridian
            Location of the picture's centre in the visual field, in degrees from the fovea.
        share
            Share of the cones that belong to the class, chosen at random: about 0.07 for S cones (Curcio et al. 1991);
            their absence within 0.3 degree is not modelled.
        seed
            Random seed of this choice.

        Raises
        ------
        InputError
            If a number is out of range, or the picture reaches beyond 60 degrees.
        """
        if min(shape) < 1:
            raise InputError(f"shape is {shape!r}, but must be a height and width in pixels: give two of 1 or more.")
        height, width = (math.degrees(pixel_angle) * n for n in shape)
        reach = math.hypot(height, width) / 2
        if eccentricity_deg + reach > FARTHEST:
            raise InputError(
                f"the picture reaches {eccentricity_deg + reach:.3g} degrees from the fovea, but cones are known to "
                f"{FARTHEST:g}: crop it, or check that pixel_angle is in radians."
            )
        middle = eccentricity_deg * np.asarray(TOWARDS[meridian], dtype=float)
        place, density = _spiral(eccentricity_deg, math.atan2(middle[1], middle[0]), reach)
        place = place - middle
        inside = (np.abs(place[:, 0]) <= width / 2) & (np.abs(place[:, 1]) <= height / 2)
        inside &= np.random.default_rng(seed).random(len(inside)) < share
        area = np.radians(1.0) ** 2 / density[inside]  # of each cone of all classes
        spacing = np.sqrt(2 / math.sqrt(3) * area)
        return cls(np.radians(place[inside]), spacing, area / share, (int(shape[0]), int(shape[1])), pixel_angle)

    def __len__(self) -> int:
        """Return the number of cones."""
        return len(self.spacing)

    def __repr__(self) -> str:
        """Return the number of cones and the size of the picture."""
        return f"ConeMosaic({len(self)} cones under {self.shape[0]} x {self.shape[1]} pixels)"

    def catch(self, image: ArrayLike, *, quanta: float | None = None, seed: int = 0) -> FloatArray:
        """Return each cone's catch of a retinal image, the mean over the cone's aperture: N.

        Parameters
        ----------
        image
            Linear light on the retina, H x W, as in a view.
        quanta
            Quanta caught by the class in one pixel of mean light (`Photons.caught`); the catch of each cone then has
            Poisson noise. None: no noise.
        seed
            Random seed of the noise.

        Raises
        ------
        InputError
            If the image has another shape, or is negative or dark with `quanta`.

        Examples
        --------
        >>> mosaic = ConeMosaic.over((24, 24), np.radians(0.1) / 24)
        >>> flat = mosaic.catch(np.full((24, 24), 2.0), quanta=500.0)
        >>> bool(abs(flat.mean() - 2.0) < 0.05)
        True
        """
        light = check_finite("image", image, "linear light")
        if light.shape != self.shape:
            raise InputError(
                f"image has shape {light.shape}, but the mosaic lies under {self.shape}: make it for both."
            )
        total, count = np.zeros(len(self)), 0
        for radius, points in RINGS:
            for turn in 2 * np.pi * (np.arange(points) + 0.25 * radius) / points:
                offset = 5 / 6 * APERTURE / 2 * radius * self.spacing
                total += self._read(light, offset * math.cos(turn), offset * math.sin(turn))
                count += 1
        caught = total / count
        if quanta is None:
            return caught
        check_number("quanta", quanta, "quanta in a pixel", positive=True)
        if light.min() < 0 or not light.mean() > 0:
            raise InputError("image is dark or has negative values, but quanta come from light above 0: clip it.")
        # Cubic interpolation may undershoot dark edges.
        expected = np.clip(caught, 0, None) / light.mean() * quanta * self.cell / self.pixel_angle**2
        drawn = np.random.default_rng(seed).poisson(expected)
        return np.asarray(drawn * light.mean() * self.pixel_angle**2 / (quanta * self.cell))

    def image(self, caught: ArrayLike) -> FloatArray:
        """Interpolate the catches of N cones linearly to a picture, H x W.

        >>> mosaic = ConeMosaic.over((16, 16), np.radians(0.1) / 16)
        >>> bool(np.allclose(mosaic.image(np.full(len(mosaic), 0.5)), 0.5))
        True
        """
        values = check_finite("caught", caught, "linear light")
        if values.shape != self.spacing.shape or len(self) < 4:
            raise InputError(
                f"caught has shape {values.shape}, but the mosaic has {len(self)} cones: give what each "
                "caught, of 4 or more cones."
            )
        height, width = self.shape
        x = (np.arange(width) - (width - 1) / 2) * self.pixel_angle
        y = (np.arange(height) - (height - 1) / 2)[:, None] * self.pixel_angle
        x, y = np.broadcast_arrays(x, y)
        from scipy.interpolate import LinearNDInterpolator, NearestNDInterpolator  # deferred: slow to import

        interpolated = np.asarray(LinearNDInterpolator(self.place, values)(x, y))
        outside = np.isnan(interpolated)
        interpolated[outside] = NearestNDInterpolator(self.place, values)(x[outside], y[outside])
        return interpolated

    def view(self, view: View, *, quanta: float | None = None, seed: int = 0) -> View:
        """Return a view as sampled by the mosaic: the optional last step of view formation.

        Parameters as for `catch`; the view's optics stay, and know nothing of the mosaic's aliases.

        Raises
        ------
        InputError
            If the view's pixels are not those of the mosaic.
        """
        if not math.isclose(view.pixel_angle, self.pixel_angle, rel_tol=1e-6):
            raise InputError(
                f"the view's pixels subtend {view.pixel_angle:g} and the mosaic's {self.pixel_angle:g} radians: make "
                "the mosaic for the view."
            )
        seen = self.image(self.catch(view.image, quanta=quanta, seed=seed))
        return replace(view, image=seen.astype(view.image.dtype))

    def _read(self, light: FloatArray, right: FloatArray | float, down: FloatArray | float) -> FloatArray:
        """Return the light at each cone's place plus an offset (rad)."""
        height, width = self.shape
        column = (self.place[:, 0] + right) / self.pixel_angle + (width - 1) / 2
        row = (self.place[:, 1] + down) / self.pixel_angle + (height - 1) / 2
        return np.asarray(map_coordinates(light, np.stack([row, column]), order=3, mode="nearest"))


def _spiral(eccentricity: float, direction: float, reach: float) -> tuple[FloatArray, FloatArray]:
    """Return the cones (N x 2, degrees from the fovea) within `reach` of a place and a margin, and their density."""
    near, far = max(eccentricity - reach, 0.0), min(eccentricity + reach, FARTHEST)
    radius = np.arange(0.0, FARTHEST + STEP_DEG / 2, STEP_DEG)
    within = {side: _within(side) for side in get_args(Meridian)}
    first = math.floor(min(np.interp(near, radius, numbers) for numbers in within.values()))
    last = math.ceil(max(np.interp(far, radius, numbers) for numbers in within.values()))
    number = np.arange(first, last + 1)
    angle = GOLDEN_ANGLE * number
    if eccentricity > reach:  # only what lies in the direction of the picture
        turn = (angle - direction + np.pi) % (2 * np.pi) - np.pi
        number = number[np.abs(turn) <= math.asin(reach / eccentricity)]
        angle = GOLDEN_ANGLE * number
    cosine, sine = np.cos(angle), np.sin(angle)
    sides = [("temporal", cosine > 0, cosine), ("nasal", cosine <= 0, cosine)]
    sides += [("inferior", sine > 0, sine), ("superior", sine <= 0, sine)]
    shares = {side: np.where(is_there, part**2, 0.0) for side, is_there, part in sides}
    low, high = np.zeros(len(number)), np.full(len(number), FARTHEST)
    for _ in range(40):  # cones within a radius grow with it
        middle = (low + high) / 2
        count = sum(shares[side] * np.interp(middle, radius, within[side]) for side in within)
        low, high = np.where(count < number + 0.5, middle, low), np.where(count < number + 0.5, high, middle)
    density = np.asarray(sum(shares[side] * cone_density(low, side) for side in get_args(Meridian)))
    return np.column_stack([low * cosine, low * sine]), density


@lru_cache(maxsize=4)
def _within(side: Meridian) -> FloatArray:
    """Return the cumulative number of cones by radius (`STEP_DEG` apart), for a rotationally symmetric density."""
    radius = np.arange(0.0, FARTHEST + STEP_DEG / 2, STEP_DEG)
    ring = 2 * np.pi * radius * cone_density(np.minimum(radius, FARTHEST), side)
    return np.concatenate([[0.0], np.cumsum((ring[1:] + ring[:-1]) / 2 * STEP_DEG)])
