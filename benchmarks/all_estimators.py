"""Comparison of all estimators with the information limit: error, bias, coverage and speed by blur, noise and texture.

    python benchmarks/all_estimators.py [--seeds 4] [--psf gaussian] [--out FILE.csv]

The walls, the bound and the scores are those of `analysis/estimators.py`, which draws the same table as a figure; this
benchmark has more walls, every number, and autofocus on every texture.
"""

from __future__ import annotations

import argparse
import sys
from dataclasses import replace
from pathlib import Path

import pandas as pd
from tqdm import tqdm

sys.path.insert(0, str(Path(__file__).parents[1] / "analysis"))

from estimators import ESTIMATORS, PAIR, measure, milliseconds


def main() -> None:
    parser = argparse.ArgumentParser(description="all estimators against the information limit")
    parser.add_argument("--seeds", type=int, default=4, help="walls of each kind (default 4)")
    parser.add_argument("--psf", choices=("gaussian", "disc"), default="gaussian", help="shape of the blur")
    parser.add_argument("--out", type=Path, help="also write the table here, as CSV")
    options = parser.parse_args()
    everywhere = [one if one.method == "edges" else replace(one, textures=PAIR) for one in ESTIMATORS]
    with tqdm(total=1.0, bar_format="{percentage:3.0f}%|{bar}| {elapsed} < {remaining}", leave=False) as bar:
        rows = measure(
            seeds=options.seeds,
            estimators=everywhere,
            psf=options.psf,
            progress=lambda share: bar.update(share - bar.n),
        )
    table = pd.DataFrame(rows)
    speed = {one.label: milliseconds(one) for one in ESTIMATORS}
    table["ms_per_megapixel"] = table["estimator"].map(speed)
    print(table.to_string(index=False, float_format=lambda value: f"{value:.2f}"))
    if options.out:
        table.to_csv(options.out, index=False)


if __name__ == "__main__":
    main()
