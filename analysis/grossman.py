"""Distance of edges from one photograph, compared with the accuracy reported by Grossman in 1985."""

from __future__ import annotations

import warnings
from collections.abc import Sequence

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray
from report import Progress, Shown, alone

from focalgradient import FocalGradientWarning, Lens, View, recover_depth
from focalgradient.plotting import BLUE, GREY, ORANGE, new_figure, style
from focalgradient.render import cast, noisy
from focalgradient.scenes import Plane, Scene, Texture

LENS = Lens(focal_length=0.050, f_number=8, focus_distance=0.75)
"""Standard lens of a 35 mm camera (our choice, as the paper does not state Grossman's settings)."""

PITCH = 12e-6  # m
SHAPE = (160, 160)
NOISE = 0.005  # white is 1
DISTANCES = (0.85, 1.0, 1.25, 1.5, 1.75, 2.0, 2.5, 3.0)  # m, of the card, all beyond focus
GROSSMAN = 0.0125  # m: "an accuracy ± 1.25 centimeters" (section IV)
CARD = 0.55  # side of the card relative to the frame


def photograph(distance: float, seed: int) -> View:
    """Render a dark card on a white sheet at `distance` (m) by ray casting, with noise, in 8 bits."""
    pixel = PITCH / LENS.sensor_distance
    side = CARD * SHAPE[1] * pixel * distance
    # the card lies slightly before the sheet, parallel to it: only its four edges are measured
    card = Plane((0.0, 0.0, distance * (1 - 1e-5)), (0, 0, -1), Texture(mean=0.1, contrast=0.0), size=(side, side))
    sheet = Plane((0.0, 0.0, distance), (0.0, 0.0, -1.0), Texture(mean=0.8, contrast=0.0))
    view = noisy(cast(Scene((sheet, card)), LENS, SHAPE, pixel, samples=64, seed=seed).view, NOISE, seed)
    return View((np.rint(255 * np.clip(view.image, 0, 1)) / 255).astype(np.float32), LENS, pixel)


def measure(
    distances: Sequence[float], *, seeds: int = 3, progress: Progress | None = None
) -> dict[str, NDArray[np.float64]]:
    """Estimate distances of the cards' edges, each from one photograph.

    Returns
    -------
    dict of ndarray
        Distances x seeds: ``estimate_m``, median over the valid pixels; distances: ``points_rms_m``, RMS error of
        single pixels. NaN without valid pixels.
    """
    estimate, rms = np.full((len(distances), seeds), np.nan), np.full(len(distances), np.nan)
    for row, distance in enumerate(distances):
        errors = []
        for seed in range(seeds):
            with warnings.catch_warnings():
                warnings.simplefilter("ignore", FocalGradientWarning)  # warning of no valid pixel, which is drawn
                depth = recover_depth([photograph(distance, seed)], method="edges", near=LENS.focus_distance)
            found = depth.distance[depth.valid]
            if found.size:
                estimate[row, seed] = np.median(found)
                errors.append(found - distance)
            if progress is not None:
                progress((row * seeds + seed + 1) / (len(distances) * seeds))
        if errors:
            rms[row] = np.sqrt(np.mean(np.concatenate(errors) ** 2))
    return {"estimate_m": estimate, "points_rms_m": rms}


def reach(distances: Sequence[float], errors: NDArray[np.float64], bound: float = GROSSMAN) -> float:
    """Return the largest of `distances` up to which all errors are within `bound`; NaN if there is none."""
    within = np.cumprod(errors <= bound).astype(bool)
    return float(np.asarray(distances)[within].max()) if within.any() else float("nan")


def make(*, full: bool = False, progress: Progress | None = None) -> Shown:
    found = measure(DISTANCES, seeds=10 if full else 3, progress=progress)
    error = np.abs(found["estimate_m"] - np.array(DISTANCES)[:, None]).max(axis=1)
    cards, points = reach(DISTANCES, error), reach(DISTANCES, found["points_rms_m"])
    return Shown(
        title="Distance of edges from one photograph, in centimetres",
        caption=(
            f"A dark card on a white sheet at {len(DISTANCES)} distances, ray cast through a lens of "
            f"{1e3 * LENS.focal_length:g} mm at f/{LENS.f_number:g} focused at {LENS.focus_distance:g} m, pixels of "
            f"{1e6 * PITCH:g} µm, {100 * NOISE:g} % noise, 8 bits. Depth from one photograph each, by the blur of the "
            "card’s edges; the computer is given only that all lies beyond the focus.",
            "Filled: the largest error of a card’s distance (median along its edges) over the photographs. Open: root "
            "mean square error of single points of the edge. Dashed: the ± 1.25 cm that Grossman reported in 1985 "
            "with a simple version of this technique and a standard lens. The paper gives neither his lens nor his "
            "distances, so this does not repeat his measurement.",
        ),
        figure=_draw(error, found["points_rms_m"]),
        summary={
            "card_within_1.25_cm_up_to_m": cards,
            "single_points_within_1.25_cm_up_to_m": points,
            "largest_error_of_a_card_at_1_m_cm": 100 * float(error[DISTANCES.index(1.0)]),
            "largest_error_of_a_card_at_2_m_cm": 100 * float(error[DISTANCES.index(2.0)]),
            "largest_error_of_a_card_at_3_m_cm": 100 * float(error[DISTANCES.index(3.0)]),
        },
        plotted={"distance_m": DISTANCES, "largest_error_of_a_card_m": error, **found},
    )


def _draw(cards: NDArray[np.float64], points: NDArray[np.float64]) -> Figure:
    with style():
        figure = new_figure(120, 76, layout="constrained")
        ax = figure.add_subplot()
        ax.axhline(100 * GROSSMAN, color=GREY, linewidth=0.8, linestyle=(0, (4, 4)))
        ax.text(DISTANCES[0], 100 * GROSSMAN * 1.08, "Grossman 1985: 1.25 cm", color=GREY, va="bottom")
        ax.plot(DISTANCES, 100 * cards, "o-", color=BLUE, markersize=4, label="a card, largest error")
        ax.plot(
            *(DISTANCES, 100 * points, "s-"),
            color=ORANGE,
            fillstyle="none",
            markersize=4,
            linewidth=1,
            label="single points, r.m.s. error",
        )
        ax.set(xlabel="distance (m)", ylabel="error of distance (cm)", yscale="log")
        ax.yaxis.set_major_formatter(lambda value, _: f"{value:g}")
        ax.set_title("One photograph, by edges (simulated views)")
        ax.legend(loc="lower right")
        figure.draw_without_rendering()
    return figure


if __name__ == "__main__":
    alone("grossman", make)
