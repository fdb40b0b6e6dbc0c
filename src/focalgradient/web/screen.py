"""Calibration of a participant's screen: size by a card, viewing distance by the blind spot, gamma by grey matches.

The procedure is that of Li, Joo, Yeatman & Reinecke (2020, Scientific Reports 10, 904): a drawn card is matched to a
bank card; then a ball moves away from a square fixated by one eye, and a key is pressed when it disappears at the edge
of the blind spot. All values have standard errors; `benchmarks/viewing_distance.py` simulates participants.
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
"""Standard error in m of matching two edges by eye: two to three CSS pixels at either edge (our choice)."""

EDGE_DEG = 12.5
"""Eccentricity in degrees at which the ball disappears. Li et al. (2020) found key presses at 13.5 degrees, at 54 cm;
the ball had moved by one degree of it during `REACTION_S`, at 120 pixels of 0.265 mm per s.
"""

PERSON_SD = 0.074
"""Standard deviation over persons of the distance derived from the blind spot, as a fraction: 40 mm at 540 mm."""

REACTION_S = 0.3
"""Time in s between disappearance and key press: a simple reaction time (our choice)."""

STEP_PX = 2.0
"""Movement of the ball per frame, in CSS pixels."""


@dataclass(frozen=True, slots=True)
class Measured:
    """Pixel pitch and viewing distance, each with its standard error.

    Parameters
    ----------
    pixel_m, pixel_sd_m
        Pitch of CSS pixels, in m.
    distance_m, distance_sd_m
        Distance from the eye to the screen, in m; None if the blind spot was not measured.
    """

    pixel_m: float
    pixel_sd_m: float
    distance_m: float | None
    distance_sd_m: float | None


def measure(card_px: float, blind_spot_px: Sequence[float], refresh_hz: float | None) -> Measured:
    """Estimate pixel pitch and viewing distance from a participant's settings.

    The ball moves on until the key is pressed, and the farther the higher the frame rate: this overshoot is subtracted.
    The error of a distance has three parts: variation of the blind spot between persons, the error of matching the
    card, and the scatter of one person's key presses. Repetition reduces only the third.

    Parameters
    ----------
    card_px
        Width of the drawn card when it matched the bank card, in CSS pixels.
    blind_spot_px
        Distance from the square to the ball at each press, in CSS pixels.
    refresh_hz
        Frame rate in Hz; if it is None, the distance is None too.

    Examples
    --------
    >>> found = measure(323.5, [470.0, 480.0, 490.0, 475.0, 485.0], 60.0)
    >>> round(found.distance_m, 3), round(found.distance_sd_m, 3)
    (0.53, 0.04)
    """
    pixel = CARD[0] / card_px
    card = CARD_SD_M / CARD[0]
    delay = math.inf if refresh_hz is None else REACTION_S * STEP_PX * refresh_hz
    presses = np.asarray(blind_spot_px, float) - delay
    presses = presses[presses > 0]
    if len(presses) == 0:
        return Measured(pixel, card * pixel, None, None)
    middle = float(np.median(presses))
    distance = middle * pixel / math.tan(math.radians(EDGE_DEG))
    # The standard error of the median of a few normal values is 1.25 times that of their mean.
    spread = 1.25 * float(presses.std(ddof=1)) / math.sqrt(len(presses)) / middle if len(presses) > 1 else PERSON_SD
    return Measured(pixel, card * pixel, distance, distance * math.hypot(PERSON_SD, card, spread))


def gamma_of(matches: Sequence[tuple[float, float]]) -> tuple[float, float] | None:
    """Estimate a display's gamma and its standard error from matches of grey with black and white rows.

    If a fraction s of the rows is white, grey of level v matches them in luminance when (v / 255) ** gamma = s (Colombo
    & Derrington 2001, Displays 22, 87; To, Woods, Goldstein & Peli 2013, Vision Research 90, 15). Luminance at level 0
    is assumed to be 0. The standard error is that of the few matches, increased so that an interval of two standard
    errors covers 95 %.

    Parameters
    ----------
    matches
        Fraction of white rows (between 0 and 1) and matching level (1 to 254) of each match.

    Returns
    -------
    tuple of float, or None
        Gamma and its standard error; None for fewer than two matches.

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
    # Rounding to whole levels: standard error of 1 / sqrt(12) of the change from one level to the next.
    step = each / (levels * np.abs(np.log(levels / 255))) / math.sqrt(12)
    scatter = max(float(each.std(ddof=1)), float(np.sqrt(np.mean(step**2))))
    wider = float(stdtrit(len(each) - 1, 0.975)) / 2
    return float(each.mean()), wider * scatter / math.sqrt(len(each))
