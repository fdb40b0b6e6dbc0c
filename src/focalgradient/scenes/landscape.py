"""Fractal landscapes with mountains under a sky, with detail down to the pixel size at every distance."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from focalgradient.arrays import FloatArray
from focalgradient.errors import checked
from focalgradient.quantities import Seed
from focalgradient.scenes.fractal import fractal
from focalgradient.scenes.materials import ramp
from focalgradient.scenes.objects import Field, Mark, Mesh, Point, Scene, Sky
from focalgradient.scenes.shapes import sheet

__all__ = ["GROUNDS", "Land", "clouded_sky", "terrain"]

# Reflectances of the ground, from hollows to crests.
GROUNDS = {
    "meadow": ((0.05, 0.045, 0.02), (0.10, 0.12, 0.035), (0.17, 0.19, 0.06), (0.33, 0.31, 0.16)),
    "sand": ((0.22, 0.14, 0.08), (0.42, 0.30, 0.18), (0.52, 0.40, 0.26), (0.64, 0.54, 0.40)),
    "gravel": ((0.05, 0.048, 0.045), (0.18, 0.17, 0.155), (0.32, 0.30, 0.27), (0.50, 0.48, 0.44)),
    "heath": ((0.05, 0.03, 0.025), (0.15, 0.085, 0.06), (0.22, 0.17, 0.09), (0.36, 0.30, 0.20)),
    "loam": ((0.045, 0.028, 0.018), (0.13, 0.08, 0.05), (0.23, 0.155, 0.10), (0.38, 0.29, 0.20)),
}
HAZE = (0.55, 0.63, 0.74)  # linear RGB of kilometres of air (a design choice)
PLAIN, FARTHEST = 30.0, 400.0  # distances (m) at which the mountains begin, and the land ends


@dataclass(frozen=True, slots=True)
class Land:
    """A fractal landscape: ground height as a function of position.

    Parameters
    ----------
    seed
        Random seed of the landscape.
    eye
        Height of the camera above the ground at its feet, in metres.
    relief
        Height of bumps of the near ground, in metres.
    mountains
        Height of the distant mountains as a tangent, seen from the camera.
    ground
        Ground cover, a key of `GROUNDS`.

    Examples
    --------
    >>> land = Land(seed=1, eye=0.15)
    >>> bool(abs(land.height([0.0], [1.0])[0]) < 0.1)
    True
    """

    seed: int
    eye: float
    relief: float = 0.02
    mountains: float = 0.08
    ground: str = "meadow"

    def height(self, x: ArrayLike, z: ArrayLike, finest: ArrayLike = 1e-3) -> FloatArray:
        """Return the height in metres at x (right) and z (away) in metres, with detail down to wavelength `finest`."""
        x, z = np.broadcast_arrays(np.asarray(x, float), np.asarray(z, float))
        noise = self._noise(x, z, finest)
        # Ridged noise, as left by erosion: sharp crests, round valleys, in one chain with nothing behind.
        crest = 0.7 - 1.9 * np.abs(noise(2, 80.0, 0.5)) + 1.2 * noise(3, 120.0, 0.45)
        crest = np.where(crest > 0, crest, 0.3 * crest)
        chain = np.exp(-((np.log(np.maximum(z, 1.0) / 190) / 0.55) ** 2))
        rise = _ease(np.log(np.maximum(z, 1e-3) / 5) / math.log(8))
        return (
            self.relief * noise(0, 0.9, 0.45)
            + 0.35 * rise * noise(1, 14.0, 0.42)
            + self.mountains * 190 * chain * crest
            - 0.1 * np.maximum(z - 260, 0)
        )

    def _noise(self, x: FloatArray, z: FloatArray, finest: ArrayLike) -> Callable[[int, float, float], FloatArray]:
        """Return the noise of a key, coarsest wavelength (m) and roughness at points of the ground."""
        place = np.stack([x, np.zeros_like(x), z], axis=-1)
        return lambda key, coarsest, roughness: fractal(
            place, self.seed + key, coarsest=coarsest, finest=np.minimum(finest, coarsest), roughness=roughness
        )

    def mesh(self, field: float, *, texels: int = 1200) -> Mesh:
        """Return the ground visible in a frame `field` wide (a tangent), with a margin on both sides."""

        def places(rows: int, columns: int) -> tuple[FloatArray, FloatArray, FloatArray]:
            # Evenly spaced in the picture: by 1/z on flat ground, by log z on the mountains.
            near = 1 / np.linspace(0.55 * field / (0.8 * self.eye), 1 / PLAIN, 2 * rows // 3)
            far = np.geomspace(PLAIN, FARTHEST, rows - len(near) + 1)[1:]
            z, across = np.meshgrid(
                np.concatenate([near, far]), np.linspace(-0.85, 0.85, columns) * field, indexing="ij"
            )
            deep, wide = np.gradient(z, axis=0), 1.7 * field / columns * z
            return across * z, z, 2 * np.sqrt(np.minimum(deep, 3 * wide) * wide)

        x, z, finest = places(480, 481)
        points = np.stack([x, self.eye - self.height(x, z, 4 * finest), z], axis=-1)
        x, z, finest = places(texels, texels)
        return sheet(points, self._paint(x, z, finest), smooth=False)

    def _paint(self, x: FloatArray, z: FloatArray, finest: FloatArray) -> NDArray[np.float32]:
        noise = self._noise(x, z, finest)
        # Patches of all sizes, blades and grains; far away, folds of the land.
        tone = 0.45 * noise(10, 1.6, 0.8) + 0.9 * noise(11, 0.04, 0.95) + 0.4 * noise(12, 40.0, 0.8)
        colour = ramp(1.2 * tone, GROUNDS[self.ground])
        bare = np.clip(2.2 * noise(13, 0.8, 0.7) - 0.7, 0, 1)[..., None]
        colour = colour * (1 - 0.6 * bare) + 0.6 * bare * ramp(tone, GROUNDS["loam"])
        # Aerial perspective: distant mountains become pale and blue.
        air = (0.65 * (1 - np.exp(-z / 220)))[..., None]
        colour = colour * (1 - air) + 0.7 * np.array(HAZE) * air
        return np.clip(colour, 0.01, 0.95).astype(np.float32)


def clouded_sky(seed: int, *, cover: float, brightness: float, warmth: float = 0.0) -> Sky:
    """Return a sky with fractal clouds.

    `cover` is the cloud cover from 0 (clear) to 1, `brightness` the mean radiance, `warmth` (0 to 1) the horizon's
    reddening.

    >>> clouded_sky(1, cover=0.5, brightness=0.4).radiance.shape
    (1024, 2048, 3)
    """
    rows, columns = 1024, 2048
    up, around = np.meshgrid(
        np.pi / 2 - (np.arange(rows // 2) + 0.5) * np.pi / rows,
        (np.arange(columns) + 0.5) * 2 * np.pi / columns - np.pi,
        indexing="ij",
    )
    zenith, horizon = np.array([0.16, 0.33, 0.68]), np.array([0.60, 0.73, 0.88])
    horizon = horizon * (1 - warmth) + warmth * np.array([1.0, 0.74, 0.48])
    blue = horizon + (zenith - horizon) * (np.sin(up)[..., None] ** 0.42)
    # Banks of cloud with flat bases: noise stretched along the horizon, increasingly towards it.
    place = np.stack([np.cos(up) * np.sin(around), 2.6 * np.sqrt(up + 0.02), np.cos(up) * np.cos(around)], axis=-1)
    finest = np.where(up < 0.6, 0.006, 0.04)  # higher parts lie outside frames that show the ground
    billow = fractal(place, seed, coarsest=0.22, finest=finest, roughness=0.6)
    bank = fractal(place, seed + 1, coarsest=0.7, finest=0.1, roughness=0.5)
    thick = _ease((0.9 * billow + bank + 1.8 * cover - 0.9) * 1.8)[..., None]
    under = np.clip(0.5 + 0.8 * np.roll(billow, 6, axis=0) - 0.5 * billow, 0, 1)[..., None]
    cloud = (1.05 - 0.4 * under * thick) * np.array([1.0, 0.985, 0.965])
    cloud = cloud * (1 - 0.3 * warmth * np.array([0.0, 0.35, 0.8]))
    seen = blue * (1 - 0.92 * thick) + cloud * 0.92 * thick
    seen *= brightness / float((seen * np.cos(up)[..., None]).mean() * np.pi / 2)
    radiance = np.empty((rows, columns, 3), np.float32)
    radiance[: rows // 2] = seen
    # Below the horizon, the sky has the ground's radiance, for rays that miss the land's edge.
    radiance[rows // 2 :] = 0.3 * seen[-1].mean(axis=0)
    return Sky(radiance)


def _ease(share: FloatArray) -> FloatArray:
    """Return a smooth step from 0 at 0 to 1 at 1, constant outside."""
    share = np.clip(share, 0, 1)
    return share * share * (3 - 2 * share)


def sunlight(random: np.random.Generator) -> tuple[Point, Point, float]:
    """Return a random sun direction (behind the camera, to either side), its colour, and the sky's warmth."""
    azimuth = random.uniform(0.5, 1.25) * random.choice([-1, 1])
    elevation = random.uniform(0.35, 1.0)
    warmth = float(np.clip((0.7 - elevation) / 0.5, 0, 1)) * random.uniform(0.4, 1.0)
    sun = (
        math.cos(elevation) * math.sin(azimuth),
        -math.sin(elevation),
        -math.cos(elevation) * math.cos(azimuth),
    )
    return sun, (1.08, 1.0 - 0.14 * warmth, 0.90 - 0.38 * warmth), warmth


