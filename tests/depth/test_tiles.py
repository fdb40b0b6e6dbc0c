"""Large frames by tiles: as whole, but for far less than a standard deviation at the seams."""

from __future__ import annotations

import numpy as np
import pytest
from judged import over_sd
from shaped import PIXEL, filtered

from focalgradient import Lens, View, recover_depth
from focalgradient.depth.equalise import outlines, parts
from focalgradient.psf import transfer

LENSES = [Lens(0.025, number, 0.85) for number in (16, 5.6)]


def wall(shape: tuple[int, int], distance: float = 1.3) -> list[View]:
    """Views of a textured wall, whose texture does not repeat."""
    return filtered(
        LENSES,
        lambda down, right, lens: transfer(np.hypot(down, right), lens.blur_radius(distance) / PIXEL, "disc"),
        shape=shape,
        noise=0.01,
    )


def test_tiles_cover_the_frame_once():
    seen = np.zeros((1003, 4001), int)
    for tile in parts.tiles(seen.shape, 5):
        seen[tile.core] += 1
        assert all(part.start % 5 == 0 for part in (*tile.core, *tile.outer))
    assert (seen == 1).all()


def test_a_frame_by_tiles_is_as_whole(monkeypatch):
    views = wall((330, 640))
    whole = recover_depth(views, near=0.85, noise=0.01)
    monkeypatch.setattr(parts, "CORE", 330)
    said: list[tuple[float, str]] = []
    tiled = recover_depth(views, near=0.85, noise=0.01, progress=lambda share, words: said.append((share, words)))
    assert any("tile 2 of 2" in words for _, words in said)
    assert [share for share, _ in said] == sorted(share for share, _ in said)
    off = np.abs(tiled.vergence - whole.vergence) / whole.vergence_sd
    seam = off[:, 300:340][whole.valid[:, 300:340]]
    assert np.median(seam) <= 0.1
    assert (tiled.valid == whole.valid).mean() > 0.98
    # Across the seam depth does not jump by more than it does elsewhere.
    jump = np.abs(np.diff(tiled.vergence, axis=1)) / tiled.vergence_sd[:, 1:]
    assert np.median(jump[:, 319]) <= 0.1
    assert (np.abs(over_sd(tiled, 1.3)) < 2).mean() == pytest.approx(0.95, abs=0.06)


@pytest.mark.slow
def test_depth_about_an_outline_is_the_same_from_the_part_of_the_frame_about_it(monkeypatch):
    near, far = wall((200, 1000), 1.1), wall((200, 1000), 1.6)
    left = np.arange(1000) < 400
    views = [View(np.where(left, a.image, b.image), a.optics, PIXEL) for a, b in zip(near, far, strict=True)]
    made: list[list[parts.Tile]] = []

    def tiles_about(*given):
        made.append(parts.tiles_about(*given))
        return made[-1]

    monkeypatch.setattr(outlines, "tiles_about", tiles_about)
    part = recover_depth(views, near=0.85, noise=0.01)
    (tile,) = made[-1]
    assert tile.outer[1].stop - tile.outer[1].start < 400
    monkeypatch.setattr(parts, "MUCH", 0)
    whole = recover_depth(views, near=0.85, noise=0.01)
    assert made[-1][0].outer == (slice(0, 200), slice(0, 1000))
    assert part.details["outlines"]
    assert part.details["outlines"] == whole.details["outlines"]
    assert (part.valid == whole.valid).all()
    apart = np.abs(part.vergence - whole.vergence) / whole.vergence_sd
    assert apart[part.valid].max() < 0.01
