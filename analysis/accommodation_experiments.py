"""Replication of published accommodation experiments with an eye that focuses by its own depth estimate."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import get_args

import numpy as np
from matplotlib.figure import Figure
from report import Progress, Shown, alone

from focalgradient.eye import Accommodation, Oscillation, Stimulus, Target, accommodate, target_course
from focalgradient.eye.accommodation import Cue
from focalgradient.parallel import cores, in_order, processes
from focalgradient.plotting import GREY, ORANGE, new_figure, style
from focalgradient.published.following import LIGHTS, follow

CUES: tuple[Cue, ...] = get_args(Cue)
COLUMNS = {"both": "both", "bands": "bands alone", "moments": "moments alone"}
FLICKER = (Oscillation(0.5, 0.5), Oscillation(0.25, 2.0))  # D and Hz, Metlapally et al.
CONTRAST = (Oscillation(0.15 / 0.7, 0.5), Oscillation(0.15 / 0.7, 2.0, math.pi))  # fractions of a mean of 0.7
PHASES = (0.0, 2.4, 4.8, 1.2, 3.6, 6.0, 0.6, 3.0)  # phase of the flicker in each trial, rad

Made = dict[str, dict[str, float]]
Job = tuple[Cue, int]


@dataclass(frozen=True)
class Row:
    """Prediction: published result, corresponding quantity of the model, and criterion of agreement."""

    experiment: str
    published: str
    kind: str
    conditions: tuple[str, ...]
    agrees: Callable[[dict[str, float]], bool]


ROWS = (
    Row(
        "light of 590 nm alone; gain at 0.2 Hz",
        "falls (Kruger et al. 1993)",
        "gain",
        ("monochromatic", "white"),
        lambda m: m["monochromatic"] < 0.85 * m["white"],
    ),
    Row(
        "chromatic aberration neutralised; gain",
        "falls (Kruger et al. 1993)",
        "gain",
        ("neutralised", "white"),
        lambda m: m["neutralised"] < 0.85 * m["white"],
    ),
    Row(
        "chromatic aberration reversed; gain",
        "severely disrupted (Kruger et al. 1993)",
        "gain",
        ("reversed", "white"),
        lambda m: m["reversed"] < 0.5 * m["white"],
    ),
    Row(
        "the same; mean focus, of a target at 2 D on average (D)",
        "severely disrupted (Kruger et al. 1993)",
        "focus",
        ("reversed", "white"),
        lambda m: abs(m["reversed"] - 2) > 0.5 > abs(m["white"] - 2),
    ),
    Row(
        "the same; error of focus, root mean square (D)",
        "severely disrupted (Kruger et al. 1993)",
        "error",
        ("reversed", "white"),
        lambda m: m["reversed"] > 3 * m["white"],
    ),
    Row(
        "light of 590 nm alone; phase at 0.2 Hz (degrees)",
        "lags more (Kruger et al. 1993)",
        "phase",
        ("monochromatic", "white"),
        lambda m: m["monochromatic"] < m["white"] - 5,
    ),
    Row(
        "neutralised against monochromatic; gain",
        "alike (Aggarwala et al. 1995)",
        "gain",
        ("neutralised", "monochromatic"),
        lambda m: abs(m["neutralised"] - m["monochromatic"]) < 0.15,
    ),
    Row(
        "small pupils; slope of the response",
        "falls below 3 mm (Ward & Charman 1985)",
        "pupil",
        ("0.5 mm", "1 mm", "3 mm"),
        lambda m: m["0.5 mm"] < m["1 mm"] < 0.95 * m["3 mm"],
    ),
    Row(
        "target without detail above 1 c/deg; share of a step",
        "no response (Vision Res. 164, 62, 2019)",
        "low-pass",
        ("1 c/deg", "sharp"),
        lambda m: m["1 c/deg"] < 0.3 * m["sharp"],
    ),
    Row(
        "target without detail above 5.6 c/deg; share of a step",
        "response (Vision Res. 164, 62, 2019)",
        "low-pass",
        ("5.6 c/deg", "sharp"),
        lambda m: m["5.6 c/deg"] > 0.3 * m["sharp"],
    ),
    Row(
        "empty field; focus after 15 s (D)",
        "about 1.5 D (Leibowitz & Owens 1978)",
        "empty",
        ("from 0.5 D", "from 4 D"),
        lambda m: all(0.75 < value < 2.25 for value in m.values()),
    ),
    Row(
        "focus flickers at 0.5 and 2 Hz; right direction",
        "impaired (Metlapally et al.)",
        "flicker",
        ("focus", "none"),
        lambda m: m["focus"] < m["none"] - 0.1,
    ),
    Row(
        "contrast flickers at 0.5 and 2 Hz; right direction",
        "not impaired (Metlapally et al.)",
        "flicker",
        ("contrast", "none"),
        lambda m: m["contrast"] >= m["none"] - 0.1 and m["none"] > 0.6,
    ),
    Row(
        "rendered blur, alike in all colours; share of a step",
        "no response (Cholewiak et al. 2018)",
        "rendered",
        ("defocus", "real"),
        lambda m: m["defocus"] < 0.25 * m["real"],
    ),
    Row(
        "rendered blur with chromatic aberration; share of a step",
        "response (Cholewiak et al. 2018)",
        "rendered",
        ("chromatic", "real"),
        lambda m: m["chromatic"] > 0.5 * m["real"],
    ),
)


SINE = ("gain", "phase", "focus", "error")
"""Measures of sinusoidal tracking: gain, phase (degrees), mean focus and root-mean-square error (D)."""


def following(eye: Accommodation, stimulus: Stimulus, seconds: float, seed: int) -> tuple[float, ...]:
    """Measure the tracking of the target of Kruger et al. (1993): see `SINE`."""
    found = follow(eye, stimulus, seconds, seed)
    return abs(found.response), math.degrees(np.angle(found.response)), found.focus, found.error


def slope(eye: Accommodation, seconds: float, seed: int) -> float:
    """Return the slope of accommodation as a function of the vergence of a steady target, from 0.5 to 4 D."""
    found = []
    for vergence in (0.5, 4.0):
        course = accommodate(target_course([0, 0, 1], [2.0, vergence, vergence]), seconds, eye, seed=seed)
        found.append(vergence - course.lag(seconds / 3))
    return (found[1] - found[0]) / 3.5


def share(eye: Accommodation, stimulus: Stimulus, seconds: float, seed: int, step: float = 1.0) -> float:
    """Return the fraction of a step from 2 D that accommodation has completed at the end, averaged over directions."""
    found = []
    for way in (1, -1):
        to = 2 + way * step
        course = accommodate(target_course([0, 0.05, 0.05, 1], [2.0, 2.0, to, to]), seconds, eye, stimulus, seed=seed)
        late = course.times > seconds - 1
        found.append(way * float(course.accommodation[late].mean() - eye.plant.steady(2.0)) / step)
    return float(np.mean(found))


def right_way(eye: Accommodation, flicker: str, trial: int) -> float:
    """Return 1 if focus has moved in the correct direction 1.2 s after a step of 1 D from 2 D, else 0."""
    turned = [replace(one, phase=one.phase + PHASES[trial % len(PHASES)]) for one in (*FLICKER, *CONTRAST)]
    focus = tuple(turned[:2]) if flicker == "focus" else ()
    contrast = tuple(turned[2:]) if flicker == "contrast" else ()
    way = 1 if trial % 2 else -1
    course = accommodate(
        target_course([0, 0.05, 0.05, 1], [2.0, 2.0, 2.0 + way, 2.0 + way]),
        1.3,
        eye,
        Stimulus(focus_flicker=focus, contrast_flicker=contrast),
        seed=trial,
    )
    moved = course.accommodation[-2:].mean() - course.accommodation[:4].mean()
    return float(moved * way > 0.2)


SHOWN = {
    "defocus": Stimulus(rendering="defocus"),
    "chromatic": Stimulus(rendering="chromatic"),
}


def directions(job: Job) -> Made:
    """Run one trial of the flicker experiments with an eye that uses this cue."""
    eye = Accommodation(cue=job[0])
    return {"flicker": {name: right_way(eye, name, job[1]) for name in ("none", "focus", "contrast")}}


def courses(job: Job) -> Made:
    """Run all other experiments with an eye that uses this cue, for one seed."""
    cue, seed = job
    eye = Accommodation(cue=cue)
    found: Made = {kind: {} for kind in SINE}
    for name, light in LIGHTS.items():
        for kind, value in zip(SINE, following(eye, light, 10.0, seed), strict=True):
            found[kind][name] = value
    found["pupil"] = {f"{mm:g} mm": slope(replace(eye, pupil_diameter=1e-3 * mm), 5.0, seed) for mm in (0.5, 1.0, 3.0)}
    found["low-pass"] = {
        "sharp" if math.isinf(cpd) else f"{cpd:g} c/deg": share(eye, Stimulus(target=Target(finest_cpd=cpd)), 3.0, seed)
        for cpd in (1.0, 5.6, math.inf)
    }
    found["empty"] = {f"from {start:g} D": _empty(eye, start, seed) for start in (0.5, 4.0)}
    found["rendered"] = {"real": found["low-pass"]["sharp"]}  # the same stimulus
    found["rendered"] |= {name: share(eye, shown, 3.0, seed) for name, shown in SHOWN.items()}
    return found


def averaged(each: Sequence[Made]) -> Made:
    """Average over seeds; with two or more seeds, add the standard errors as "KIND se"."""
    found: Made = {}
    for kind, conditions in each[0].items():
        for name in conditions:
            values = np.array([one[kind][name] for one in each])
            found.setdefault(kind, {})[name] = float(values.mean())
            if len(each) > 1:
                found.setdefault(f"{kind} se", {})[name] = float(values.std(ddof=1) / math.sqrt(len(each)))
    return found


def measure(
    seeds: int,
    trials: int,
    *,
    cues: Sequence[Cue] = CUES,
    workers: int = 1,
    kept: Path | None = None,
    progress: Progress | None = None,
) -> dict[str, Made]:
    """Run every experiment with each of the cues; return values by condition. Seeds are distributed over processes.

    Results of each seed are cached in the folder `kept`, and read from there in later runs.
    """
    measured: dict[str, dict[str, list[Made]]] = {cue: {"courses": [], "directions": []} for cue in cues}
    jobs = {
        courses: [(cue, seed) for seed in range(seeds) for cue in cues],
        directions: [(cue, trial) for trial in range(trials) for cue in cues],
    }
    share = {courses: 0.9 / max(seeds * len(cues), 1), directions: 0.1 / max(trials * len(cues), 1)}
    done = 0.0
    with processes(workers) as executor:
        for run, these in jobs.items():
            known = _read(kept, run.__name__, these)
            missing = [job for job in these if job not in known]
            fresh = _kept(kept, run.__name__, missing, in_order(executor, run, missing))
            for job in these:
                measured[job[0]][run.__name__].append(known[job] if job in known else next(fresh))
                done += share[run]
                if progress is not None:
                    progress(min(done, 1.0))
    return {cue: averaged(each["courses"]) | averaged(each["directions"]) for cue, each in measured.items()}


def _file(kept: Path, kind: str, job: Job) -> Path:
    return kept / f"{kind}-{job[0]}-{job[1]}.json"


def _read(kept: Path | None, kind: str, jobs: Sequence[Job]) -> dict[Job, Made]:
    """Read the results of earlier runs."""
    if kept is None:
        return {}
    files = {job: _file(kept, kind, job) for job in jobs}
    return {job: json.loads(file.read_text(encoding="utf-8")) for job, file in files.items() if file.exists()}


def _kept(kept: Path | None, kind: str, jobs: Sequence[Job], made: Iterable[Made]) -> Iterator[Made]:
    """Write each result atomically to its own file when it is available."""
    for job, one in zip(jobs, made, strict=True):
        if kept is not None:
            kept.mkdir(parents=True, exist_ok=True)
            file = _file(kept, kind, job)
            file.with_suffix(".part").write_text(json.dumps(one), encoding="utf-8")
            file.with_suffix(".part").replace(file)
        yield one


def _empty(eye: Accommodation, start: float, seed: int) -> float:
    """Return accommodation after 15 s of an empty field."""
    course = accommodate(lambda t: start, 15.0, eye, Stimulus(target=Target(contrast=0.0)), seed=seed)
    return float(course.accommodation[course.times > 13].mean())


def make(
    *, full: bool = False, seeds: int | None = None, kept: Path | None = None, progress: Progress | None = None
) -> Shown:
    """Draw the table for 1 seed (20 with `full`) or for `seeds`, with as many direction trials, at least 6."""
    count_seeds = seeds or (20 if full else 1)
    measured = measure(count_seeds, max(count_seeds, 6), workers=cores() if full else 1, kept=kept, progress=progress)
    agreed = {cue: [row.agrees(measured[cue][row.kind]) for row in ROWS] for cue in CUES}
    count = {cue: sum(agreed[cue]) for cue in CUES}
    differ = "; ".join(row.experiment for row, same in zip(ROWS, agreed["both"], strict=True) if not same)
    return Shown(
        title="Experiments on accommodation, with an eye that focuses by its own estimate of depth",
        caption=(
            "Each experiment is done with a simulated eye (`eye.accommodate`, pupil 4 mm) that estimates depth from "
            "two wavebands at several moments, and with one of the two mechanisms taken away: two wavebands without "
            "comparison of moments, and one waveband at several moments. Numbers are in the order of the conditions in "
            "brackets; black agrees with what was published, orange does not. What counts as agreement is in the "
            f"script. Nothing was fitted to these outcomes. {_runs(count_seeds)}",
            f"The eye with both agrees in {count['both']} of {len(ROWS)}, by bands alone in {count['bands']}, by "
            f"moments alone in {count['moments']}. It disagrees in: {differ or 'none'}.",
            "Every view is taken to have the eye's own normal optics; where the apparatus changes them, the estimate "
            "is wrong, and its stated uncertainty too small. The eye’s accommodation is known exactly.",
        ),
        figure=_draw(measured, agreed),
        summary={"agree": {cue: f"{count[cue]} of {len(ROWS)}" for cue in CUES}},
        plotted=dict(measured),
    )


def _runs(seeds: int) -> str:
    if seeds == 1:
        return "Runs are few, so small differences mean little: --full averages 20 seeds, --seeds any number."
    return f"Each number is a mean over {seeds} seeds, with its standard error."


def _stated(made: Made, kind: str, condition: str) -> str:
    """Format a number, with its standard error if there is one."""
    digits = 0 if kind == "phase" else 2
    error = made.get(f"{kind} se", {}).get(condition)
    value = f"{made[kind][condition]:.{digits}f}"
    return value if error is None else f"{value}±{error:.{digits}f}"


def _draw(measured: dict[str, Made], agreed: dict[Cue, list[bool]]) -> Figure:
    with style():
        figure = new_figure(280, 100)
        ax = figure.add_axes((0.01, 0.01, 0.98, 0.98))
        ax.set_axis_off()
        ax.set(xlim=(0, 1), ylim=(len(ROWS) + 0.6, -1))
        places = {"experiment": 0.0, "published": 0.295, "both": 0.525, "bands": 0.685, "moments": 0.845}
        heads = {"experiment": "Experiment (conditions)", "published": "Published"} | COLUMNS
        for name, words in heads.items():
            ax.text(
                places[name], -0.4, words if name in ("experiment", "published") else f"Model: {words}", weight="bold"
            )
        ax.axhline(0.0, color=GREY, linewidth=0.8)
        for number, row in enumerate(ROWS):
            y = number + 0.6
            ax.text(0.0, y, row.experiment, va="center")
            ax.text(0.0, y + 0.38, f"[{', '.join(row.conditions)}]", va="center", fontsize=6, color=GREY)
            ax.text(places["published"], y, row.published, va="center")
            for cue in CUES:
                same = agreed[cue][number]
                values = ", ".join(_stated(measured[cue], row.kind, one) for one in row.conditions)
                words = f"{values}: {'agrees' if same else 'differs'}"
                size = 5.5 if len(row.conditions) > 2 else None  # makes room for three numbers with errors
                ax.text(places[cue], y, words, va="center", fontsize=size, color="black" if same else ORANGE)
        figure.text(0.99, 0.005, "a simulated eye", ha="right", va="bottom", fontsize=7)
    return figure


if __name__ == "__main__":
    alone(
        "accommodation_experiments",
        make,
        seeds=(int, "seeds, each about 100 s of processor time (default: 1, or 20 with --full)"),
        kept=(
            Path,
            "folder for what each seed gave: a run that was cut off goes on from there; empty it for another model",
        ),
    )
