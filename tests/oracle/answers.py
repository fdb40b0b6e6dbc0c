"""Results of reports on fixed data sets, to compare two states of the package while its structure changes.

    PYTHONPATH=tests python tests/oracle/answers.py make FOLDER
    PYTHONPATH=tests python tests/oracle/answers.py compare OLD NEW

Run `make` with each state of the package (`PYTHONPATH=OTHER/src:OTHER/tests` selects another checkout), on one machine,
because processors differ in the last digits. `compare` prints, per data set, the number of results and the largest
relative difference; results of OLD that have no counterpart by design are counted by reason. It exits with 1 where a
difference exceeds `TOLERANCE` or a mapped result is missing in NEW. `results.csv` is read in both layouts: one row an
effect (columns name and level), and the earlier one (columns table and measure), which `key_of` maps to the first.
"""

from __future__ import annotations

import contextlib
import functools
import io
import math
import os
import sys
import tempfile
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

import pandas as pd
import test_kept_reports as kept
import test_report_own_detection
from recorded import RATING, record_ratings
from test_scales import design_of, record

from focalgradient.cli import main
from focalgradient.power import Model
from focalgradient.report import make_report

TOLERANCE = 1e-7
FIELDS = {"estimate": "estimate", "standard_error": "standard_error", "df": "df", "p": "p", "p_holm": "p_corrected"}
"""Numbers compared: their column in the earlier layout, and now."""

Key = tuple[str, str, str]
"""Name, level, and the role of repeated analyses ("without exclusions" and the like; else empty)."""


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

SETS: dict[str, kept.Case] = {
    "complete": kept.Case(lambda root: record_ratings(root, 12, Model(effect=1.6)), {"bound": 1.25}),
    "gaps": kept.COMPARED["incomplete"],
    "exclusions": kept.CASES["exclusions"],
    "factors": kept.CASES["factors"],
    "one scene": kept.Case(lambda root: record_ratings(root, 8, Model(effect=1.6), design=ONE_SCENE)),
    "forty": kept.Case(lambda root: record_ratings(root, 40, Model(effect=1.3))),
    "steps": kept.COMPARED["own_steps"],
    "comparisons": kept.CASES["comparisons"],
    "choices": kept.Case(lambda root: record(root, design_of(scale="choice"), 8)),
    "cube": kept.CASES["cube"],
    "thresholds": kept.Case(simulated_thresholds),
    "own thresholds": kept.CASES["thresholds"],
    "detection": kept.Case(
        kept.table_of(functools.partial(test_report_own_detection.answers, 4, 120)), {"columns": {"condition": "where"}}
    ),
    "own task": kept.Case(own_task),
}


def make(folder: Path) -> None:
    folder.mkdir(parents=True, exist_ok=True)
    for name, case in SETS.items():
        with tempfile.TemporaryDirectory() as place:
            report = make_report(case.data(Path(place) / "data"), **case.given)  # type: ignore[arg-type]
        content = report.files["results.csv"]
        (folder / f"{name}.csv").write_bytes(content)
        print(f"{name}: {len(content.splitlines()) - 1} rows", flush=True)


HERE = ", these scenes"
DESCRIPTIVE = "describes data or a model, not an effect; stays in its own table"
REPEATED = "repeats another row"

WORDS = {
    "depth effect at the largest aperture (ratio to the pinhole)": "depth effect",
    "odds ratio of a higher answer at the largest aperture": "log odds of a higher answer",
    "ratio of the depth effects": "difference of the depth effects",
    "ratio of the odds ratios": "difference of the log odds",
    "difference of the slopes": "difference of the slopes",
}
"""Descriptions of main results in the earlier layout, up to their first comma."""


EXCLUDED = (*WORDS, "slope, ", "odds ratio of the nonrigid", "geometric mean threshold (")
"""Beginnings of the results that are given with and without exclusions."""


def headline(what: str) -> tuple[str, str]:
    """Return name and level of a main result of the earlier layout."""
    first, _, rest = what.partition(", ")
    if what.startswith("slope, "):
        return "slope on aperture", rest.partition(" in focus")[0]
    if first in WORDS:
        return WORDS[first], rest.removesuffix(" in focus").replace(" to ", " less ")
    if first.startswith("odds ratio of the nonrigid"):
        return "log odds of the nonrigid reading", rest
    if first.startswith("geometric mean threshold"):
        return "geometric mean threshold", rest
    return (first, rest) if first.startswith("mean ") else (what, "")


def pair(name: object) -> str:
    return str(name).replace(" / ", " less ")


