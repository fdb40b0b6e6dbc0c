"""Frames that the default method rejects, each with one cause that is known."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any

import cv2
import numpy as np
from blurred import Camera, lens, texture, wall
from numpy.typing import NDArray
from scipy import ndimage

from focalgradient import View
from focalgradient.srgb import linear_to_srgb, srgb_to_linear

APERTURES = (lens(16), lens(4))
FOCI = (lens(5.6, 0.85), lens(5.6, 1.4))
TILE = 512


@dataclass(frozen=True)
class Frame:
    """Views, the cause for which they show no depth, and limits of the search."""

    cause: str
    what: str
    views: Sequence[View]
    limits: dict[str, Any] = field(default_factory=lambda: {"near": 0.85})


def changed(view: View, image: NDArray[Any]) -> View:
    return View(np.asarray(image, np.float32), view.optics, view.pixel_angle)


def jpeg(view: View, quality: int) -> View:
    pixels = np.rint(255 * linear_to_srgb(np.clip(0.4 * view.image, 0, 1))).astype(np.uint8)
    pixels = cv2.imdecode(cv2.imencode(".jpg", pixels, [cv2.IMWRITE_JPEG_QUALITY, quality])[1], cv2.IMREAD_GRAYSCALE)
    return changed(view, srgb_to_linear(pixels / 255) / 0.4)


def sharpened(view: View) -> View:
    """A view as a camera stores it that sharpens its pictures (unsharp mask)."""
    return changed(view, view.image + 1.5 * (view.image - ndimage.gaussian_filter(view.image, 1.5)))


def squares(seed: int) -> NDArray[np.float64]:
    """Squares on blank paper."""
    random = np.random.default_rng([seed, 7])
    sheet = np.full((TILE, TILE), 1.4)
    for down, right in random.integers(0, TILE, (30, 2)):
        side = random.integers(8, 24)
        place = np.ix_(np.arange(down, down + side) % TILE, np.arange(right, right + side) % TILE)
        sheet[place] = random.uniform(0.1, 0.6)
    return sheet


def frames(seeds: Sequence[int]) -> Iterator[Frame]:
    for seed in seeds:
        random = np.random.default_rng([seed, 99])
        for distance in (1.1, 1.5):
            for lenses, limits in ((APERTURES, {"near": 0.85}), (FOCI, {})):
                name = "apertures" if lenses is APERTURES else "foci"
                angle = random.uniform(0, 2 * np.pi)
                size = random.uniform(3, 8)
                moved = [Camera(), Camera(down=size * np.sin(angle), right=size * np.cos(angle))]
                views = wall(lenses, distance, seed=seed, cameras=moved)
                yield Frame("displacement", f"{name}, {size:.1f} px", views, limits)
                pair = [wall(lenses, distance, seed=seed + n)[n // 50] for n in (0, 50)]
                yield Frame("scenes", name, pair, limits)
                for noise in (0.3, 0.6):
                    views = wall(lenses, distance, seed=seed, noise=noise)
                    yield Frame("noise", f"{name}, {noise}", views, limits)
                faint = texture(seed, 0.0005)
                views = wall(lenses, distance, seed=seed, field=faint, noise=0.002)
                yield Frame("texture", name, views, limits)
                for quality in (30, 50):
                    clean = wall(lenses, distance, seed=seed, noise=0.004, field=texture(seed, 0.06))
                    yield Frame("jpeg", f"{name}, {quality}", [jpeg(view, quality) for view in clean], limits)
                sheet = wall(lenses, distance, seed=seed, field=squares(seed), noise=0.003)
                yield Frame("edges", name, [sharpened(view) for view in sheet], limits)
            swapped = wall(APERTURES, distance, seed=seed)[::-1]
            views = [View(v.image, one, v.pixel_angle) for v, one in zip(swapped, APERTURES, strict=True)]
            yield Frame("optics", "apertures exchanged", views)
        far = (lens(11, 0.4), lens(1.4, 0.4))
        yield Frame("range", "f/1.4", wall(far, 3.0, seed=seed), {"near": 0.4})
