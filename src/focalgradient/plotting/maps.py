"""Figures of views and depth maps.

Drawing functions draw into the axes `ax` and return them. Depth is coloured linearly in *vergence*, in which the
precision of a map is about constant: near is bright, far is dark; the colour bar is labelled in metres. Rejected pixels
show the hatched background.
"""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from dataclasses import replace
from textwrap import fill
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.colors import ListedColormap
from matplotlib.figure import Figure
from matplotlib.patches import Patch
from numpy.typing import NDArray

from focalgradient.arrays import FloatArray
from focalgradient.errors import InputError, check_list
from focalgradient.optics import DualPixel, Lens, Optics
from focalgradient.plotting.figures import MM, add_axes_mm, new_figure, round_ticks, shortened, style
from focalgradient.view import View

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.colorbar import Colorbar

    from focalgradient.depth import DepthMap

__all__ = [
    "REFUSED",
    "depth_figure",
    "describe_optics",
    "draw_depth",
    "draw_distance",
    "draw_error",
    "draw_uncertainty",
    "draw_view",
]

REFUSED: dict[str, Any] = {"facecolor": "#efefef", "edgecolor": "#a6a6a6", "hatch": "//////"}
"""Style of the background that shows at rejected pixels: a hatched grey distinct from all colour maps used here."""

_MOST_VIEWS = 4

_OUTSIDE = ("#bbbbbb", "white", "#c0392b")
"""Colours of what lies farther than the search, and nearer (the middle one is not used)."""

_MOST_PIXELS = 2000
"""Side in pixels of the largest picture drawn without subsampling: 180 mm at 280 pixels per inch."""

LONGEST_LABEL = 40
"""Letters of a colour bar's label that leave room for the title of the map beside it."""

LONGEST_LINE = 50
"""Letters of a line of a map's title that leave room for the title and the colour bar beside it."""

LETTER = 1.3
"""Width of a letter in a colour bar's label (mm), with a margin; longer labels are shortened."""


def depth_figure(
    views: Sequence[View],
    depth: DepthMap,
    *,
    names: Sequence[str] | None = None,
    truth: NDArray[np.floating] | None = None,
) -> Figure:
    """Draw views, recovered depth and its uncertainty; with `truth`, also the true depth and the error.

    Parameters
    ----------
    views
        The views from which depth was recovered; the first four are drawn.
    depth
        The recovered depth map, H x W.
    names
        A name for each view, such as its file name.
    truth
        True distance in metres, H x W; ``inf`` or ``nan`` where there is none.

    Returns
    -------
    matplotlib.figure.Figure
        180 mm wide, no text below 8 pt; save it with its `savefig`.

    Raises
    ------
    InputError
        If `names` does not name every view, or `truth` has another shape than the map.

    Examples
    --------
    >>> from focalgradient import DepthMap, Lens, View
    >>> flat = np.full((12, 16), 0.5)
    >>> lenses = [Lens(0.025, f_number, 1.0) for f_number in (16, 5.6)]
    >>> views = [View(flat, lens, pixel_angle=3e-4) for lens in lenses]
    >>> figure = depth_figure(views, DepthMap(flat, 0.01 * flat, flat > 0, flat > 0))
    >>> [ax.get_title(loc="left") for ax in figure.axes[:3]]
    ['f/16, focus 1 m', 'f/5.6, focus 1 m', 'Recovered depth, 100 % valid']
    """
    views = check_list("views", views, "views")
    if names is not None and len(names) != len(views):
        raise InputError(f"names has {len(names)} entries for {len(views)} views: give one name for each view.")
    if truth is not None and truth.shape != depth.shape:
        raise InputError(
            f"truth has shape {truth.shape}, but the depth map {depth.shape}: give the true distance of every pixel."
        )
    shown, depth, truth = _thinned(views[:_MOST_VIEWS], depth, truth)
    titles = ["" if depth.details.get("order_only") else describe_optics(view.optics) for view in shown]
    if names is not None:
        titles = [f"{shortened(name)}\n{title}" for name, title in zip(names, titles, strict=False)]
    limits = _vergence_limits(depth, truth)
    with style():
        lines = max(_depth_title(depth).count("\n"), _uncertainty_title(depth).count("\n"))
        rows = [(max(2, len(shown)), 1 if names is None else 2), (2, 1 + lines)]
        rows += [(2, 1)] * (truth is not None) + [(2, 2)] * (depth.evidence is not None)
        figure, panels = _page(depth.shape, rows)
        for ax, view, title in zip(panels[0], shown, titles, strict=False):
            draw_view(ax, view, title)
        for ax in panels[0][len(shown) :]:  # next to a single view: summary of its depth
            ax.set_axis_off()
            said = (fill(line, 48, subsequent_indent="   ") for line in depth.summary().splitlines())
            ax.text(0, 1, "\n".join(said), va="top")
        if depth.evidence is not None:
            completed_ax, completed_sd_ax = panels.pop()
            _draw_completed(completed_ax, completed_sd_ax, depth, limits)
        if truth is None:
            depth_ax, sd_ax = panels[1]
        else:
            (true_ax, depth_ax), (error_ax, sd_ax) = panels[1:]
            draw_distance(true_ax, truth, limits=limits, title="True depth")
            draw_error(error_ax, depth, truth)
        draw_depth(depth_ax, depth, limits=limits)
        draw_uncertainty(sd_ax, depth)
        legend = [Patch(**REFUSED, linewidth=0, label="rejected: no depth estimate")]
        figure.legend(handles=legend, loc="lower left", bbox_to_anchor=(0.0, 0.0), handlelength=2.4, handleheight=1.2)
        if len(views) > len(shown):
            height = 4.2 * MM / figure.get_figheight()
            figure.text(0.99, height, f"{len(shown)} of {len(views)} views shown", ha="right")
        figure.draw_without_rendering()  # ticks are created on first drawing, which must use this style
    return figure


