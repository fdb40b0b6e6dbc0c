"""Find content of a figure that is cut off or covered: text, data, legends."""

from __future__ import annotations

import re
from collections.abc import Iterator
from itertools import combinations
from typing import Any

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.collections import Collection, PathCollection
from matplotlib.colors import to_hex
from matplotlib.figure import Figure
from matplotlib.legend import Legend
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.path import Path
from matplotlib.spines import Spine
from matplotlib.text import Text
from matplotlib.transforms import Bbox, BboxBase
from numpy.typing import NDArray

__all__ = ["CutContentError", "check_figure", "figure_faults"]

SLACK = 1.5
"""Distance in pixels by which content may leave its box: half the width of a line."""

TEXT_GAP = 0.4
"""Minimum horizontal gap between two texts, in units of the smaller font's size."""

TEXT_LEADING = 0.15
"""Empty part of a text's box above and below its digits, in units of the font's size."""

UNIT_ALONE = re.compile(r"\([^()\s]{1,6}\)")
"""A line of a label that holds a unit only."""


class CutContentError(AssertionError):
    """A figure has content that is cut off or covered."""


def check_figure(figure: Figure, name: str = "figure") -> None:
    """Raise `CutContentError` with all faults of a figure, if it has any."""
    if faults := figure_faults(figure):
        raise CutContentError("\n  ".join([f"{name} has content that is cut off or covered:", *faults]))


def figure_faults(figure: Figure) -> list[str]:
    """Describe each fault of a figure as it is drawn at its resolution.

    Faults are: text or axes beyond the figure, data beyond their axes, text on text, a legend on data, two entries of a
    legend that look alike, and a unit alone on a line. A curve that leaves its axes on purpose has the gid "clipped".
    """
    figure.draw_without_rendering()
    axes = [ax for ax in figure.findobj(Axes) if isinstance(ax, Axes) and _is_drawn(ax)]
    texts = list(_texts(figure, axes))
    legends = [legend for legend in figure.findobj(Legend) if isinstance(legend, Legend) and _is_drawn(legend)]
    faults = [f"{_quoted(text)} leaves the figure" for text in texts if not _inside(_box(text), figure.bbox)]
    faults += [f"the axes {_named(ax)} leave the figure" for ax in axes if not _inside(ax.bbox, figure.bbox)]
    faults += [
        f"{_quoted(text)} has its unit alone on a line"
        for text in texts
        if len(lines := text.get_text().split("\n")) > 1 and any(map(UNIT_ALONE.fullmatch, lines))
    ]
    outlines = [_outline(text) for text in texts]
    boxes = [Bbox([outline.min(axis=0), outline.max(axis=0)]) for outline in outlines]
    for one, other in combinations(range(len(texts)), 2):
        if boxes[one].overlaps(boxes[other]) and _meet(outlines[one], outlines[other]):
            faults.append(f"{_quoted(texts[one])} and {_quoted(texts[other])} touch")
    for ax in axes:
        faults += [f"{_described(artist)} leaves the axes {_named(ax)}" for artist in _beyond(ax)]
    for legend in legends:
        faults += _faults_of_legend(legend, axes)
    return faults


def _is_drawn(artist: Artist) -> bool:
    """Return whether an artist, its axes and its figures are visible."""
    parent = artist.axes if artist.axes is not artist else artist.get_figure()
    return artist.get_visible() and (not isinstance(parent, Axes) or _is_drawn(parent))


def _texts(figure: Figure, axes: list[Axes]) -> Iterator[Text]:
    """Yield the texts that are drawn: not ticks beyond the limits, nor labels of axes that are off."""
    hidden: set[Text] = set()
    for ax in axes:
        for axis in ax.findobj(Axis):
            assert isinstance(axis, Axis)
            shown = ax.axison and axis.get_visible()
            low, high = sorted(axis.get_view_interval())
            margin = 1e-9 * (high - low)
            for tick in (*axis.get_major_ticks(), *axis.get_minor_ticks()):
                if not (shown and tick.get_visible() and low - margin <= tick.get_loc() <= high + margin):
                    hidden |= {tick.label1, tick.label2}
            if not shown:
                hidden |= {axis.label, axis.offsetText}
    for text in figure.findobj(Text):
        if isinstance(text, Text) and text not in hidden and text.get_text().strip() and _is_drawn(text):
            yield text


def _box(text: Text) -> BboxBase:
    """Return the box of a text without its arrow, in pixels."""
    return Text.get_window_extent(text)


def _outline(text: Text) -> NDArray[np.float64]:
    """Return the four corners of a text's box, turned as the text is, with its share of the gap between texts."""
    box = _box(text)
    angle = np.radians(text.get_rotation())
    across, along = np.cos(angle), np.sin(angle)
    size = np.array([box.width, box.height])
    if min(abs(across), abs(along)) > 1e-6:  # the box is that of the turned text
        turned = np.abs([[across, along], [along, across]])
        size = np.abs(np.linalg.solve(turned, size)) if abs(across**2 - along**2) > 0.05 else _unturned(text)
    elif abs(along) > 0.5:
        size = size[::-1]
    assert text.figure is not None
    em = float(text.get_fontsize()) * text.figure.dpi / 72
    half = np.maximum(size / 2 + [TEXT_GAP / 2 * em, -TEXT_LEADING * em], 0.1)
    corners = half * [[-1, -1], [1, -1], [1, 1], [-1, 1]]
    return corners @ np.array([[across, along], [-along, across]]) + [box.x0 + box.width / 2, box.y0 + box.height / 2]


