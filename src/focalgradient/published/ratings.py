"""The paper's own two experiments: ratings of depth, and the rotating Necker cube."""

from __future__ import annotations

from math import inf

from focalgradient.published.record import Finding, Published

__all__ = ["RECORDS"]

OWN_DISCOUNT = "that blur which contradicts the layout's order is discounted, and that blurred is farther"
OWN_ODDS = "that blur favours the reading in which blurred is farther"
WAITS = "Asked by a later commit; the range stands before."

RECORDS = (
    Published(
        key="pentland1987",
        citation="Pentland 1987, IEEE PAMI 9, first experiment",
        doi="",
        design="Pictures of naturalistic scenes with focal gradients of several magnitudes were rated for "
        "three-dimensionality while people fixated the nearest or the farthest object.",
        conditions=("nearest fixated", "farthest fixated"),
        findings=(
            Finding(
                quantity="rating at the largest aperture over the pinhole, nearest fixated",
                units="1",
                printed="increases strongly with increasing magnitude of the focal gradient",
                low=1.0,
                high=inf,
                source="full text",
                taken=OWN_DISCOUNT,
                remark=WAITS,
            ),
            Finding(
                quantity="rating at the largest aperture over the pinhole, farthest fixated",
                units="1",
                printed="no increase in subjective impression of depth results",
                low=-inf,
                high=1.0,
                source="full text",
                taken=OWN_DISCOUNT,
                remark=WAITS,
            ),
        ),
    ),
    Published(
        key="pentland1987-necker",
        citation="Pentland 1987, IEEE PAMI 9, second experiment",
        doi="",
        design="A wireframe cube that rotates in perspective was seen as rigid or as wobbling, with and without a "
        "focal gradient that favours the nonrigid reading.",
        conditions=("no focal gradient", "gradient that favours the nonrigid reading"),
        findings=(
            Finding(
                quantity="share of time nonrigid with the gradient less that without",
                units="1",
                printed="seen almost as often as the rigid one",
                low=0.0,
                high=inf,
                source="full text",
                taken=OWN_ODDS,
                remark=WAITS,
            ),
        ),
    ),
)
