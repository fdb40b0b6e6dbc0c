"""Multifocal and extended-depth lenses: pupil zones of different power, as in simultaneous-image lenses.

Each zone is a ring about the pupil's centre whose power is added to the eye's. The wavefront is continuous, as of a
refractive lens whose profile has no steps: in a zone of added power P it rises by P r dr. Many narrow zones whose power
changes evenly form a lens of extended depth of focus.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from focalgradient.arrays import FloatArray
from focalgradient.errors import InputError, check_number, described

__all__ = ["ZonedLens"]


@dataclass(frozen=True, slots=True)
class ZonedLens:
    """Lens with zones of different power, worn on the eye or implanted.

    Parameters
    ----------
    diameters
        Outer diameters of the zones in metres, from the centre outwards, increasing. The last zone continues beyond its
        diameter.
    additions
        Added power of each zone in dioptres.

    Raises
    ------
    InputError
        If they do not pair, or a number is out of range.

    Examples
    --------
    A centre-near lens: 2 D within 2 mm, nothing around it.

    >>> lens = ZonedLens((0.002, 0.008), (2.0, 0.0))
    >>> lens.power([0.0005, 0.002]).tolist()
    [2.0, 0.0]
    >>> lens.wavefront([0.0, 0.001, 0.002]).round(3).tolist()  # micrometres
    [0.0, 1.0, 1.0]
    """

    diameters: tuple[float, ...]
    additions: tuple[float, ...]

    def __post_init__(self) -> None:
        pairs = isinstance(self.diameters, tuple) and isinstance(self.additions, tuple)
        if not (pairs and len(self.diameters) == len(self.additions) > 0):
            raise InputError(
                f"diameters is {described(self.diameters)} and additions {described(self.additions)}, but must be two "
                "tuples of one length: a diameter and a power for each zone."
            )
        for diameter, power in zip(self.diameters, self.additions, strict=True):
            check_number("diameters", diameter, "metres", positive=True)
            check_number("additions", power, "dioptres")
        if any(np.diff(self.diameters) <= 0) or self.diameters[-1] > 0.02 or max(map(abs, self.additions)) > 10:
            raise InputError(
                "diameters must grow from zone to zone up to 0.02, additions be within 10: give metres and dioptres."
            )

    @classmethod
    def parse(cls, zones: str) -> ZonedLens:
        """Parse zones written as "MM:D,...": outer diameters in millimetres and added powers in dioptres.

        >>> ZonedLens.parse("2:2,8:0")
        ZonedLens(diameters=(0.002, 0.008), additions=(2.0, 0.0))
        """
        try:
            pairs = [(float(mm), float(power)) for mm, power in (zone.split(":") for zone in zones.split(","))]
        except ValueError:
            raise InputError(
                f"zones is {zones!r}, but must be outer diameters in millimetres and added powers in dioptres, from "
                "the centre outwards, such as 2:2,8:0."
            ) from None
        try:
            return cls(tuple(1e-3 * mm for mm, _ in pairs), tuple(power for _, power in pairs))
        except InputError:
            raise InputError(
                f"zones is {zones!r}, but diameters must be positive and increase up to 20 mm, and powers must be "
                "within 10 D."
            ) from None

    def power(self, radius: object) -> FloatArray:
        """Return the added power in dioptres at a `radius` (m, any shape)."""
        zone = np.searchsorted(np.asarray(self.diameters) / 2, np.asarray(radius, dtype=float))
        return np.asarray(np.asarray(self.additions)[np.minimum(zone, len(self.additions) - 1)])

    def wavefront(self, radius: object) -> FloatArray:
        """Return the wavefront (um) at a `radius` (m, any shape), 0 at the centre; sign as the defocus term."""
        r = np.asarray(radius, dtype=float)
        inner = np.concatenate([[0.0], np.asarray(self.diameters)[:-1] / 2])
        outer = np.concatenate([np.asarray(self.diameters)[:-1] / 2, [np.inf]])
        total = np.zeros(r.shape)
        for low, high, power in zip(inner, outer, self.additions, strict=True):
            total += power * (np.clip(r, low, high) ** 2 - low**2) / 2
        return 1e6 * total
