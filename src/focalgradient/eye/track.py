"""Depth as a running estimate: what successive moments show of a target that may move, brought together in dioptres.

The estimate is a posterior distribution over vergence. Between moments it widens as the target may have moved
(`Motion`); each moment's views multiply it by their likelihood, which the depth core gives. Within one fixation the
texture stays, so that all of its views are compared together; from one fixation to the next only the posterior goes on.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike, NDArray

from focalgradient.depth.equalise.patch import vergence_likelihood
from focalgradient.errors import InputError, check_finite, check_list, check_number
from focalgradient.progress import Progress
from focalgradient.view import View

__all__ = ["Motion", "Track", "Tracker", "track"]

FloatArray = NDArray[np.float64]

GRID: FloatArray = np.asarray(np.arange(-1.0, 8.0001, 0.04), dtype=np.float64)
"""Vergences in dioptres at which the posterior is held; those below 0 lie beyond infinity, which only lenses reach."""


@dataclass(frozen=True, slots=True)
class Motion:
    """Where a target is expected, and how it is expected to move.

    Parameters
    ----------
    rest, spread
        Mean and standard deviation in dioptres of the places where a target is expected before it is seen. By default
        about the resting focus of accommodation.
    drift
        Dioptres by which it moves in a second, root mean square; over longer times by the square root of time.
    jumps
        How often in a second it is expected to jump anywhere.

    All but `rest` by default are our choices.
    """

    rest: float = 1.4
    spread: float = 1.5
    drift: float = 0.3
    jumps: float = 0.2

    def __post_init__(self) -> None:
        check_number("rest", self.rest, "dioptres")
        check_number("spread", self.spread, "dioptres", positive=True)
        check_number("drift", self.drift, "dioptres per root second", least=0)
        check_number("jumps", self.jumps, "jumps per second", least=0)

    def expected(self, vergences: FloatArray) -> FloatArray:
        """Probability of each of `vergences` before anything is seen."""
        found = np.exp(-((vergences - self.rest) ** 2) / (2 * self.spread**2))
        return found / found.sum()

    def after(self, posterior: FloatArray, vergences: FloatArray, seconds: float) -> FloatArray:
        """The `posterior` over `vergences` after so many `seconds` in which nothing is seen."""
        step = float(vergences[1] - vergences[0])
        variance = self.drift**2 * seconds
        # As the drift widens the distribution a pull to the middle narrows it: what is expected for ever is `expected`.
        pull = -math.expm1(-variance / (2 * self.spread**2))
        spread = posterior
        if variance > (0.2 * step) ** 2:
            middle = vergences + (self.rest - vergences) * pull
            moved = np.exp(-((vergences[:, None] - middle) ** 2) / (2 * variance))
            spread = (moved / moved.sum(axis=0)) @ posterior
        stays = math.exp(-self.jumps * seconds)
        return stays * spread + (1 - stays) * self.expected(vergences)


@dataclass(frozen=True, slots=True, eq=False)
class Track:
    """A running estimate: at each of `times` (s) the vergence and its standard deviation (D)."""

    times: FloatArray
    vergence: FloatArray
    vergence_sd: FloatArray


@dataclass(slots=True)
class Tracker:
    """The posterior of one target's vergence, brought up to date moment by moment; see `track`."""

    noise: float
    correlation: float = 1.0
    wraps: bool = False
    motion: Motion = Motion()
    vergences: FloatArray = field(default_factory=lambda: GRID)
    posterior: FloatArray = field(init=False)
    _begun: FloatArray = field(init=False)  # posterior as the fixation began
    _views: list[View] = field(init=False, default_factory=list)
    _fixation: int | None = field(init=False, default=None)
    _since: float = field(init=False, default=0.0)  # when the fixation began
    _last: float | None = field(init=False, default=None)  # the moment before

    def __post_init__(self) -> None:
        self.posterior = self.motion.expected(self.vergences)
        self._begun = self.posterior

    def start(self, vergence: float, sd: float) -> None:
        """Begin with a normal distribution of this mean and standard deviation (D)."""
        posterior = np.exp(-((self.vergences - vergence) ** 2) / (2 * sd**2))
        self.posterior = self._begun = posterior / posterior.sum()

    def update(self, time: float, views: Sequence[View], fixation: int) -> tuple[float, float]:
        """Take in what is seen at `time` (s) within a `fixation`; the posterior mean and sd (D)."""
        if fixation != self._fixation:
            unseen = 0.0 if self._last is None else time - self._last
            self._begun = self.motion.after(self.posterior, self.vergences, unseen)
            self._fixation, self._since, self._views = fixation, time, []
        self._last = time
        self._views.extend(views)
        likelihood = vergence_likelihood(
            self._views, self.vergences, noise=self.noise, correlation=self.correlation, wraps=self.wraps
        )
        prior = self.motion.after(self._begun, self.vergences, time - self._since)
        log = (
            np.log(np.maximum(prior, np.finfo(float).tiny)) + likelihood
        )  # where nothing was expected, something may be
        posterior = np.exp(log - log.max())
        self.posterior = posterior / posterior.sum()
        return self.estimate

    @property
    def estimate(self) -> tuple[float, float]:
        """Posterior mean and standard deviation (D)."""
        mean = float(self.posterior @ self.vergences)
        variance = float(self.posterior @ (self.vergences - mean) ** 2)
        step = float(self.vergences[1] - self.vergences[0])
        return mean, math.sqrt(variance + step**2 / 12)


