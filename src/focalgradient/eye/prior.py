"""Depth through an eye that is not known exactly: uncertain chromatic aberration, focus and illuminant.

People's chromatic aberration has a standard deviation of a quarter of its mean. Depth from two wavebands changes by
about half a dioptre for each unit of the scale, so that the uncertainty is marginalised (`recover_eye_depth`) or
reduced: a person's aberration is constant, and can be estimated from fixations with two wavebands at two moments each
(`learn_chromatic_scale`), as depth by moments alone hardly depends on it.
"""

from __future__ import annotations

import math
import warnings
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Annotated, Any

import numpy as np

from focalgradient.arrays import FloatArray
from focalgradient.depth.depth_map import DepthMap
from focalgradient.depth.recover import recover_depth
from focalgradient.errors import FocalGradientWarning, InputError, check_fields, check_list, described
from focalgradient.eye.cones import Cones
from focalgradient.eye.local_colour import ColouredCones, LocalColours, SeenContrast
from focalgradient.eye.spectral import SpectralBasis
from focalgradient.quantities import Range
from focalgradient.view import View

__all__ = ["EyePrior", "learn_chromatic_scale", "recover_eye_depth"]

SCALE_SD = 0.25
"""Standard deviation over people of chromatic aberration over its mean: 0.39 of 1.54 D between 450 and 650 nm."""

NODES = ((0.0, 2 / 3), (math.sqrt(3), 1 / 6), (-math.sqrt(3), 1 / 6))
"""Nodes (in SD) and weights of the three-point Gauss-Hermite rule that marginalises a normal prior."""

LEAST_SCALE = 0.1
"""Minimum scale of chromatic aberration: below it wavebands hardly differ in focus."""

GRID = np.linspace(-2.5, 2.5, 21)
"""Grid of scales in SD of the prior, on which the posterior is computed."""

TRIED = (-1.5, -0.5, 0.5, 1.5)
"""Scales (in SD) at which depth is recovered: a cubic interpolates between them."""

MODEL_SD = 0.01
"""Standard deviation (D) of the difference between depth by bands and by moments of one fixation in the limit of no
noise: 0.003 to 0.01 D for grey walls and a known eye. Our choice."""


LEAST_SHARE = 0.05
"""Minimum share of pixels with depth both by bands and by moments for a fixation to count: a choice."""


@dataclass(frozen=True, slots=True)
class EyePrior:
    """Prior of an eye: chromatic scale, focus and illuminant.

    Parameters
    ----------
    chromatic_scale, chromatic_scale_sd
        Mean and standard deviation of chromatic aberration, as a multiple of the mean eye's.
    focus_sd
        Standard deviation of the focus that the views' optics state (D), common to all views.
    illuminants
        Possible lights, equally probable; empty: the light that the views' optics state.

    Raises
    ------
    InputError
        If a number is out of range, or a light unknown.

    Examples
    --------
    >>> EyePrior().chromatic_scale_sd
    0.25
    """

    chromatic_scale: Annotated[float, Range("multiples of the mean eye's aberration", 0)] = 1.0
    chromatic_scale_sd: Annotated[float, Range("multiples of the mean eye's aberration", 0)] = SCALE_SD
    focus_sd: Annotated[float, Range("dioptres", 0)] = 0.0
    illuminants: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        check_fields(self)
        for name in self.illuminants:
            SpectralBasis.of_srgb(name)  # refuses an unknown light

    def eyes(self) -> list[tuple[float, str | None, float]]:
        """Return scales, lights and weights (with a sum of 1) that represent the prior; the most probable first."""
        scales = NODES if self.chromatic_scale_sd > 0 else ((0.0, 1.0),)
        lights: tuple[str | None, ...] = self.illuminants or (None,)
        return [
            (max(LEAST_SCALE, self.chromatic_scale + place * self.chromatic_scale_sd), light, weight / len(lights))
            for place, weight in scales
            for light in lights
        ]


