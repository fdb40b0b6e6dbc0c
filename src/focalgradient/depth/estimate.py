"""Input and result of every depth method; `focalgradient.depth.recover` does the rest."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from focalgradient.depth.registration import RegisteredViews
from focalgradient.depth.search import Search
from focalgradient.depth.settings import RecoverySettings
from focalgradient.view import View

__all__ = ["Estimate", "Problem"]


@dataclass(frozen=True, slots=True, eq=False)
class Problem:
    """Input of a method: checked and registered views, search range, blur and settings."""

    views: Sequence[View]
    registered: RegisteredViews
    search: Search
    settings: RecoverySettings


@dataclass(frozen=True, slots=True, eq=False)
class Estimate:
    """Depth estimated by one method.

    Parameters
    ----------
    vergence, vergence_sd
        H x W, in dioptres, on the first view's pixels.
    valid
        H x W.
    noise
        Standard deviation of each view's noise, in the view's own unit.
    side_known
        H x W: whether the views decide the side of focus, beyond what the search decides.
    details
        What this method alone has to state, as plain JSON values.
    warnings
        Warnings to issue, each a sentence.
    searched
        Vergence that was searched, in dioptres, where the method restricts the search.
    beyond
        H x W integers, of methods that see it: 1 at or nearer than the nearest depth searched, -1 at or beyond the
        farthest, 0 elsewhere.
    """

    vergence: NDArray[np.float32]
    vergence_sd: NDArray[np.float32]
    valid: NDArray[np.bool_]
    noise: Sequence[float]
    side_known: NDArray[np.bool_] | bool = True
    details: Mapping[str, Any] = field(default_factory=dict)
    warnings: Sequence[str] = ()
    searched: tuple[float, float] | None = None
    beyond: NDArray[np.int8] | None = None