@checked
def terrain(seed: Seed = 0, *, field: Field = 0.35) -> Scene:
    """Return a fractal landscape, from the ground at the camera's feet to mountains hundreds of metres away.

    Parameters
    ----------
    seed
        Random seed of the land, its cover, the clouds and the light.
    field
        Width of the frame as a tangent: number of columns x pixel angle.

    Examples
    --------
    >>> [mark.distance > 30 for mark in terrain(seed=2).marks]
    [False, True]
    """
    random = np.random.default_rng([seed, 4])
    grounds = list(GROUNDS)
    land = Land(
        seed=int(random.integers(2**20)),
        eye=random.uniform(0.09, 0.16),
        relief=random.uniform(0.02, 0.035),
        mountains=random.uniform(0.05, 0.11),
        ground=grounds[seed % len(grounds)],
    )
    sun, tint, warmth = sunlight(random)
    sky = clouded_sky(int(random.integers(2**20)), cover=random.uniform(0.15, 0.75), brightness=0.42, warmth=warmth)
    ground = land.mesh(field)
    # Visible points on the frame's vertical midline: one in the foreground, and one in the mountains.
    x, y, z = ground.vertices[np.abs(ground.vertices[:, 0]) < 1e-3 * field * ground.vertices[:, 2]].T
    seen = np.flatnonzero(y / z <= np.minimum.accumulate(y / z))
    near = seen[np.argmax((y / z)[seen] <= 0.38 * field)]
    far = seen[z[seen] > min(60.0, z[seen][-1] / 2)]
    marks = tuple(
        Mark(name, (float(x[index]), float(y[index]), float(z[index])))
        for name, index in (("nearest", near), ("farthest", far[len(far) // 2]))
    )
    return Scene((ground,), sun=sun, ambient=0.35, sky=sky, tint=tint, marks=marks)
