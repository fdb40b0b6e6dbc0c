"""Parameter recovery: observers fitted to their own simulated choices, ratings and durations.

Prints true value, estimate and standard error of each parameter, and draws a figure.
"""

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray
from report import Shown, alone

from focalgradient.observers import Answers, Durations, ObserverFit, Ratings, depth_order_observer, fit_observer
from focalgradient.observers.likelihood import Conditions, Values
from focalgradient.plotting import BLUE, GREY, new_figure, style
from focalgradient.progress import Progress

FloatArray = NDArray[np.float64]
PEOPLE, TRIALS = 30, 240
POSITIVE = frozenset({"level", "people", "noise"})
CHOICES = {"disparity": 0.7, "fall": 1.5, "people": 0.4, "near_bias": 0.1, "blur": 0.5}
RATINGS = {"level": 1.2, "blur": 0.25, "people": 0.3, "noise": 0.3}
DURATIONS = {"level": 4.0, "blur": 0.6, "people": 0.5, "noise": 0.8}
TRIAL_S = 12.0


def law(conditions: Conditions, values: Values, own: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the mean log duration, which depends on blur and person, and its standard deviation."""
    mean = np.log(values["level"]) + values["blur"] * conditions["blur"] + values["people"] * own
    return mean, values["noise"] + 0 * mean


def fits(seed: int = 1) -> dict[str, tuple[dict[str, float], ObserverFit]]:
    """Simulate and fit each kind of answer; the search does not start at the true values."""
    rng = np.random.default_rng(seed)
    who = np.repeat(np.arange(PEOPLE), TRIALS)
    own = rng.standard_normal(PEOPLE)[who]
    blur = rng.choice([-0.5, 0.5], len(who))
    sure = {"level": 2.0, "blur": 0.0, "people": 0.5, "noise": 0.5}

    observer = depth_order_observer("blur")
    viewing, relative = rng.choice([0.4, 1.0, 2.0], len(who)), rng.choice([-0.5, -0.2, 0.2, 0.5], len(who))
    shown = {"viewing": viewing, "relative": relative, "rendered_blur": (blur > 0).astype(float)}
    right = rng.random(len(who)) < observer.probability(shown, CHOICES, own)
    choices = fit_observer(Answers(who, shown, right.astype(float)), observer)

    mean, spread = law({"blur": blur}, RATINGS, own)
    rated = Answers(who, {"blur": blur}, mean + spread * rng.standard_normal(len(who)))
    ratings = fit_observer(rated, Ratings(law, sure, POSITIVE))

    mean, spread = law({"blur": blur}, DURATIONS, own)
    lasted = np.exp(mean + spread * rng.standard_normal(len(who)))
    shown = {"blur": blur, "censored": (lasted > TRIAL_S).astype(float)}
    durations = fit_observer(Answers(who, shown, np.minimum(lasted, TRIAL_S)), Durations(law, sure, POSITIVE))
    return {"Choices": (CHOICES, choices), "Ratings": (RATINGS, ratings), "Durations": (DURATIONS, durations)}


def make(*, full: bool = False, progress: Progress | None = None) -> Shown:
    """Fit and draw; `full` has no effect."""
    found = fits()
    rows = [
        (kind, name, value, fit.values[name], fit.standard_errors[name])
        for kind, (true, fit) in found.items()
        for name, value in true.items()
    ]
    away = [abs(estimate - true) / error for _, _, true, estimate, error in rows]
    return Shown(
        title="Observers fitted to simulated answers",
        caption=(
            f"Estimates over true values with 95 % intervals, of {PEOPLE} simulated people with {TRIALS} answers each, "
            "for choices, ratings and durations. People's own effects are integrated out; the search does not start at "
            "the true values.",
        ),
        figure=_draw(found),
        summary={
            "parameters": len(rows),
            "farthest from the true value (standard errors)": max(away),
            "farther than 2 standard errors": sum(one > 2 for one in away),
        },
        plotted={
            "parameter": [f"{kind}: {name}" for kind, name, *_ in rows],
            "true": [row[2] for row in rows],
            "fitted": [row[3] for row in rows],
            "standard error": [row[4] for row in rows],
        },
    )


def _draw(found: dict[str, tuple[dict[str, float], ObserverFit]]) -> Figure:
    with style():
        figure = new_figure(180, 60, layout="constrained")
        for ax, (kind, (true, fit)) in zip(figure.subplots(1, 3), found.items(), strict=True):
            for place, (name, value) in enumerate(true.items()):
                estimate, error = fit.values[name], fit.standard_errors[name]
                ax.errorbar(estimate / value, place, xerr=1.96 * error / value, fmt="o", color=BLUE, markersize=4)
            ax.axvline(1, color=GREY, linewidth=0.6, linestyle=(0, (4, 4)))
            ax.set_yticks(range(len(true)), [name.replace("_", " ") for name in true])
            ax.set(ylim=(len(true) - 0.5, -0.5), xlabel="Fitted over true (95 % interval)")
            ax.set_title(kind, loc="left")
        ax.set_title("simulated people", loc="right", color=GREY)
        figure.draw_without_rendering()
    return figure


if __name__ == "__main__":
    alone("observers_recovery", make)
