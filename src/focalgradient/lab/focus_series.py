"""A focus series and how focus follows the gaze, without a window: which focus a place wants, and how it is reached."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from focalgradient.display import Display
from focalgradient.errors import InputError
from focalgradient.files import printable, read_array, read_json

__all__ = ["TIME_CONSTANT", "FocusSeries", "Focusing", "Transition", "read_series"]

Transition = Literal["eye", "immediate"]
"""How focus gets to a new distance: as an eye's, or within a frame."""

TIME_CONSTANT = 0.3
"""Seconds of a first-order response: about that of human accommodation (Campbell & Westheimer, J Physiol 151, 1960)."""

STEPS = 16
"""Pictures from one focus to the next. At 60 Hz focus moves by an eighteenth of the way in the first frame."""

LARGEST = 1 << 30
"""Bytes of all pictures on the graphics card."""


@dataclass(frozen=True, slots=True, eq=False)
class FocusSeries:
    """Pictures of one scene at several foci, as ``focalgradient blur`` makes them.

    Parameters
    ----------
    folder
        Where they are.
    vergences
        Of the foci in dioptres, rising.
    light
        Linear light of each, H x W or H x W x 3, 1 being white.
    metres
        Distance of what each pixel shows, H x W.
    summary
        How they were made.
    """

    folder: Path
    vergences: tuple[float, ...]
    light: tuple[NDArray[np.float32], ...]
    metres: NDArray[np.floating]
    summary: dict[str, Any]

    def vergence_at(self, x: float, y: float, radius: float = 0.0) -> float | None:
        """Vergence in dioptres at a place, the median within `radius` pixels each way; None outside the picture.

        `x` and `y` are in pixels from the upper left corner of the picture.
        """
        height, width = self.metres.shape
        if not (0 <= x < width and 0 <= y < height):
            return None
        row, column, reach = int(y), int(x), round(radius)
        part = self.metres[max(row - reach, 0) : row + reach + 1, max(column - reach, 0) : column + reach + 1]
        return float(np.median(1 / part))

    def nearest(self, vergence: float) -> int:
        """Number of the focus that is nearest to a vergence, in dioptres."""
        return int(np.argmin(np.abs(np.asarray(self.vergences) - vergence)))

    def steps(self) -> int:
        """Pictures from one focus to the next: as many as the graphics card is taken to hold, and `STEPS` at most."""
        each = 3 * self.metres.size
        return max(1, min(STEPS, (LARGEST // each - 1) // max(len(self.vergences) - 1, 1)))

    def encoded(self, display: Display) -> list[NDArray[np.uint8]]:
        """Give all pictures from the farthest focus to the nearest, `steps` from each to the next, for a display.

        Those between are mixtures of their two neighbours in linear light.
        """
        count = self.steps()
        pictures = []
        for far, near in zip(self.light, self.light[1:], strict=False):
            pictures += [display.encode(far + np.float32(n / count) * (near - far)) for n in range(count)]
        return [*pictures, display.encode(self.light[-1])]

    def number_of(self, vergence: float) -> int:
        """Which picture of `encoded` has the focus nearest to a vergence."""
        count = self.steps()
        places = count * np.arange(len(self.vergences))
        return round(float(np.interp(vergence, self.vergences, places)))


def read_series(folder: Path) -> FocusSeries:
    """Read a series that ``focalgradient blur`` made of one picture, with two foci or more.

    Raises
    ------
    InputError
        If there is none, or a file of it is missing or does not fit the others.
    """
    path = folder / "summary.json"
    summary = read_json(path, "the summary of 'focalgradient blur'")
    try:
        foci = [float(metres) for metres in summary["settings"]["focus_m"]]
        white = float(summary["settings"].get("white", 1.0))
        several = len(summary["pictures"]) != 1
        if not (all(one > 0 for one in foci) and 0 < white < math.inf):
            raise ValueError
    except (KeyError, TypeError, ValueError, AttributeError) as error:
        raise InputError(
            f"{printable(path)} is no summary of 'focalgradient blur': give the folder it made."
        ) from error
    if several or len(set(foci)) < max(len(foci), 2):
        raise InputError(
            f"{printable(folder)} is no focus series: make one with 'focalgradient blur', of one picture and with two "
            "or more --focus."
        )
    metres = read_array(folder / "distance.npy", "the distances that 'focalgradient blur' writes")
    ordered = sorted(foci, reverse=True)
    light = [read_array(folder / f"blurred-{one}m.npy", "a picture of the series") for one in ordered]
    for one, found in zip(ordered, light, strict=True):
        fits = found.shape in (metres.shape, (*metres.shape, 3)) and found.shape == light[0].shape
        if not (fits and found.dtype.kind == "f" and np.isfinite(found).all()):
            raise InputError(
                f"blurred-{one}m.npy in {printable(folder)} does not fit the other files: make the series anew."
            )
    if metres.dtype.kind != "f" or not (metres > 0).all():
        raise InputError(f"distance.npy in {printable(folder)} holds no distances: make the series anew.")
    scaled = tuple(np.asarray(one / np.float32(white), np.float32) for one in light)
    return FocusSeries(folder, tuple(1 / one for one in ordered), scaled, metres, summary)


class Focusing:
    """Where the focus is, and where it goes.

    Parameters
    ----------
    vergences
        Of the foci that there are, in dioptres.
    transition
        ``"eye"``: the way that is left shrinks to 1/e in `time_constant` seconds. ``"immediate"``: none is left.
    time_constant
        In seconds.

    Examples
    --------
    >>> focusing = Focusing([0.5, 2.0], "eye")
    >>> focusing.look(1)
    True
    >>> round(focusing.step(0.3), 3)  # 1 - 1/e of 1.5 dioptres
    1.448
    """

    def __init__(
        self, vergences: Sequence[float], transition: Transition, time_constant: float = TIME_CONSTANT
    ) -> None:
        self._vergences, self._transition, self._constant = vergences, transition, time_constant
        self.target = 0
        self.vergence = vergences[0]

    def look(self, focus: int) -> bool:
        """Go to the focus of that number: whether that is another than before."""
        changed, self.target = focus != self.target, focus
        return changed

    def step(self, seconds: float) -> float:
        """Let time pass: the vergence in focus then."""
        goal = self._vergences[self.target]
        left = 0.0 if self._transition == "immediate" else math.exp(-seconds / self._constant)
        self.vergence = goal + left * (self.vergence - goal)
        return self.vergence
