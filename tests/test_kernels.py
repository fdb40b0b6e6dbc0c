"""Numbers do not depend on the processor: statistics, power, observers, depth and eye under several kernels.

    python tests/test_kernels.py FILE.npz [PROCESSORS]

computes the numbers and keeps them; the test does so in processes whose linear algebra and numpy use other instructions
or another number of threads, and compares them to a relative 1e-6. `make test-kernels` runs it.
"""

from __future__ import annotations

import io
import os
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Mapping
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

RELATIVE, ABSOLUTE = 1e-6, 1e-9
"""Tolerances of numbers; the absolute one is for differences and deviances that are 0 but for rounding."""


REPORTS = "ratings", "incomplete", "own_steps", "comparisons", "cube", "thresholds", "detection"
"""Cases of `reported`."""

KERNELS: Mapping[str, Mapping[str, str]] = {
    "Haswell": {"OPENBLAS_CORETYPE": "Haswell", "NPY_DISABLE_CPU_FEATURES": "AVX512F"},
    "Prescott, two threads": {
        "OPENBLAS_CORETYPE": "Prescott",
        "NPY_DISABLE_CPU_FEATURES": "AVX2 FMA3 AVX512F",
        "OPENBLAS_NUM_THREADS": "2",
    },
    "SkylakeX": {"OPENBLAS_CORETYPE": "SkylakeX"},
}
"""Environment of each process; the first is the reference."""


def processor_features() -> set[str]:
    path = Path("/proc/cpuinfo")
    lines = path.read_text("utf-8").splitlines() if path.exists() else []
    return {word for line in lines if line.startswith("flags") for word in line.split()}


def report_numbers() -> Iterator[tuple[str, np.ndarray]]:
    """Every number of every table of the reports, and whether each is given; no figure is rendered."""
    from reported import CASES

    from focalgradient.report import parts

    parts.as_files = lambda figure: {"png": b"\x89PNG", "pdf": b"%PDF"}
    for name in REPORTS:
        with tempfile.TemporaryDirectory() as folder:
            report = CASES[name].report(Path(folder) / "data")
        for file, content in sorted(report.files.items()):
            # The dictionary of columns counts the seconds in which sittings began.
            if file.endswith(".csv") and not file.startswith(("files", "versions")) and "_dictionary" not in file:
                table = pd.read_csv(io.BytesIO(content))
                for column in table.select_dtypes("number"):
                    yield f"{name}/{file}/{column}", table[column].to_numpy(float)


def model_numbers() -> Iterator[tuple[str, np.ndarray]]:
    """Power, fits of durations, of observers and of the ordinal model."""
    from scipy import special

    from focalgradient.design import DepthRatingDesign
    from focalgradient.observers import Answers, Choices, fit_observer
    from focalgradient.power import Model, Study, quick_power
    from focalgradient.statistics.dominance import PerceptDurations, fit_dominance
    from focalgradient.statistics.durations import fit_durations_of_people

    power = quick_power(Study(Model(effect=1.2), DepthRatingDesign()), 8, 200)
    yield "power", np.array(list(power.values()))

    random = np.random.default_rng(1)
    who = np.repeat(np.arange(12), 40)
    seconds = 4 * np.exp(0.5 * random.standard_normal(12)[who] + 0.8 * random.standard_normal(480))
    cut, ones = seconds > 9, np.ones(480)
    people = fit_durations_of_people(np.minimum(seconds, 9), cut, who)
    yield "durations of people", np.array([people.shape, people.geometric_mean, people.log_sd, people.log_sd_se])
    reading = np.tile([0.5, -0.5], 240)
    dominance = fit_dominance(PerceptDurations(np.minimum(seconds, 9), cut, who, reading, ones, ones))
    yield "dominance", np.array([dominance.median, dominance.spread, dominance.preference, dominance.log_likelihood])
    yield "dominance errors", np.array(list(dominance.standard_errors.values()))

    level, person = np.tile([0.5, 1.0, 2.0], 100), np.repeat(np.arange(6), 50)
    right = random.random(300) < special.ndtr(0.8 * np.exp(0.3 * random.standard_normal(6))[person] * level)

    def probability(conditions: Mapping, values: Mapping, own: np.ndarray) -> np.ndarray:
        return special.ndtr(values["sensitivity"] * np.exp(values["spread"] * own) * conditions["level"])

    observer = Choices(probability, {"sensitivity": 1.0, "spread": 0.2}, frozenset({"sensitivity", "spread"}))
    fitted = fit_observer(Answers(person, {"level": level}, right), observer)
    yield "observer", np.array([*fitted.values.values(), *fitted.standard_errors.values(), fitted.log_likelihood])


