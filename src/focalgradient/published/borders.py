"""Depth order at a border between two textures, by the blur of textures and border (Mather; Marshall et al.)."""

from __future__ import annotations

from functools import lru_cache, partial
from math import inf

from focalgradient.display import Display
from focalgradient.observers import DepthOrder, Observer
from focalgradient.published.record import Finding, Prediction, Published, mean_of
from focalgradient.published.thresholds import OWN_WEBER, weber_fraction
from focalgradient.stimuli import PAPERS, replica

__all__ = ["RECORDS", "blurred_nearer"]

SEEDS = range(4)
"""Seeds of the textures over which the prediction is averaged (our choice)."""

SIZE_DEG = 5.0
"""Width and height of the pictures in degrees (our choice)."""

FINE = Display(distance=Display().distance * 60 / Display().pixels_per_degree)
"""Display with about 60 pixels per degree (our choice)."""

OWN_BORDER = "that the nearer side owns the border's blur"
"""Assumption of the observer that was taken from these papers."""

PAIRED = "The observer reads the blurs from the pixels. Textures and the blur of 4 arcmin are our choice."


@lru_cache(maxsize=64)
def blurred_nearer(observer: Observer, paper: str, border: str) -> Prediction:
    """Return the proportion of answers in which the blurred side looks nearer, for a "sharp" or a "blurred" border.

    It is the mean probability over both sides and `SEEDS`.
    """
    answers = []
    for sharp, blurred in (("left", "right"), ("right", "left")):
        for seed in SEEDS:
            drawn = replica(
                paper,
                f"{sharp} sharp, {border} border",
                pixels_per_degree=FINE.pixels_per_degree,
                width_deg=SIZE_DEG,
                height_deg=SIZE_DEG,
                seed=seed,
            )
            order = DepthOrder(first=drawn.masks[blurred], second=drawn.masks[sharp])
            answers.append(observer.look(drawn.picture, FINE, order).probability["first"])
    return mean_of(answers)


RECORDS = (
    Published(
        key="mather1996",
        citation="Mather 1996, Proc. R. Soc. Lond. B 263",
        doi="",
        design="Of two textured regions, one sharp and one blurred, people said which is nearer, with a sharp or a "
        "blurred border between them.",
        conditions=tuple(PAPERS["mather1996"].conditions),
        settings={"task": "published", "experiment": "mather1996"},
        findings=(
            Finding(
                quantity="share in which the blurred side looks nearer, border blurred",
                units="1",
                printed="the border's blur establishes the order (abstract); a blurred border puts the blurred side "
                "in front",
                low=0.5,
                high=inf,
                source="memory",
                taken=OWN_BORDER,
                ask=partial(blurred_nearer, paper="mather1996", border="blurred"),
                remark=PAIRED,
            ),
            Finding(
                quantity="share in which the blurred side looks nearer, border sharp",
                units="1",
                printed="the border's blur establishes the order (abstract); a sharp border puts the sharp side in "
                "front",
                low=-inf,
                high=0.5,
                source="memory",
                taken=OWN_BORDER,
                ask=partial(blurred_nearer, paper="mather1996", border="sharp"),
                remark=PAIRED,
            ),
        ),
    ),
    Published(
        key="mather2002",
        citation="Mather and Smith 2002, Perception 31",
        doi="",
        design="Of two random textures at a sinusoidal border, one blurred, people said which is nearer; blur "
        "discrimination thresholds were measured with similar textures.",
        conditions=tuple(PAPERS["mather2002"].conditions),
        settings={"task": "published", "experiment": "mather2002"},
        findings=(
            Finding(
                quantity="Weber fraction of blur in textures",
                units="1",
                printed="0.28 to 0.56",
                low=0.28,
                high=0.56,
                source="abstract",
                taken=OWN_WEBER,
                ask=partial(weber_fraction, pedestal=4.0),
                remark="The pedestal of 4 arcmin is our choice.",
            ),
            Finding(
                quantity="share in which the blurred side looks nearer, border blurred",
                units="1",
                printed="blur variation alone is sufficient to determine the apparent depth ordering (abstract); its "
                "direction",
                low=0.5,
                high=inf,
                source="memory",
                taken=OWN_BORDER,
                ask=partial(blurred_nearer, paper="mather2002", border="blurred"),
                remark=PAIRED,
            ),
            Finding(
                quantity="share in which the blurred side looks nearer, border sharp",
                units="1",
                printed="blur variation alone is sufficient to determine the apparent depth ordering (abstract); its "
                "direction",
                low=-inf,
                high=0.5,
                source="memory",
                taken=OWN_BORDER,
                ask=partial(blurred_nearer, paper="mather2002", border="sharp"),
                remark=PAIRED,
            ),
        ),
    ),
    Published(
        key="marshall1996",
        citation="Marshall, Burbeck, Ariely, Rolland and Martin 1996, JOSA A 13",
        doi="",
        design="People said which of two adjacent textured regions is nearer, while the blur of either region and of "
        "the edge between them varied.",
        conditions=tuple(PAPERS["marshall1996"].conditions),
        settings={"task": "published", "experiment": "marshall1996"},
        findings=(
            Finding(
                quantity="share in which the blurred side looks nearer, border blurred",
                units="1",
                printed="the region whose blur the edge has looks nearer",
                low=0.5,
                high=inf,
                source="memory",
                taken=OWN_BORDER,
                ask=partial(blurred_nearer, paper="marshall1996", border="blurred"),
                remark=PAIRED,
            ),
            Finding(
                quantity="share in which the blurred side looks nearer, border sharp",
                units="1",
                printed="the region whose blur the edge has looks nearer",
                low=-inf,
                high=0.5,
                source="memory",
                taken=OWN_BORDER,
                ask=partial(blurred_nearer, paper="marshall1996", border="sharp"),
                remark=PAIRED,
            ),
        ),
    ),
)
