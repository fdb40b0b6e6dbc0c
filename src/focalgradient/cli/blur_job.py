"""Blurring of one picture at every focus, for `focalgradient blur`."""

from __future__ import annotations

import math
import warnings
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from focalgradient.cli.blur_eye import spectra_of
from focalgradient.cli.options import gamma_of, read_depth_file
from focalgradient.cli.program import announce
from focalgradient.cli.through_optics import pixel_angle_of, refuse_slips
from focalgradient.errors import FocalGradientWarning, InputError
from focalgradient.files import printable
from focalgradient.plausibility import check_frame
from focalgradient.progress import Progress

if TYPE_CHECKING:
    from focalgradient.display import Display
    from focalgradient.optics import Optics
    from focalgradient.psf import Psf

__all__ = ["DISTANCE", "SINGLE", "BlurJob", "share_of"]

SECONDS_PER_MEGAPIXEL = 0.55
"""Computing time of one picture through one lens, in s per megapixel on two cores: 1920 x 1080 pixels in colour with a
blur of 15 pixels took 1.1 s (`benchmarks/blurred_pictures.py --speed`).
"""

SINGLE, DISTANCE = "blurred", "distance.npy"
"""Stem of the files made from a single picture; and the file of its distances in m, with holes filled."""

LIGHTS = 3
"""Number of spectral bands of a display if its spectra are unknown, each blurred at one focus."""

CLIPPED = 1e-3
"""Proportion of values above the display's white beyond which a warning is issued."""


