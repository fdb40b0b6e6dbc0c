"""Distance in metres by the blur of pictures."""

from __future__ import annotations

from math import inf

from focalgradient.published.record import Finding, Published
from focalgradient.stimuli import PAPERS

__all__ = ["RECORDS"]

WAITS = "Asked by a later commit; the range stands before."
OWN_MODEL = "that blur gives the scale of a layout: the model that this paper proposes"

RECORDS = (
    Published(
        key="held2010",
        citation="Held, Cooper, O'Brien and Banks 2010, ACM Trans. Graphics 29(2), 19",
        doi="10.1145/1731047.1731057",
        design="People judged the distance of a city in pictures with blur that is consistent with a simulated "
        "distance, a planar gradient along or across it, or none.",
        conditions=tuple(PAPERS["held2010"].conditions),
        findings=(
            Finding(
                quantity="judged distance, consistent blur over no blur",
                units="1",
                printed="blur changes the apparent distance and scale (abstract); nearer with more blur",
                low=-inf,
                high=1.0,
                source="memory",
                taken=OWN_MODEL,
                remark=WAITS,
            ),
            Finding(
                quantity="judged distance, consistent blur of 0.15 m over that of 0.36 m",
                units="1",
                printed="the pattern of blur indicates the apparent scale (abstract); nearer with more blur",
                low=-inf,
                high=1.0,
                source="memory",
                taken=OWN_MODEL,
                remark=WAITS,
            ),
            Finding(
                quantity="judged distance, aligned gradient over no blur",
                units="1",
                printed="some approximations should work well (abstract); an aligned gradient does",
                low=-inf,
                high=1.0,
                source="memory",
                taken=OWN_MODEL,
                remark=WAITS,
            ),
            Finding(
                quantity="logarithm of the effect of the orthogonal gradient over that of consistent blur",
                units="1",
                printed="and others should not (abstract); an orthogonal gradient works less",
                low=-inf,
                high=1.0,
                source="memory",
                remark=WAITS,
            ),
        ),
    ),
    Published(
        key="vishwanath2010",
        citation="Vishwanath and Blaser 2010, J. Vision 10(10), 26",
        doi="",
        design="People judged the distance of surfaces with and without a vertical or a horizontal gradient of blur.",
        conditions=tuple(PAPERS["vishwanath2010"].conditions),
        findings=(
            Finding(
                quantity="judged distance with the gradient of blur over that without",
                units="1",
                printed="surfaces with blur gradients were judged as significantly closer",
                low=-inf,
                high=1.0,
                source="abstract",
                remark=WAITS,
            ),
            Finding(
                quantity="judged distance with the gradient of 0.28 m over that with the gradient of 1.14 m",
                units="1",
                printed="the size of the effect modulated by the degree of blur",
                low=-inf,
                high=1.0,
                source="abstract",
                remark=WAITS,
            ),
            Finding(
                quantity="judged distance with the gradient across the slant over that without",
                units="1",
                printed="substantial changes in perceived distance regardless of relative depth relations of the "
                "surfaces indicated by other cues",
                low=-inf,
                high=1.0,
                source="abstract",
                remark=WAITS,
            ),
        ),
    ),
)
