"""Estimates of the vergence of a moving target from two wavebands, from several moments, and from both.

    python benchmarks/moving_targets.py --seeds 8

Each row summarises simulated courses of `eye.accommodate`, in which an eye focuses on the target by its own estimate:
root mean square error of the estimate (D), fraction of time within two stated SDs, mean stated SD (D), and gain and
phase of accommodation for sinusoidal targets. Both cues together should never be worse than either, with 92 to 97 %
within two SDs. Prediction of sines needs longer courses, and their phase needs fluctuations of accommodation to cancel:

    python benchmarks/moving_targets.py --targets "sine 0.2 Hz" --cues both --seconds 35 --skip 15 --mirrored
"""

from __future__ import annotations

import argparse
import math
from collections.abc import Callable
from dataclasses import replace
from typing import get_args

import numpy as np

from focalgradient.eye import Accommodation, Course, accommodate, target_course
from focalgradient.eye.accommodation import Cue

SECONDS, SKIPPED = 8.0, 2.0
"""Default duration of a course, and time at its start that gain and phase leave out, in seconds."""

MEAN = 2.0
"""Mean vergence of the sines in dioptres."""

HERTZ = {"sine 0.2 Hz": 0.2, "sine 0.5 Hz": 0.5, "sine 1 Hz": 1.0}
TARGETS = {
    "still": lambda t: 2.5,
    "sine 0.2 Hz": lambda t: 2 + 0.5 * math.sin(0.4 * math.pi * t),
    "sine 0.5 Hz": lambda t: 2 + 0.5 * math.sin(math.pi * t),
    "sine 1 Hz": lambda t: 2 + 0.25 * math.sin(2 * math.pi * t),
    "step": lambda t: 3.0 if t >= SECONDS / 2 else 1.5,
    "ramp": lambda t: 1.0 + 0.25 * t,
}
NAMES = [*TARGETS, "random walk"]
WALK = 0.4
"""Root-mean-square displacement of the random walk in one second, in dioptres."""


def target(name: str, seed: int) -> Callable[[float], float]:
    """Return the target's vergence (D) as a function of time (s); random walks depend on the seed, within .5 to 4 D."""
    if name in TARGETS:
        return TARGETS[name]
    times = np.arange(0.0, SECONDS + 0.1, 0.1)
    steps = WALK * math.sqrt(0.1) * np.random.default_rng([seed, 77]).standard_normal(times.size)
    walked = 1.5 + np.cumsum(steps)
    return target_course(times, 0.5 + 3.5 - np.abs(np.mod(walked, 7.0) - 3.5))


def mirrored_half(course: Course, eye: Accommodation, name: str, seconds: float, seed: int) -> Course:
    """Return half the difference of a course and that of the target mirrored about `MEAN`: fluctuations cancel."""
    back = accommodate(lambda t: 2 * MEAN - target(name, seed)(t), seconds, eye, seed=seed)
    return replace(
        course, target=(course.target - back.target) / 2, accommodation=(course.accommodation - back.accommodation) / 2
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, default=8, help="courses a row")
    parser.add_argument("--first", type=int, default=100, help="first seed")
    parser.add_argument("--targets", nargs="+", choices=NAMES, default=NAMES)
    parser.add_argument("--cues", nargs="+", choices=get_args(Cue), default=get_args(Cue))
    parser.add_argument("--seconds", type=float, default=SECONDS, help="duration of a course")
    parser.add_argument("--skip", type=float, default=SKIPPED, help="seconds that gain and phase leave out")
    parser.add_argument("--mirrored", action="store_true", help="gain and phase of pairs with the mirrored sine")
    options = parser.parse_args()
    print("target        cue      rms error  within 2 sd  stated sd  gain  phase")
    for name in options.targets:
        for cue in options.cues:
            errors, stated, response = [], [], []
            for seed in range(options.first, options.first + options.seeds):
                eye = Accommodation(cue=cue)
                course = accommodate(target(name, seed), options.seconds, eye, seed=seed)
                errors.append(course.estimate - course.target)
                stated.append(course.estimate_sd)
                if name in HERTZ:
                    if options.mirrored:
                        course = mirrored_half(course, eye, name, options.seconds, seed)
                    response.append(course.response(HERTZ[name], skip=options.skip))
            error, sd = np.array(errors), np.array(stated)
            row = f"{name:13} {cue:8} {np.sqrt(np.mean(error**2)):9.3f}  {np.mean(np.abs(error) < 2 * sd):11.3f}"
            row += f"  {sd.mean():9.3f}"
            if response:
                mean = complex(np.mean(response))
                row += f"  {abs(mean):4.2f}  {math.degrees(np.angle(mean)):5.0f}"
            print(row, flush=True)


if __name__ == "__main__":
    main()
