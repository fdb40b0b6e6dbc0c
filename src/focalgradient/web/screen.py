"""A participant's screen: size from a card, viewing distance from the blind spot, gamma from matches; all with errors.

The procedure is that of Li, Joo, Yeatman & Reinecke (2020, Scientific Reports 10, 904): a drawn card is made as large
as a bank card; then a ball moves away from a square that one eye looks at, and a key is pressed when it disappears, at
the edge of the blind spot. `benchmarks/viewing_distance.py` simulates people who do it.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import stdtrit

from focalgradient.display import CARD

__all__ = ["Measured", "gamma_of", "measure"]

CARD_SD_M = 0.5e-3
"""Standard error with which two edges are matched by eye: two to three CSS pixels at either edge. Our choice."""

EDGE_DEG = 12.5
"""Where the ball disappears, in degrees from the square. Li et al. (2020) found the key pressed at 13.5 degrees, 54 cm
away, of which the ball had come one degree in `REACTION_S`, at 120 pixels of 0.265 mm a second."""

PERSON_SD = 0.074
"""Standard deviation over people of the distance that the blind spot gives, as a share of it: 40 mm at 540 mm."""

REACTION_S = 0.3
"""Between the disappearing and the key: a simple reaction time. Our choice."""

STEP_PX = 2.0
"""CSS pixels that the ball moves from one frame to the next."""


@dataclass(frozen=True, slots=True)
class Measured:
    """A screen and a viewing distance, each with its standard error.

    Parameters
    ----------
    pixel_m, pixel_sd_m
        Distance of two CSS pixels, in metres.
    distance_m, distance_sd_m
        From the eye to the screen, in metres; None where the blind spot was not measured.
    """

    pixel_m: float
    pixel_sd_m: float
    distance_m: float | None
    distance_sd_m: float | None


def measure(card_px: float, blind_spot_px: Sequence[float], refresh_hz: float | None) -> Measured:
    """Estimate the pitch of the pixels and the viewing distance from what a participant did.

    The ball moves on until the key is pressed, the farther the more frames a second there are: that way is taken back.
    The error of a distance has three parts: people differ in where their blind spot is, the card was not matched
    perfectly, and the presses of one person scatter. The first two do not become less by repeating.

    Parameters
    ----------
    card_px
        Width of the drawn card when it was as large as the card, in CSS pixels.
    blind_spot_px
        From the square to the ball at each press, in CSS pixels.
    refresh_hz
        Frames a second; None where it is not known, and with it the distance.

    Examples
    --------
    >>> found = measure(323.5, [470.0, 480.0, 490.0, 475.0, 485.0], 60.0)
    >>> round(found.distance_m, 3), round(found.distance_sd_m, 3)
    (0.53, 0.04)
    """
    pixel = CARD[0] / card_px
    card = CARD_SD_M / CARD[0]
    if refresh_hz is None:
        return Measured(pixel, card * pixel, None, None)
    presses = np.asarray(blind_spot_px, float) - REACTION_S * STEP_PX * refresh_hz
    presses = presses[presses > 0]
    if len(presses) == 0:
        return Measured(pixel, card * pixel, None, None)
    middle = float(np.median(presses))
    distance = middle * pixel / math.tan(math.radians(EDGE_DEG))
    # The median of a few normal values scatters 1.25 times as much as their mean.
    spread = 1.25 * float(presses.std(ddof=1)) / math.sqrt(len(presses)) / middle if len(presses) > 1 else PERSON_SD
    return Measured(pixel, card * pixel, distance, distance * math.hypot(PERSON_SD, card, spread))


def gamma_of(matches: Sequence[tuple[float, float]]) -> tuple[float, float] | None:
    """Estimate a display's gamma from matches of grey with black and white rows, and its standard error.

    Where a share s of the rows is white, grey of level v looks as bright as they do if (v / 255) ** gamma = s (Colombo
    & Derrington 2001, Displays 22, 87; To, Woods, Goldstein & Peli 2013, Vision Research 90, 15). Light at level 0 is
    taken for none. The standard error comes from the scatter of so few matches, and is made larger until two of them
    cover 95 %.

    Parameters
    ----------
    matches
        Of each the share of white rows, between 0 and 1, and the level, from 1 to 254.

    Returns
    -------
    tuple of float, or None
        None for fewer than two matches.

    Examples
    --------
    >>> gamma, sd = gamma_of([(0.5, 186), (0.25, 136), (0.5, 190), (0.25, 132)])
    >>> round(gamma, 2), round(sd, 2)
    (2.22, 0.08)
    """
    if len(matches) < 2:
        return None
    shares, levels = np.asarray(matches, float).T
    each = np.log(shares) / np.log(levels / 255)
    # A level is a whole number: an error of one part in sqrt(12) of the change from one to the next.
    step = each / (levels * np.abs(np.log(levels / 255))) / math.sqrt(12)
    scatter = max(float(each.std(ddof=1)), float(np.sqrt(np.mean(step**2))))
    wider = float(stdtrit(len(each) - 1, 0.975)) / 2
    return float(each.mean()), wider * scatter / math.sqrt(len(each))