def track(
    views: Sequence[View],
    times: ArrayLike,
    *,
    noise: float,
    correlation: float = 1.0,
    fixation: float = 0.5,
    motion: Motion | None = None,
    wraps: bool = False,
    progress: Progress | None = None,
) -> Track:
    """Depth of one target as a running estimate over a series of views, such as 10 s of an eye's.

    Parameters
    ----------
    views
        In order of time, each with the optics of its moment; those of one moment are of one or two wavebands.
    times
        Of each view, in seconds; equal for views of one moment.
    noise
        Standard deviation of the pixels' noise in the images' units.
    correlation
        Of the textures in the two wavebands.
    fixation
        Seconds for which the gaze stays, and with it the texture: views within them are compared with each other.
        A texture that stays for longer makes the errors of successive fixations alike, and the stated sd too small.
    motion
        How the target is expected to move; by default `Motion()`.
    wraps
        Whether the texture goes on at the opposite side (`Target`).
    progress
        Called with the share done and a few words.

    Returns
    -------
    Track
        One estimate for each moment, from that moment and those before.

    Raises
    ------
    InputError
        If views and times do not pair, times go back, or a number is out of range.

    Examples
    --------
    A wall at 1.5 D, seen for two seconds by an eye whose focus fluctuates about 1 D.

    >>> from focalgradient.eye import Eye, Microfluctuations, accommodation_views
    >>> times = np.arange(0, 2, 0.25)
    >>> eye, course = Eye(0.004, 1.0), Microfluctuations()
    >>> seen = accommodation_views(1 / 1.5, eye, times.tolist(), course, (64, 64), 2.9e-4, noise=0.05)
    >>> found = track([one.view for one in seen], times, noise=0.05)
    >>> bool(abs(found.vergence[-1] - 1.5) < 0.1), bool(found.vergence_sd[-1] < found.vergence_sd[0])
    (True, True)
    """
    views = check_list("views", views, "views")
    moments = check_finite("times", times, "seconds")
    check_number("fixation", fixation, "seconds", positive=True, finite=False)
    if moments.ndim != 1 or len(views) != moments.size or not views or np.any(np.diff(moments) < 0):
        raise InputError(
            f"views holds {len(views)} and times {moments.size}, but each view needs its time, none before the last."
        )
    if not all(isinstance(view, View) for view in views):
        raise InputError("views must hold View: give each one's attribute view.")
    tracker = Tracker(noise, correlation, wraps, motion or Motion())
    distinct = np.unique(moments)
    found = np.empty((distinct.size, 2))
    for number, time in enumerate(distinct):
        now = [view for view, at in zip(views, moments, strict=True) if at == time]
        found[number] = tracker.update(float(time), now, int((time - distinct[0]) / fixation + 1e-9))
        if progress is not None:
            progress((number + 1) / distinct.size, "tracking depth")
    return Track(distinct, found[:, 0], found[:, 1])
