"""Closed-loop accommodation: simulation of an eye that focuses by its own estimate of depth alone.

At every moment the target is imaged on a patch of retina by the eye's present optics; the depth core estimates the
target's vergence from these views (`track`); and this estimate, after a latency, drives the lens (`Plant`). The
estimator assumes the eye's own normal optics and knows its state of accommodation. A `Stimulus` may differ from this
assumption: light of one wavelength, chromatic aberration neutralised or reversed, rendered blur.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import lru_cache
from operator import attrgetter
from typing import Annotated, Any, Literal

import numpy as np
from numpy.typing import ArrayLike

from focalgradient.arrays import FloatArray
from focalgradient.errors import InputError, check_fields, check_finite, checked, described
from focalgradient.eye.chromatic import chromatic_difference
from focalgradient.eye.cones import S_FINEST_CPD, Cones
from focalgradient.eye.fluctuation import Microfluctuations, growth
from focalgradient.eye.light import Band
from focalgradient.eye.model_eye import Eye, TimeCourse
from focalgradient.eye.plant import Plant
from focalgradient.eye.prediction import Predictor
from focalgradient.eye.pulse import Pulse, PulsedPlant
from focalgradient.eye.ranges import Pupil
from focalgradient.eye.target import Target
from focalgradient.eye.track import NEAREST, Motion, Tracker
from focalgradient.progress import Progress, silent
from focalgradient.psf import disc_transfer
from focalgradient.quantities import Range, Seed
from focalgradient.view import View

__all__ = ["Accommodation", "Course", "Cue", "Rendering", "Stimulus", "accommodate", "target_course"]


Cue = Literal["bands", "moments", "both"]
"""Views that depth is estimated from: two wavebands at each moment, one waveband at several moments, or both
together."""

Rendering = Literal["none", "defocus", "chromatic"]
"""Blur rendered into a picture at a fixed vergence: none, the same in all colours, or with the eye's chromatic
aberration."""

SETTLE = 1.0
"""Time before the course begins, in seconds, in which the eye looks at the target's first position."""

REDDEST_S = 540.0
"""Longest wavelength in nm at which S cones have a view: beyond it they catch less than 1 % of their peak."""

RESTORED = 0.01
"""Regularisation (power) of the inverse filter that renders chromatic blur, for frequencies that the eye does not pass;
our choice."""


@dataclass(frozen=True, slots=True)
class Stimulus:
    """Stimulus of the accommodating eye, apart from its distance.

    Parameters
    ----------
    target
        Texture of the target.
    light_nm
        Wavelength of monochromatic light in nm; None for the spectrum of the `illuminant`.
    illuminant
        Name of the light, such as "D65" or "3000 K" (`focalgradient.eye.illuminant`), which the eye knows.
    chromatic_scale
        The eye's chromatic aberration as modified by the apparatus, in multiples of its own: 0 is neutralised, -1
        reversed.
    focus_flicker, contrast_flicker
        Oscillations of the target's vergence (D), and of its contrast (shares), which the eye does not model.
    rendering
        Unless ``"none"``, the target is a picture fixed at its first vergence, in which the blur of a moving target is
        rendered for an eye focused on the picture.
    """

    target: Target = field(default_factory=Target)
    light_nm: Annotated[float, Range("nanometres")] | None = None
    illuminant: str = "D65"
    chromatic_scale: Annotated[float, Range("multiples of the eye's aberration")] = 1.0
    focus_flicker: Sequence[TimeCourse] = ()
    contrast_flicker: Sequence[TimeCourse] = ()
    rendering: Rendering = "none"

    def __post_init__(self) -> None:
        check_fields(self)
        if self.light_nm is not None:
            chromatic_difference(self.light_nm)


