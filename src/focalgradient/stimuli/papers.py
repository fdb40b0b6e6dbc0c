"""Stimuli of published experiments, by the paper's bibliography key and the name of a condition.

Each lists the parameters stated in the paper's abstract or on its authors' page; all others are choices of this
package.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any

from focalgradient.errors import InputError, check_one_of, described
from focalgradient.stimuli.borders import blurred_edge, texture_border
from focalgradient.stimuli.leaves import dead_leaves
from focalgradient.stimuli.stimulus import Stimulus
from focalgradient.stimuli.surfaces import miniature, slanted_plane
from focalgradient.stimuli.wide_field import wide_field

__all__ = ["PAPERS", "Paper", "replica"]


@dataclass(frozen=True, slots=True)
class Paper:
    """A published experiment: the drawing function of its stimuli, and the parameters of its conditions.

    Parameters
    ----------
    draw
        Drawing function of the stimulus.
    conditions
        Parameters of each condition, by name.
    stated
        Names of the parameters whose values are stated in the paper's abstract or on its authors' page.
    """

    draw: Callable[..., Stimulus]
    conditions: Mapping[str, Mapping[str, Any]]
    stated: tuple[str, ...]


def _borders(**others: Any) -> dict[str, dict[str, Any]]:
    """Return the conditions of a border: which side is sharp, and whether the border is."""
    return {
        f"{sharp} sharp, {name} border": {
            f"{sharp}_blur_arcmin": 0.0,
            f"{blurred}_blur_arcmin": 4.0,
            "border_blur_arcmin": edge,
            **others,
        }
        for sharp, blurred in (("left", "right"), ("right", "left"))
        for name, edge in (("sharp", 0.0), ("blurred", 4.0))
    }


LEVELS_ARCMIN = (0.0, 0.5, 1.0, 1.5, 2.25, 3.25, 4.5, 6.0)
"""Blurs of the leaves in arcmin, spaced by discriminable steps (a design choice)."""

HELD = {"true_distance_m": 783.0, "pupil_mm": 4.6}
"""Scene distance at which simulated distances of 0.36, 0.23 and 0.15 m require apertures of 10.0, 15.65 and 24.5 m."""

VISHWANATH = {"slant_deg": 60.0, "texture": "projected"}
MAIELLO = {"window_deg": 46.0, "focus_m": 0.4, "psf": "gaussian"}
"""Parameters that are the same in all conditions."""

PAPERS: dict[str, Paper] = {
    "mather1996": Paper(texture_border, _borders(border="straight"), ()),
    "marshall1996": Paper(texture_border, _borders(border="straight"), ()),
    "mather2002": Paper(texture_border, _borders(border="sinusoidal"), ("border",)),
    "taylor2015": Paper(
        dead_leaves,
        {
            f"{n} blurs": {"blurs_arcmin": LEVELS_ARCMIN[:n], "order": "random"}
            for n in range(1, len(LEVELS_ARCMIN) + 1)
        },
        (),
    ),
    "watson2011": Paper(
        blurred_edge,
        {
            f"pedestal {blur:g}, increment {more:g}": {"pedestal_arcmin": blur, "increment_arcmin": more}
            for blur in (0.0, 0.5, 1.0, 2.0, 4.0)
            for more in (0.0, 0.25, 0.5, 1.0)
        },
        (),
    ),
    "held2010": Paper(
        miniature,
        {
            f"{kind}, {metres:g} m": {"gradient": gradient, "simulated_distance_m": metres} | HELD
            for kind, gradient in (("consistent", "consistent"), ("aligned", "vertical"), ("orthogonal", "horizontal"))
            for metres in (0.36, 0.23, 0.15)
        },
        ("gradient", "simulated_distance_m"),
    ),
    "vishwanath2010": Paper(
        slanted_plane,
        {
            f"{way} gradient, {metres:g} m": {"tilt_deg": tilt, "distance_m": metres} | VISHWANATH
            for way, tilt in (("vertical", 90.0), ("horizontal", 0.0))
            for metres in (0.28, 0.57, 1.14)
        },
        ("distance_m",),
    ),
    "maiello2017": Paper(
        wide_field,
        {
            f"{degrees:g} degrees, {quadrant}": {"eccentricity_deg": degrees, "quadrant": quadrant} | MAIELLO
            for degrees in (0.0, 4.0, 8.0, 12.0)
            for quadrant in ("upper right", "upper left", "lower left", "lower right")
        },
        ("eccentricity_deg", "quadrant", *MAIELLO),
    ),
}
"""Published experiments by bibliography key."""


def replica(paper: str, condition: str | None = None, **others: Any) -> Stimulus:
    """Draw the stimulus of a published experiment.

    Parameters
    ----------
    paper
        Bibliography key, one of `PAPERS`.
    condition
        A condition listed in ``PAPERS[paper].conditions``; None: the first.
    others
        Parameters of the drawing function that replace the defaults.

    Returns
    -------
    Stimulus
        ``controlled["stated_in_paper"]`` names the parameters whose values are stated in the paper's abstract or on its
        authors' page; the others are choices of this package: compare them with the paper before calling it a
        replication.

    Raises
    ------
    InputError
        If the paper, the condition or a parameter is unknown.

    Examples
    --------
    >>> one = replica("mather2002", "left sharp, blurred border", width_deg=4, height_deg=4)
    >>> one.name, one.controlled["near"], one.controlled["stated_in_paper"]
    ('texture_border', 'right', ['border'])
    """
    check_one_of("paper", paper, PAPERS)
    known = PAPERS[paper]
    condition = next(iter(known.conditions)) if condition is None else condition
    if condition not in known.conditions:
        raise InputError(f"condition is {described(condition)}, but {paper} has {'; '.join(known.conditions)}.")
    given = {**known.conditions[condition], **others}
    try:
        drawn = known.draw(**given)
    except TypeError as error:
        raise InputError(
            f"{paper} is drawn by {known.draw.__name__}, which rejected the parameters: {error}."
        ) from error
    stated = [name for name in known.stated if name not in others]
    about = {"condition": condition, "stated_in_paper": stated}
    return replace(drawn, source=(paper,), controlled={**drawn.controlled, **about})
