"""Export for other software: analysed trials as one long table with a data dictionary, and R scripts of the tests."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import combinations

import pandas as pd

from focalgradient.dataset import DataSet
from focalgradient.report.ordinal_script import ordinal_script
from focalgradient.statistics import (
    ComparisonResult,
    DepthRatingResult,
    Effect,
    NeckerResult,
    OrdinalResult,
)
from focalgradient.statistics.crossed import FEWEST_SCENES
from focalgradient.statistics.questions import Answers
from focalgradient.statistics.tables import FIXATIONS, fixations_of

__all__ = ["reader", "report_files", "safe_csv", "trial_files"]

MEANING = {
    "participant_id": "participant",
    "session": "session label; empty without one",
    "trial": "number of the trial within its participant and session",
    "scene": "scene shown",
    "aperture": "aperture: pinhole, or its f-number",
    "aperture_mm": "diameter of the aperture in millimetres; 0 for the pinhole",
    "fixation": "object fixated and in focus: nearest, farthest, or as the design names it",
    "repetition": "number of the repetition of the picture",
    "rating": "rating as given: ratio to the standard, or step of the scale",
    "log_rating": "natural logarithm of the rating",
    "response_time": "seconds from the picture to the answer",
    "dropped_frames": "frames dropped by the display in this trial",
    "catch": "whether the trial was a catch trial, not analysed",
    "kind": "human or simulated",
    "included": "whether the analysis rests on it: kept by the rules of exclusion, and no catch trial",
}

CUBE_MEANING = {
    "participant_id": "participant",
    "session": "session label; empty without one",
    "trial": "number of the trial within its participant and session",
    "gradient": "reading that the blur agrees with: none, rigid or nonrigid",
    "strength": "aperture of the blur in millimetres; 0 without a gradient",
    "onset": "seconds from the start of the trial",
    "duration": "seconds that the report lasted",
    "percept": "reported reading: rigid, nonrigid, none (no key) or both",
    "censored": "whether the end of the trial cut the report off",
    "trial_duration": "seconds that the trial lasted",
    "dropped_frames": "frames dropped by the display in this trial",
    "catch": "whether the trial was a catch trial, not analysed",
    "kind": "human or simulated",
    "included": "whether the analysis rests on it: kept by the rules of exclusion, and no catch trial",
}

CUBE = """# The headline test of the report: log odds of the time of the nonrigid reading (half of the mean duration of
# a report added to each reading), each gradient against none, over subjects. Base R only. Run in the report's folder:
# Rscript necker_headline.R
# In JASP the same: open necker_wide.csv (log odds), then T-Tests, Paired Samples T-Test, each condition with "none 0".
d <- read.csv("necker_reports.csv", colClasses = c(participant_id = "character"))
d <- d[as.character(d$included) %in% c("True", "TRUE", "1"), ]
d$condition <- paste(d$gradient, d$strength)
time <- function(of) tapply(ifelse(d$percept == of, d$duration, 0), list(d$participant_id, d$condition), sum)
half <- mean(d$duration[d$percept %in% c("rigid", "nonrigid")]) / 2
odds <- log((time("nonrigid") + half) / (time("rigid") + half))
odds[time("nonrigid") + time("rigid") == 0] <- NA
tested <- unique(d[d$gradient != "none", c("gradient", "strength")])
tested <- tested[order(tested$gradient, -tested$strength), ]  # the primary one first
tested <- paste(tested$gradient, tested$strength)
found <- do.call(rbind, lapply(tested, function(name) {
  change <- na.omit(odds[, name] - odds[, "none 0"])
  if (length(change) < 2 || sd(change) < 1e-12) return(NULL)  # no test
  t <- t.test(change)
  data.frame(condition = name, change = mean(change), low = t$conf.int[1], high = t$conf.int[2], t = t$statistic,
             df = t$parameter, p = t$p.value)
}))
others <- found$condition != tested[1]; found$p_holm <- NA  # the primary p is not corrected
found$p_holm[others] <- p.adjust(found$p[others], "holm")
print(found, row.names = FALSE, digits = 6)
"""

HEADLINE = """# The headline test of the report: the depth effect (log ratio of the ratings at the largest aperture to
# the pinhole) over subjects and scenes crossed as random effects. Run in the report's folder: Rscript headline.R
# Complete tables: base R, by mean squares; before it, with the packages lme4 and lmerTest, the same by REML, which may
# take fewer degrees of freedom where subjects and scenes differ little (here min(subjects, scenes) - 1 or more).
# Tables with empty cells: REML, by lmerTest where it is installed, else in base R.
d <- read.csv("depth_rating_trials.csv", colClasses = c(participant_id = "character", scene = "character"))
{prepare}
of <- depth_effects(d)
for (f in names(of)) {{
  y <- of[[f]]
  cat("depth effect:", f, "\\n")
  if (!anyNA(y) && ncol(y) >= {fewest} && requireNamespace("lmerTest", quietly = TRUE)) {{
    fit <- try(lmerTest::lmer(value ~ 1 + (1 | participant_id) + (1 | scene), cells_of(y)), silent = TRUE)
    if (!inherits(fit, "try-error")) print(summary(fit)$coefficients)
  }}
  print(headline(y), digits = 7)
}}
"""

JASP = """# The same for JASP. By its menus: open depth_rating_wide.csv, a row for each subject and scene; Mixed Models,
# Linear Mixed Models; dependent variable nearest, farthest or difference (log ratios); random grouping factors
# participant_id and scene; no fixed effect but the intercept; degrees of freedom by Satterthwaite. Where the scene is
# "all scenes", no scene was rated at both apertures (or with both objects in focus): T-Tests, One Sample T-Test, of
# that column. By its R console: open depth_rating_trials.csv, then run this on `data`; base R only.
d <- data
d$participant_id <- as.character(d$participant_id); d$scene <- as.character(d$scene)
{prepare}
of <- depth_effects(d)
for (f in names(of)) {{ cat("depth effect:", f, "\\n"); print(headline(of[[f]]), digits = 7) }}
"""

MEANS = """student <- function(mean, error, df) {
  half <- qt(.975, df) * error
  c(mean = mean, low = mean - half, high = mean + half, t = mean / error, df = df, p = 2 * pt(-abs(mean / error), df))
}
cells_of <- function(y) {  # a row for each cell that has a value
  cells <- expand.grid(participant_id = rownames(y), scene = colnames(y), stringsAsFactors = FALSE)
  na.omit(cbind(cells, value = as.vector(y)))
}
by_lmertest <- function(y) {  # a table with empty cells, by REML
  cells <- cells_of(y)
  random <- c(if (max(table(cells$participant_id)) > 1) "(1 | participant_id)",
              if (max(table(cells$scene)) > 1) "(1 | scene)")
  model <- as.formula(paste("value ~ 1 +", paste(random, collapse = " + ")))
  found <- summary(suppressMessages(lmerTest::lmer(model, cells)))$coefficients[1, ]
  student(found[["Estimate"]], found[["Std. Error"]], found[["df"]])
}
by_reml <- function(y) {  # the same in base R: deviance in relative SDs, Satterthwaite by its Hessian
  at <- which(!is.na(y), arr.ind = TRUE); v <- y[at]; v <- v / sd(v); n <- length(v)
  same <- lapply(1:2, function(k) outer(at[, k], at[, k], "==") + 0)
  free <- which(sapply(1:2, function(k) max(table(at[, k]))) > 1)
  solved <- function(theta) {
    root <- chol(diag(n) + theta[1]^2 * same[[1]] + theta[2]^2 * same[[2]])
    one <- backsolve(root, rep(1, n), transpose = TRUE); w <- backsolve(root, v, transpose = TRUE)
    m <- sum(one * w) / sum(one^2)
    c(mean = m, information = sum(one^2), square = sum((w - m * one)^2), logdet = 2 * sum(log(diag(root))))
  }
  full <- function(some) { theta <- c(0, 0); theta[free] <- some; theta }
  profiled <- function(some) {  # by variances: by SDs, its slope at 0 is always 0
    s <- solved(full(sqrt(abs(some)))); (n - 1) * log(s[["square"]] / (n - 1)) + s[["logdet"]] + log(s[["information"]])
  }
  starts <- list(c(1, 1), c(.01, .01), c(.01, 3), c(3, .01), c(100, 10))
  minimum <- function(start) nlminb(start[free], profiled, lower = 0, upper = 1e6, control = list(rel.tol = 1e-13))
  fits <- lapply(starts, minimum)
  theta <- sqrt(full(fits[[which.min(sapply(fits, `[[`, "objective"))]]$par)); s <- solved(theta)
  point <- c(theta, sqrt(s[["square"]] / (n - 1)))
  deviance <- function(x) {
    s <- solved(x[1:2]); 2 * (n - 1) * log(x[3]) + s[["square"]] / x[3]^2 + s[["logdet"]] + log(s[["information"]])
  }
  variance <- function(x) x[3]^2 / solved(x[1:2])[["information"]]
  used <- c(free, 3); size <- 1e-3 * c(pmax(theta, 1), point[3])
  step <- function(k) replace(c(0, 0, 0), k, size[k])
  gradient <- sapply(used, function(k) (variance(point + step(k)) - variance(point - step(k))) / (2 * size[k]))
  hessian <- outer(used, used, Vectorize(function(i, j) (deviance(point + step(i) + step(j)) -
    deviance(point + step(i) - step(j)) - deviance(point - step(i) + step(j)) + deviance(point - step(i) - step(j))) /
    (4 * size[i] * size[j])))
  e <- eigen(hessian, symmetric = TRUE); kept <- e$values > 1e-8 * max(e$values, 1)
  along <- as.vector(t(e$vectors[, kept, drop = FALSE]) %*% gradient)
  df <- 2 * variance(point)^2 / sum(2 * along^2 / e$values[kept]); unit <- sd(y[at])
  student(s[["mean"]] * unit, point[3] / sqrt(s[["information"]]) * unit, df)
}
less <- function(a, b) {  # differences within scenes; of the subjects' means where no scene has both
  y <- if (identical(colnames(a), colnames(b))) a - b
  if (is.null(y) || all(is.na(y)))
    y <- matrix(rowMeans(a, na.rm = TRUE) - rowMeans(b, na.rm = TRUE), dimnames = list(rownames(a), "all scenes"))
  y
}
pooled <- function(e) {  # without scenes where no subject has a scene at two apertures
  seen <- tapply(e$aperture_mm, list(e$participant_id, e$scene), function(mm) length(unique(mm)))
  if (max(seen, na.rm = TRUE) < 2 && length(unique(e$aperture_mm)) > 1) e$scene <- "all scenes"
  e
}
scenes_of <- function(e, d) if ("all scenes" %in% e$scene) "all scenes" else unique(d$scene)
no_test <- function(y) {  # why there is no test over subjects
  if (sum(rowSums(!is.na(y)) > 0) < 2) return("Fewer than two subjects have a value: no test.")
  own <- own_means(y)
  if (sd(own) <= 1e-12 * max(1, abs(own))) "All subjects have the same value: no test."
}
own_means <- function(y) {  # of subjects; empty cells are filled by subject + scene where that is possible
  y <- y[rowSums(!is.na(y)) > 0, colSums(!is.na(y)) > 0, drop = FALSE]
  if (!anyNA(y)) return(rowMeans(y))
  line <- lm(value ~ participant_id + scene, cells_of(y))
  if (anyNA(coef(line))) return(rowMeans(y, na.rm = TRUE))
  of <- expand.grid(participant_id = rownames(y), scene = colnames(y), stringsAsFactors = FALSE)
  y[is.na(y)] <- predict(line, of)[is.na(y)]
  rowMeans(y)
}
crossed <- function(y) {  # the mean of a table of subjects by scenes, both random where there are FEWEST_SCENES scenes
  y <- y[rowSums(!is.na(y)) > 0, colSums(!is.na(y)) > 0, drop = FALSE]
  s <- nrow(y); n <- ncol(y); reason <- no_test(y)
  if (!is.null(reason)) return(reason)
  if (n >= FEWEST_SCENES && anyNA(y) && !(sum(!is.na(y)) == s && s == n))
    return(if (requireNamespace("lmerTest", quietly = TRUE)) by_lmertest(y) else by_reml(y))
  r <- own_means(y); over_subjects <- student(mean(r), sd(r) / sqrt(s), s - 1)
  if (n < FEWEST_SCENES || anyNA(y)) return(over_subjects)
  k <- colMeans(y); free <- (s - 1) * (n - 1)
  ms <- c(subjects = n * var(r), scenes = s * var(k), residual = sum((y - outer(r, k, "+") + mean(y))^2) / free)
  if (ms[["scenes"]] <= ms[["residual"]]) return(over_subjects)
  v <- sum(ms * c(1, 1, -1)); df <- max(v^2 / sum(ms^2 / c(s - 1, n - 1, free)), min(s, n) - 1)
  student(mean(y), sqrt(v / (s * n)), df)
}
"""
MEANS = MEANS.replace("FEWEST_SCENES", str(FEWEST_SCENES))
"""R functions that test a mean over subjects and scenes, or over subjects if there are few scenes."""

LARGEST = """show("largest aperture, over subjects and scenes:", largest, crossed)
show("largest aperture, over subjects:", largest, here)
"""

COMPARED = """# The headline tests of the report: does the answer change with the aperture? A line on the aperture for
# each subject and scene (steps, places, or choices 0 and 1), its slope over subjects and scenes, both random
# (that of steps and places decides), and over subjects for these scenes (that of choices decides).
# Run in the report's folder: Rscript headline_comparisons.R (base R; tables with empty
# cells by lmerTest where it is installed, else by REML in base R)
# In JASP: open depth_rating_wide.csv, a row for each subject and a column for each condition; ANOVA,
# Repeated Measures ANOVA, over the apertures of one fixation; under contrasts choose polynomial, the linear one.
d <- read.csv("depth_rating_trials.csv", colClasses = c(participant_id = "character", scene = "character"))
d <- d[as.character(d$included) %in% c("True", "TRUE", "1"), ]; options(width = 200)
MEANStable_of <- function(e, what) {  # a row a subject, a column a scene
  of <- list(factor(e$participant_id, unique(d$participant_id)), factor(e$scene, scenes_of(e, d)))
  y <- sapply(levels(of[[2]]), function(k) sapply(levels(of[[1]]), function(s) what(e[of[[1]] == s & of[[2]] == k, ])))
  matrix(y, nlevels(of[[1]]), dimnames = lapply(of, levels))
}
slope <- function(all) function(o) {
  m <- tapply(o$rating, factor(o$aperture_mm, all), mean); w <- all - mean(all); used <- w != 0
  if (!any(used) || anyNA(m[used])) NA else sum(w[used] * m[used]) / sum(w^2)
}
slopes <- list(); largest <- list(); known <- c("nearest", "farthest"); choice <- all(d$rating %in% 0:1)
for (f in c(intersect(known, d$fixation), sort(setdiff(unique(d$fixation), known)))) {
  e <- pooled(d[d$fixation == f, ]); all <- sort(unique(e$aperture_mm)); slopes[[f]] <- table_of(e, slope(all))
  if (all(is.na(slopes[[f]]))) {  # no subject has a scene at all apertures: the slope of the means over scenes
    m <- aggregate(rating ~ participant_id + scene + aperture_mm, e, mean); m$scene <- "all scenes"
    slopes[[f]] <- table_of(m, slope(all))
  }
  largest[[f]] <- table_of(e[e$aperture_mm == max(all), ], function(o) if (nrow(o)) mean(o$rating) else NA) - choice / 2
}
if (length(slopes) > 1 && !choice) for (pair in combn(names(slopes), 2, simplify = FALSE))
  slopes[[paste(pair, collapse = " less ")]] <- less(slopes[[pair[1]]], slopes[[pair[2]]])
