"""The published experiments, by their key in the bibliography.

Numbers that no source at hand prints are left out; a direction is then all that is compared.
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
"""By key."""
