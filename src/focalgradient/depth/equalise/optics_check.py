"""Whether other optics than those stated explain the views better: an order reversed, apertures off by a factor.

What is stated of the optics is typed by people and rounded by cameras. Apertures or foci of the wrong views leave more
of the views than noise does, wherever they are blurred. The same part of the views is then compared for the stated
optics and for likely slips, for the same noise, and the slip that leaves clearly less is named. It is a warning: depth
stays that of the stated optics. A common factor of all apertures, or a common shift of all foci, leaves nothing more:
only a calibration finds those. Nor does the order of two foci, whose depths are each other's mirror image; their
magnification may (`focalgradient.depth.registration`).
"""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass

from focalgradient.depth.equalise.blur_shape import SIDE, Shape, fit_models
from focalgradient.depth.estimate import Problem
from focalgradient.depth.model_error import DOUBTFUL
from focalgradient.depth.search import Search
from focalgradient.errors import InputError
from focalgradient.optics import Optics

__all__ = ["judge_optics"]

BETTER = 0.6
"""What is left by the likelier optics, over what is left by those stated, from which they are named: slips gave 0.03 to
0.5 on rendered slants, right optics with a wrong shape of blur 0.85."""

EXPLAINS = 4.0
"""Times the noise that the likelier optics may leave for them to be named: what fits no better is no explanation, and
where nothing fits (printed squares: 28 times the noise), contradiction has another cause."""

FACTORS = (0.5, 2.0)
"""Factors by which the f-number of the more blurred views may be off: two stops either way."""

SUSPECT = 1.1
"""Median misfit from which slips are looked for: right optics with the right shape of blur leave 0.99 to 1.01."""


@dataclass(frozen=True, slots=True)
class _Stated:
    """Optics as somebody may have meant them."""

    aperture_diameter: float
    focus_vergence: float


def judge_optics(
    problem: Problem, shape: Shape, noise_sd: Sequence[float], misfit: float, explained: float, tau: float
) -> tuple[dict[str, float], list[str]]:
    """What the stated optics and likely slips leave of the views, over noise, and the warning of the likelier.

    `misfit`, `explained` and `tau` are the frame's median misfit, its share of texture that the stated optics explain,
    and the model error by the split-band test.
    """
    if misfit < SUSPECT and explained > 0.8 and tau < DOUBTFUL:
        return {}, []
    search, settings = problem.search, problem.settings
    searches = {"as stated": search}
    for name, optics in _slips([view.optics for view in problem.views]):
        with suppress(InputError):  # the limits leave these nothing to search
            searches[name] = Search.over(optics, search.pixel_angle, settings.near, settings.far)
    part = problem.registered.most_textured_crop(SIDE)
    fits = fit_models([(one, shape) for one in searches.values()], part, noise_sd, settings.window)
    left = {name: fit.misfit for name, fit in zip(searches, fits, strict=True)}
    best = min(left, key=lambda name: left[name])
    if left[best] > min(EXPLAINS, BETTER * left["as stated"]):
        return left, []
    return left, [
        f"the views contradict the optics stated: they fit better with {best} (what is left of them is "
        f"{left[best]:.2f} times the noise, {left['as stated']:.2f} as stated): check the f-numbers and focus "
        "distances, and their order (f_number, focus_distance), and that all is of this lens."
    ]


def _slips(optics: Sequence[Optics]) -> list[tuple[str, list[Optics]]]:
    """Likely slips, and the optics that were meant."""
    apertures, foci = [o.aperture_diameter for o in optics], [o.focus_vergence for o in optics]
    found: list[tuple[str, list[Optics]]] = []

    def add(name: str, diameters: Sequence[float], vergences: Sequence[float]) -> None:
        meant: list[Optics] = [_Stated(*one) for one in zip(diameters, vergences, strict=True)]
        if (list(diameters), list(vergences)) != (apertures, foci):
            found.append((name, meant))

    add("the apertures in reverse order", apertures[::-1], foci)
    if len(set(apertures)) > 1:
        add("the foci in reverse order", apertures, foci[::-1])
        add("apertures and foci in reverse order", apertures[::-1], foci[::-1])
        widest = max(apertures)
        for factor in FACTORS:
            meant = [a / factor if a == widest else a for a in apertures]
            if len({(a, f) for a, f in zip(meant, foci, strict=True)}) > 1:
                add(f"{factor:g} times the f-number of the most open view", meant, foci)
    if len(optics) > 2 and len(set(foci)) > 2:
        add("the foci in reverse order", apertures, foci[::-1])
        for n in range(len(foci) - 1):
            add(f"the foci of views {n + 1} and {n + 2} exchanged", apertures, _exchanged(foci, n))
    return found


def _exchanged(values: Sequence[float], n: int) -> list[float]:
    """`values` with the n-th and the next in each other's place."""
    return [*values[:n], values[n + 1], values[n], *values[n + 2 :]]