here <- function(y) {
  reason <- no_test(y); own <- own_means(y)
  if (is.null(reason)) student(mean(own), sd(own) / sqrt(length(own)), length(own) - 1) else reason
}
show <- function(title, tables, test) {
  found <- lapply(tables, test); found <- found[!sapply(found, is.character)]
  if (!length(found)) return(invisible())
  cat(title, "\\n"); print(as.data.frame(do.call(rbind, found)), digits = 7)  # p is not corrected
}
show("slopes, over subjects and scenes:", slopes, crossed)
show("slopes, over subjects:", slopes, here)
LARGEST""".replace("LARGEST", LARGEST).replace("MEANS", MEANS)

PREPARE = (
    """d <- d[as.character(d$included) %in% c("True", "TRUE", "1"), ]
depth_effect <- function(d, fixation) {  # log ratio of the largest aperture to the pinhole: subjects x scenes
  e <- pooled(d[d$fixation == fixation, ]); largest <- max(e$aperture_mm)
  mean_at <- function(mm) {
    o <- e[e$aperture_mm == mm, ]
    of <- list(factor(o$participant_id, unique(d$participant_id)), factor(o$scene, scenes_of(e, d)))
    tapply(o$log_rating, of, mean)
  }
  if (largest > 0) mean_at(largest) - mean_at(0) else NA * mean_at(0)
}
depth_effects <- function(d) {  # of each object in focus, and the difference of each pair
  known <- c("nearest", "farthest"); names <- unique(as.character(d$fixation))
  names <- c(intersect(known, names), sort(setdiff(names, known)))
  of <- sapply(names, function(f) depth_effect(d, f), simplify = FALSE)
  if (length(names) > 1) for (pair in combn(names, 2, simplify = FALSE))
    of[[paste(pair, collapse = " less ")]] <- less(of[[pair[1]]], of[[pair[2]]])
  of
}
"""
    + MEANS
    + """headline <- function(y) {
  found <- crossed(y)
  if (is.character(found)) return(found)
  c(found, ratio = exp(found[["mean"]]))
}"""
)
"""R code shared by `headline.R` and `headline_jasp.R`."""


def trial_files(
    table: pd.DataFrame,
    kept: pd.DataFrame,
    result: DepthRatingResult | ComparisonResult | None,
    data: DataSet | None = None,
) -> dict[str, bytes]:
    """Return all trials as a long CSV, a data dictionary, and scripts that repeat the main test.

    Parameters
    ----------
    table, kept
        All trials with every column, and those that the rules kept, with a common index.
    result
        Analysis; the scripts quote its results.
    data
        Data set whose sidecars describe the columns, if there is one.
    """
    import numpy as np

    out = table.assign(
        log_rating=np.log(table["rating"].where(table["rating"] > 0)),
        included=table.index.isin(kept.index) & ~table["catch"].astype(bool),
    )
    out = _ordered(out, MEANING)
    files = {
        "depth_rating_trials.csv": safe_csv(out),
        "depth_rating_trials_dictionary.csv": _dictionary(out, MEANING, data),
        "read_depth_rating_trials.R": reader("depth_rating_trials.csv", out),
    }
    if isinstance(result, ComparisonResult):
        script = COMPARED if result.analysis.alike is not None else COMPARED.replace(LARGEST, "")
        files["headline_comparisons.R"] = (script + _found(result.answers)).encode()
    if result is not None and not result.analysis.ratios:
        files["depth_rating_wide.csv"] = safe_csv(_answers(out))
    ordinal = result.ordinal if isinstance(result, DepthRatingResult) else None
    if result is not None and isinstance(ordinal, OrdinalResult) and (found := _found(result.answers)):
        files["headline_ordinal.R"] = (ordinal_script(ordinal) + found).encode()
    if isinstance(result, DepthRatingResult) and result.analysis.ratios:
        if len(wide := _depth_effects(out)):
            files["depth_rating_wide.csv"] = safe_csv(wide)
        found = _found(result.answers)
        files["headline.R"] = (HEADLINE.format(prepare=PREPARE, fewest=FEWEST_SCENES) + found).encode()
        files["headline_jasp.R"] = (JASP.format(prepare=PREPARE) + found).encode()
    return files


def _found(answers: Answers) -> str:
    """Format the package's main results as comments, for comparison."""
    tested = ((one.level, one.outcome) for one in answers.headlines)
    return "".join(f"# focalgradient: {name}: {test.summary()}\n" for name, test in tested if isinstance(test, Effect))


