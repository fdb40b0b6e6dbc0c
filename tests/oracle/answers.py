"""Results of reports on fixed data sets, to compare two states of the package while its structure changes.

    PYTHONPATH=tests python tests/oracle/answers.py make FOLDER
    PYTHONPATH=tests python tests/oracle/answers.py compare OLD NEW

Run `make` with each state of the package (`PYTHONPATH=OTHER/src:OTHER/tests` selects another checkout), on one machine,
because processors differ in the last digits. `compare` prints, per data set, the number of results and the largest
relative difference. It exits with 1 where a difference exceeds `TOLERANCE` or a result of OLD is missing in NEW.
"""

from __future__ import annotations

import contextlib
import functools
import io
import os
import sys
import tempfile
from pathlib import Path

import pandas as pd
import test_report_own_detection
from recorded import RATING, record_ratings
from reported import CASES, WHERE, Case, table_of
from test_scales import design_of, record

from focalgradient.cli import main
from focalgradient.power import Model

TOLERANCE = 1e-7
FIELDS = ["estimate", "standard_error", "df", "p", "p_corrected"]
"""Numbers compared."""


def simulated(root: Path, task: str | Path, observers: int, seed: int = 1, design: Path | None = None) -> Path:
    stated = [] if design is None else ["--design", str(design)]
    with contextlib.suppress(SystemExit), contextlib.redirect_stdout(io.StringIO()):
        main(["simulate", str(task), "--observers", str(observers), "--seed", str(seed), "--out", str(root), *stated])
    return root


def own_task(root: Path) -> Path:
    file = Path(__file__).parents[2] / "experiments" / "depth_order.py"
    os.environ["FOCALGRADIENT_TASKS"] = str(file)
    return simulated(root, file, 8)


def simulated_thresholds(root: Path) -> Path:
    design = root.with_suffix(".toml")
    design.write_text('task = "blurthreshold"\nscenes = ["a"]\nrepetitions = 12\n')
    return simulated(root, "blur-threshold", 3, seed=3, design=design)


ONE_SCENE = RATING.model_copy(update={"scenes": ("spheres-01",)})

SETS: dict[str, Case] = {
    "complete": Case(lambda root: record_ratings(root, 12, Model(effect=1.6)), {"bound": 1.25}),
    "gaps": CASES["incomplete"],
    "exclusions": CASES["exclusions"],
    "factors": CASES["factors"],
    "one scene": Case(lambda root: record_ratings(root, 8, Model(effect=1.6), design=ONE_SCENE)),
    "forty": Case(lambda root: record_ratings(root, 40, Model(effect=1.3))),
    "steps": CASES["own_steps"],
    "comparisons": CASES["comparisons"],
    "choices": Case(lambda root: record(root, design_of(scale="choice"), 8)),
    "cube": CASES["cube"],
    "thresholds": Case(simulated_thresholds),
    "own thresholds": CASES["thresholds"],
    "detection": Case(table_of(functools.partial(test_report_own_detection.answers, 4, 120)), WHERE),
    "own task": Case(own_task),
}


def make(folder: Path) -> None:
    folder.mkdir(parents=True, exist_ok=True)
    for name, case in SETS.items():
        with tempfile.TemporaryDirectory() as place:
            content = case.report(Path(place) / "data").files["results.csv"]
        (folder / f"{name}.csv").write_bytes(content)
        print(f"{name}: {len(content.splitlines()) - 1} rows", flush=True)


def results_of(file: Path) -> pd.DataFrame:
    """Return the numbers of each result by name, level and role."""
    table = pd.read_csv(file, dtype={"participant": str, "level": str}, keep_default_na=False, na_values=[""])
    return table.fillna({"level": ""}).set_index(["name", "level", "role"])[FIELDS].astype(float)


def compare(old: Path, new: Path) -> bool:
    """Print the differences of all sets; return whether all are within the tolerance."""
    same = True
    for path in sorted(old.glob("*.csv")):
        before = results_of(path)
        after = results_of(new / path.name).reindex(before.index)
        apart = (
            ((after - before).abs() / before.abs().clip(lower=1e-300)).where(before.notna(), 0.0).fillna(float("inf"))
        )
        worst = apart.max(axis=1)
        differs = worst[worst > TOLERANCE]
        print(f"{path.stem:16}{len(before):6} results {worst.max():12.3g}{'   differs' * bool(len(differs))}")
        for key, difference in differs.items():
            print(f"    {key}: {difference:.3g}")
        same &= differs.empty
    return same


if __name__ == "__main__":
    match sys.argv[1:]:
        case ["make", folder]:
            make(Path(folder))
        case ["compare", old, new]:
            sys.exit(not compare(Path(old), Path(new)))
        case _:
            sys.exit(__doc__)