def _thinned(
    views: Sequence[View], depth: DepthMap, truth: NDArray[np.floating] | None
) -> tuple[Sequence[View], DepthMap, NDArray[np.floating] | None]:
    """Return views, map and truth, subsampled if larger than a page can show, as drawing copies them many times."""
    every = -(-max(depth.shape) // _MOST_PIXELS)
    if every <= 1:
        return views, depth, truth
    some = (slice(None, None, every),) * 2
    arrays = {name: getattr(depth, name)[some] for name in ("vergence", "vergence_sd", "valid", "side_known")}
    thin = [View(view.image[some], view.optics, every * view.pixel_angle) for view in views]
    arrays["common_errors"] = depth.common_errors[:, ::every, ::every]
    for name in ("evidence", "beyond"):
        values = getattr(depth, name)
        arrays[name] = None if values is None else values[some]
    return thin, replace(depth, **arrays), None if truth is None else truth[some]


def draw_view(ax: Axes, view: View, title: str | None = None) -> Axes:
    """Draw a view as displayed: linear radiance, brightest 0.3 % clipped, with a gamma of 2.2."""
    white = max(float(np.percentile(view.image, 99.7)), np.finfo(float).tiny)
    ax.imshow(np.clip(view.image / white, 0, 1) ** (1 / 2.2), cmap="gray", vmin=0, vmax=1)
    return _picture(ax, describe_optics(view.optics) if title is None else title)


def draw_depth(
    ax: Axes,
    depth: DepthMap,
    *,
    limits: tuple[float, float] | None = None,
    title: str = "",
    outlines: bool = False,
) -> Axes:
    """Draw the valid depth, coloured linearly in vergence between `limits` (D), with a colour bar in metres.

    The title states the valid fraction, and the side of focus assumed if the views do not determine it. With
    `outlines`, detected occlusion boundaries (``depth.details["outlines"]``) are drawn as lines.
    """
    limits = limits or _vergence_limits(depth, None)
    title = title or _depth_title(depth)
    if outlines:
        for curve in depth.details.get("outlines", ()):
            ax.plot(*zip(*curve, strict=True), color="black", linewidth=0.8, scalex=False, scaley=False)
    if "rejected" in depth.details:
        said = fill(f"No depth: most likely because {depth.details['rejected']}.", 42)
        box = {"facecolor": "white", "edgecolor": "#888888", "linewidth": 0.4}
        ax.text(0.5, 0.5, said, transform=ax.transAxes, ha="center", va="center", bbox=box)
    if depth.beyond is not None and depth.beyond.any():
        outside = np.where(depth.beyond == 0, np.nan, depth.beyond)
        ax.imshow(outside, cmap=ListedColormap(_OUTSIDE), vmin=-1, vmax=1, interpolation="nearest", zorder=1)
    if depth.details.get("order_only"):
        count = int(depth.details["order_only"])
        bar = _map(
            ax, depth.vergence, depth.valid, "viridis", (1.0, 2.0), "position in the stack (order only)", "position"
        )
        bar.set_ticks([1 + n / (count - 1) for n in range(count)], labels=[str(n + 1) for n in range(count)])
        return _picture(ax, title)
    return _draw_metres(ax, depth, depth.valid, limits, title)


def _draw_metres(ax: Axes, depth: DepthMap, drawn: NDArray[np.bool_], limits: tuple[float, float], title: str) -> Axes:
    """Draw a map in vergence relative to the entrance pupil, with a colour bar labelled in the user's distance."""
    plane = f"distance from {depth.plane} (m)"
    label = plane if len(plane) <= LONGEST_LABEL else "distance (m)"
    bar = _map(ax, np.maximum(depth.vergence, 0), drawn, "viridis", limits, label, "distance (m)")
    return _with_metres(ax, bar, limits, title, depth.offset)


def draw_distance(ax: Axes, distance: NDArray[np.floating], *, limits: tuple[float, float], title: str = "") -> Axes:
    """Draw `distance` (m, H x W, ``nan`` where unknown) as `draw_depth` does, between `limits` in dioptres."""
    bar = _map(ax, 1 / distance, ~np.isnan(distance), "viridis", limits, "distance (m)")
    return _with_metres(ax, bar, limits, title)


def _with_metres(ax: Axes, bar: Any, limits: tuple[float, float], title: str, offset: float = 0.0) -> Axes:
    """Label a colour bar of vergences in metres: distance from the entrance pupil minus `offset` (m)."""
    count = round(np.clip(ax.get_window_extent().height / ax.figure.dpi * 3.2, 2, 7))
    offset = min(offset, 0.9 / max(limits[1], 1e-6))
    low, high = (1 / (1 / limit - offset) if limit > 0 else 0.0 for limit in limits)
    ticks = _metre_ticks(low, high, count=count)
    bar.set_ticks([1 / (1 / tick + offset) if tick > 0 else 0.0 for tick in ticks], labels=[_metres(t) for t in ticks])
    bar.ax.invert_yaxis()  # far at the top, as for increasing distance
    return _picture(ax, title)


def draw_uncertainty(ax: Axes, depth: DepthMap, title: str | None = None) -> Axes:
    """Draw the standard deviation of distance, in per cent of distance or in positions of a stack, where valid."""
    _draw_relative_sd(ax, depth, depth.valid)
    return _picture(ax, _uncertainty_title(depth) if title is None else title)


def _relative_sd(depth: DepthMap) -> tuple[FloatArray, str]:
    """Return the standard deviation of distance in per cent of distance, inf at infinity; of order in positions."""
    if count := depth.details.get("order_only"):
        return np.asarray((int(count) - 1) * depth.vergence_sd, float), "positions"
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.where(depth.vergence > 0, 100 * depth.vergence_sd / depth.vergence, np.inf), "%"


def _draw_relative_sd(ax: Axes, depth: DepthMap, drawn: NDArray[np.bool_]) -> None:
    sd, unit = _relative_sd(depth)
    low, high = _robust(sd[drawn], 0, 98)
    bar = _map(ax, sd, drawn, "magma", (min(low, 0.8 * high), high), f"sd ({unit})")
    bar.locator = round_ticks()


def _uncertainty_title(depth: DepthMap) -> str:
    """Return the median standard deviation between pixels, and that common to the frame."""
    sd, unit = _relative_sd(depth)
    title = _summary("Uncertainty: median sd", sd[depth.valid], unit)
    if len(depth.common_errors) and depth.valid.any():
        common = np.median(depth.common_sd[depth.valid] / np.maximum(depth.vergence[depth.valid], 1e-9))
        title += f"\nbetween pixels, {100 * common:.2g} % in common"
    return title


def draw_error(ax: Axes, depth: DepthMap, truth: NDArray[np.floating], title: str | None = None) -> Axes:
    """Draw recovered minus true distance, in per cent of the true distance (`truth`, m, H x W), where valid."""
    usable = depth.valid & np.isfinite(truth)
    percent = 100 * (depth.distance / np.where(usable, truth, 1.0) - 1)
    limit = _robust(np.abs(percent[usable]), 0, 95)[1]
    _map(ax, percent, usable, "RdBu_r", (-limit, limit), "error (%)")
    text = _summary("Error: median magnitude", np.abs(percent[usable]))
    if usable.any():
        bias = round(float(np.median(percent[usable])), 2) + 0.0  # no negative zero
        text += f", bias {bias:+.2g} %".replace("-", "−")
    return _picture(ax, text if title is None else title)


def _draw_completed(depth_ax: Axes, sd_ax: Axes, depth: DepthMap, limits: tuple[float, float]) -> None:
    """Draw a completed map and its standard deviation, with the fraction of each kind of evidence."""
    assert depth.evidence is not None
    measured, near, guessed = (_percent(float(np.mean(depth.evidence == how))) for how in (2, 1, 0))
    everywhere = np.ones(depth.shape, bool)
    title = f"Completed depth: {measured} measured,\n{near} near evidence, {guessed} guessed"
    _draw_metres(depth_ax, depth, everywhere, limits, title)
    _draw_relative_sd(sd_ax, depth, everywhere)
    _picture(sd_ax, "Uncertainty of the completed map")


def describe_optics(optics: Optics) -> str:
    """Describe the optics of a view in a photographer's terms.

    >>> describe_optics(Lens(focal_length=0.025, f_number=5.6, focus_distance=0.85))
    'f/5.6, focus 0.85 m'
    """
    if isinstance(optics, DualPixel):
        half = "mean of halves" if optics.asymmetry == 0 else "left half" if optics.asymmetry > 0 else "right half"
        return f"{half}, {describe_optics(optics.lens)}"
    if not isinstance(optics, Lens):
        return f"{1e3 * optics.aperture_diameter:.3g} mm, focus {optics.focus_vergence:.3g} D"
    aperture = "pinhole" if math.isinf(optics.f_number) else f"f/{optics.f_number:.3g}"
    return f"{aperture}, focus {_metres(optics.focus_vergence)} m"


def _page(shape: tuple[int, int], rows: Sequence[tuple[int, int]]) -> tuple[Figure, list[list[Axes]]]:
    """Lay out rows of (columns, title lines) for pictures of `shape` on a page 180 mm wide, from top to bottom.

    Rows of two columns leave room for a colour bar next to each picture; others have pictures only.
    """
    width, margin, gap, bar, legend = 180.0, 1.5, 5.0, 18.0, 8.0
    placed, depth = [], 1.0
    for columns, lines in rows:
        pitch = (width - 2 * margin + gap) / columns
        wide = pitch - gap - (bar if columns == 2 else 0)
        high = min(max(wide * shape[0] / shape[1], 12.0), 95.0)  # limited for extreme aspect ratios
        depth += 1.5 + 4.0 * lines + high
        placed.append([(margin + pitch * column, depth, wide, high) for column in range(columns)])
        depth += 2.5
    figure = new_figure(width, depth + legend)
    return figure, [[add_axes_mm(figure, *place) for place in row] for row in placed]


def _map(
    ax: Axes,
    values: NDArray[np.floating],
    drawn: NDArray[np.bool_],
    colours: str,
    limits: tuple[float, float],
    label: str,
    short: str = "",
) -> Colorbar:
    """Draw `values` where `drawn` is True over the hatched background, with a colour bar on the right.

    The bar has the `label`, or the `short` one where it is too low for that.
    """
    low, high = limits
    image = ax.imshow(np.where(drawn, values, np.nan), cmap=colours, vmin=low, vmax=high)
    ax.patch.set(**REFUSED, linewidth=0)
    beyond = bool((values[drawn] < low).any()), bool((values[drawn] > high).any())
    extend = {(False, False): "neither", (True, False): "min", (False, True): "max", (True, True): "both"}[beyond]
    bar = ax.figure.colorbar(image, cax=ax.inset_axes((1.03, 0, 0.04, 1)), extend=extend, extendfrac=0.03)
    letters = int(25.4 * ax.get_window_extent().height / ax.figure.dpi / LETTER)
    bar.set_label(short if short and len(label) > letters else label)
    bar.ax.spines["outline"].set_linewidth(0.4)
    bar.ax.set_visible(bool(drawn.any()))  # without values the scale would be arbitrary
    return bar


def _picture(ax: Axes, title: str) -> Axes:
    """Format `ax` as a picture: no ticks, thin frame, title."""
    ax.set(xticks=[], yticks=[], anchor="NW")
    ax.spines[:].set(visible=True, linewidth=0.4, color="#888888")
    ax.set_title(title, loc="left")
    return ax


def _vergence_limits(depth: DepthMap, truth: NDArray[np.floating] | None) -> tuple[float, float]:
    """Return the vergence limits of the colour scale (D): 99 % of the valid depth and of the truth, not below 0."""
    vergence = depth.vergence[depth.valid] if depth.valid.any() else depth.vergence.ravel()
    low, high = _robust(vergence, 0.5, 99.5)
    if truth is not None and np.isfinite(truth).any():
        nearest, farthest = _robust(truth[np.isfinite(truth)], 0.5, 99.5)
        low, high = min(low, 1 / farthest), max(high, 1 / nearest)
    low, high = max(low, 0.0), max(high, 1e-6)
    middle = (low + high) / 2
    return (low, high) if high - low > 0.02 * middle else (0.99 * middle, 1.01 * middle)


def _robust(values: NDArray[np.floating], low: float, high: float) -> tuple[float, float]:
    """Return the `low` and `high` percentiles of the finite `values`; (0, 1) if there are none."""
    values = values[np.isfinite(values)]
    if values.size == 0:
        return 0.0, 1.0
    bottom, top = np.percentile(values, [low, high])
    return float(bottom), float(top)


def _metre_ticks(low: float, high: float, count: int) -> list[float]:
    """Return about `count` evenly spaced vergences from `low` to `high` whose distances have few digits."""
    slack = 0.35 * (high - low) / count
    ticks = []
    for vergence in np.linspace(low, high, count) if low == 0 else np.linspace(low + slack, high - slack, count):
        for digits in range(1, 7):
            tick = 1 / float(_metres(vergence, digits)) if vergence > 0 else 0.0
            if abs(tick - vergence) <= slack and low <= tick <= high:
                ticks.append(tick)
                break
    return ticks


def _metres(vergence: float, digits: int = 4) -> str:
    """Format the distance of `vergence` in metres, to `digits` significant digits."""
    return "∞" if vergence <= 0 else f"{1 / vergence:.{digits}g}"


def _percent(share: float) -> str:
    return f"{100 * share:.3g} %" if 0 < share < 0.995 else f"{100 * share:.4g} %"


def _summary(text: str, values: NDArray[np.floating], unit: str = "%") -> str:
    return f"{text} {np.median(values):.2g} {unit}" if values.size else f"{text} unknown"


def _depth_title(depth: DepthMap) -> str:
    """Return the title of a map: the valid fraction, the side of focus assumed, and what the colours outside mean."""
    lines = [f"Recovered depth, {_percent(depth.valid.mean())} valid", _side_note(depth) or ""]
    if depth.beyond is not None:
        for way, colour, words in zip((-1, 1), ("grey", "red"), depth.outside_in_words(), strict=True):
            if (depth.beyond == way).any():
                lines.append(f"{colour}: {words} ({_percent(np.mean(depth.beyond == way))})")
    # A number is not parted from its unit.
    lines = [re.sub(r"(?<=\d) (?=m\b|%)", "\N{NO-BREAK SPACE}", line) for line in lines]
    filled = "\n".join(fill(line, LONGEST_LINE, subsequent_indent="   ") for line in lines if line)
    return filled.replace("\N{NO-BREAK SPACE}", " ")


def _side_note(depth: DepthMap) -> str | None:
    """Return a note on the side of focus that was assumed, or what else is blurred alike; None if the views tell it."""
    stated = str(depth.details.get("side", ""))
    if "assumed" not in stated and depth.side_known[depth.valid].all():
        return depth.blurred_alike_in_words() or None
    side = [word for word in ("beyond", "nearer") if word in stated]
    return "side of focus assumed" + (f": {side[0]}" if side else "")
