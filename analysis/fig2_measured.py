"""Fig. 2, measured: depth recovered from rendered views of textured walls at many distances."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from fig2 import focal_gradient_error, stereo_error
from matplotlib.figure import Figure
from numpy.typing import NDArray
from report import Progress, Shown, alone

from focalgradient import DepthMap, FocalGradientWarning, Lens, recover_depth
from focalgradient.plotting import BLUE, GREY, ORANGE, new_figure, style
from focalgradient.render import cast, noisy
from focalgradient.scenes import plane

FOCUS = 2.0  # m, as in the paper's figure
SHARP, BLURRED = (Lens(focal_length=0.025, f_number=number, focus_distance=FOCUS) for number in (11, 4))
PIXEL = 8e-6 / SHARP.sensor_distance  # rad
NOISE = 0.01  # relative to the mean radiance
CLEAR = 1.5  # blur radius in pixels above which blur exceeds that of the pixel
DISTANCES = (1.0, 1.1, 1.2, 1.4, 1.6, 1.8, 1.9, 2.12, 2.25, 2.5, 3.0, 3.5, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0, 10.0)


def measure(
    distances: Sequence[float],
    *,
    blur: bool = True,
    shape: tuple[int, int] = (240, 240),
    samples: int = 64,
    seed: int = 1,
    progress: Progress | None = None,
) -> dict[str, NDArray[np.float64]]:
    """Render walls at `distances` (m) through two apertures, recover their depth, and score it.

    Parameters
    ----------
    distances
        Distances of the walls, in metres.
    blur
        False to render both views through the small aperture although the optics are those of two: the recovered depth
        is then independent of blur.
    shape, samples, seed
        Settings of the rendering; each wall has its own texture and noise.
    progress
        Function called with the completed fraction, 0 to 1.

    Returns
    -------
    dict of ndarray
        Values by distance, over valid pixels: ``rms_m``, RMS error of distance; ``relative_error``, the same for the
        size of the blur, which is proportional to |V - V_focus|; ``bias``, its mean; ``predicted_m``, the value of
        `rms_m` expected from `vergence_sd`; ``coverage``, fraction within 2 `vergence_sd`. NaN without valid pixels.
        ``valid``: fraction of valid pixels. ``warned``: 1 if `recover_depth` warned that the views do not fit the
        optics.
    """
    rows = []
    for index, distance in enumerate(distances):
        scene = plane(distance, seed=seed + index)
        sharp = cast(scene, SHARP, shape, PIXEL, samples=samples, seed=seed).view
        blurred = cast(scene, BLURRED, shape, PIXEL, samples=samples, seed=seed).view if blur else sharp
        noise = NOISE * float(sharp.image.mean())
        first, second = noisy(sharp, noise, 2 * (seed + index)), noisy(blurred, noise, 2 * (seed + index) + 1)
        # two apertures do not determine the side of focus, which a user knows from the set-up
        near, far = (FOCUS, None) if distance > FOCUS else (None, FOCUS)
        with warnings.catch_warnings(record=True) as given:  # expected if `blur` is False: the stated optics are wrong
            warnings.simplefilter("always", FocalGradientWarning)
            depth = recover_depth([first, replace(second, optics=BLURRED)], near=near, far=far)
        rows.append(_score(depth, distance) | {"warned": float(bool(given))})
        if progress is not None:
            progress((index + 1) / len(distances))
    return {name: np.array([row[name] for row in rows]) for name in rows[0]}


def _score(depth: DepthMap, distance: float) -> dict[str, float]:
    valid = depth.valid
    if not valid.any():
        return dict.fromkeys(("rms_m", "relative_error", "bias", "predicted_m", "coverage"), np.nan) | {"valid": 0.0}
    error = depth.vergence[valid].astype(float) - 1 / distance
    defocus = abs(1 / FOCUS - 1 / distance)
    sd = depth.vergence_sd[valid]
    return {
        "rms_m": float(np.sqrt(np.mean((depth.distance[valid] - distance) ** 2))),
        "relative_error": float(np.sqrt(np.mean(error**2))) / defocus,
        "bias": float(error.mean()) * np.sign(1 / distance - 1 / FOCUS) / defocus,
        "predicted_m": float(np.sqrt(np.mean(sd**2))) * distance**2,
        "coverage": float(np.mean(np.abs(error) <= 2 * sd)),
        "valid": float(valid.mean()),
    }


def make(*, full: bool = False, progress: Progress | None = None) -> Shown:
    report = progress or (lambda share: None)
    distances = np.array(DISTANCES)
    shape, samples = ((480, 480), 256) if full else ((240, 240), 64)
    on = measure(DISTANCES, shape=shape, samples=samples, progress=lambda share: report(0.65 * share))
    off = measure(
        DISTANCES, blur=False, shape=shape, samples=samples, progress=lambda share: report(0.65 + 0.35 * share)
    )
    radius = BLURRED.blur_radius(distances) / PIXEL
    clear = radius >= CLEAR
    relative = float(np.sqrt(np.mean(on["relative_error"][clear] ** 2)))
    ratio = on["rms_m"] / focal_gradient_error(distances, relative)
    return Shown(
        title="Fig. 2 measured: error of distance on rendered views",
        caption=(
            f"Textured walls at {len(distances)} distances, ray cast through f/{SHARP.f_number:g} and "
            f"f/{BLURRED.f_number:g} with focus at {FOCUS:g} m and {100 * NOISE:g} % noise; depth recovered from the "
            "two views, given only which side of focus the wall is on. Each point is the root mean square error over "
            "the valid pixels of one wall.",
            f"Left: the errors follow the paper’s curve, drawn here for the one relative error of blur measured, "
            f"e = {100 * relative:.2g} %, instead of the 2 % taken for a person. Dashes: what the depth map itself "
            "states by its vergence_sd, which is computed without the truth.",
            f"Right: the same errors as a share of the blur. One e serves all distances where the blur disc has a "
            f"radius of at least {CLEAR:g} pixels; near focus blur is smaller than a pixel and its relative error "
            "rises, so that the error of distance does not fall to the curve’s zero.",
            "Crosses: both views rendered through the small aperture, and the depth core given the optics of two. "
            "The curve disappears: it comes from the blur. "
            f"The depth core warned that the views do not fit the optics at {off['warned'].sum():.0f} of these walls, "
            f"and at {on['warned'].sum():.0f} with the true optics.",
        ),
        figure=_draw(distances, on, off, clear, relative),
        summary={
            "relative_error_of_blur_e_percent": 100 * relative,
            "bias_of_blur_median_over_walls_percent": 100 * float(np.median(on["bias"][clear])),
            "measured_error_over_curve_least_and_largest": [float(ratio[clear].min()), float(ratio[clear].max())],
            "measured_error_over_stated_median": float(np.median(on["rms_m"] / on["predicted_m"])),
            "within_2_vergence_sd_mean_over_walls_percent": 100 * float(on["coverage"].mean()),
            "error_close_to_focus_at_1.9_m_m": float(on["rms_m"][DISTANCES.index(1.9)]),
            "error_at_10_m_m": float(on["rms_m"][-1]),
            "valid_pixels_mean_over_walls_percent": 100 * float(on["valid"].mean()),
            "without_blur_relative_error_median_percent": 100 * float(np.nanmedian(off["relative_error"])),
            "without_blur_error_at_10_m_m": float(off["rms_m"][-1]),
            "walls_warned_of": int(on["warned"].sum()),
            "without_blur_walls_warned_of": int(off["warned"].sum()),
        },
        plotted={"distance_m": distances, "blur_radius_px": radius, "blur": on, "no_blur": off},
    )


def _draw(
    distances: NDArray[np.float64],
    on: dict[str, NDArray[np.float64]],
    off: dict[str, NDArray[np.float64]],
    clear: NDArray[np.bool_],
    relative: float,
) -> Figure:
    fine = np.linspace(0.5, 10.2, 389)
    with style():
        figure = new_figure(180, 84, layout="constrained")
        left, right = figure.subplots(1, 2)
        percent = f"{100 * relative:.2g} %"
        left.plot(fine, stereo_error(fine), color="#bdbdbd", linewidth=1, label="stereopsis, 1 mm at 1 m")
        curve = focal_gradient_error(fine, relative)
        left.plot(fine, curve, color=BLUE, label=rf"$e\,D\,|D/u_0-1|$, $e$ = {percent}")
        left.plot(distances, on["predicted_m"], "_", color="black", markersize=9, label="stated by vergence_sd")
        left.plot(distances, on["rms_m"], "o", color=BLUE, markersize=4, label="measured")
        left.set(ylim=(0, 1.25 * max(on["rms_m"].max(), curve[-1])), ylabel="error of distance (m), root mean square")
        left.set_title("Recovered distance, focus at 2 m")
        left.legend(loc="upper left")

        right.axhline(100 * relative, color=BLUE)
        right.plot(distances[clear], 100 * on["relative_error"][clear], "o", color=BLUE, markersize=4)
        right.plot(
            distances[~clear], 100 * on["relative_error"][~clear], "o", color=BLUE, markersize=4, fillstyle="none"
        )
        right.plot(distances, 100 * off["relative_error"], "x", color=ORANGE, markersize=4.5)
        right.set(yscale="log", ylim=(0.3, 300), ylabel="error of the size of blur (%)")
        right.axvline(FOCUS, color=GREY, linewidth=0.6, linestyle=(0, (4, 4)), zorder=0)
        right.set_yticks([1, 10, 100], labels=["1", "10", "100"])
        right.set_title("The same, as a share of the blur")
        right.text(10.2, 130, "both views through the same aperture", color=ORANGE, ha="right", va="bottom")
        right.text(2.6, 6.0, f"blur below {CLEAR:g} pixels", color=BLUE)
        right.text(10.2, 120 * relative, f"$e$ = {percent}", color=BLUE, ha="right", va="bottom")
        for ax in (left, right):
            ax.set(xlim=(0, 10.3), xticks=range(0, 11, 2), xlabel="distance $D$ (m)")
        figure.draw_without_rendering()
    return figure


if __name__ == "__main__":
    alone("fig2_measured", make)
