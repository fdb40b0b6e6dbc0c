"""Materials: textures with the colours and grain of stone, earth, wood and plaster."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from focalgradient.arrays import FloatArray
from focalgradient.scenes.fractal import fractal
from focalgradient.scenes.shapes import Paint

__all__ = ["NATURAL", "grained", "material", "ramp"]

# Reflectances in red, green and blue, from dark to light parts.
NATURAL: dict[str, tuple[tuple[float, float, float], ...]] = {
    "granite": ((0.05, 0.05, 0.055), (0.22, 0.20, 0.19), (0.42, 0.38, 0.36), (0.62, 0.58, 0.55)),
    "sandstone": ((0.18, 0.09, 0.05), (0.40, 0.23, 0.13), (0.55, 0.36, 0.21), (0.68, 0.52, 0.35)),
    "marble": ((0.12, 0.11, 0.11), (0.45, 0.44, 0.42), (0.66, 0.64, 0.60), (0.80, 0.78, 0.74)),
    "moss": ((0.03, 0.035, 0.015), (0.08, 0.11, 0.03), (0.18, 0.21, 0.07), (0.34, 0.32, 0.16)),
    "rust": ((0.05, 0.025, 0.02), (0.22, 0.08, 0.035), (0.42, 0.18, 0.07), (0.52, 0.33, 0.20)),
    "slate": ((0.03, 0.035, 0.045), (0.10, 0.12, 0.15), (0.20, 0.23, 0.26), (0.36, 0.38, 0.38)),
    "wood": ((0.10, 0.05, 0.025), (0.28, 0.15, 0.07), (0.44, 0.27, 0.14), (0.58, 0.41, 0.25)),
    "jade": ((0.02, 0.06, 0.045), (0.07, 0.20, 0.14), (0.20, 0.36, 0.26), (0.50, 0.58, 0.46)),
}


def ramp(value: ArrayLike, colours: ArrayLike) -> FloatArray:
    """Return colours, ... x 3, interpolated on a scale from -1 (first of `colours`, k x 3) to 1 (last).

    >>> ramp([-1.0, 0.0], [[0.1, 0.1, 0.1], [0.3, 0.2, 0.1]]).round(2).tolist()
    [[0.1, 0.1, 0.1], [0.2, 0.15, 0.1]]
    """
    colours = np.asarray(colours, dtype=float)
    scale = np.linspace(-1, 1, len(colours))
    at = np.asarray(value, dtype=float)
    return np.stack([np.interp(at, scale, channel) for channel in colours.T], axis=-1)


def grained(
    colours: ArrayLike,
    seed: int,
    size: float,
    contrast: float = 1.0,
    *,
    roughness: float = 0.85,
    stretch: ArrayLike = (1.0, 1.0, 1.0),
) -> Paint:
    """Return a paint of stains up to `size` metres, with grain down to the pixel size; `stretch` divides its scale.

    >>> grained(NATURAL["slate"], 1, 0.5)(np.zeros((5, 4, 3)), 0.001).shape
    (5, 4, 3)
    """

    def paint(points: FloatArray, detail: float) -> FloatArray:
        tone = fractal(points * np.asarray(stretch), seed, coarsest=size, finest=2 * detail, roughness=roughness)
        return ramp(1.3 * contrast * tone, colours)

    return paint


def material(name: str, seed: int, size: float) -> Paint:
    """Return the paint of a natural material for a body of `size` metres.

    >>> material("granite", 1, 0.1)(np.zeros((5, 4, 3)), 0.001).shape
    (5, 4, 3)
    """
    colours = NATURAL[name]

    def paint(points: FloatArray, detail: float) -> FloatArray:
        def noise(key: int, coarsest: float, roughness: float = 0.75) -> FloatArray:
            return fractal(points, seed + 31 * key, coarsest=coarsest * size, finest=2 * detail, roughness=roughness)

        tone = noise(0, 0.8)
        grain = noise(1, 0.12, 0.9)
        match name:
            case "granite":
                tone = 0.35 * tone + 1.1 * grain
            case "marble":
                bent = noise(2, 0.9, 0.6)
                vein = 1 - np.abs(noise(3, 0.7, 0.65) + 0.3 * bent) * 3
                tone = 0.75 + 0.25 * tone - 1.7 * np.clip(vein, 0, 1) ** 2 + 0.2 * grain
            case "wood":
                x, _, z = np.moveaxis(points, -1, 0)
                ring = np.hypot(x + 0.3 * size, z - 0.2 * size) / size * 9 + 1.2 * noise(2, 1.2, 0.5)
                tone = 0.8 * (2 * (ring % 1) - 1) + 0.35 * grain
            case "sandstone" | "slate":
                layer = points[..., 1] / size * 5 + 0.9 * noise(2, 1.0, 0.5)
                tone = 0.6 * np.sin(2 * np.pi * layer) * (0.6 + 0.4 * tone) + 0.45 * grain + 0.35 * tone
            case _:
                tone = 0.8 * tone + 0.6 * grain
        colour = ramp(1.2 * tone, colours)
        # Irregular stains of another hue.
        stain = np.clip(noise(4, 0.6, 0.6) * 2 - 0.5, 0, 1)[..., None]
        return colour * (1 - stain * np.array([0.15, 0.3, 0.45]))

    return paint
