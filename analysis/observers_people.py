"""Cross-validated comparison of observers on human depth-order judgements (Konrad, Cooper & Wetzstein 2016).

Reads the study's table `depth_task.csv`: participant, mode, correct, viewing_distance_D, relative_distance_D. Trials
with relative distance 0, which have no correct answer, are excluded. Also prints the prediction of the observer with
the best AIC for as many new people as the second argument states (default 4).
"""

import math
import sys
from pathlib import Path

import numpy as np
import pandas as pd

from focalgradient.observers import DEPTH_ORDER_OBSERVERS, Answers, compare_observers


def read(file: Path) -> Answers:
    """Read the answers of the table; modes become the available cues."""
    table = pd.read_csv(file)
    table = table[table["relative_distance_D"] != 0]
    mode = table["mode"]
    conditions = {
        "viewing": table["viewing_distance_D"].to_numpy(float),
        "relative": table["relative_distance_D"].to_numpy(float),
        "rendered_blur": mode.isin(["normal_dof", "focus_dof"]).to_numpy(float),
        "focus_follows": mode.isin(["focus", "focus_dof"]).to_numpy(float),
        "monovision": (mode == "mono").to_numpy(float),
    }
    return Answers(table["participant"].to_numpy(), conditions, table["correct"].to_numpy(float))


def main() -> None:
    """Print the fit of each observer, and its prediction for a new person."""
    answers = read(Path(sys.argv[1]))
    print("log likelihood: fitted, held out; AIC, BIC; exceedance probability; held out per person and its SD")
    compared = compare_observers(answers, DEPTH_ORDER_OBSERVERS)
    for one in compared:
        own = np.array(list(one.held_out.values()))
        print(
            f"{one.name:58} {one.fit.log_likelihood:9.2f} {one.held_out_total:9.2f} {one.fit.aic:8.1f} "
            f"{one.fit.bic:8.1f} {one.exceedance:6.3f}   {own.mean():8.2f} {own.std(ddof=1):6.2f}"
        )
        errors = one.fit.standard_errors
        stated = [f"{name} {value:.2f} ({errors.get(name, np.nan):.2f})" for name, value in one.fit.values.items()]
        print("   ", ", ".join(stated))
    new = int(sys.argv[2]) if len(sys.argv) > 2 else 4
    best = min(compared, key=lambda one: one.fit.aic)
    own = np.array(list(best.held_out.values()))
    print(
        f"predicted log likelihood of {new} new people with as many trials: {new * own.mean():.0f} +- "
        f"{math.sqrt(new) * own.std(ddof=1):.0f} ({best.name})"
    )


if __name__ == "__main__":
    main()
