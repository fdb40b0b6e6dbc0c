"""The depth map: what the depth core returns, and what is kept on disk."""

from __future__ import annotations

import json
import os
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from focalgradient.errors import InputError
from focalgradient.files import printable, read_arrays, write_whole

__all__ = ["DepthMap"]

_GRIDS = ("vergence", "vergence_sd", "valid", "side_known")


@dataclass(frozen=True, slots=True, eq=False)
class DepthMap:
    """Depth at every pixel, with its uncertainty and what is to be trusted.

    Parameters
    ----------
    vergence
        Vergence in dioptres, H x W, at every pixel, trusted or not.
    vergence_sd
        Standard deviation of `vergence` in dioptres, H x W.
    valid
        H x W: False where the estimate is refused (too little texture, contradicting views, side undecided).
    side_known
        H x W: whether the views themselves tell on which side of focus the point lies. Where they do not,
        `vergence` is the reading stated in ``details["side"]``, and its mirror image about focus fits as well.
    details
        How the map was made: settings, estimated noise and gains, shares, warnings; plain JSON values.
    offset
        From the plane that distances count from to the optical centre of the lens, in metres: vergence counts from
        there, `distance` from the plane. 0 unless the camera was calibrated.

    Examples
    --------
    >>> flat = np.full((2, 3), 0.5)
    >>> depth = DepthMap(flat, 0.01 * flat, flat > 0, flat > 0)
    >>> float(depth.distance[0, 0]), round(float(depth.distance_sd[0, 0]), 3)
    (2.0, 0.02)
    """

    vergence: NDArray[np.floating]
    vergence_sd: NDArray[np.floating]
    valid: NDArray[np.bool_]
    side_known: NDArray[np.bool_]
    details: dict[str, Any] = field(default_factory=dict)
    offset: float = 0.0

    @property
    def shape(self) -> tuple[int, int]:
        """Height and width in pixels."""
        height, width = self.vergence.shape
        return height, width

    @property
    def distance(self) -> NDArray[np.floating]:
        """Distance in metres, H x W: 1 / vergence - offset, and ``inf`` where the vergence is not positive."""
        return (self._optical_distance - self.offset).astype(self.vergence.dtype)

    @property
    def distance_sd(self) -> NDArray[np.floating]:
        """First-order standard deviation of `distance` in metres, H x W: vergence_sd / vergence^2."""
        return (self.vergence_sd * self._optical_distance**2).astype(self.vergence.dtype)

    @property
    def _optical_distance(self) -> NDArray[np.floating]:
        with np.errstate(divide="ignore"):
            return np.where(self.vergence > 0, 1.0 / np.abs(self.vergence), np.inf)

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write the map to `path` as a compressed NumPy archive, all or nothing.

        Its arrays, each H x W: ``distance`` (m), ``vergence`` (D), ``vergence_sd`` (D), ``valid`` and
        ``side_known`` (bool); ``offset`` (m); and ``details``, a JSON text.
        """

        def write(place: Path) -> None:
            with place.open("wb") as file:
                np.savez_compressed(
                    file,
                    distance=self.distance,
                    vergence=self.vergence,
                    vergence_sd=self.vergence_sd,
                    valid=self.valid,
                    side_known=self.side_known,
                    offset=np.array(self.offset),
                    details=np.array(json.dumps(self.details)),
                )

        write_whole(path, write)

    @classmethod
    def load(cls, path: str | os.PathLike[str]) -> DepthMap:
        """Read a map that `save` wrote.

        Raises
        ------
        InputError
            If the file is not such an archive.
        """
        what = "a depth map that focalgradient wrote"
        found = read_arrays(path, (*_GRIDS, "details", "offset"), what)
        try:
            vergence, vergence_sd, valid, side_known = grids = [found[name] for name in _GRIDS]
            details = json.loads(str(found["details"][()]))
            offset = float(found["offset"]) if "offset" in found else 0.0
            if any(grid.ndim != 2 or grid.shape != grids[0].shape for grid in grids):
                raise ValueError("shapes differ")
            if [grid.dtype.kind for grid in grids] != ["f", "f", "b", "b"] or not isinstance(details, dict):
                raise ValueError("other types")
        except (KeyError, TypeError, ValueError, RecursionError) as error:
            raise InputError(f"{printable(path)} is not {what}, or is damaged: give one that is whole.") from error
        return cls(vergence, vergence_sd, valid, side_known, details, offset)
