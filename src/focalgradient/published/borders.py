"""Depth order at a border between two textures, by the blur of textures and border (Mather; Marshall et al.)."""

from __future__ import annotations

from functools import partial

from focalgradient.published.record import Finding, Published
from focalgradient.published.thresholds import OWN_WEBER, weber_fraction
from focalgradient.stimuli import PAPERS

__all__ = ["RECORDS"]

RECORDS = (
    Published(
        key="mather1996",
        citation="Mather 1996, Proc. R. Soc. Lond. B 263",
        doi="",
        design="Of two textured regions, one sharp and one blurred, people said which is nearer, with a sharp or a "
        "blurred border between them.",
        conditions=tuple(PAPERS["mather1996"].conditions),
        settings={"task": "published", "experiment": "mather1996"},
        findings=(),
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
        findings=(),
    ),
)
