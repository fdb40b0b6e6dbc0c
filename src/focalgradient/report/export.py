"""The analysed trials for other software: one long table with its dictionary, and scripts of the headline test in R."""

from __future__ import annotations

import pandas as pd

from focalgradient.statistics import DepthRatingResult, Effect
from focalgradient.statistics.crossed import FEWEST_SCENES

__all__ = ["safe_csv", "trial_files"]

MEANING = {
    "participant_id": "participant",
    "session": "session label; empty without one",
    "trial": "number of the trial within its participant and session",
    "scene": "scene shown",
    "aperture": "aperture: pinhole, or its f-number",
    "aperture_mm": "diameter of the aperture in millimetres; 0 for the pinhole",
    "fixation": "object fixated and in focus: nearest or farthest",
    "repetition": "number of the repetition of the picture",
    "rating": "rating as given: ratio to the standard, or step of the scale",
    "log_rating": "natural logarithm of the rating",
    "response_time": "seconds from the picture to the answer",
    "dropped_frames": "frames dropped by the display in this trial",
    "catch": "whether the trial was a catch trial, not analysed",
    "kind": "human or simulated",
    "included": "whether the analysis rests on it: kept by the rules of exclusion, and no catch trial",
}

HEADLINE = """# The headline test of the report: the rise of the ratings from the pinhole to the largest aperture, over
# subjects and scenes crossed as random effects. Run in the report's folder: Rscript headline.R
# The second part is base R, by mean squares. Before it, with the packages lme4 and lmerTest, the same by REML: it may
# take fewer degrees of freedom where subjects and scenes differ little (here min(subjects, scenes) - 1 or more).
d <- read.csv("depth_rating_trials.csv", colClasses = c(participant_id = "character", scene = "character"))
{prepare}
for (f in unique(d$fixation)) {{
  cells <- rises(d, f)
  cat("fixation:", f, "\\n")
  if (requireNamespace("lmerTest", quietly = TRUE) && length(unique(cells$scene)) >= {fewest}) {{
    fit <- lmerTest::lmer(log_ratio ~ 1 + (1 | participant_id) + (1 | scene), cells)
    print(summary(fit)$coefficients)
  }}
  print(headline(cells))
}}
"""

JASP = """# The same for JASP: open depth_rating_trials.csv in JASP, then run this in its R console, on `data`.
# Base R only. By the menus the same: the log ratio of each subject and scene, then Mixed Models, Linear Mixed Models,
# dependent variable log_ratio, random grouping factors participant_id and scene, no fixed effect but the intercept,
# degrees of freedom by Satterthwaite.
d <- data
d$participant_id <- as.character(d$participant_id); d$scene <- as.character(d$scene)
{prepare}
for (f in unique(as.character(d$fixation))) {{ cat("fixation:", f, "\\n"); print(headline(rises(d, f))) }}
"""

PREPARE = """d <- d[as.character(d$included) %in% c("True", "TRUE", "1"), ]
rises <- function(d, fixation) {{  # a row a subject and scene: log ratio of the largest aperture to the pinhole
  e <- d[d$fixation == fixation, ]
  e <- e[e$aperture_mm == 0 | e$aperture_mm == max(e$aperture_mm), ]
  m <- aggregate(log_rating ~ participant_id + scene + aperture_mm, e, mean)
  both <- merge(m[m$aperture_mm > 0, ], m[m$aperture_mm == 0, ], by = c("participant_id", "scene"))
  data.frame(participant_id = both$participant_id, scene = both$scene,
             log_ratio = both$log_rating.x - both$log_rating.y)
}}
headline <- function(cells) {{  # complete tables of subjects by scenes
  y <- tapply(cells$log_ratio, list(cells$participant_id, cells$scene), mean)
  if (anyNA(y)) return("Some subject has no answers to some scene: use lmerTest.")
  s <- nrow(y); n <- ncol(y); r <- rowMeans(y); k <- colMeans(y); free <- (s - 1) * (n - 1)
  ms <- c(subjects = n * var(r), scenes = s * var(k), residual = sum((y - outer(r, k, "+") + mean(y))^2) / free)
  v <- sum(ms * c(1, 1, -1)); df <- max(v^2 / sum(ms^2 / c(s - 1, n - 1, free)), min(s, n) - 1)
  if (n < {fewest} || ms[["scenes"]] <= ms[["residual"]]) {{ v <- ms[["subjects"]]; df <- s - 1 }}
  error <- sqrt(v / (s * n)); t <- mean(y) / error; half <- qt(.975, df) * error
  c(log_ratio = mean(y), low = mean(y) - half, high = mean(y) + half, t = t, df = df, p = 2 * pt(-abs(t), df),
    ratio = exp(mean(y)))
}}"""


def trial_files(table: pd.DataFrame, kept: pd.DataFrame, result: DepthRatingResult | None) -> dict[str, bytes]:
    """All trials as a long CSV, the meaning of its columns, and scripts that repeat the headline test.

    Parameters
    ----------
    table, kept
        All trials, and those that the rules kept; rows of the same index are the same.
    result
        The analysis: the scripts name what it found.
    """
    import numpy as np

    out = table.assign(
        log_rating=np.log(table["rating"].where(table["rating"] > 0)),
        included=table.index.isin(kept.index) & ~table["catch"].astype(bool),
    )
    names = [name for name in MEANING if name in out]
    out = out[names]
    meaning = pd.DataFrame(
        [
            (
                name,
                MEANING[name],
                str(out[name].dtype),
                int(out[name].nunique(dropna=True)),
                int(out[name].isna().sum()),
            )
            for name in names
        ],
        columns=["column", "meaning", "type", "values", "missing"],
    )
    files = {
        "depth_rating_trials.csv": safe_csv(out),
        "depth_rating_trials_dictionary.csv": safe_csv(meaning),
    }
    if result is not None and result.scale == "ratio":
        prepare = PREPARE.format(fewest=FEWEST_SCENES)
        found = "".join(
            f"# focalgradient: {each.fixation}: {each.rise.summary()}\n"
            for each in result.fixations
            if isinstance(each.rise, Effect)
        )
        files["headline.R"] = (HEADLINE.format(prepare=prepare, fewest=FEWEST_SCENES) + found).encode()
        files["headline_jasp.R"] = (JASP.format(prepare=prepare) + found).encode()
    return files


def safe_csv(table: pd.DataFrame) -> bytes:
    r"""A table as CSV; text that a spreadsheet would take for a formula gets an apostrophe before it.

    Examples
    --------
    >>> safe_csv(pd.DataFrame({"a": ["=1+1", "b"], "c": [-1.5, 2.0]}))
    b"a,c\n'=1+1,-1.5\nb,2.0\n"
    """

    def safe(value: object) -> object:
        return f"'{value}" if isinstance(value, str) and value.startswith(("=", "+", "-", "@", "\t", "\r")) else value

    texts = {name: table[name].map(safe) for name in table if table[name].dtype.kind not in "biuf"}
    out = table.assign(**{str(name): values for name, values in texts.items()}) if texts else table
    out = out.rename(columns=lambda name: safe(str(name)))
    return bytes(out.to_csv(index=False, lineterminator="\n").encode())