def _unturned(text: Text) -> NDArray[np.float64]:
    angle = text.get_rotation()
    text.set_rotation(0)
    box = _box(text)
    text.set_rotation(angle)
    return np.array([box.width, box.height])


def _meet(one: NDArray[np.float64], other: NDArray[np.float64]) -> bool:
    """Return whether two rectangles overlap: no side of either separates them."""
    for sides in (one, other):
        for axis in (sides[1] - sides[0], sides[2] - sides[1]):
            first, second = one @ axis, other @ axis
            if first.max() <= second.min() or second.max() <= first.min():
                return False
    return True


def _inside(box: BboxBase, outer: BboxBase) -> bool:
    return bool(
        box.x0 >= outer.x0 - SLACK
        and box.y0 >= outer.y0 - SLACK
        and box.x1 <= outer.x1 + SLACK
        and box.y1 <= outer.y1 + SLACK
    )


def _data(ax: Axes) -> Iterator[tuple[Artist, NDArray[np.float64], tuple[bool, bool]]]:
    """Yield each artist with data, its points in pixels, and which of their coordinates are data."""
    for artist in ax.get_children():
        if not artist.get_visible() or artist is ax.patch or isinstance(artist, Spine) or artist.get_gid() == "clipped":
            continue
        if isinstance(artist, Line2D):
            transform, paths = artist.get_transform(), [artist.get_path()]
        elif isinstance(artist, PathCollection):
            transform, paths = artist.get_offset_transform(), [Path(np.asarray(artist.get_offsets(), float))]
        elif isinstance(artist, Collection):
            transform, paths = artist.get_transform(), [*artist.get_paths()]
        elif isinstance(artist, Patch):
            transform, paths = artist.get_transform(), [artist.get_path()]
        else:
            continue
        points = [transform.transform(path.vertices) for path in paths]
        across, along = transform.contains_branch_seperately(ax.transData)
        if sum(map(len, points)):
            yield artist, np.concatenate([one for one in points if len(one)]), (across, along)


def _beyond(ax: Axes) -> list[Artist]:
    """Return the artists whose data leave the axes."""
    low, high = np.array(ax.bbox.min) - SLACK, np.array(ax.bbox.max) + SLACK
    found = []
    for artist, points, of_data in _data(ax):
        clips = artist.get_clip_on()
        finite = np.isfinite(points).all(axis=1)
        out = ((points < low) | (points > high)) & of_data
        if clips and (out.any(axis=1) & finite).any():
            found.append(artist)
    return found


def _faults_of_legend(legend: Legend, axes: list[Axes]) -> list[str]:
    box = legend.get_window_extent()
    faults = []
    if not _inside(box, legend.get_figure(root=True).bbox):  # type: ignore[union-attr]
        faults.append("a legend leaves the figure")
    for ax in axes:
        for artist, points, _ in _data(ax):
            if _covers(box, artist, points[np.isfinite(points).all(axis=1)]):
                faults.append(f"a legend covers {_described(artist)} of the axes {_named(ax)}")
    looks: dict[Any, str] = {}
    for handle, text in zip(legend.legend_handles, legend.get_texts(), strict=False):
        look = _look(handle)
        if look is not None and looks.setdefault(look, text.get_text()) != text.get_text():
            faults.append(f"{text.get_text()!r} and {looks[look]!r} look alike in a legend")
    return faults


def _covers(box: BboxBase, artist: Artist, points: NDArray[np.float64]) -> bool:
    """Return whether a box covers points, the lines that join them, or the area inside them."""
    if not len(points):
        return False
    if isinstance(artist, PathCollection) or (isinstance(artist, Line2D) and artist.get_linestyle() == "None"):
        low, high = np.array(box.min) + SLACK, np.array(box.max) - SLACK
        return bool(((points > low) & (points < high)).all(axis=1).any())
    return Path(points).intersects_bbox(Bbox(box.get_points()), filled=isinstance(artist, Patch))


def _look(handle: Artist | None) -> Any:
    """Return what distinguishes a line of a legend from another."""
    if not isinstance(handle, Line2D):
        return None
    return to_hex(handle.get_color()), str(handle.get_linestyle()), str(handle.get_marker()), handle.get_linewidth()


def _quoted(text: Text) -> str:
    return repr(text.get_text())


def _described(artist: Artist) -> str:
    label = str(artist.get_label())
    return type(artist).__name__ + ("" if label.startswith("_") or not label else f" {label!r}")


def _named(ax: Axes) -> str:
    titles = (ax.get_title(loc=where) for where in ("left", "center", "right"))
    return repr(next(filter(None, (*titles, ax.get_ylabel(), ax.get_xlabel())), "without a name"))
