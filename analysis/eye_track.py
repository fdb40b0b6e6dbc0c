"""Depth of a still target over time from one waveband: the effect of 2 Hz microfluctuations in addition to drift."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray
from report import Progress, Shown, alone

from focalgradient.eye import Cones, Eye, Microfluctuations, Motion, Target, track
from focalgradient.plotting import BLUE, GREY, ORANGE, new_figure, style

LOW = 0.1  # D, root mean square, below 0.6 Hz
HIGH = 0.1  # D, root mean square, from 1.0 to 2.3 Hz
TARGETS = (0.5, 1.5)  # D, for an eye focused at 1 D
RATE, FIXATION, NOISE = 8.0, 0.5, 0.2  # estimates per second, s, relative to the mean
KINDS = {
    "steady": ("a steady focus", GREY),
    "drift": ("slow changes alone (below 0.6 Hz)", BLUE),
    "both": ("and those at 1.0-2.3 Hz", ORANGE),
}


def course(kind: str, seed: int) -> Microfluctuations:
    """Return fluctuations of that kind; the slow component has the same power in all kinds."""
    if kind == "steady":
        return Microfluctuations(rms=0.0, seed=seed)
    if kind == "drift":
        return Microfluctuations(rms=LOW, high_share=0.0, seed=seed)
    return Microfluctuations(rms=float(np.hypot(LOW, HIGH)), high_share=HIGH**2 / (LOW**2 + HIGH**2), seed=seed)


def measure(*, seconds: float, seeds: int, progress: Progress | None = None) -> dict[str, Any]:
    """Return error, stated SD and fraction on the correct side over time, for each kind of fluctuation."""
    times = np.arange(0, seconds, 1 / RATE)
    still = Motion(drift=0.0, jumps=0.0, speed=0.0)
    found: dict[str, Any] = {"time_s": times}
    done = 0
    for kind in KINDS:
        error, sd, right = [], [], []
        for seed in range(seeds):
            for vergence in TARGETS:
                random = np.random.default_rng([seed, 42])
                eyes = Eye(0.004, 1.0).through(times, course(kind, seed))
                views = []
                for time, eye in zip(times, eyes, strict=True):
                    texture = 1000 * seed + int(time / FIXATION + 1e-9)
                    views += Target().views(
                        [Cones.of(eye, "L+M")], vergence, noise=NOISE, random=random, texture=texture
                    )
                one = track(views, times, noise=NOISE, fixation=FIXATION, motion=still, wraps=True)
                error.append(one.vergence - vergence)
                sd.append(one.vergence_sd)
                right.append((one.vergence > 1.0) == (vergence > 1.0))
                done += 1
                if progress is not None:
                    progress(done / (len(KINDS) * seeds * len(TARGETS)))
        found[kind] = {
            "rms_error_D": np.sqrt(np.mean(np.square(error), axis=0)),
            "rms_sd_D": np.sqrt(np.mean(np.square(sd), axis=0)),
            "right": np.mean(right, axis=0),
            "within_2_sd": float(np.mean(np.abs(error) < 2 * np.array(sd))),
        }
    return found


def make(*, full: bool = False, progress: Progress | None = None) -> Shown:
    seconds, seeds = (10.0, 16) if full else (4.0, 3)
    measured = measure(seconds=seconds, seeds=seeds, progress=progress)
    times = measured["time_s"]
    half = int(np.searchsorted(times, 0.49))
    early = {kind: float(measured[kind]["rms_error_D"][half - 1]) for kind in KINDS}
    late = {kind: float(measured[kind]["rms_error_D"][-1]) for kind in KINDS}
    return Shown(
        title="What fluctuations at 2 Hz add to drift",
        caption=(
            "A simulated eye, pupil 4 mm, focused at 1 D but for its fluctuations, looks at a still target 0.5 D to "
            "either side, with its L and M cones alone; the depth core compares what falls on the retina within each "
            f"fixation of half a second, and the estimate runs on over {seconds:g} s (`eye.track`, {2 * seeds} series "
            f"a curve, noise of {NOISE:g} of the mean). Slow changes of {LOW:g} D root mean square alone, or with as "
            "much at 1.0 to 2.3 Hz. Dashed: the standard deviation that is stated.",
            f"After half a second the error is {early['drift']:.2f} D by slow changes alone and {early['both']:.2f} D "
            f"with the fast ones; at the end {late['drift']:.3f} and {late['both']:.3f} D. With a steady focus it is "
            f"{early['steady']:.2f} and {late['steady']:.2f} D: the natural spectrum that the scene is "
            "assumed to have gives the size of defocus, and leaves its side open. "
            f"Within two stated standard deviations: {100 * measured['drift']['within_2_sd']:.0f} and "
            f"{100 * measured['both']['within_2_sd']:.0f} % of the estimates.",
        ),
        figure=_draw(times, measured),
        summary={
            "rms_error_after_half_a_second_D": early,
            "rms_error_at_the_end_D": late,
            "right_side_after_half_a_second": {kind: float(measured[kind]["right"][half - 1]) for kind in KINDS},
            "within_2_sd": {kind: measured[kind]["within_2_sd"] for kind in KINDS},
        },
        plotted=measured,
    )


def _draw(times: NDArray[np.float64], measured: dict[str, Any]) -> Figure:
    with style():
        figure = new_figure(180, 72, layout="constrained")
        axes = figure.subplots(1, 2)
        for kind, (words, colour) in KINDS.items():
            one = measured[kind]
            axes[0].plot(times, one["rms_error_D"], color=colour, label=words)
            axes[0].plot(times, one["rms_sd_D"], color=colour, linestyle="--", linewidth=0.8)
            axes[1].plot(times, 100 * one["right"], color=colour)
        axes[0].set(yscale="log", xlabel="time (s)", ylabel="error (D), root mean square")
        drawn = [measured[kind][name] for kind in KINDS for name in ("rms_error_D", "rms_sd_D")]
        axes[0].set_ylim(min(0.01, 0.9 * float(np.min(drawn))), max(4.0, 1.1 * float(np.max(drawn))))
        axes[0].set_yticks([0.01, 0.03, 0.1, 0.3, 1], labels=["0.01", "0.03", "0.1", "0.3", "1"])
        axes[0].minorticks_off()
        axes[0].legend(loc="upper right")
        axes[0].set_title("Error of a running estimate, simulated")
        axes[1].set(xlabel="time (s)", ylabel="estimates on the right side (%)", ylim=(0, 104))
        axes[1].axhline(50, color=GREY, linewidth=0.6, linestyle=(0, (4, 4)))
        axes[1].set_title("Side of focus")
        figure.draw_without_rendering()
    return figure


if __name__ == "__main__":
    alone("eye_track", make)
