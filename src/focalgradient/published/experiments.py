"""Published experiments, by their key in the bibliography.

Numbers that no available source prints are omitted; only the direction of the effect is then compared.
"""

from __future__ import annotations

from focalgradient.published import borders, displays, distance, ratings, thresholds
from focalgradient.published.accommodation import kruger1993
from focalgradient.published.record import Published

__all__ = ["EXPERIMENTS"]

EXPERIMENTS: dict[str, Published] = {
    one.key: one
    for one in (
        *ratings.RECORDS,
        *borders.RECORDS,
        *thresholds.RECORDS,
        *distance.RECORDS,
        *displays.RECORDS,
        kruger1993(),
    )
}
"""Published experiments, by key in the bibliography."""
