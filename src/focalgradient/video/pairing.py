"""Pairing of video frames that alternate between two apertures (even and odd frames).

Each two successive frames form a pair, so that n frames give n - 1 depth maps; two frames are held in memory at a time.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from itertools import islice

import numpy as np

from focalgradient.errors import InputError
from focalgradient.video.reading import Frame, Grey, Skipped

__all__ = ["PLAIN", "Pair", "alternation", "pairs"]

PLAIN = 0.1
"""Change of log detail from frame to frame below which the two apertures cannot be distinguished."""


@dataclass(frozen=True, slots=True, eq=False)
class Pair:
    """Two successive frames: one through the aperture of even frames, one through that of odd frames.

    `number` is that of the later frame.
    """

    number: int
    even: Grey
    odd: Grey


def alternation(frames: Iterable[Frame | Skipped], detail: Callable[[Grey], float], most: int = 24) -> float:
    """Return the median log ratio of detail between even and odd frames, over the first `most` successive frames.

    `detail` measures a frame's high-frequency content. If positive, even frames are the sharper ones, counted with the
    frames that were lost: two successive frames of one aperture change the parity of those behind them.

    >>> import itertools
    >>> frames = (Frame(n, np.full((1, 1), 20 if n % 2 else 40, np.uint8)) for n in itertools.count())
    >>> round(alternation(frames, lambda image: float(image.mean())), 3)
    0.693
    """
    steps: list[tuple[int, float]] = []
    before: tuple[int, float] | None = None
    for item in islice(frames, most):
        if isinstance(item, Frame):
            level = math.log(max(detail(item.image), 1e-12))
            if before is not None and item.number == before[0] + 1:
                steps.append((item.number, level - before[1]))
            before = item.number, level
    if not steps:
        raise InputError("the video contains no two successive decodable frames: give one with more frames.")
    usual, lost, signed = float(np.median([abs(change) for _, change in steps])), 0, []
    for number, change in steps:
        if usual > PLAIN and abs(change) < usual / 2:
            lost += 1
        else:
            signed.append(change * (1 if (number + lost) % 2 == 0 else -1))
    return float(np.median(signed))


def pairs(frames: Iterable[Frame | Skipped], detail: Callable[[Grey], float], step: float) -> Iterator[Pair | Skipped]:
    """Yield pairs of successive frames; violations of the alternation are reported, and pairing continues.

    Parameters
    ----------
    frames
        Frames, as yielded by `Source.frames`.
    detail
        Function that measures a frame's high-frequency content.
    step
        Result of `alternation`. Two successive frames whose detail differs by less than half of it show the same
        aperture: a frame between them was lost. If the difference has the wrong sign, a frame was lost before. Below 10
        %, neither can be detected, and frames are used as they come.

    Yields
    ------
    Pair or Skipped
        In the order of the frames. A frame without a partner before or after it is reported, too.
    """
    # Parity of the frame numbers, including frames lost without trace.
    lost = 0
    before: Frame | None = None
    before_level = 0.0
    paired = True
    for item in frames:
        if isinstance(item, Skipped):
            if before is not None and not paired:
                yield Skipped(before.number, before.number, _ALONE)
            before, paired = None, True
            yield item
            continue
        level = math.log(max(detail(item.image), 1e-12))
        if before is None:
            before, before_level, paired = item, level, False
            continue
        change = (level - before_level) * (1 if (item.number + lost) % 2 == 0 else -1)
        wrong = None
        if abs(step) > PLAIN and abs(change) < abs(step) / 2:
            wrong = "show the same aperture, so that a frame between them was lost"
        elif abs(step) > PLAIN and change * step < 0:
            wrong = "alternate in the wrong order, as after a loss or a cut"
        if wrong is not None:
            if not paired:
                yield Skipped(before.number, before.number, _ALONE)
            yield Skipped(before.number, item.number, wrong)
            lost += 1
            paired = False
        else:
            step += 0.1 * (float(np.clip(change, -2 * abs(step), 2 * abs(step))) - step)
            even, odd = (item, before) if (item.number + lost) % 2 == 0 else (before, item)
            yield Pair(item.number, even.image, odd.image)
            paired = True
        before, before_level = item, level
    if before is not None and not paired:
        yield Skipped(before.number, before.number, _ALONE)


_ALONE = "has no neighbour through the other aperture"