def _answers(trials: pd.DataFrame) -> pd.DataFrame:
    """Return the mean step, or the proportion of choices, by subject (rows) and condition (columns)."""
    rows = trials[trials["included"]]
    found = {}
    for fixation in fixations_of(rows):
        own = rows[rows["fixation"] == fixation].sort_values("aperture_mm")
        for aperture, answers in own.groupby("aperture", sort=False):
            found[f"{fixation} {aperture}"] = answers.groupby("participant_id")["rating"].mean()
    return pd.DataFrame(found).rename_axis("participant_id").reset_index()


ALL_SCENES = "all scenes"
"""Scene of a value that is averaged over scenes, as the R scripts name it."""


def _depth_effects(trials: pd.DataFrame) -> pd.DataFrame:
    """Return log ratios of largest aperture to pinhole by subject and scene, for each fixation, and differences."""
    rows = trials[trials["included"]]
    of = {}
    names = fixations_of(rows)
    for name in names:
        own = rows[rows["fixation"] == name]
        if own["aperture_mm"].nunique() > 1 and own["aperture_mm"].min() == 0:
            if own.groupby(["participant_id", "scene"])["aperture_mm"].nunique().max() < 2:
                own = own.assign(scene=ALL_SCENES)
            means = own.groupby(["participant_id", "scene", "aperture_mm"])["log_rating"].mean().unstack()
            of[name] = means.iloc[:, -1] - means.iloc[:, 0]
    if names == FIXATIONS and len(of) == 2:
        of["difference"] = _less(of["nearest"], of["farthest"])
    elif set(names) - {*FIXATIONS}:
        of |= {f"{one}_less_{other}": _less(of[one], of[other]) for one, other in combinations([*of], 2)}
    wide = pd.DataFrame(of)
    return wide.rename_axis(["participant_id", "scene"]).reset_index() if of else wide


