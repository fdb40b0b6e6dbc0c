"""False-positive rates and coverage of the analyses of ordinal ratings, signed comparisons and choices, by simulation.

    python benchmarks/scales_error_rates.py [--sets 300] [--scales steps,bipolar,choice] [--means 0,1] [--subjects 6]
        [--levels 0,-4,-6] [--differences normal,skewed] [--scenes 0,0.5] [--workers 2 | --scheduler ADDRESS]

Each data set is one experiment: N subjects, 6 scenes, 2 repetitions, one fixation. The latent percept is level + effect
x aperture / largest + logistic noise, in log odds; effects have an SD of 1 over subjects, around a mean of 0 or 1, and
an SD of 0 or 0.5 over scenes. "steps" has seven steps, with the pinhole among four apertures, and a mean level that may
be far below the middle of the scale (`--levels`, log odds), where most answers are the lowest step; "bipolar" is the
nearest integer from -3 to 3 and "choice" its sign, for three apertures against a reference. The true value for an
interval is that of 100,000 subjects with one scene each, and for steps the mean effect itself. For steps the t-test
over within-subject effects (`own_rises`) is shown next to the test that the analysis chose.
"""

from __future__ import annotations

import argparse
import os
from functools import cache
from itertools import product
from typing import Any, ClassVar, NamedTuple

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # matrices are small: threads would only slow it down

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from scipy import special, stats

from focalgradient.parallel import in_order, shared
from focalgradient.statistics import Effect, NotComputed, compare_pictures
from focalgradient.statistics.cells import slope_weights
from focalgradient.statistics.crossed import moments
from focalgradient.statistics.means import paired_effect
from focalgradient.statistics.ordinal import ordinal_rating
from focalgradient.statistics.ordinal_people import own_rises

FloatArray = NDArray[np.float64]

MM = np.array([2.27, 4.55, 8.93])
APERTURES = ("f/22", "f/11", "f/5.6")
SCENES, REPETITIONS = 6, 2
SPREAD = 1.0  # standard deviation of effects and of levels over subjects, log odds
CUTS = np.linspace(-3.0, 3.0, 6)  # thresholds between the seven steps
SUBJECTS = (4, 6, 10, 20)
DIFFERENCES = {"normal": 0.0, "skewed": 1.4, "very skewed": 4.0}  # skewness of the subjects' effects
SCENE_SD = (0.0, 0.5)


class Scale:
    """Response scale in the simulation; this class is for comparisons with a reference."""

    name: ClassVar[str]
    apertures: ClassVar[dict[str, float]] = dict(zip(APERTURES, MM.tolist(), strict=True))
    level_sd: ClassVar[float] = 0.0
    """Standard deviation of subjects' levels, log odds."""
    middle: ClassVar[float] = 0.0
    """Answer without a preference for either picture."""

    def answers(self, felt: FloatArray) -> FloatArray:
        """Return the answers to latent percepts."""
        raise NotImplementedError

    def means(self, felt: FloatArray) -> FloatArray:
        """Return the mean answers to latent percepts, averaged over logistic noise."""
        raise NotImplementedError

    def truth(self, rises: FloatArray) -> tuple[float, float]:
        """Return slope per millimetre, and answer at the largest aperture, of a population with these effects."""
        means = self.means(rises[:, None] * MM / MM[-1]).mean(axis=0)
        return float(np.polyfit(MM, means, 1)[0]), float(means[-1]) - self.middle

    def found(self, seed: int, cell: Cell, sets: int, executor: Any) -> tuple[Found, dict[str, str]]:
        """Analyse the data sets of a cell; return results and additional information."""
        return comparisons(seed, cell, sets), {}


class Bipolar(Scale):
    """Integers from -3 to 3."""

    name = "bipolar"

    def answers(self, felt: FloatArray) -> FloatArray:
        """See `Scale.answers`."""
        return np.clip(np.round(felt), -3, 3)

    def means(self, felt: FloatArray) -> FloatArray:
        """See `Scale.means`."""
        return np.asarray(special.expit(felt[..., None] - np.arange(-2.5, 3.0)).sum(axis=-1) - 3)