def key_of(row: dict[str, object]) -> Key | str:
    """Return the key of a row of the earlier layout, or the reason why it has none."""
    table, measure = str(row["table"]), str(row["measure"])
    fixation, aperture = str(row.get("fixation")), f"{row.get('fixation')}, {row.get('aperture')}"
    if table.endswith("_exclusions_effect") and measure == "effect":
        what = str(row["what"])
        if not what.startswith(EXCLUDED):
            return (*headline(what), "")
        if row["exclusions"] == "without exclusions":
            return (*headline(what), "without exclusions")
        return (*headline(what), "") if what.startswith("geometric mean threshold (") else REPEATED
    if table == "robustness" and measure == "effect" and row["rules"] != "all":
        return "", fixation, f"without the rule {row['rules']}"
    match table, measure:
        case "depth_rating_rises", "effect":
            name = "difference of the depth effects" if " / " in fixation else "depth effect"
            return name + HERE * ("these" in str(row["generalises_over"])), pair(fixation), ""
        case "depth_rating_means", "rating":
            return "mean rating", aperture, ""
        case "depth_rating_means", "against_pinhole" | "these_scenes":
            here = HERE * (measure == "these_scenes")
            return (
                ("depth effect" + here, fixation, "")
                if row["largest"]
                else ("ratio to the pinhole" + here, aperture, "")
            )
        case "depth_rating_slopes", "effect":
            return "slope on aperture", fixation, ""
        case "depth_rating_equivalence", "effect":
            return "equivalence to zero", fixation, ""
        case "depth_rating_sensitivity", "effect":
            return "depth effect, bootstrap-t", fixation, ""
        case "depth_rating_ordinal", "effect":
            what = str(row["what"])
            name = "slope of the log odds" if what.startswith("slope") else "log odds of a higher answer"
            name = "difference of the log odds" if "ratio of the odds ratios" in what else name
            return name + HERE * ("these" in str(row["generalises_over"])), pair(fixation), ""
        case "comparison_means", "mean":
            return "mean answer", f"{row['in focus']}, {row['aperture']}", ""
        case "necker_effects", "odds_of_time":
            return "log odds of the nonrigid reading", f"{row['gradient']} gradient, {row['strength']:g} mm", ""
        case "necker_shares", "of_readings" | "time" | "reports":
            name = {"of_readings": "share of both readings’ time", "time": "share of the time"}.get(measure)
            level = f"{row['gradient']} gradient, {row['strength']:g} mm, {row['percept']}"
            return name or "share of the reports", level, ""
        case "threshold_groups", "threshold" | "slope":
            return f"{measure} of the mean person", str(row["condition"]), ""
        case "thresholds" | "blur_thresholds", _ if measure.startswith("threshold"):
            parts = (row["participant"], row["session"], row.get("condition"))
            return "threshold", ", ".join(str(part) for part in parts if isinstance(part, str)), ""
        case "detection", "d′" | "c":
            name = {"c": "criterion c"}.get(measure, measure)
            return name, ", ".join(str(row[part]) for part in ("participant", "condition")), ""
        case _, "effect" if table.endswith("_tests"):
            return str(row["effect"]), "", ""
    return DESCRIPTIVE


Numbers = dict[str, float]


def results_of(file: Path) -> tuple[dict[Key, Numbers], Counter[str]]:
    """Return the numbers of each result by key, and how many rows have none, by reason."""
    table = pd.read_csv(file, dtype={"participant": str, "level": str})
    if "name" in table:
        rows = table.assign(level=table["level"].fillna("")).to_dict("records")
        return {_current(row): {new: row[new] for new in FIELDS.values()} for row in rows}, Counter()
    results, without = {}, Counter[str]()
    if "aperture_mm" in table:  # at the largest aperture the ratio to the pinhole is the depth effect
        table["largest"] = table["aperture_mm"] == table["aperture_mm"].max()
    for row in table.to_dict("records"):
        key = key_of(row)
        if isinstance(key, str) or not math.isfinite(row["estimate"]):
            without[key if isinstance(key, str) else "not computed"] += 1
        else:
            results[key] = {new: row.get(old, math.nan) for old, new in FIELDS.items()}
    return results, without


def _current(row: dict[str, str]) -> Key:
    repeated = row["role"] if row["role"].startswith("without") else ""
    return ("" if "rule" in repeated else row["name"], row["level"], repeated)


def differences(old: dict[Key, Numbers], new: dict[Key, Numbers]) -> Iterator[tuple[Key, float]]:
    """Yield the largest relative difference of each result; infinity where it is missing.

    Results without exclusions are those of the analysis where nothing was excluded.
    """
    for key, before in old.items():
        after = new.get(key, new.get((*key[:2], "")))
        if after is None:
            yield key, math.inf
            continue
        known = [name for name, value in before.items() if math.isfinite(value)]
        apart = [abs(after[name] - before[name]) / max(abs(before[name]), 1e-300) for name in known]
        yield key, max((math.inf if math.isnan(one) else one for one in apart), default=0.0)


def compare(old: Path, new: Path) -> bool:
    """Print the differences of all sets; return whether all are within the tolerance."""
    same, unmapped = True, Counter[str]()
    for path in sorted(old.glob("*.csv")):
        before, without = results_of(path)
        unmapped += without
        apart = dict(differences(before, results_of(new / path.name)[0]))
        worst = max(apart.values(), default=0.0)
        print(f"{path.stem:16}{len(apart):6} results {worst:12.3g}{'' if worst <= TOLERANCE else '   differs'}")
        for key, difference in apart.items():
            if difference > TOLERANCE:
                print(f"    {key}: {difference:.3g}")
        same &= bool(apart) and worst <= TOLERANCE
    for reason, count in unmapped.items():
        print(f"{count} rows of OLD: {reason}")
    return same


if __name__ == "__main__":
    match sys.argv[1:]:
        case ["make", folder]:
            make(Path(folder))
        case ["compare", old, new]:
            sys.exit(not compare(Path(old), Path(new)))
        case _:
            sys.exit(__doc__)
