"""Annular blur: the aperture of a mirror lens with a central obstruction."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from focalgradient.psf.disc import DISC_K, disc_edge, disc_transfer
from focalgradient.psf.shape import Psf, parameter

__all__ = ["Annulus"]


@dataclass(frozen=True)
class Annulus(Psf):
    """Annulus: a disc with a central obstruction, as of a mirror lens."""

    name = "annulus"

    obstruction: float = parameter(0.35, "diameter of the obstruction / diameter of the aperture", least=0.0, most=0.95)
    """Obstruction ratio; mirror lenses for photography have 0.35 to 0.5."""

    @property
    def sd_per_radius(self) -> float:
        """Standard deviation per blur radius of a uniform annulus, whose variance is (1 + obstruction^2) / 4."""
        return DISC_K * math.sqrt(1 + self.obstruction**2)

    @property
    def edge_reach(self) -> float:
        """Radius of the rim, 1."""
        return 1.0

    def transfer(self, frequency: ArrayLike, radius: ArrayLike) -> NDArray[np.float64]:
        """Return the area-weighted difference between the transfers of the full disc and of the obstruction."""
        hole = self.obstruction
        inner, outer = (disc_transfer(frequency, scale * np.asarray(radius, float)) for scale in (hole, 1.0))
        return (outer - hole**2 * inner) / (1 - hole**2)

    def edge_response(self, position: ArrayLike, radius: float) -> NDArray[np.float64]:
        """Return the area-weighted difference between the edge responses of the full disc and of the obstruction."""
        u, hole = np.asarray(position, float) / radius, self.obstruction
        inner = disc_edge(u / hole) if hole else 0.0
        return np.asarray((disc_edge(u) - hole**2 * inner) / (1 - hole**2), float)
