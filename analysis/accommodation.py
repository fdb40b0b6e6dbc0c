"""Closed-loop accommodation: steps and sinusoids followed by a simulated eye with its own depth estimate."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from report import Progress, Shown, alone

from focalgradient.eye import Accommodation, Course, accommodate
from focalgradient.plotting import BLUE, GREY, ORANGE, new_figure, style

HERTZ = (0.2, 0.5)
AMPLITUDE, MEAN = 0.5, 2.0  # D, of the sinusoids
STEP = (1.0, 3.0)  # D, at 1 s
SECONDS = {"step": 5.0, 0.2: 10.0, 0.5: 6.0}


def measure(*, seed: int = 0, progress: Progress | None = None) -> dict[Any, Course]:
    """Simulate the time courses for a step and for a sinusoid of each frequency, without fluctuations of focus."""
    eye = Accommodation(fluctuation=None)
    found: dict[Any, Course] = {}
    jobs: dict[Any, Callable[[float], float]] = {"step": lambda t: STEP[int(t >= 1.0)]} | {
        f: lambda t, hertz=f: MEAN + AMPLITUDE * math.sin(2 * math.pi * hertz * t) for f in HERTZ
    }
    for done, (name, target) in enumerate(jobs.items()):
        found[name] = accommodate(target, SECONDS[name], eye, seed=seed)
        if progress is not None:
            progress((done + 1) / len(jobs))
    return found


def make(*, full: bool = False, progress: Progress | None = None) -> Shown:
    courses = measure(progress=progress)
    plant = Accommodation().plant
    responses = {f: courses[f].response(f, skip=1.0) for f in HERTZ}
    ideal = {f: complex(plant.sine_response(f)) for f in HERTZ}
    error = courses["step"].estimate - courses["step"].target
    lag = STEP[1] - plant.steady(STEP[1])
    in_words = ", and ".join(
        f"at {f:g} Hz with a gain of {abs(responses[f]):.2f}, {math.degrees(np.angle(responses[f])):.0f} degrees "
        f"(lens and controller alone {abs(ideal[f]):.2f} and {math.degrees(np.angle(ideal[f])):.0f})"
        for f in HERTZ
    )
    return Shown(
        title="A simulated eye that focuses by its own estimate of depth",
        caption=(
            "A textured target jumps, or moves to and fro. At each tenth of a second it falls on a patch of retina "
            "through the eye's optics, pupil 4 mm; the depth core estimates its vergence from what the L and M and the "
            "S cones catch within a fixation; and this estimate drives the lens, 0.3 s later, through a leaky "
            "integrator (`eye.accommodate`). Focus has no fluctuations here.",
            f"After the step the eye lags by {courses['step'].lag(1.0):.2f} D at {STEP[1]:g} D; with a perfect "
            f"estimate it would by {lag:.2f} D. The estimate errs by {np.sqrt(np.mean(error**2)):.3f} D, root mean "
            f"square. It follows sines {in_words}: once it has learnt how they move, the controller is ahead of its "
            "estimates (`eye.Predictor`).",
            "Dashed: what lens and controller would do if the demand were known, and not predicted.",
        ),
        figure=_draw(courses),
        summary={
            "lag_after_a_step_to_3_D": courses["step"].lag(1.0),
            "gain": {f"{f:g} Hz": abs(responses[f]) for f in HERTZ},
            "phase_deg": {f"{f:g} Hz": math.degrees(np.angle(responses[f])) for f in HERTZ},
            "gain_of_plant": {f"{f:g} Hz": abs(ideal[f]) for f in HERTZ},
            "phase_of_plant_deg": {f"{f:g} Hz": math.degrees(np.angle(ideal[f])) for f in HERTZ},
            "estimate_rms_error_D": float(np.sqrt(np.mean(error**2))),
        },
        plotted={
            str(name): {"time_s": c.times, "target_D": c.target, "accommodation_D": c.accommodation}
            for name, c in courses.items()
        },
    )


def _draw(courses: dict[Any, Course]) -> Figure:
    plant = Accommodation().plant
    with style():
        figure = new_figure(180, 66, layout="constrained")
        axes = figure.subplots(1, 3, sharey=True)
        titles = {"step": "Step from 1 to 3 D", 0.2: "Sine at 0.2 Hz", 0.5: "Sine at 0.5 Hz"}
        for ax, (name, course) in zip(axes, courses.items(), strict=True):
            held = "steps-post" if name == "step" else "default"
            ax.plot(course.times, course.target, color=GREY, linewidth=1, label="target", drawstyle=held)
            ax.plot(course.times, course.estimate, color=BLUE, linewidth=0.8, label="estimate")
            ax.plot(course.times, course.accommodation, color=ORANGE, label="accommodation")
            if name == "step":
                ideal = plant.step_response(course.times - 1.0, *STEP)
            else:
                wave = complex(plant.sine_response(name)) * AMPLITUDE
                ideal = plant.steady(MEAN) + (wave * np.exp(2j * np.pi * name * course.times)).imag
            ax.plot(course.times, ideal, color="black", linewidth=0.8, linestyle="--", label="demand known")
            ax.set(xlabel="time (s)", xlim=(0, float(course.times[-1])))
            ax.set_title(titles[name])
        axes[0].set_ylabel("vergence (D), simulated eye")
        axes[0].legend(loc="lower right")
        figure.draw_without_rendering()
    return figure


if __name__ == "__main__":
    alone("accommodation", make)