class Choice(Scale):
    """Choice of the deeper of two pictures."""

    name = "choice"
    middle = 0.5

    def answers(self, felt: FloatArray) -> FloatArray:
        """See `Scale.answers`."""
        return (felt > 0).astype(float)

    def means(self, felt: FloatArray) -> FloatArray:
        """See `Scale.means`."""
        return np.asarray(special.expit(felt))


class Steps(Scale):
    """Seven steps, with the pinhole among the apertures."""

    name = "steps"
    apertures = {"pinhole": 0.0} | Scale.apertures
    level_sd = SPREAD

    def answers(self, felt: FloatArray) -> FloatArray:
        """See `Scale.answers`."""
        return np.asarray(1.0 + np.digitize(felt, CUTS), dtype=np.float64)

    def found(self, seed: int, cell: Cell, sets: int, executor: Any) -> tuple[Found, dict[str, str]]:
        """See `Scale.found`."""
        tasks = [(seed, cell, number) for number in range(sets)]
        both, here, held, own = np.array(list(in_order(executor, in_steps, tasks))).T
        lowest = (answered(rng_of(seed, cell), cell, 500) == 1).mean()
        return Found(both, here, held, np.full(sets, np.nan), own), {"answers in the lowest step": f"{lowest:.2f}"}


SCALES: dict[str, Scale] = {scale.name: scale for scale in (Steps(), Bipolar(), Choice())}


class Cell(NamedTuple):
    """Settings common to the data sets of a cell."""

    scale: str
    kind: str
    scene_sd: float
    mean: float
    subjects: int
    level: float = 0.0


def people(rng: np.random.Generator, size: int | tuple[int, ...], kind: str, mean: float) -> FloatArray:
    """Draw the effect of each subject: normal, or gamma-distributed with some skewness."""
    shape = (2 / DIFFERENCES[kind]) ** 2 if DIFFERENCES[kind] else 0.0
    away = (rng.gamma(shape, size=size) - shape) / np.sqrt(shape) if shape else rng.normal(size=size)
    return np.asarray(mean + SPREAD * away, dtype=np.float64)


def answered(rng: np.random.Generator, cell: Cell, sets: int) -> FloatArray:
    """Draw the answers of many data sets (sets x subjects x scenes x apertures x repetitions); steps have a pinhole."""
    scale = SCALES[cell.scale]
    amounts = np.array(list(scale.apertures.values()))
    who = (sets, cell.subjects, 1, 1, 1)
    rise = people(rng, (sets, cell.subjects), cell.kind, cell.mean).reshape(who)
    rise = rise + cell.scene_sd * rng.normal(size=(sets, 1, SCENES, 1, 1))
    level = cell.level + scale.level_sd * rng.normal(size=who) if scale.level_sd else np.zeros(who)
    shape = (sets, cell.subjects, SCENES, len(amounts), REPETITIONS)
    return scale.answers(level + rise * amounts[:, None] / MM[-1] + rng.logistic(size=shape))


def as_rows(one: FloatArray, scale: str) -> pd.DataFrame:
    """Convert one data set to the table of trials that the analyses take."""
    amounts = SCALES[scale].apertures
    names = list(amounts)
    rows = pd.DataFrame(np.argwhere(np.isfinite(one)), columns=["who", "place", "number", "repetition"])
    return rows.assign(
        rating=one.ravel(),
        participant_id=rows["who"].map("{:02}".format),
        scene=rows["place"].map("s{}".format),
        aperture=rows["number"].map(names.__getitem__),
        aperture_mm=rows["number"].map([*amounts.values()].__getitem__),
        trial=range(len(rows)),
        fixation="nearest",
        catch=False,
    )