@dataclass(frozen=True, slots=True)
class Accommodation:
    """Accommodating eye: its optics, depth cue, motor plant and noise.

    Parameters
    ----------
    cue
        Views that depth is estimated from.
    pupil_diameter
        Metres.
    plant
        Lens and controller.
    pulse
        Drive of disaccommodation after a sudden change of the demand; None: the plant alone, as in accommodation.
    fluctuation
        Microfluctuations of focus about the plant's response, at a response of 2 D: they grow with the response as in
        `Microfluctuations.of`. Another time course is added unchanged; None is a steady focus.
    horizon
        Prediction horizon in seconds for targets that move predictably (`Predictor`); 0 switches prediction off. Of the
        delay of latency, controller and lens, 0.6 s at 0.5 and 1 Hz, 0.17 s remain, as in people's phase lags (Heron &
        Charman 2004).
    motion
        Prior of how targets move.
    noise
        Standard deviation of a pixel's noise over the mean at every moment: with 0.2 one fixation of a natural target
        defocused by half a dioptre gives its vergence to about 0.05 D by two bands, the threshold for a change of blur
        (0.05-0.07 D).
    rate
        Moments per second.
    fixation
        Duration in seconds of gaze at one place of the target: steady fixation has about two microsaccades per second
        (Martinez-Conde et al. 2004). With ``"bands"`` alone gaze moves at every moment, so that moments cannot be
        compared.
    """

    cue: Cue = "both"
    pupil_diameter: Pupil = 0.004
    plant: Plant = field(default_factory=Plant)
    pulse: Pulse | None = field(default_factory=Pulse)
    fluctuation: TimeCourse | None = field(default_factory=Microfluctuations)
    motion: Motion = field(default_factory=Motion)
    noise: Annotated[float, Range("shares of the mean", positive=True)] = 0.2
    rate: Annotated[float, Range("hertz", positive=True)] = 10.0
    fixation: Annotated[float, Range("seconds", positive=True)] = 0.5
    horizon: Annotated[float, Range("seconds", 0)] = 0.5

    def __post_init__(self) -> None:
        check_fields(self)
        if not (self.fluctuation is None or callable(getattr(self.fluctuation, "at", None))):
            raise InputError(
                f"fluctuation is {described(self.fluctuation)}, but must be a course in time: give Microfluctuations()."
            )

    @property
    def bands(self) -> tuple[Band, ...]:
        """Wavebands of the views that are compared."""
        return ("L+M",) if self.cue == "moments" else ("L+M", "S")


@dataclass(frozen=True, slots=True, eq=False)
class Course:
    """Time course of accommodation: n samples of each quantity.

    ``times`` in seconds; in dioptres ``target``, ``accommodation`` (with its fluctuations), ``estimate`` of the target
    and its ``estimate_sd``.
    """

    times: FloatArray
    target: FloatArray
    accommodation: FloatArray
    estimate: FloatArray
    estimate_sd: FloatArray

    def lag(self, seconds: float = 2.0) -> float:
        """Return the mean of target minus accommodation over the last `seconds`, in dioptres."""
        last = self.times > self.times[-1] - seconds
        return float(np.mean((self.target - self.accommodation)[last]))

    def response(self, frequency: float, skip: float = 0.0) -> complex:
        """Return accommodation over target at `frequency` (Hz) after `skip` s: modulus is gain, angle is phase (rad).

        By least squares of sine, cosine, a mean and a slope.
        """
        kept = self.times >= self.times[0] + skip
        t = self.times[kept]
        waves = np.column_stack([np.exp(2j * np.pi * frequency * t), np.ones_like(t), t - t.mean()])
        design = np.column_stack([waves[:, 0].real, waves[:, 0].imag, waves[:, 1:].real])
        fits = np.linalg.lstsq(design, np.column_stack([self.accommodation[kept], self.target[kept]]), rcond=None)[0]
        answer, stimulus = (complex(a, -b) for a, b in fits[:2].T)
        return answer / stimulus

    def summary(self) -> dict[str, float]:
        """Return the `lag`, the estimate's error (root mean square), and how often it is below 2 standard deviations.

        >>> rows = np.array([[1.0, 1.0], [0.5, 1.0], [1.2, 0.8], [0.09, 0.2]])
        >>> {name: round(value, 2) for name, value in Course(np.arange(2.0), *rows).summary().items()}
        {'lag_D': 0.25, 'estimate_rms_error_D': 0.2, 'estimate_within_2_sd': 0.5}
        """
        error = self.estimate - self.target
        return {
            "lag_D": self.lag(),
            "estimate_rms_error_D": float(np.sqrt(np.mean(error**2))),
            "estimate_within_2_sd": float(np.mean(np.abs(error) < 2 * self.estimate_sd)),
        }

    def to_csv(self) -> str:
        """Return a CSV table with one row for each moment."""
        columns = (self.times, self.target, self.accommodation, self.estimate, self.estimate_sd)
        rows = [",".join(f"{value:.4f}" for value in row) for row in zip(*columns, strict=True)]
        return "\n".join(["time_s,target_D,accommodation_D,estimate_D,estimate_sd_D", *rows, ""])


