"""Image-forming optics: lenses, and the protocol that all optics implement.

Distances are in metres in front of the lens, positive; vergence V = 1/distance in dioptres, 0 at infinity.
"""

from focalgradient.optics.dual_pixel import DualPixel
from focalgradient.optics.lens import Aperture, Lens, Side, defocus_at, distance_of_blur
from focalgradient.optics.protocol import (
    Capabilities,
    Mixture,
    Optics,
    OwnBlur,
    blur_of,
    capabilities,
    check_optics,
    own_blur,
    refocused,
)

__all__ = [
    "Aperture",
    "Capabilities",
    "DualPixel",
    "Lens",
    "Mixture",
    "Optics",
    "OwnBlur",
    "Side",
    "blur_of",
    "capabilities",
    "check_optics",
    "defocus_at",
    "distance_of_blur",
    "own_blur",
    "refocused",
]