@cache
def truth(scale: str, kind: str, scene_sd: float, mean: float) -> tuple[float, float]:
    """Return slope per millimetre, and answer at the largest aperture, of the population."""
    rng = np.random.default_rng(1)
    rises = people(rng, 100_000, kind, mean) + scene_sd * rng.normal(size=100_000)
    return SCALES[scale].truth(rises)


class Found(NamedTuple):
    """Results by data set: p of the slope over subjects and scenes, and for these scenes; coverage of intervals.

    For steps also p of within-subject effects. NaN: not computed.
    """

    p: FloatArray
    p_these: FloatArray
    slope: FloatArray
    largest: FloatArray
    p_own: FloatArray


def tested(cells: FloatArray, true: float) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Test tables of subjects by scenes: p over both, p for these scenes, coverage of `true` by the former interval."""
    found = moments(cells)
    with np.errstate(divide="ignore", invalid="ignore"):  # no variation: no test, as in `crossed_effect`
        p = 2 * stats.t.sf(np.abs(found.mean) / found.standard_error, found.df)
    own = cells.mean(axis=-1)
    subjects = own.shape[-1]
    with np.errstate(divide="ignore", invalid="ignore"):
        t = own.mean(axis=-1) / own.std(axis=-1, ddof=1) * np.sqrt(subjects)
    here = 2 * stats.t.sf(np.abs(t), subjects - 1)
    held = np.abs(found.mean - true) < stats.t.ppf(0.975, found.df) * found.standard_error
    alike = own.std(axis=-1) < 1e-12
    return tuple(np.where(alike, np.nan, each) for each in (p, here, held))  # type: ignore[return-value]


def comparisons(seed: int, cell: Cell, sets: int) -> Found:
    """Analyse data sets of comparisons, all at once."""
    given = answered(rng_of(seed, cell), cell, sets)
    slope, largest = truth(cell.scale, cell.kind, cell.scene_sd, cell.mean)
    means = given.mean(axis=-1)
    away = tested(means[..., -1] - SCALES[cell.scale].middle, largest)[2]
    weights = slope_weights(MM)
    assert isinstance(weights, np.ndarray)
    both, here, held = tested(means @ weights, slope)
    return Found(both, here, held, away, np.full(sets, np.nan))


def _of(both: Effect | NotComputed, here: Effect | NotComputed, true: float) -> tuple[float, float, float]:
    if isinstance(both, NotComputed) or isinstance(here, NotComputed):
        return np.nan, np.nan, np.nan
    return both.p, here.p, float(both.low < true < both.high)


def rng_of(seed: int, cell: Cell, *number: int) -> np.random.Generator:
    """Return the random stream of a cell, or of one of its data sets."""
    place = ([*SCALES].index(cell.scale), list(DIFFERENCES).index(cell.kind))
    return np.random.default_rng([seed, *place, int(cell.scene_sd > 0), int(cell.mean > 0), cell.subjects, *number])


def in_steps(task: tuple[int, Cell, int]) -> tuple[float, float, float, float]:
    """Analyse one ordinal data set, which depends on `task` only: `Found`, and p of within-subject effects."""
    seed, cell, number = task
    (one,) = answered(rng_of(seed, cell, number), cell, 1)
    rows = as_rows(one, cell.scale)
    found = ordinal_rating(rows, [])
    if isinstance(found.rises[0], NotComputed):
        return np.nan, np.nan, np.nan, np.nan
    category = np.unique(rows["rating"], return_inverse=True)[1]
    amounts = rows["aperture_mm"].to_numpy()[:, None] / MM[-1]
    own = own_rises(category, amounts, np.zeros((len(rows), 0)), rows["who"].to_numpy())[:, 0]
    test = paired_effect(own, "subjects' own rises")
    return *_of(found.rises[0], found.these_scenes[0], cell.mean), getattr(test, "p", np.nan)


def compare(seed: int) -> None:
    """Analyse one data set of each kind by `compare_pictures` and by this file; exit if they differ."""
    kinds: tuple[str, ...] = ("bipolar", "choice")
    for scale in kinds:
        cell = Cell(scale, "normal", SCENE_SD[1], 0.0, 6)
        mine = comparisons(seed, cell, 2)
        one = answered(rng_of(seed, cell), cell, 2)[1]
        found = compare_pictures(as_rows(one, scale), scale)
        random, here = (", subjects and scenes", "") if scale == "choice" else ("", ", these scenes")
        slopes, at_largest = "slope on aperture", "largest aperture against identical pictures"
        names = (slopes + random, slopes + here, at_largest + random)
        slope, fixed, largest = (next(iter(found.answers.to(name).values())) for name in names)
        assert isinstance(slope, Effect) and isinstance(fixed, Effect) and isinstance(largest, Effect)  # noqa: PT018
        np.testing.assert_allclose((mine.p[1], mine.p_these[1]), (slope.p, fixed.p), rtol=1e-9)
        true = truth(scale, "normal", SCENE_SD[1], 0.0)[1]
        assert mine.largest[1] == (largest.low < true < largest.high)


def shares(found: Found) -> dict[str, str]:
    """Format rates and coverages of a cell as in the table; bold as in statistics_error_rates.py."""
    table = pd.DataFrame(found._asdict())
    computed = table[table["p"].notna()]
    lost = f" ({len(table) - len(computed)} lost)" if len(computed) < len(table) else ""
    rates = {
        "rejected": (computed["p"] < 0.05).mean(),
        "rejected, for these scenes": (computed["p_these"] < 0.05).mean(),
    }
    if found.p_own.size and not np.isnan(found.p_own).all():
        rates["rejected, subjects' own rises"] = (computed["p_own"] < 0.05).mean()
    held = {"coverage": computed["slope"].mean(), "coverage, largest aperture": computed["largest"].mean()}
    printed = {name: f"**{rate:.3f}**" if rate > 0.06 else f"{rate:.3f}" for name, rate in rates.items()}
    printed |= {name: f"**{c:.3f}**" if abs(c - 0.95) > 0.02 else f"{c:.3f}" for name, c in held.items() if c == c}
    return printed | {"rejected": printed["rejected"] + lost}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--sets", type=int, default=300, help="of each cell")
    parser.add_argument("--scales", default="bipolar,choice,steps")
    parser.add_argument(
        "--means", default="0,1", help="mean rises, log odds; rates of rejection are printed of 0 alone"
    )
    parser.add_argument("--levels", default="0", help="mean levels of answers in steps, log odds from the middle")
    parser.add_argument("--differences", default=",".join(DIFFERENCES), help="how subjects' rises are distributed")
    parser.add_argument("--scenes", default=",".join(map(str, SCENE_SD)), help="standard deviations of scenes' rises")
    parser.add_argument("--subjects", type=int, nargs="+", default=SUBJECTS)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--scheduler", help="address of a Dask scheduler, instead of processes")
    options = parser.parse_args()
    compare(options.seed)
    means, levels, scenes = (
        [float(each) for each in x.split(",")] for x in (options.means, options.levels, options.scenes)
    )
    print("| scale; subjects; scenes; mean rise; level | | " + " | ".join(f"N = {n}" for n in options.subjects) + " |")
    print("| --- " * (2 + len(options.subjects)) + "|", flush=True)
    with shared(options.workers, options.scheduler) as executor:
        for row in product(options.scales.split(","), options.differences.split(","), scenes, means, levels):
            cells = []
            for subjects in options.subjects:
                cell = Cell(*row[:4], subjects, row[4])
                found, more = SCALES[cell.scale].found(options.seed, cell, options.sets, executor)
                cells.append(shares(found) | more)
            for name in cells[0]:
                if row[3] == 0 or not name.startswith("rejected"):
                    label = "; ".join([row[0], row[1], *(f"{value:g}" for value in row[2:])])
                    print(f"| {label} | {name} | " + " | ".join(cell[name] for cell in cells) + " |", flush=True)


if __name__ == "__main__":
    main()
