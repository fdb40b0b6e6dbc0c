"""Fig. 1: one scene through two apertures, and the position of the image in a curved mirror."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Ellipse, Patch, Polygon, Rectangle
from numpy.typing import NDArray
from report import Progress, Shown, alone

from focalgradient import Lens
from focalgradient.plotting import BLUE, GREY, ORANGE, new_figure, style
from focalgradient.render import Rendered, render_series
from focalgradient.scenes import bottle
from focalgradient.scenes.bottle import BODY_RADIUS

SEED = 2
FOCUS = 1 / (1 - BODY_RADIUS)  # D, the front of the bottle
SMALL, LARGE = (Lens(focal_length=0.05, f_number=number, focus_distance=1 / FOCUS) for number in (22, 4))
FIELD = 0.36  # height of the frame, a tangent
FOCI = np.round(np.arange(0.65, 1.201, 0.05), 2)  # D
WINDOW = (0.112, 0.140)  # tangents below the horizon: the reflection of the checkerboard at the foot of the bottle
HALF_WIDTH = 0.012


def pair(shape: tuple[int, int], samples: int, progress: Progress | None = None) -> list[Rendered]:
    """Render the bottle through the small and the large aperture."""
    report = progress or (lambda share: None)
    return render_series(
        *(bottle(SEED), [SMALL, LARGE], shape, FIELD / shape[0]),
        engine="path",
        samples=samples,
        progress=lambda share, what: report(share),
    )


def sweep(
    foci: NDArray[np.float64], pixel_angle: float, samples: int, progress: Progress | None = None
) -> dict[str, NDArray[np.float64]]:
    """Focus through the reflection in the bottle's body, and measure its sharpness.

    Parameters
    ----------
    foci
        Vergences to focus at, in dioptres.
    pixel_angle
        Angle in radians of one pixel.
    samples
        Number of rays per pixel.
    progress
        Function called with the completed fraction, 0 to 1.

    Returns
    -------
    dict of ndarray
        ``across`` and ``upright``: energy of the differences between neighbours in that direction by focus, without the
        contribution of noise, relative to its maximum. ``traced_across``, ``traced_upright``: vergence of the scene in
        the window from traced rays, in dioptres: median over the window, and 10th and 90th percentiles.
    """
    height, width = 2 * round((WINDOW[1] + 0.004) / pixel_angle), 2 * round((HALF_WIDTH + 0.004) / pixel_angle)
    lenses = [Lens(focal_length=0.05, f_number=4, focus_distance=1 / focus) for focus in foci.tolist()]
    report = progress or (lambda share: None)
    rendered = render_series(
        *(bottle(SEED), lenses, (height, width), pixel_angle),
        engine="path",
        samples=samples,
        progress=lambda share, what: report(share),
    )
    rows = slice(*(height // 2 + round(tangent / pixel_angle) for tangent in WINDOW))
    columns = slice(width // 2 - round(HALF_WIDTH / pixel_angle), width // 2 + round(HALF_WIDTH / pixel_angle))
    energy = np.array(
        [
            # the mean of dA x dB of the halves A and B contains no noise
            [
                np.mean(np.diff(one.view.image[rows, columns], axis=axis) ** 2)
                - np.mean(np.diff(one.residual[rows, columns], axis=axis) ** 2)
                for axis in (1, 0)
            ]
            for one in rendered
            if one.residual is not None
        ]
    )
    vergence = rendered[0].vergence
    assert vergence is not None
    shown = vergence[rows, columns].reshape(-1, 2, 2)
    spread = [np.nanpercentile(shown[:, axis, axis], (50, 10, 90)) for axis in (0, 1)]
    across, upright = (energy / energy.max(axis=0)).T
    return {"across": across, "upright": upright, "traced_across": spread[0], "traced_upright": spread[1]}


def peak(foci: NDArray[np.float64], energy: NDArray[np.float64]) -> float:
    """Return the focus of maximum sharpness, by a parabola through the logarithms of the three largest neighbours."""
    best = int(np.clip(np.argmax(energy), 1, len(foci) - 2))
    a, b, c = np.log(energy[best - 1 : best + 2])
    return float(foci[best] + (foci[1] - foci[0]) * (a - c) / (2 * (a - 2 * b + c)))


def make(*, full: bool = False, progress: Progress | None = None) -> Shown:
    report = progress or (lambda share: None)
    shape, samples = ((720, 520), 256) if full else ((360, 260), 64)
    pictures = pair(shape, samples, lambda share: report(0.5 * share))
    pixel_angle = 4e-4 if full else 6e-4
    sharpness = sweep(FOCI, pixel_angle, samples if full else 32, lambda share: report(0.5 + 0.5 * share))
    across, upright = (peak(FOCI, sharpness[name]) for name in ("across", "upright"))
    return Shown(
        title="Fig. 1: a scene through two apertures",
        caption=(
            "Rendered pictures. Left: the set-up of the paper. A half-silvered mirror gives two cameras the same view, "
            f"one through a small aperture (f/{SMALL.f_number:g}) and one through a large one (f/{LARGE.f_number:g}); "
            f"both are focused on the front of the bottle, at {1 / FOCUS:.3g} m.",
            "In the second picture the wall and most of the plane are blurred, and so are the reflections in the "
            "bottle, though its surface is in focus: the light that they bring has come farther.",
            "Right: where the reflection in the marked patch lies. While the focus moves, differences across are "
            "greatest where rays spread sideways meet, and differences upright where those spread upwards do. The "
            "bottle is a convex mirror across and a flat one upright, so that these are two places, both farther than "
            "its surface. Bands mark where traced rays put them (10th to 90th percentile over the patch). The checks "
            "are not quite upright in the patch, so that either blur shows a little on both curves.",
        ),
        figure=_draw(pictures, sharpness),
        summary={
            "vergence_of_the_surface_dioptres": FOCUS,
            "image_across_traced_dioptres": sharpness["traced_across"][0],
            "image_across_sharpest_dioptres": across,
            "image_upright_traced_dioptres": sharpness["traced_upright"][0],
            "image_upright_sharpest_dioptres": upright,
            "noise_of_the_pictures_percent": [100 * one.noise / float(one.view.image.mean()) for one in pictures],
        },
        plotted={"focus_dioptres": FOCI, **sharpness},
    )


def _draw(pictures: list[Rendered], sharpness: dict[str, NDArray[np.float64]]) -> Figure:
    with style():
        figure = new_figure(180, 68, layout="constrained")
        setup, small, large, focus = figure.subplots(1, 4, width_ratios=(0.95, 0.9, 0.9, 1.35))
        _setup(setup)
        white = float(np.percentile(pictures[0].view.image, 99))
        for ax, one, lens in ((small, pictures[0], SMALL), (large, pictures[1], LARGE)):
            assert one.colour is not None
            ax.imshow(np.clip(one.colour / white, 0, 1) ** (1 / 2.2), interpolation="none")
            ax.set_title(f"(b) f/{lens.f_number:g}, rendered" if one is pictures[0] else f"(c) f/{lens.f_number:g}")
            ax.set_anchor("N")
            ax.set_axis_off()
        height, width = pictures[0].view.shape
        scale = height / FIELD
        corner = ((width - 1) / 2 - HALF_WIDTH * scale, (height - 1) / 2 + WINDOW[0] * scale)
        for ax in (small, large):
            size = (2 * HALF_WIDTH * scale, (WINDOW[1] - WINDOW[0]) * scale)
            ax.add_patch(Rectangle(corner, *size, fill=False, edgecolor=ORANGE, linewidth=0.9))
        for name, colour, marker in (("across", BLUE, "o"), ("upright", ORANGE, "s")):
            middle, low, high = sharpness[f"traced_{name}"]
            focus.axvspan(low, high, 0, 0.74, color=colour, alpha=0.22, linewidth=0)
            focus.axvline(middle, 0, 0.74, color=colour, linewidth=0.7, linestyle=(0, (4, 3)))
            focus.plot(FOCI, sharpness[name], color=colour, marker=marker, markersize=3, linewidth=1, label=name)
        focus.axvline(FOCUS, 0, 0.74, color=GREY, linewidth=0.8)
        focus.text(FOCUS + 0.012, 1.0, "surface", color=GREY, va="center", ha="left")
        focus.set(xlabel="focus (D)", ylabel="differences (share of the largest)", ylim=(0, 1.42))
        focus.set(xlim=(0.62, 1.23), xticks=(0.7, 0.8, 0.9, 1.0, 1.1, 1.2), yticks=(0, 0.2, 0.4, 0.6, 0.8, 1))
        focus.set_title("(d) Sharpness of the reflection")
        traced = [
            Patch(facecolor=GREY, alpha=0.3, label="traced rays, 10–90 %"),
            Line2D([], [], color=GREY, linewidth=0.7, linestyle=(0, (4, 3)), label="their median"),
        ]
        handles = [*focus.get_legend_handles_labels()[0], *traced]
        focus.legend(handles=handles, loc="upper left", ncols=2, columnspacing=1.0, handlelength=1.6, fontsize=7)
        figure.draw_without_rendering()
    return figure


def _setup(ax: Axes) -> None:
    """Draw two cameras that share a view: light from below, a half-silvered mirror, a small and a large aperture."""
    ax.set(xlim=(-1.2, 2.0), ylim=(-2.3, 2.2), aspect="equal", anchor="N")
    ax.set_axis_off()
    ax.set_title("(a) The set-up")
    for x in (-0.22, 0.22):
        ax.plot([x * 0.2, x], [-1.7, 0.0 + x], color=GREY, linewidth=0.7)
        ax.plot([x, x * 0.9], [x, 1.35], color=GREY, linewidth=0.7)
        ax.plot([x, 1.2], [x, x * 0.9], color=GREY, linewidth=0.7)
    ax.plot([-0.5, 0.5], [-0.5, 0.5], color=BLUE, linewidth=1.6)
    ax.text(-0.55, -0.42, "half-\nsilvered\nmirror", ha="right", va="center", color=BLUE, fontsize="small")
    for at, up, gap in (((0.0, 1.15), False, 0.07), ((1.05, 0.0), True, 0.32)):
        for side in (-1, 1):
            ends = np.array([gap, 0.5]) * side
            ax.plot(*((at[0] + 0 * ends, at[1] + ends) if up else (at[0] + ends, at[1] + 0 * ends)), "k", linewidth=2)
    ax.add_patch(Ellipse((0, 1.35), 0.8, 0.16, facecolor="none", edgecolor="black", linewidth=0.8))
    ax.add_patch(Ellipse((1.25, 0), 0.16, 0.8, facecolor="none", edgecolor="black", linewidth=0.8))
    ax.add_patch(Rectangle((-0.45, 1.45), 0.9, 0.6, facecolor="#eeeeee", edgecolor="black", linewidth=0.8))
    ax.add_patch(Rectangle((1.35, -0.45), 0.6, 0.9, facecolor="#eeeeee", edgecolor="black", linewidth=0.8))
    ax.text(0.58, 1.15, f"f/{SMALL.f_number:g}", va="center", fontsize="small")
    ax.text(1.05, 0.6, f"f/{LARGE.f_number:g}", ha="center", va="bottom", fontsize="small")
    half = np.array([(0.06, -1.5), (0.06, -1.72), (0.17, -1.85), (0.17, -2.25)])
    outline = np.concatenate([half, half[::-1] * (-1, 1)])
    ax.add_patch(Polygon(outline, facecolor="#c8d4dc", edgecolor="black", linewidth=0.8))


if __name__ == "__main__":
    alone("fig1", make)