@checked
def accommodate(
    target: Callable[[float], float],
    duration: Annotated[float, Range("seconds", positive=True)],
    eye: Accommodation | None = None,
    stimulus: Stimulus | None = None,
    *,
    seed: Seed = 0,
    progress: Progress | None = None,
) -> Course:
    """Simulate closed-loop accommodation to a target for `duration` seconds.

    Parameters
    ----------
    target
        Vergence in dioptres of the target at a time in seconds.
    duration
        Seconds.
    eye, stimulus
        By default `Accommodation()` and `Stimulus()`.
    seed
        Random seed of noise, textures and fluctuations.
    progress
        Called with the share done and a short description.

    Returns
    -------
    Course
        `duration` x rate moments; the same for the same seed.

    Raises
    ------
    InputError
        If the duration is shorter than the interval between moments, or the target is nearer than the lens can focus,
        or than 8 D.

    Examples
    --------
    A target steps from 1 to 3 D after half a second; two seconds later the eye has followed by its own estimate.

    >>> found = accommodate(lambda t: 3.0 if t >= 0.5 else 1.0, 3.0, Accommodation(fluctuation=None), seed=1)
    >>> bool(abs(found.lag(0.5)) < 0.4), found.times.size
    (True, 30)
    """
    eye, stimulus = eye or Accommodation(), stimulus or Stimulus()
    if not callable(target):
        raise InputError(
            f"target is {described(target)}, but must be a function of time: give target_course(times, vergences)."
        )
    if round(duration * eye.rate) < 1:
        raise InputError(f"duration is {duration:g} s, but the eye looks every {1 / eye.rate:g} s: give more.")
    step, before = 1 / eye.rate, round(SETTLE * eye.rate)
    times = np.asarray((np.arange(round(duration * eye.rate) + before) - before) * step, dtype=np.float64)
    wanted = check_finite("target", [target(max(t, 0.0)) for t in times], "dioptres at each time")
    for part, nearest in (("lens", eye.plant.nearest), ("estimate", NEAREST)):
        if not np.all((wanted >= 0) & (wanted <= nearest)):
            raise InputError(
                f"the target lies between {wanted.min():g} and {wanted.max():g} D, but the {part} goes from 0 to "
                f"{nearest:g} D only."
            )
    fluctuation = _fluctuation(eye, times, seed)
    grows = isinstance(eye.fluctuation, Microfluctuations)
    predictor = Predictor(eye.horizon, step)
    random = np.random.default_rng([seed, 5])
    tracker = Tracker(eye.noise, stimulus.target.correlation, True, eye.motion)
    tracker.start(wanted[0], 0.3)
    lens = PulsedPlant(eye.plant, eye.pulse, float(wanted[0]))
    waiting = [float(wanted[0])] * (1 + round(eye.plant.latency * eye.rate))
    rows = np.empty((times.size, 3))
    for number, time in enumerate(times):
        focus = float(lens.accommodation + fluctuation[number] * (growth(lens.accommodation) if grows else 1.0))
        fixation = number if eye.cue == "bands" else int((time + SETTLE) / eye.fixation + 1e-9)
        views = _retina(eye, stimulus, time, focus, wanted, number, random, 10_000 * seed + fixation)
        estimate, sd = tracker.update(float(time), views, fixation)
        rows[number] = focus, estimate, sd
        waiting = [*waiting[1:], min(max(predictor.update(estimate), 0.0), eye.plant.nearest)]
        lens.advance(waiting[0], step)
        (progress or silent)((number + 1) / times.size, "accommodating")
    kept = slice(before, None)
    return Course(times[kept], wanted[kept], rows[kept, 0], rows[kept, 1], rows[kept, 2])


def _fluctuation(eye: Accommodation, times: FloatArray, seed: int) -> FloatArray:
    """Return the fluctuation of focus (D) at each of `times`; microfluctuations are drawn from the seed."""
    course = eye.fluctuation
    if course is None:
        return np.zeros_like(times)
    if isinstance(course, Microfluctuations):
        course = replace(course, seed=course.seed + seed)
    return np.asarray(course.at(times))


def _retina(
    eye: Accommodation,
    stimulus: Stimulus,
    time: float,
    focus: float,
    wanted: FloatArray,
    number: int,
    random: np.random.Generator,
    texture: int,
) -> list[View]:
    """Return the views of the target at this moment, with the optics that the eye assumes for them."""
    moment = float(max(time, 0.0))
    vergence = float(wanted[number] if stimulus.rendering == "none" else wanted[0])
    vergence += sum(float(one.at(moment)) for one in stimulus.focus_flicker)
    contrast = max(0.0, 1 + sum(float(one.at(moment)) for one in stimulus.contrast_flicker))
    bands = [band for band in eye.bands if band != "S" or (stimulus.light_nm or 0) < REDDEST_S]
    own = [_cones(eye.pupil_diameter, band, stimulus.illuminant) for band in bands]
    shown = None
    if stimulus.rendering != "none":
        shown = [_drawn(one, stimulus, float(wanted[0]), float(wanted[number])) for one in own]
    return stimulus.target.views(
        [_Formed(one, focus, stimulus.chromatic_scale, stimulus.light_nm) for one in own],
        vergence,
        noise=eye.noise,
        random=random,
        texture=texture,
        contrast=contrast,
        seen_as=[_Known(one, focus) for one in own],
        shown=shown,
    )