def recover_eye_depth(views: Sequence[View], prior: EyePrior | None = None, **settings: Any) -> DepthMap:
    """Recover depth from an eye's views, marginalised over the prior of the eye.

    Parameters
    ----------
    views
        As for `focalgradient.recover_depth`, with `Cones` as optics; their eye's chromatic aberration is not used.
    prior
        Prior of the eye and the light; None: people's chromatic aberration.
    settings
        Those of `focalgradient.recover_depth`.

    Returns
    -------
    DepthMap
        Mean of the posterior, and its standard deviation, of vergence at each pixel. Valid where every eye of the
        prior that explains the views gives depth. ``details["eye"]`` states the prior.

    Raises
    ------
    InputError
        If the optics of a view are not `Cones`, or for the errors of `focalgradient.recover_depth`.

    Examples
    --------
    >>> from focalgradient.eye import Eye, band_views
    >>> seen = band_views(1 / 1.5, Eye(0.004, 1.0), (96, 96), 2.909e-4, noise=0.01, seed=1)
    >>> views = [one.view for one in seen]
    >>> known, people = (recover_eye_depth(views, EyePrior(chromatic_scale_sd=sd)) for sd in (0.0, 0.25))
    >>> bool(np.median(people.vergence_sd) > 3 * np.median(known.vergence_sd))
    True
    """
    prior = EyePrior() if prior is None else prior
    for view in check_list("views", views, "View"):
        if not isinstance(view, View) or not isinstance(view.optics, Cones):
            optics = view.optics if isinstance(view, View) else view
            raise InputError(f"views holds {described(optics)}, but must hold views of Cones: use recover_depth.")
    maps: list[tuple[float, DepthMap]] = []
    for number, (scale, light, weight) in enumerate(prior.eyes()):
        with warnings.catch_warnings():
            if number:  # a warning is issued for the first; others are only less likely
                warnings.simplefilter("ignore", FocalGradientWarning)
            maps.append((weight, recover_depth([_seen_by(view, scale, light) for view in views], **settings)))
    first = maps[0][1]
    # An eye that does not explain a place at all is left out there.
    weights = np.stack([weight * one.valid for weight, one in maps])
    total = np.maximum(weights.sum(axis=0), 1e-9)
    vergences = np.stack([one.vergence for _, one in maps])
    mean = (weights * vergences).sum(axis=0) / total
    variance = np.stack([one.vergence_sd**2 for _, one in maps]) + (vergences - mean) ** 2
    sd = np.sqrt((weights * variance).sum(axis=0) / total + prior.focus_sd**2)
    known = first.valid & (total > 0.5)
    stated: dict[str, Any] = {"chromatic_scale": prior.chromatic_scale, "chromatic_scale_sd": prior.chromatic_scale_sd}
    stated |= {"focus_sd_D": prior.focus_sd, "illuminants": list(prior.illuminants)}
    return replace(
        first,
        vergence=np.where(known, mean, first.vergence).astype(np.float32),
        vergence_sd=np.where(known, sd, first.vergence_sd).astype(np.float32),
        valid=known,
        details={**first.details, "eye": stated, "share_valid": float(known.mean())},
    )


def learn_chromatic_scale(
    fixations: Sequence[Sequence[View]], prior: EyePrior | None = None, **settings: Any
) -> EyePrior:
    """Estimate a person's chromatic scale from fixations, each in two wavebands at two or more moments.

    At the right scale depth by wavebands at one moment is that by moments in one waveband. The posterior of the scale
    is the prior times the likelihood of their differences, one for each fixation.

    Parameters
    ----------
    fixations
        For each fixation its views, of `Cones`.
    prior
        Prior of the eye; None: people's chromatic aberration.
    settings
        Those of `focalgradient.recover_depth`.

    Returns
    -------
    EyePrior
        The prior with the scale's posterior mean and standard deviation.

    Raises
    ------
    InputError
        If a fixation has not two wavebands and two moments.
    """
    prior = EyePrior() if prior is None else prior
    if prior.chromatic_scale_sd == 0:
        return prior
    scales = prior.chromatic_scale + GRID * prior.chromatic_scale_sd
    log_posterior = -(GRID**2) / 2
    for number, views in enumerate(fixations, 1):
        bands, moments = _by_bands_and_moments(number, views)
        log_posterior = log_posterior + _likelihood(bands, moments, prior, scales, settings)
    weight = np.exp(log_posterior - log_posterior.max()) * (scales > LEAST_SCALE)
    weight /= weight.sum()
    mean = float(weight @ scales)
    sd = float(np.sqrt(weight @ (scales - mean) ** 2))
    return replace(prior, chromatic_scale=mean, chromatic_scale_sd=max(sd, float(np.diff(scales)[0]) / 4))


