"""Display model: conversion between radiance and 8-bit values and between pixels and visual angle; limits on blur.

Radiance is expressed as a fraction of the display's white (1 is the maximum). Exposure is applied beforehand, so that
all pictures of one scene share the same exposure.
"""

from __future__ import annotations

import math
import os
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from focalgradient.arrays import FloatArray
from focalgradient.errors import InputError, check_fields
from focalgradient.files import printable, read_toml
from focalgradient.plausibility import check_display, check_screen_width, given_as
from focalgradient.quantities import Range
from focalgradient.srgb import linear_to_srgb, srgb_to_linear

__all__ = ["CARD", "EYE_STEP", "WEBER", "Display"]

CARD = (85.60e-3, 53.98e-3)
"""Width and height of a bank card in metres (ISO/IEC 7810, ID-1)."""

WEBER = 0.28
"""Weber fraction for blur discrimination: the smallest of the published values, 0.28 to 0.56."""

EYE_STEP = 0.06 * 4.5e-3
"""Smallest detectable difference in blur-disc diameter, in radians (0.9 arcmin): a threshold of 0.05 to 0.07 D through
a pupil of 3 to 6 mm."""


@dataclass(frozen=True, slots=True)
class Display:
    """An 8-bit display viewed perpendicular to its centre.

    Parameters
    ----------
    size_px
        Width and height in pixels.
    pixel_pitch
        Pixel pitch in metres.
    distance
        Viewing distance from the eye to the screen, in metres.
    gamma
        Exponent of luminance over pixel value; three exponents (red, green, blue gun) where they differ; or ``"sRGB"``
        for the sRGB transfer function (IEC 61966-2-1).
    white
        Luminance of white, in cd/m^2.
    dither
        Whether levels between two 8-bit values are rendered by random dithering, which is unbiased on average.

    Raises
    ------
    InputError
        If a value is not positive, or the exponent is not between 1 and 4.

    Examples
    --------
    >>> display = Display(size_px=(1920, 1080), pixel_pitch=0.2767e-3, distance=0.57)
    >>> round(display.pixels_per_degree, 2), tuple(round(side, 1) for side in display.size_deg)
    (35.95, (50.0, 29.4))
    """

    size_px: tuple[int, int] = (1920, 1080)
    pixel_pitch: Annotated[float, Range("metres", positive=True)] = 0.2767e-3
    distance: Annotated[float, Range("metres", positive=True)] = 0.57
    gamma: float | tuple[float, float, float] | Literal["sRGB"] = "sRGB"
    white: Annotated[float, Range("cd/m^2", positive=True)] = 100.0
    dither: bool = False

    def __post_init__(self) -> None:
        check_fields(self)
        if not (len(self.size_px) == 2 and all(isinstance(side, int) and side > 0 for side in self.size_px)):
            raise InputError(
                f"size_px is {self.size_px!r}, but must be a display's positive width and height in pixels."
            )
        check_display(self.pixel_pitch, self.distance, self.size_px[0])
        guns = self.gamma if isinstance(self.gamma, tuple) and len(self.gamma) == 3 else (self.gamma,)
        if self.gamma != "sRGB" and not all(isinstance(gun, (int, float)) and 1 <= gun <= 4 for gun in guns):
            raise InputError(
                f"gamma is {self.gamma!r}, but must be a number between 1 and 4, three of them, or 'sRGB'."
            )

    @classmethod
    def of_width(cls, width: float, size_px: tuple[int, int] = (1920, 1080), **others: Any) -> Display:
        """Return a display whose screen is `width` metres wide; `others` are further parameters of `Display`.

        >>> round(Display.of_width(0.531).pixel_pitch * 1e3, 4)
        0.2766
        """
        display = cls(size_px, width / max(size_px[0], 1), **others)  # the size is checked there
        check_screen_width(width, display.distance)
        return display

    @classmethod
    def read(cls, path: str | os.PathLike[str]) -> Display:
        """Return the display described by a TOML file.

        Parameters
        ----------
        path
            File with the keys ``pixel_pitch_um`` (micrometres), ``distance_m`` (metres) and, if they differ from the
            defaults, ``size_px``, ``gamma``, ``white`` and ``dither``.

        Raises
        ------
        InputError
            If it cannot be read, or a key is unknown, missing or invalid.
        """
        table = read_toml(Path(path), "a display's file")
        known = {"size_px", "pixel_pitch_um", "distance_m", "gamma", "white", "dither"}
        if unknown := sorted(set(table) - known):
            raise InputError(
                f"{printable(path)} has the key {unknown[0]!r}, but a display may have only "
                f"{', '.join(sorted(known))}: remove it."
            )
        try:
            size, pitch = tuple(table.pop("size_px", cls().size_px)), 1e-6 * table.pop("pixel_pitch_um")
            with given_as({"pixel_pitch": ("pixel_pitch_um", "um"), "distance": ("distance_m", "m")}):
                return cls(size, pitch, table.pop("distance_m"), **table)
        except (KeyError, TypeError) as error:
            raise InputError(
                f"{printable(path)} does not describe a display: give size_px = [width, height], pixel_pitch_um, "
                "distance_m and gamma."
            ) from error

    @property
    def pixels_per_degree(self) -> float:
        """Pixels per degree of visual angle at the screen's centre (the density increases towards the edges)."""
        return math.radians(1) * self.distance / self.pixel_pitch

    @property
    def size_deg(self) -> tuple[float, float]:
        """Width and height of the screen in degrees of visual angle."""
        return self.degrees(self.size_px[0]), self.degrees(self.size_px[1])

    def degrees(self, pixels: float) -> float:
        """Return the visual angle in degrees of a length in `pixels` centred on the screen.

        >>> round(Display(pixel_pitch=1e-3, distance=0.5).degrees(1000), 6)  # 1 m seen from 0.5 m
        90.0
        """
        return math.degrees(2 * math.atan(pixels * self.pixel_pitch / 2 / self.distance))

    def arcmin(self, pixels: float) -> float:
        """Return the visual angle in minutes of arc of a length in `pixels` at the screen's centre."""
        return 60 * pixels / self.pixels_per_degree

    def decode(self, values: ArrayLike) -> FloatArray:
        """Return the linear radiance (white = 1) of 8-bit `values`; with one gamma per gun, the last axis is colour.

        >>> Display(gamma=2.0).decode([0, 51, 255]).round(6).tolist()
        [0.0, 0.04, 1.0]
        """
        values = np.asarray(values)
        if values.size and not (values.min() >= 0 and values.max() <= 255):
            raise InputError("values exceed the range 0 to 255 of an 8-bit picture: clip or rescale them.")
        share = values / 255
        if isinstance(self.gamma, tuple) and (not values.ndim or values.shape[-1] != 3):
            raise InputError(
                "values have no axis of 3 colours, which a display with one gamma per gun needs: give them as the "
                "last axis."
            )
        if self.gamma != "sRGB":
            return np.asarray(share ** np.asarray(self.gamma), float)
        return srgb_to_linear(share)

    def encode(self, light: ArrayLike, seed: int = 0) -> NDArray[np.uint8]:
        """Return the 8-bit values that best display linear radiance `light` (white = 1), clipped to the range.

        With one gamma per gun, the last axis of an H x W x 3 array is colour; any other array is taken as grey and
        gains an axis of 3 colours.

        Parameters
        ----------
        light
            Linear radiance, any shape; 1 is white.
        seed
            Seed of the dithering, if the display dithers.

        Raises
        ------
        InputError
            If the radiance contains values that are not finite.

        Examples
        --------
        >>> Display(gamma=2.0).encode([0.0, 0.04, 1.0, 1.5]).tolist()
        [0, 51, 255, 255]
        >>> Display(gamma=(2.0, 1.0, 4.0)).encode(0.04).tolist()
        [51, 10, 114]
        """
        light = np.asarray(light, float)
        if isinstance(self.gamma, tuple):
            colours = np.moveaxis(light, -1, 0) if light.ndim == 3 and light.shape[-1] == 3 else [light] * 3
            guns = [replace(self, gamma=gamma) for gamma in self.gamma]
            values = [gun.encode(own, 3 * seed + at) for at, (gun, own) in enumerate(zip(guns, colours, strict=True))]
            return np.stack(values, axis=-1)
        if not np.isfinite(light).all():
            raise InputError(
                "light contains values that are not finite, but must be fractions of the display's white: repair or "
                "mask them."
            )
        light = np.clip(light, 0, 1)
        levels = self.decode(np.arange(256))
        if not self.dither:
            share = linear_to_srgb(light) if self.gamma == "sRGB" else light ** (1 / self.gamma)
            return np.rint(255 * share).astype(np.uint8)
        below = np.minimum(np.searchsorted(levels, light, side="right") - 1, 254)
        part = (light - levels[below]) / (levels[below + 1] - levels[below])
        above = np.random.default_rng(seed).random(light.shape) < part
        return (below + above).astype(np.uint8)

    def step(self, light: float) -> float:
        """Return the quantisation step, as a fraction of white, at the radiance `light`.

        With one gamma per gun, the largest of the three steps.

        >>> round(255 * Display(gamma=1.0).step(0.5), 6)
        1.0
        """
        if isinstance(self.gamma, tuple):
            return max(replace(self, gamma=gamma).step(light) for gamma in self.gamma)
        below = min(int(np.searchsorted(self.decode(np.arange(256)), light, side="right")) - 1, 254)
        low, high = self.decode([below, below + 1]).tolist()
        return float(high - low)

    def check_steps(self, diameters: Sequence[float]) -> None:
        """Raise `InputError` if the display, or its viewer, cannot resolve the step between two blur-disc diameters.

        A disc of diameter d px displayed on pixels has a standard deviation of hypot(d / 4, 1 / sqrt(12)) px: that of
        the disc combined with that of a square pixel. The display resolves a step to the next larger disc if this
        standard deviation increases by at least `WEBER`, the Weber fraction for blur discrimination (from no blur this
        takes 0.92 px). The viewer resolves it if the diameters differ by at least `EYE_STEP`.

        Parameters
        ----------
        diameters
            Blur-disc diameters in pixels, at one location of the pictures to be distinguished.

        Raises
        ------
        InputError
            If two neighbouring diameters, after sorting, differ by less than that.

        Examples
        --------
        >>> Display().check_steps([0.0, 1.0, 2.0, 4.0])
        >>> Display().check_steps([0.0, 0.5])
        Traceback (most recent call last):
        focalgradient.errors.InputError: the smallest step of blur, 0 to 0.5 px, increases the spread of light on ...
        """
        ordered = sorted(diameters)
        for small, large in pairwise(ordered):
            growth = math.hypot(large / 4, math.sqrt(1 / 12)) / math.hypot(small / 4, math.sqrt(1 / 12)) - 1
            if growth < WEBER:
                raise InputError(
                    f"the smallest step of blur, {small:.2g} to {large:.2g} px, increases the spread of light on the "
                    f"display's pixels by {growth:.0%}, but the threshold of people is {WEBER:.0%}: give the pictures "
                    "more pixels, or make the apertures larger or more different."
                )
            step = math.radians(self.arcmin(large - small) / 60)
            if step < EYE_STEP:
                raise InputError(
                    f"the smallest step of blur, {small:.2g} to {large:.2g} px, is "
                    f"{self.arcmin(large - small):.2g} arcmin at the viewing distance of {self.distance:g} m, but the "
                    f"threshold of the eye is {60 * math.degrees(EYE_STEP):.2g}: come closer, or use larger pixels."
                )

    def check_f_numbers(self, numbers: Sequence[float], diameter: float) -> None:
        """Refuse f-numbers whose blurs the display or its viewer cannot distinguish; name the largest that would do.

        Parameters
        ----------
        numbers
            The f-numbers; ``inf`` is a pinhole.
        diameter
            Of the blur disc at f/1, in pixels, at the place in the pictures where the apertures are compared.

        Raises
        ------
        InputError
            As `check_steps` does.

        Examples
        --------
        >>> Display().check_f_numbers([math.inf, 22, 11], diameter=40.0)
        >>> Display().check_f_numbers([math.inf, 64, 11], diameter=40.0)
        Traceback (most recent call last):
        focalgradient.errors.InputError: f/64 after the pinhole: the smallest step of blur, 0 to 0.62 px, ... do.
        """
        for large, small in pairwise(sorted(numbers, reverse=True)):
            before = diameter / large
            try:
                self.check_steps([before, diameter / small])
            except InputError as error:
                pixel_sd = math.sqrt(1 / 12)
                carried = 4 * math.sqrt(((1 + WEBER) * math.hypot(before / 4, pixel_sd)) ** 2 - pixel_sd**2)
                seen = before + 60 * math.degrees(EYE_STEP) / self.arcmin(1.0)
                largest = math.floor(10 * diameter / max(carried, seen)) / 10  # down: it passes its own check
                name = "the pinhole" if math.isinf(large) else f"f/{large:g}"
                would = (
                    f"f/{largest:g} is the largest f-number after {name} that would do"
                    if largest >= 0.5
                    else (f"no f-number after {name} would do")
                )
                reason = str(error).removesuffix(".")
                raise InputError(f"f/{small:g} after {name}: {reason}; at this size {would}.") from error