@dataclass(frozen=True, slots=True, eq=False)
class BlurJob:
    """Blurring of one picture at every focus."""

    picture: Path
    depth: Path
    stem: str
    options: dict[str, Any]
    optics: Sequence[Optics]
    focus: tuple[float, ...]
    display: Display | None
    shape: Psf | None  # of the blur; None: the optics' own, or a disc
    frame: Any = None

    def run(self, say: Progress, to_come: int) -> tuple[dict[str, Any], dict[str, Any]]:
        """Return the files to write, by name, and the summary; announce the time for `to_come` such pictures."""
        from focalgradient.photographs import picture_of, read_picture

        say(0.0, "reading")
        encoding = self.options["encoding"]
        shown = (
            read_picture(self.picture, encoding) if self.frame is None else picture_of(self.frame, encoding or "srgb")
        )
        if (dark := float((shown.light < 0).mean())) > 0:
            warnings.warn(
                f"{printable(self.picture)}: {dark:.2%} of the values are negative and are shown "
                "as black: check how the picture was made.",
                FocalGradientWarning,
                stacklevel=2,
            )
        angle = pixel_angle_of(self.options, shown.light.shape[1], self.display)
        distances = read_depth_file(self.depth, self.options, angle)
        if distances.metres.shape != shown.light.shape[:2]:
            (h, w), (dh, dw) = shown.light.shape[:2], distances.metres.shape
            raise InputError(
                f"{printable(self.picture)} is {w} x {h} pixels but {printable(self.depth)} is {dw} x {dh}, but both "
                "must have the same size: scale or crop one of them."
            )
        refuse_slips(distances.metres, self.optics, angle, self.options["depth_unit"])
        check_frame(angle, shown.light.shape)
        parts = [
            self._parts(optics, np.append(distances.metres, [metres] * self.options["to_show"]), angle)
            for metres, optics in zip(self.focus, self.optics, strict=True)
        ]
        pictures = to_come * sum(parts)
        announce(SECONDS_PER_MEGAPIXEL * 1e-6 * distances.metres.size * pictures, f"{pictures} blurred pictures")
        writers: dict[str, Any] = {}
        largest, residuals = [], []
        for number, (metres, optics, lights) in enumerate(zip(self.focus, self.optics, parts, strict=True)):
            part = share_of(say, number, len(self.focus))
            if self.options["to_show"]:
                light, residual = self._to_show(shown.light, distances.metres, optics, metres, angle, lights, part)
                residuals.append(residual)
            else:
                light = self._seen(shown.light, distances.metres, optics, angle, lights, part)
            largest.append(_largest(optics, distances.metres, angle))
            writers[f"{self.stem}-{metres}m.png"] = self._png(light)
            writers[f"{self.stem}-{metres}m.npy"] = partial(_save, light)
        low, high = float(distances.metres.min()), float(distances.metres.max())
        if self.stem == SINGLE:
            writers[DISTANCE] = partial(_save, distances.metres.astype(np.float32))
        facts = {
            "picture": printable(self.picture),
            "encoding": shown.encoding,
            "pixel_type": shown.pixel_type,
            "size_px": list(shown.light.shape[1::-1]),
            "pixel_arcmin": 60 * math.degrees(angle),
            "distance_m": [low, high],
            "share_of_holes_filled": distances.filled,
            "largest_blur_px": largest,
            **({"wavelengths": parts} if self.options["chromatic"] else {}),
            **({"residuals": residuals} if residuals else {}),
        }
        return writers, facts

    def _parts(self, optics: Optics, metres: Any, angle: float) -> int:
        """Return the number of wavelength samples, each blurred at its own focus."""
        if not self.options["chromatic"]:
            return 1
        if self.options["wavelengths"] is not None:
            return int(self.options["wavelengths"])
        if find_spec("colour") is None and self.options["illuminant"] is None:
            warnings.warn(
                "colour-science is not installed, so red, green and blue are each blurred at one focus, which is "
                "in error by up to 0.1 of white: install focalgradient[eye].",
                FocalGradientWarning,
                stacklevel=2,
            )
            return LIGHTS
        from focalgradient.eye import parts_needed

        eye: Any = optics
        return parts_needed(metres, eye, pixel_angle=angle, basis=spectra_of(self.options))

    def _seen(
        self, light: Any, metres: Any, optics: Optics, angle: float, parts: int, tell: Progress
    ) -> np.ndarray[Any, np.dtype[np.float32]]:
        from focalgradient.render import blur_picture

        if not self.options["chromatic"]:
            return blur_picture(light, metres, optics, pixel_angle=angle, psf=self.shape, progress=tell)
        eye: Any = optics
        colours = np.repeat(light[..., None], 3, axis=2) if light.ndim == 2 else light
        if self.options["wavelengths"] is not None or find_spec("colour") is not None:
            from focalgradient.eye import retinal_image

            basis = spectra_of(self.options)
            return retinal_image(colours, metres, eye, pixel_angle=angle, wavelengths=parts, basis=basis, progress=tell)
        from focalgradient.stimuli import depth_rating

        seen = [
            blur_picture(
                colours[..., n], metres, eye.in_light(nm), pixel_angle=angle, progress=share_of(tell, n, LIGHTS)
            )
            for n, nm in enumerate(depth_rating.LIGHTS)
        ]
        return np.stack(seen, axis=-1)

    def _to_show(
        self, light: Any, metres: Any, eye: Any, screen: float, angle: float, parts: int, tell: Progress
    ) -> tuple[Any, dict[str, list[float]]]:
        """Return what a display at `screen` (m) must show, and the residual errors of it and of simpler pictures."""
        from focalgradient.eye import chromatic_stimulus

        colours = np.repeat(light[..., None], 3, axis=2) if light.ndim == 2 else light
        white = self.options["white"]
        found = chromatic_stimulus(
            colours / white,
            metres,
            eye,
            screen=screen,
            pixel_angle=angle,
            wavelengths=parts,
            basis=spectra_of(self.options),
            progress=tell,
        )
        names = ("residual", "unlimited", "scene_shown", "alike")
        return white * found.shown, {name: list(getattr(found, name)) for name in names}

    def _png(self, light: Any) -> bytes:
        """Return the picture encoded for the display, as PNG."""
        from focalgradient.display import Display
        from focalgradient.photographs.pictures import png_of

        shares = light / np.float32(self.options["white"])
        if (beyond := float((shares > 1).mean())) > CLIPPED:
            warnings.warn(
                f"{beyond:.1%} of the values are brighter than white and are clipped in the PNG: give a larger "
                "--white.",
                FocalGradientWarning,
                stacklevel=2,
            )
        screen = self.display or Display(gamma=gamma_of(self.options["gamma"]))
        return png_of(screen.encode(np.clip(shares, 0, 1)))


def share_of(say: Progress, number: int, count: int) -> Progress:
    """Return the progress callback for one part of `count`."""
    return lambda share, words: say((number + share) / count, words)


def _save(light: Any, path: Path) -> None:
    np.save(path, light)


def _largest(optics: Optics, metres: Any, angle: float) -> float:
    """Return the radius of the largest blur disc, in pixels."""
    return float(np.abs(optics.focus_vergence - 1 / metres).max() * optics.aperture_diameter / 2 / angle)