def _likelihood(
    bands: list[View], moments: list[View], prior: EyePrior, scales: FloatArray, settings: dict[str, Any]
) -> FloatArray:
    """Return the log likelihood of `scales` from how depth by bands and by moments differ in one fixation."""
    places, off, sds = [], [], []
    for place in TRIED:
        scale = max(LEAST_SCALE, prior.chromatic_scale + place * prior.chromatic_scale_sd)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", FocalGradientWarning)
            one, other = (
                recover_depth([_seen_by(v, scale, None) for v in some], **settings) for some in (bands, moments)
            )
        both = one.valid & other.valid
        if both.mean() > LEAST_SHARE:
            places.append(scale)
            off.append(float(np.median(one.vergence[both] - other.vergence[both])))
            sds.append(float(np.median(np.hypot(one.vergence_sd[both], other.vergence_sd[both]))))
    if len(places) < 2:
        return np.zeros(len(scales))
    difference = np.polynomial.Polynomial.fit(places, off, min(2, len(places) - 1))(scales)
    sd = np.hypot(np.interp(scales, places, sds), MODEL_SD)
    # A fixation on which the model fails must not decide: heavy tails (Student's t of 3 degrees of freedom).
    return np.asarray(-2 * np.log1p((difference / sd) ** 2 / 3) - np.log(sd))


def _by_bands_and_moments(number: int, views: Sequence[View]) -> tuple[list[View], list[View]]:
    """Return the views of one moment in all wavebands, and those of the first waveband at all moments."""
    states = [view.optics.eye.accommodation for view in views if isinstance(view.optics, Cones)]
    names = [view.optics.light for view in views if isinstance(view.optics, Cones)]
    if len(states) < len(views) or len(set(names)) < 2 or len(set(states)) < 2:
        raise InputError(
            f"fixation {number} shows {len(set(names))} waveband(s) at {len(set(states))} moment(s) of accommodation, "
            "but needs two of each, of Cones: give the views of L+M and S cones at two moments."
        )
    bands = [view for view, state in zip(views, states, strict=True) if state == states[0]]
    return bands, [view for view, name in zip(views, names, strict=True) if name == names[0]]


def _seen_by(view: View, scale: float, light: str | None) -> View:
    """Return the view with the optics of an eye of this chromatic scale, in a light if one is given."""
    cones = view.optics
    assert isinstance(cones, Cones)
    eye = replace(cones.eye, chromatic_scale=scale)
    if isinstance(cones, ColouredCones) and cones.colours is not None:
        return replace(view, optics=_of_eye(cones.colours, scale, light).seen_by(replace(cones, eye=eye)))
    if light is None:
        return replace(view, optics=replace(cones, eye=eye))
    own: Any = cones.light
    return replace(view, optics=Cones.of(eye, own, illuminant=light, finest_cpd=cones.finest_cpd, model=cones.model))


def _of_eye(colours: LocalColours, scale: float, light: str | None) -> LocalColours:
    """Return the colours with an eye of this chromatic scale, in a light if one is given."""
    spectra = tuple(
        replace(one, eye=replace(one.eye, chromatic_scale=scale)) if isinstance(one, SeenContrast) else one
        for one in colours.spectra
    )
    own = replace(colours, spectra=spectra)
    return own if light is None else own.lit_by(SpectralBasis.of_srgb(light))
