"""Cue comparisons on unavailable displays: multifocal, light-field and focus-tunable displays."""

from __future__ import annotations

import math
from functools import partial
from math import inf

from focalgradient.observers import Observer
from focalgradient.published.record import Finding, Prediction, Published
from focalgradient.published.thresholds import discrimination

__all__ = ["RECORDS", "blur_over_disparity", "blur_weight_change"]

NEAR_D, AWAY_D = 0.0, 2.0
"""Distances (D) from fixation that represent "near" and "away from" fixation (our choice)."""

THRESHOLDS = (
    "Thresholds of the observer's laws, 0 and 2 D from fixation. Its threshold of disparity does not "
    "depend on the distance from fixation."
)


def blur_over_disparity(observer: Observer, away: float) -> Prediction:
    """Return the ratio of the depth thresholds (D) by blur and by disparity, at a distance (D) from fixation."""
    by_disparity = math.radians(observer.stereo / 60) / observer.interocular
    return Prediction(discrimination(observer, away).value / by_disparity)


def blur_weight_change(observer: Observer) -> Prediction:
    """Return the change in the weight of blur from near to away from fixation, with inverse-variance weights."""
    near, away = (1 / (1 + blur_over_disparity(observer, one).value ** 2) for one in (NEAR_D, AWAY_D))
    return Prediction(away - near)


RECORDS = (
    Published(
        key="held2012",
        citation="Held, Cooper and Banks 2012, Current Biology 22, 426-431",
        doi="10.1016/j.cub.2012.01.033",
        design="On a display of several focal distances people discriminated depth by blur, by disparity or by both, "
        "near fixation and away from it.",
        conditions=("blur", "disparity", "both"),
        needs="a display of several focal distances for each eye",
        findings=(
            Finding(
                quantity="threshold by blur over that by disparity, away from fixation",
                units="1",
                printed="blur was indeed more precise away from fixation",
                low=-inf,
                high=1.0,
                source="abstract",
                ask=partial(blur_over_disparity, away=AWAY_D),
                remark=THRESHOLDS,
            ),
            Finding(
                quantity="threshold by blur over that by disparity, near fixation",
                units="1",
                printed="disparity was more precise near fixation",
                low=1.0,
                high=inf,
                source="abstract",
                ask=partial(blur_over_disparity, away=NEAR_D),
                remark=THRESHOLDS,
            ),
        ),
    ),
    Published(
        key="langer2015",
        citation="Langer and Siciliano 2015, Vision Research 107, 15-21",
        doi="",
        design="The experiment of Held, Cooper and Banks with rendered blur on a common 3D display.",
        conditions=("near fixation", "away from fixation"),
        needs="a display for two eyes with disparate pictures of these scenes, which are not drawn here",
        findings=(
            Finding(
                quantity="weight of blur away from fixation less that near it",
                units="1",
                printed="subjects did not rely more on blur to discriminate depth at distances far from fixation",
                low=-inf,
                high=0.0,
                source="abstract",
                ask=blur_weight_change,
                remark=THRESHOLDS,
            ),
        ),
    ),
    Published(
        key="maiello2015",
        citation="Maiello, Chessa, Bex and Solari 2015, PLoS ONE 10",
        doi="",
        design="People said which of two patches of light-field photographs is farther, with pictorial cues, blur and "
        "disparity added separately.",
        conditions=("pictorial", "blur", "disparity", "their combinations"),
        needs="light-field photographs with their distances, shown to two eyes",
        findings=(
            Finding(
                quantity="sensitivity to depth with blur less that without",
                units="d'",
                printed="blur cues impaired sensitivity",
                low=-inf,
                high=0.0,
                source="abstract",
                remark="It looks without a layout, and so has no pictorial cues that blur could impair.",
            ),
        ),
    ),
    Published(
        key="konrad2016",
        citation="Konrad, Cooper and Wetzstein 2016, CHI",
        doi="10.1145/2858036.2858140",
        design="People in a near-eye display ordered depth, among other tasks, with conventional, focus-tunable and "
        "monovision optics.",
        conditions=("conventional", "focus-tunable", "monovision"),
        needs="a near-eye display with focus-tunable lenses",
        findings=(
            Finding(
                quantity="share right with focus-tunable optics less that with conventional ones, near distances",
                units="1",
                printed="improve user performance in terms of reaction times and accuracy, particularly for nearby "
                "simulated distances",
                low=0.0,
                high=inf,
                source="abstract",
                remark="`depth_order_observer` is fitted to these very people, so its answer would be no prediction; "
                "the observer that looks has pictures of one focus.",
            ),
        ),
    ),
)