def light_numbers() -> Iterator[tuple[str, np.ndarray]]:
    """Distances by aperture and by the eye's colours, and an eye's transfer."""
    from two_views import DISTANCE, picture

    from focalgradient import Lens, View, recover_depth
    from focalgradient.eye import Eye, band_views

    views = []
    for f_number in (16, 5.6):
        lens = Lens(0.025, f_number, 0.85)
        views.append(View(picture(f_number) / 65535, lens, 8e-6 / lens.sensor_distance))
    for method in ("equalise", "spectra"):
        depth = recover_depth(views, method=method, near=0.9, far=3 * DISTANCE)
        yield f"depth {method}", depth.distance
        yield f"depth {method} sd", depth.vergence_sd
    eye = Eye(refraction="-2.00 -0.75 x 180", age=30, looking_at=2.5)
    frequency = np.degrees(np.linspace(0.0, 30.0, 16))  # cycles per radian
    yield "eye", np.abs(eye.optical_transfer(0 * frequency, frequency, 2.0))
    plain = Eye(pupil_diameter=0.004, accommodation=2.0)
    rendered = band_views(1 / 2.5, plain, (96, 96), np.radians(1 / 60), noise=0.01, seed=3)
    depth = recover_depth([band.view for band in rendered], psf="optics")
    yield "depth by colour", depth.distance


def compute(path: Path) -> None:
    sources = report_numbers, model_numbers, light_numbers
    np.savez(path, **{name: values for source in sources for name, values in source()})


@pytest.mark.slow
def test_numbers_do_not_depend_on_the_processor(tmp_path: Path) -> None:
    found: dict[str, dict[str, np.ndarray]] = {}
    for name, setting in KERNELS.items():
        if name == "SkylakeX" and "avx512f" not in processor_features():
            continue
        path = tmp_path / f"{name}.npz"
        setting = {"OPENBLAS_NUM_THREADS": "1", **setting}
        command = [sys.executable, "-W", "ignore", __file__, str(path), setting["OPENBLAS_NUM_THREADS"]]
        subprocess.run(command, check=True, env={**os.environ, **setting}, stdout=subprocess.DEVNULL)
        with np.load(path) as numbers:
            found[name] = dict(numbers)
    reference, *others = found
    differences = [
        f"{name}, {quantity}: {difference}"
        for name in others
        for quantity, values in found[reference].items()
        if (difference := differ(found[name].get(quantity, np.array([])), values))
    ]
    assert not differences, "\n".join(differences)


def differ(values: np.ndarray, reference: np.ndarray) -> str:
    """How values differ from those of the reference; "" if they do not."""
    if values.shape != reference.shape or (np.isnan(values) != np.isnan(reference)).any():
        return "other entries are given"
    far = ~np.isclose(values, reference, rtol=RELATIVE, atol=ABSOLUTE, equal_nan=True)
    return f"{far.sum()} of {far.size}, {values[far][0]} and {reference[far][0]}" if far.any() else ""


if __name__ == "__main__":
    processors = getattr(os, "sched_getaffinity", lambda _: {0})(0)
    if len(sys.argv) > 2 and hasattr(os, "sched_setaffinity"):  # the package starts one worker for each processor
        os.sched_setaffinity(0, sorted(processors)[: int(sys.argv[2])])
    compute(Path(sys.argv[1]))