def _less(one: pd.Series[float], other: pd.Series[float]) -> pd.Series[float]:
    """Return the difference within subject and scene; of the subjects' means if no scene has both."""
    difference = one - other
    if difference.notna().any():
        return difference
    means = one.groupby(level="participant_id").mean() - other.groupby(level="participant_id").mean()
    return pd.concat({ALL_SCENES: means}, names=["scene"]).swaplevel()


def report_files(
    table: pd.DataFrame, kept: pd.DataFrame, result: NeckerResult | None, data: DataSet | None = None
) -> dict[str, bytes]:
    """Return all reports on the cube as a long CSV, a data dictionary, and a script that repeats the main test.

    Parameters
    ----------
    table, kept
        All reports with every column, and those that the rules kept, with a common index.
    result
        Analysis; the script quotes its results.
    data
        Data set whose sidecars describe the columns, if there is one.
    """
    out = table.assign(included=table.index.isin(kept.index) & ~table["catch"].astype(bool))
    out = _ordered(out, CUBE_MEANING)
    files = {
        "necker_reports.csv": safe_csv(out),
        "necker_reports_dictionary.csv": _dictionary(out, CUBE_MEANING, data),
        "read_necker_reports.R": reader("necker_reports.csv", out),
    }
    found = "" if result is None else _found(result.answers)
    if result is not None:
        odds = {
            (each.participant_id, f"{each.gradient} {each.strength:g}"): each.log_odds for each in result.subject_shares
        }
        wide = pd.Series(odds, dtype=float).unstack().rename_axis("participant_id").reset_index()
        files["necker_wide.csv"] = safe_csv(wide)
    return files | ({"necker_headline.R": (CUBE + found).encode()} if found else {})


