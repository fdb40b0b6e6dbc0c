"""Running estimate of depth: successive views of one target that may move, combined in dioptres.

The state is the target's vergence and its velocity, and the estimate their posterior distribution, represented by
weighted samples (a particle filter). Between moments the samples move as the target may have moved (`Motion`). Within
one fixation the texture stays the same, so that all of its views are compared with each other; each sample then has the
vergence that the target had at each of the fixation's moments, and its weight is the likelihood of all views given that
path, which the depth core computes. From one fixation to the next only vergence and velocity are carried over.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Annotated

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import ndtri

from focalgradient.arrays import FloatArray
from focalgradient.depth.equalise.patch import likelihood_of_transfers, ring_transfer
from focalgradient.errors import InputError, check_fields, check_finite, check_list, check_number
from focalgradient.progress import Progress, silent
from focalgradient.quantities import Range
from focalgradient.view import View

__all__ = ["Motion", "Track", "Tracker", "track"]


GRID: FloatArray = np.asarray(np.arange(-1.0, 9.0001, 0.08), dtype=np.float64)
"""Vergences in dioptres at which a target is searched after a jump, and the range of samples; negative ones lie beyond
infinity, which only lenses reach."""

NEAREST = 8.0
"""Maximum vergence in dioptres of a target: at the end of `GRID` samples would lie on one side of it only."""

SAMPLES = 400
"""Number of samples of the posterior: with 800 the errors agree within their standard error (measured on sines)."""

JUMPING = 0.15
"""Share of the samples that propose a jump at each moment, weighted by the rarity of jumps: a choice."""

IMPOSSIBLE = 1e-6
"""Minimum probability of a jump, and of its destination: a choice, far below anything expected."""

FEWEST = 0.5
"""Effective share of the samples below which they are resampled (a common choice for particle filters)."""

KERNEL = 0.1
"""Width, over the posterior's, of the kernel that separates equal samples; mean and variance are kept (Liu & West
2001)."""


@dataclass(frozen=True, slots=True)
class Motion:
    """Prior of a target's position and motion.

    Parameters
    ----------
    rest, spread
        Mean and standard deviation in dioptres of the prior of the target's vergence, by default about the resting
        focus of accommodation.
    drift
        RMS random walk of the target in a second, in dioptres; it grows with the square root of time. 0.2: with 0.1,
        errors are 1 to 3 % smaller on targets that move smoothly, but 3 % larger on a random walk, and covered less
        often (`benchmarks/moving_targets.py`).
    jumps
        Expected number of jumps per second, to any vergence.
    speed
        RMS velocity in dioptres per second: 1.1 for 0.5 D at 0.5 Hz, the fastest of the targets
        that experiments on accommodation usually show.
    persistence
        Time constant of the velocity's autocorrelation in seconds.

    All but `rest` by default are our choices.
    """

    rest: Annotated[float, Range("dioptres")] = 1.4
    spread: Annotated[float, Range("dioptres", positive=True)] = 1.5
    drift: Annotated[float, Range("dioptres per root second", 0)] = 0.2
    jumps: Annotated[float, Range("jumps per second", 0)] = 0.2
    speed: Annotated[float, Range("dioptres per second", 0)] = 1.0
    persistence: Annotated[float, Range("seconds", positive=True)] = 0.4

    def __post_init__(self) -> None:
        check_fields(self)

    def expected(self, vergences: FloatArray) -> FloatArray:
        """Return the prior probability of each of `vergences`."""
        found = np.exp(-((vergences - self.rest) ** 2) / (2 * self.spread**2))
        return found / found.sum()

    def after(
        self, vergence: FloatArray, velocity: FloatArray, seconds: float, random: np.random.Generator
    ) -> tuple[FloatArray, FloatArray]:
        """Return vergence and velocity after `seconds` without a jump: an integrated Ornstein-Uhlenbeck process.

        Mean and covariance of a step are exact (Gillespie 1996, Phys. Rev. E 54, 2084) but for the pull to `rest`,
        which keeps the distribution after a long time that of `expected`.
        """
        kept, tau = math.exp(-seconds / self.persistence), self.persistence
        moved = self.speed**2 * tau**2 * (2 * seconds / tau - 3 + 4 * kept - kept**2)
        turned = self.speed**2 * (1 - kept**2)
        both = self.speed**2 * tau * (1 - kept) ** 2
        first, second, third = random.standard_normal((3, vergence.size))
        along = both / math.sqrt(turned) if turned > 0 else 0.0
        step = along * first + math.sqrt(max(moved - along**2, 0.0)) * second + self.drift * math.sqrt(seconds) * third
        ahead = vergence + tau * (1 - kept) * velocity + step
        pulled = self.rest + (ahead - self.rest) * math.exp(-self._pull() * seconds)
        return pulled, kept * velocity + math.sqrt(turned) * first

    def _pull(self) -> float:
        """Return the rate (1/s) of the pull to `rest` that keeps the standard deviation at `spread`.

        With rate k it is drift^2 / (2 k) + speed^2 tau / (k (1 + k tau)), the variance in the long run.
        """
        walk, tau = self.drift**2 / 2, self.persistence
        a, b, c = self.spread**2 * tau, self.spread**2 - walk * tau, walk + self.speed**2 * tau
        return 2 * c / (b + math.sqrt(b**2 + 4 * a * c)) if c else 0.0


@dataclass(frozen=True, slots=True, eq=False)
class Track:
    """Running estimate: vergence and standard deviation (D) at each of `times` (s)."""

    times: FloatArray
    vergence: FloatArray
    vergence_sd: FloatArray


@dataclass(slots=True)
class Tracker:
    """Posterior of one target's vergence, updated at each moment; see `track`."""

    noise: float
    correlation: float = 1.0
    wraps: bool = False
    motion: Motion = Motion()
    samples: int = SAMPLES
    seed: int = 0
    _vergence: FloatArray = field(init=False)  # of each sample, as all that follows
    _velocity: FloatArray = field(init=False)
    _log: FloatArray = field(init=False)  # logarithms of the weights
    _counted: FloatArray = field(init=False)  # log likelihood of this fixation's views that the weights include
    _random: np.random.Generator = field(init=False)
    _views: list[View] = field(init=False, default_factory=list)  # of this fixation
    _transfers: list[FloatArray] = field(init=False, default_factory=list)  # of each view, where each sample was then
    _fixation: int | None = field(init=False, default=None)
    _last: float | None = field(init=False, default=None)  # the moment before

    def __post_init__(self) -> None:
        self._random = np.random.default_rng(self.seed)
        self.start(self.motion.rest, self.motion.spread)

    def start(self, vergence: float, sd: float) -> None:
        """Initialise with a normal distribution of this mean and standard deviation (D)."""
        deviates = self._random.permutation(ndtri((np.arange(self.samples) + 0.5) / self.samples))
        self._vergence = np.clip(vergence + sd * deviates, GRID[0], GRID[-1])
        self._velocity = self.motion.speed * self._random.standard_normal(self.samples)
        self._log, self._counted = np.zeros(self.samples), np.zeros(self.samples)

    def update(self, time: float, views: Sequence[View], fixation: int) -> tuple[float, float]:
        """Update with the views at `time` (s) within a `fixation`; return the posterior mean and SD (D)."""
        unseen = 0.0 if self._last is None else time - self._last
        now, self._velocity = self.motion.after(self._vergence, self._velocity, unseen, self._random)
        self._vergence, self._last = np.clip(now, GRID[0], GRID[-1]), time
        self._jump(views, -math.expm1(-self.motion.jumps * unseen))
        if fixation != self._fixation:
            self._fixation, self._views, self._transfers = fixation, [], []
            self._counted = np.zeros(self.samples)
        self._views.extend(views)
        self._transfers.extend(ring_transfer(view, self._vergence, wraps=self.wraps) for view in views)
        likelihood = self._likelihood(self._views, self._transfers)
        self._log = self._log + likelihood - self._counted
        self._log -= self._log.max()
        self._counted = likelihood
        estimate, weights = self.estimate, self._weights()
        if 1 / (weights**2).sum() < FEWEST * self.samples:
            self._resample(weights)
        return estimate

    @property
    def estimate(self) -> tuple[float, float]:
        """Return the posterior mean and standard deviation (D)."""
        weights = self._weights()
        mean = float(weights @ self._vergence)
        variance = float(weights @ (self._vergence - mean) ** 2)
        return mean, math.sqrt(variance * (1 + float((weights**2).sum())))  # with the error of finitely many samples

    def _weights(self) -> FloatArray:
        weights = np.exp(self._log - self._log.max())
        return np.asarray(weights / weights.sum())

    def _likelihood(self, views: Sequence[View], transfers: Sequence[FloatArray]) -> FloatArray:
        return likelihood_of_transfers(
            views, transfers, noise=self.noise, correlation=self.correlation, wraps=self.wraps
        )

    def _jump(self, views: Sequence[View], often: float) -> None:
        """Propose jumps of some samples to where the present `views` alone place the target, by the rate of jumps.

        Neither is a jump ever impossible, nor any place: where nothing was expected, something may be.
        """
        often = max(often, IMPOSSIBLE)
        expected = (1 - IMPOSSIBLE) * self.motion.expected(GRID) + IMPOSSIBLE / GRID.size
        alone = self._likelihood(views, [ring_transfer(view, GRID, wraps=self.wraps) for view in views])
        likely = np.exp(alone) * expected
        chosen = 0.9 * (likely / likely.sum()) + 0.1 * expected
        jumping = self._random.permutation(self.samples)[: round(JUMPING * self.samples)]
        cell = self._random.choice(GRID.size, jumping.size, p=chosen)
        within = (GRID[1] - GRID[0]) * (self._random.random(jumping.size) - 0.5)
        self._vergence[jumping] = GRID[cell] + within
        self._velocity[jumping] = self.motion.speed * self._random.standard_normal(jumping.size)
        change = np.full(self.samples, math.log((1 - often) / (1 - JUMPING)))
        change[jumping] = np.log(often / JUMPING * expected[cell] / chosen[cell])
        self._log = self._log + change

    def _resample(self, weights: FloatArray) -> None:
        """Resample by weight; equal samples are separated by a kernel."""
        places = (np.arange(self.samples) + self._random.random()) / self.samples
        drawn = np.searchsorted(np.cumsum(weights), places).clip(0, self.samples - 1)
        state = np.column_stack([self._vergence, self._velocity])
        mean = weights @ state
        spread = np.sqrt(weights @ (state - mean) ** 2)
        parted = mean + math.sqrt(1 - KERNEL**2) * (state[drawn] - mean)
        parted += KERNEL * spread * self._random.standard_normal(parted.shape)
        self._vergence, self._velocity = parted.T.copy()
        self._transfers = [one[drawn] for one in self._transfers]
        self._counted = self._counted[drawn]
        self._log = np.zeros(self.samples)


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
    """Estimate the depth of one target over a series of views, such as 10 s of an eye's.

    Parameters
    ----------
    views
        Views in order of time, each with the optics of its moment, in one or two wavebands per moment.
    times
        Time of each view in seconds; equal for views of one moment.
    noise
        Standard deviation of the pixels' noise in the images' units.
    correlation
        Correlation of the textures in the two wavebands.
    fixation
        Duration in seconds of constant gaze, and texture: views within it are compared with each other.
        A texture that stays for longer makes errors of successive fixations correlated, and the stated SD too small.
    motion
        Prior of the target's motion; by default `Motion()`.
    wraps
        Whether the texture is periodic (`Target`).
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
    >>> bool(abs(found.vergence[-1] - 1.5) < 2 * found.vergence_sd[-1]), bool(found.vergence_sd[-1] < 0.2)
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
        (progress or silent)((number + 1) / distinct.size, "tracking depth")
    return Track(distinct, found[:, 0], found[:, 1])