@lru_cache(maxsize=16)
def _cones(pupil_diameter: float, band: Band, illuminant: str) -> Cones:
    finest = S_FINEST_CPD if band == "S" else np.inf
    return Cones.of(Eye(pupil_diameter, 0.0), band, illuminant=illuminant, finest_cpd=finest)


def _drawn(one: Cones, stimulus: Stimulus, screen: float, vergence: float) -> FloatArray:
    """Return the filter that renders the blur of a target at `vergence` (D) into a picture at `screen` (D)."""
    frequency = stimulus.target.frequency
    if stimulus.rendering == "defocus":
        return np.asarray(disc_transfer(frequency, abs(screen - vergence) * one.aperture_diameter / 2))
    focused = one.accommodated(screen)
    real, passed = focused.transfer(frequency, vergence), focused.transfer(frequency, screen)
    return np.asarray(real * passed * (1 + RESTORED) / (passed**2 + RESTORED))


@dataclass(frozen=True, slots=True)
class _AtFocus:
    """Optics of cones at one `focus` (D)."""

    cones: Cones
    focus: float

    light = property(attrgetter("cones.light"))
    aperture_diameter = property(attrgetter("cones.aperture_diameter"))

    @property
    def focus_vergence(self) -> float:
        return _focus(self.cones) + self.focus


@dataclass(frozen=True, slots=True)
class _Formed(_AtFocus):
    """Optics that form a view: chromatic aberration scaled, or light of one wavelength."""

    chromatic_scale: float
    light_nm: float | None

    def transfer(self, frequency: ArrayLike, vergence: ArrayLike) -> FloatArray:
        cones = self.cones
        if self.light_nm is not None:
            cones = replace(cones, wavelengths_nm=(self.light_nm,), weights=())
        total: Any = 0.0
        for nm, share in zip(cones.wavelengths_nm, cones.shares.tolist(), strict=True):
            # No eye has a negative scale: each wavelength is focused where it would be by accommodating otherwise.
            changed = self.focus + (1 - self.chromatic_scale) * float(chromatic_difference(nm))
            one = replace(cones.accommodated(changed), wavelengths_nm=(nm,), weights=())
            total = total + share * one.transfer(frequency, vergence)
        return np.asarray(total)


STEP, SPAN = 0.0125, 10.0
"""Spacing in dioptres of the rows of the table of transfers, and its half-range about focus."""


@dataclass(frozen=True, slots=True)
class _Known(_AtFocus):
    """Optics assumed for a view: its transfer is interpolated from a table by defocus."""

    def transfer(self, frequency: ArrayLike, vergence: ArrayLike) -> FloatArray:
        table = _table(self.cones, np.ascontiguousarray(frequency, dtype=float).tobytes())
        place = (np.ravel(np.asarray(vergence, dtype=float)) - self.focus + SPAN) / STEP
        first = np.clip(np.floor(place).astype(int), 0, len(table) - 2)
        part = np.clip(place - first, 0, 1)[:, None]
        return np.asarray((1 - part) * table[first] + part * table[first + 1])


@lru_cache(maxsize=16)
def _focus(cones: Cones) -> float:
    return cones.focus_vergence


@lru_cache(maxsize=8)
def _table(cones: Cones, frequency: bytes) -> FloatArray:
    rows = np.arange(-SPAN, SPAN + STEP, STEP)
    return np.asarray(cones.transfer(np.frombuffer(frequency), rows[:, None]))


def target_course(times: ArrayLike, vergences: ArrayLike) -> Callable[[float], float]:
    """Return a target's vergence as a function of time: piecewise linear through `vergences` (D) at `times` (s).

    Two rows of one time are a step.

    Raises
    ------
    InputError
        If they do not pair, or times go back.

    Examples
    --------
    >>> course = target_course([0, 1, 1, 3], [1, 1, 3, 3])
    >>> [course(t) for t in (0.5, 1.0, 2.0)]
    [1.0, 3.0, 3.0]
    """
    at, values = check_finite("times", times, "seconds"), check_finite("vergences", vergences, "dioptres")
    if at.ndim != 1 or at.shape != values.shape or at.size < 1 or np.any(np.diff(at) < 0):
        raise InputError(f"times is {described(times)}, but must hold a time for each vergence, none before the last.")

    def course(time: float) -> float:
        return float(np.interp(time, at, values))

    return course