def reader(file: str, table: pd.DataFrame) -> bytes:
    """Return an R script that reads a table as `d` with typed columns: texts as factors, truth values as logical.

    >>> print(reader("a.csv", pd.DataFrame({"scene": ["01"], "mm": [1.5], "catch": [True]})).decode())
    # Reads the table with the type of each column. Run in the report's folder: source("read_a.R")
    d <- read.csv("a.csv", na.strings = "", colClasses = c("factor", "numeric", "logical"))
    <BLANKLINE>
    """
    kinds = {"b": "logical", "i": "integer", "u": "integer", "f": "numeric"}
    types = ", ".join(f'"{kinds.get(table[name].dtype.kind, "factor")}"' for name in table)
    name = file.removesuffix(".csv")
    head = f'# Reads the table with the type of each column. Run in the report\'s folder: source("read_{name}.R")\n'
    return f'{head}d <- read.csv("{file}", na.strings = "", colClasses = c({types}))\n'.encode()


def _ordered(table: pd.DataFrame, first: Mapping[str, str]) -> pd.DataFrame:
    """Return every column of a table, the usual ones first; `kind` says whether observers are simulated."""
    usual = [name for name in first if name in table]
    return table[[*usual, *(name for name in table if name not in {*usual, "simulated"})]]


def _dictionary(table: pd.DataFrame, usual: Mapping[str, str], data: DataSet | None) -> bytes:
    """Describe each column: meaning, type, number of values and of missing values."""
    sidecars = () if data is None else data.sidecars.values()
    stated = {
        name: entry["Description"]
        for sidecar in sidecars
        for name, entry in sidecar.items()
        if isinstance(entry, dict) and "Description" in entry
    }
    meaning = {**stated, **usual}
    rows = [
        (
            name,
            meaning.get(name, "as in the table"),
            str(each.dtype),
            int(each.nunique(dropna=True)),
            int(each.isna().sum()),
        )
        for name, each in ((str(column), table[column]) for column in table)
    ]
    return safe_csv(pd.DataFrame(rows, columns=["column", "meaning", "type", "values", "missing"]))


def safe_csv(table: pd.DataFrame) -> bytes:
    r"""Format a table as CSV; an apostrophe precedes text that a spreadsheet would execute as a formula.

    Truth values are TRUE and FALSE, as in R, JASP and spreadsheets.

    Examples
    --------
    >>> safe_csv(pd.DataFrame({"a": ["=1+1", "b"], "c": [-1.5, 2.0]}))
    b"a,c\n'=1+1,-1.5\nb,2.0\n"
    >>> safe_csv(pd.DataFrame({"catch": [True, False]}))
    b'catch\nTRUE\nFALSE\n'
    """

    def safe(value: object) -> object:
        return f"'{value}" if isinstance(value, str) and value.startswith(("=", "+", "-", "@", "\t", "\r")) else value

    texts = {name: table[name].map(safe) for name in table if table[name].dtype.kind not in "biuf"}
    out = table.assign(**{str(name): values for name, values in texts.items()}) if texts else table
    truth = {name: out[name].map({True: "TRUE", False: "FALSE"}) for name in out if out[name].dtype.kind == "b"}
    out = out.assign(**{str(name): values for name, values in truth.items()}).rename(
        columns=lambda name: safe(str(name))
    )
    return bytes(out.to_csv(index=False, lineterminator="\n").encode())
