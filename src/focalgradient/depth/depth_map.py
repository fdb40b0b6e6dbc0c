"""Depth map: the result of depth recovery, and its file."""

from __future__ import annotations

import json
import os
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from focalgradient.arrays import Mask
from focalgradient.errors import InputError
from focalgradient.files import printable, read_arrays, write_whole

__all__ = ["DepthMap"]

PUPIL = "the entrance pupil"

_GRIDS = ("vergence", "vergence_sd", "valid", "side_known")


_FURTHER = ("evidence", "beyond")
"""Optional arrays of a depth map."""

_NONE = np.zeros((0, 0, 0))
"""Empty common error, for a map of any size."""


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class DepthMap:
    """Depth at every pixel, with its uncertainty and validity.

    Parameters
    ----------
    vergence
        Vergence in dioptres, H x W, at every pixel, trusted or not.
    vergence_sd
        Standard deviation of `vergence` in dioptres, H x W, of what differs between pixels: noise and the blur model.
    valid
        H x W: False where no depth is claimed (too little texture, contradicting views, ambiguous side).
    side_known
        H x W: whether the views themselves decide on which side of focus the point lies. Where they do not,
        `vergence` is on the side stated in ``details["side"]``, and its mirror image about focus fits as well.
    details
        How the map was made: settings, estimated noise and gains, shares, warnings; plain JSON values.
    offset
        From the plane that distances count from to the entrance pupil of the lens, in metres: vergence counts from
        there, `distance` from the plane.
    plane
        The plane that `distance` counts from, in words.
    common_errors
        Errors that the whole frame shares, K x H x W: each an independent change of `vergence` in dioptres at one
        standard deviation of something unknown, as of the focus distance or of the apertures. By default none.
    evidence
        H x W integers, how depth is known at each pixel of a map that was completed (``dense``): 2 measured, which is
        where it is valid; 1 near to that; 0 guessed. None: the map was not completed.
    beyond
        H x W integers: -1 where the point lies beyond the far limit of the search, 1 where it lies nearer than the near
        one, as the likelihood still rises there; 0 elsewhere. Of a focus stack (``"autofocus"``): at or beyond the
        farthest focus, at or nearer than the nearest. Such pixels are not valid. None: the method does not tell.

    Examples
    --------
    >>> flat = np.full((2, 3), 0.5)
    >>> depth = DepthMap(flat, 0.01 * flat, flat > 0, flat > 0)
    >>> float(depth.distance[0, 0]), round(float(depth.distance_sd[0, 0]), 3)
    (2.0, 0.02)

    A focus that is known to 0.05 D only moves all pixels alike:

    >>> loose = DepthMap(flat, 0.01 * flat, flat > 0, flat > 0, common_errors=0.1 * flat[None])
    >>> round(float(loose.common_sd[0, 0]), 3), round(float(loose.distance_sd[0, 0]), 3)
    (0.05, 0.201)
    """

    vergence: NDArray[np.floating]
    vergence_sd: NDArray[np.floating]
    valid: Mask
    side_known: Mask
    details: dict[str, Any] = field(default_factory=dict)
    offset: float = 0.0
    plane: str = PUPIL
    common_errors: NDArray[np.floating] = field(default_factory=lambda: _NONE)
    evidence: NDArray[np.uint8] | None = None
    beyond: NDArray[np.int8] | None = None

    def __post_init__(self) -> None:
        if self.common_errors is _NONE:
            object.__setattr__(self, "common_errors", np.zeros((0, *self.vergence.shape), self.vergence.dtype))

    @property
    def shape(self) -> tuple[int, int]:
        """Height and width in pixels."""
        height, width = self.vergence.shape
        return height, width

    @property
    def distance(self) -> NDArray[np.floating]:
        """Distance in metres, H x W: 1 / vergence - offset, and ``inf`` where the vergence is not positive.

        ``nan`` where only the order of depth is known (``details["order_only"]``).
        """
        return (self._optical_distance - self.offset).astype(self.vergence.dtype)

    @property
    def common_sd(self) -> NDArray[np.floating]:
        """Standard deviation of `vergence` in dioptres, H x W, of what pixels share in error (focus, field, apertures).

        What of it differs between two places matters for their order: see `difference`. The error of a pixel has the
        standard deviation `total_sd`.
        """
        return np.sqrt((self.common_errors**2).sum(axis=0)).astype(self.vergence_sd.dtype)

    @property
    def total_sd(self) -> NDArray[np.floating]:
        """Standard deviation of `vergence` in dioptres, H x W: `vergence_sd` and `common_sd` together."""
        return np.hypot(self.vergence_sd, self.common_sd)

    def difference(self, first: tuple[int, int], second: tuple[int, int]) -> tuple[float, float]:
        """Return the vergence at one place less that at another, and the standard deviation of this, in dioptres.

        Places are column and row in pixels. Positive: the first place is nearer. The error that both share cancels;
        that of the focus over the field (curvature, tilt) does so only for neighbours.

        Raises
        ------
        InputError
            If a place lies outside of the map, or depth is not valid there.

        Examples
        --------
        >>> steps, both = np.array([[2.0, 1.9]]), np.ones((1, 2), bool)
        >>> depth = DepthMap(steps, 0.005 * steps, both, both, common_errors=np.array([[[0.0, 0.06]]]))
        >>> [round(value, 3) for value in depth.difference((0, 0), (1, 0))]
        [0.1, 0.062]
        """
        height, width = self.shape
        for column, row in (first, second):
            if not (0 <= column < width and 0 <= row < height):
                raise InputError(
                    f"the place {(column, row)} lies outside of the map, which has {width} columns and {height} rows."
                )
            if not self.valid[row, column]:
                raise InputError(f"depth is not valid at column {column}, row {row}: choose a place in `valid`.")
        (x1, y1), (x2, y2) = first, second
        shared = self.common_errors[:, y1, x1] - self.common_errors[:, y2, x2]
        sd = np.sqrt(self.vergence_sd[y1, x1] ** 2 + self.vergence_sd[y2, x2] ** 2 + (shared**2).sum())
        return float(self.vergence[y1, x1] - self.vergence[y2, x2]), float(sd)

    @property
    def distance_sd(self) -> NDArray[np.floating]:
        """First-order standard deviation of `distance` in metres, H x W: total_sd / vergence^2.

        ``inf`` and ``nan`` where the distance is.
        """
        distance = self._optical_distance
        with np.errstate(invalid="ignore"):  # infinitely far, and that for sure
            sd = self.total_sd * distance**2
        return np.where(np.isinf(distance), np.inf, sd).astype(self.vergence.dtype)

    @property
    def _order_only(self) -> bool:
        return bool(self.details.get("order_only"))

    @property
    def _optical_distance(self) -> NDArray[np.floating]:
        if self._order_only:
            return np.full_like(self.vergence, np.nan)
        with np.errstate(divide="ignore"):
            return np.where(self.vergence > 0, 1.0 / np.abs(self.vergence), np.inf)

    def __repr__(self) -> str:
        height, width = self.shape
        return f"<DepthMap of {height} x {width} pixels: {self._in_words()}>"

    def _in_words(self) -> str:
        """Return the median distance of the valid pixels, and their share."""
        share = f"{self.valid.mean():.0%} valid"
        if self._order_only:
            return f"order only, {share}"
        if not self.valid.any():
            return share
        return f"median {float(np.median(self.distance[self.valid])):.3g} m, {share}"

    def blurred_alike_in_words(self) -> str:
        """Return the distances, on the other side of focus, with the blur of those searched.

        Empty if the views show the side, or no pixel is valid.

        >>> one = np.ones((1, 1))
        >>> details = {"blurred_alike_D": [0.625, 1.25], "searched_vergence_D": [0.1, 0.625]}
        >>> DepthMap(one, one, one > 0, one > 0, details).blurred_alike_in_words()
        'same blur nearer than the focus: 0.8 to 1.6 m'
        """
        if not (alike := self.details.get("blurred_alike_D")) or not self.valid.any():
            return ""
        far, near = alike
        side = "nearer" if far >= self.details["searched_vergence_D"][1] else "farther"
        range_m = f"{1 / near:.2g} to {1 / far:.2g} m" if far > 0 else f"{1 / near:.2g} m or more"
        return f"same blur {side} than the focus: {range_m}"

    def outside_in_words(self) -> tuple[str, str]:
        """Return what it means that `beyond` is -1, and that it is 1."""
        if self._order_only:
            return "at or before the focus of the first", "at or after the focus of the last"
        if self.details.get("method") == "autofocus":
            return "at or beyond the farthest focus", "at or nearer than the nearest"
        farther, nearer = "farther than the search", "nearer than the search"
        if alike := self.details.get("blurred_alike_D"):  # more blur than is searched may lie on either side
            lowest, highest = alike
            if lowest >= self.details["searched_vergence_D"][1]:
                farther += f", or nearer than {1 / highest:.2g} m"
            elif lowest > 0:
                nearer += f", or farther than {1 / lowest:.2g} m"
        return farther, nearer

    def summary(self) -> str:
        """Summarise the map in a few lines: method, range and precision of valid pixels, side of focus.

        >>> flat = np.full((2, 3), 0.5)
        >>> print(DepthMap(flat, 0.01 * flat, flat > 0, flat > 0, {"method": "equalise", "psf": "disc"}).summary())
        Depth map of 2 x 3 pixels by method 'equalise' (psf 'disc'): median 2 m, 100% valid
        distance from the entrance pupil: 2 to 2 m (5 to 95 % of the valid pixels)
        standard deviation (median): 0.005 D, 0.02 m
        """
        height, width = self.shape
        lines = [f"Depth map of {height} x {width} pixels"]
        if "method" in self.details:
            lines[0] += f" by method {self.details['method']!r} (psf {self.details.get('psf')!r})"
        lines[0] += f": {self._in_words()}"
        if self.valid.any() and not self._order_only:
            near, far = np.percentile(self.distance[self.valid], [5, 95], method="nearest")
            sd, sd_m = (float(np.median(values[self.valid])) for values in (self.vergence_sd, self.distance_sd))
            lines.append(f"distance from {self.plane}: {near:.3g} to {far:.3g} m (5 to 95 % of the valid pixels)")
            common = float(np.median(self.common_sd[self.valid]))
            shared = f" between pixels and {common:.3g} D of the whole frame" if common > 0 else ""
            lines.append(f"standard deviation (median): {sd:.3g} D{shared}, {sd_m:.3g} m")
        elif "rejected" in self.details:
            lines.append(f"no pixel is valid: {self.details['rejected']}")
        if self.beyond is not None and self.beyond.any():
            farther, nearer = (f"{np.mean(self.beyond == way):.0%}" for way in (-1, 1))
            lines.append("{0}: {2}; {1}: {3}".format(*self.outside_in_words(), farther, nearer))
        if "side" in self.details:
            lines.append(
                "; ".join(filter(None, [f"side of focus: {self.details['side']}", self.blurred_alike_in_words()]))
            )
        lines += [f"assumed: {sentence}" for sentence in self.details.get("assumes", ())]
        return "\n".join(lines)

    def plot(self, ax: Any = None, *, outlines: bool = False) -> Any:
        """Draw the valid depth with a bar in metres (`focalgradient.plotting.draw_depth`).

        Parameters
        ----------
        ax
            Matplotlib axes to draw into; those of a new figure if not given.
        outlines
            Draw the outlines found (``details["outlines"]``) too.

        Returns
        -------
        matplotlib.axes.Axes
            ``depth.plot().figure.savefig("depth.png")`` writes them to a file.
        """
        from focalgradient.plotting import draw_depth, new_figure, style

        with style():
            if ax is None:
                height, width = self.shape
                ax = new_figure(120.0, 96.0 * height / width + 12.0, layout="compressed").add_subplot()
            return draw_depth(ax, self, outlines=outlines)

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write the map to `path` as a compressed NumPy archive, all or nothing.

        Its arrays, each H x W: ``distance`` (m), ``vergence`` (D), ``vergence_sd`` and ``common_sd`` (D), ``valid`` and
        ``side_known`` (bool); ``common_errors`` (D), K x H x W; ``offset`` (m); ``plane``, what distances count from;
        ``details``, a JSON text; and, of maps that have them, ``evidence`` and ``beyond`` (integers).

        Raises
        ------
        InputError
            If `path` is the name of a picture.
        """
        if Path(path).suffix.lower() in (".png", ".jpg", ".jpeg", ".tif", ".tiff", ".exr", ".pdf"):
            raise InputError(
                f"{printable(path)} is the name of a picture, but a map is stored as a NumPy archive: give a name that "
                "ends in .npz, or draw it with depth.plot()."
            )
        names = "distance", *_GRIDS, "common_sd", "common_errors", *_FURTHER
        arrays = {name: values for name in names if (values := getattr(self, name)) is not None}

        def write(place: Path) -> None:
            with place.open("wb") as file:
                np.savez_compressed(
                    file, **arrays, offset=self.offset, plane=self.plane, details=json.dumps(self.details)
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
        found = read_arrays(path, (*_GRIDS, "details", "offset", "plane", "common_errors", *_FURTHER), what)
        try:
            vergence, vergence_sd, valid, side_known = grids = [found[name] for name in _GRIDS]
            details = json.loads(str(found["details"][()]))
            offset = float(found["offset"]) if "offset" in found else 0.0
            plane = str(found["plane"][()]) if "plane" in found else PUPIL
            further = [found.get(name) for name in _FURTHER]
            if any(one is not None and (one.shape != vergence.shape or one.dtype.kind not in "iu") for one in further):
                raise ValueError("evidence, or what lies beyond, of another form")
            if any(grid.ndim != 2 or grid.shape != grids[0].shape for grid in grids):
                raise ValueError("shapes differ")
            common = found.get("common_errors", np.zeros((0, *vergence.shape), vergence.dtype))
            if common.ndim != 3 or common.shape[1:] != vergence.shape or common.dtype.kind != "f":
                raise ValueError("common errors of another shape")
            if [grid.dtype.kind for grid in grids] != ["f", "f", "b", "b"] or not isinstance(details, dict):
                raise ValueError("other types")
        except (KeyError, TypeError, ValueError, RecursionError) as error:
            raise InputError(f"{printable(path)} is not {what}, or is damaged: give one that is whole.") from error
        return cls(vergence, vergence_sd, valid, side_known, details, offset, plane, common, *further)
