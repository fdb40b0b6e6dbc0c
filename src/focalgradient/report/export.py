"""The analysed trials for other software: one long table with its dictionary, and scripts of the headline test in R."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import combinations

import pandas as pd

from focalgradient.statistics import (
    ComparisonResult,
    DepthRatingResult,
    Effect,
    NeckerResult,
    NotComputed,
    OrdinalResult,
)
from focalgradient.statistics.crossed import FEWEST_SCENES
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

CUBE = """# The headline test of the report: the nonrigid share of the time with one of the two readings, each gradient
# against none, over subjects. Base R only. Run in the report's folder: Rscript necker_headline.R
# In JASP the same: open necker_wide.csv, then T-Tests, Paired Samples T-Test, each condition with "none 0".
d <- read.csv("necker_reports.csv", colClasses = c(participant_id = "character"))
d <- d[as.character(d$included) %in% c("True", "TRUE", "1"), ]
d$condition <- paste(d$gradient, d$strength)
time <- function(of) tapply(ifelse(d$percept == of, d$duration, 0), list(d$participant_id, d$condition), sum)
share <- time("nonrigid") / (time("nonrigid") + time("rigid"))
found <- do.call(rbind, lapply(setdiff(colnames(share), "none 0"), function(name) {
  change <- na.omit(share[, name] - share[, "none 0"]); t <- t.test(change)
  ranks <- suppressWarnings(wilcox.test(change)$p.value)
  data.frame(condition = name, change = mean(change), low = t$conf.int[1], high = t$conf.int[2], t = t$statistic,
             df = t$parameter, p = t$p.value, wilcoxon_p = ranks)
}))
found$p_holm <- p.adjust(found$p, "holm"); found$wilcoxon_p_holm <- p.adjust(found$wilcoxon_p, "holm")
print(found, row.names = FALSE, digits = 6)
"""

HEADLINE = """# The headline test of the report: the rise of the ratings from the pinhole to the largest aperture, over
# subjects and scenes crossed as random effects. Run in the report's folder: Rscript headline.R
# Complete tables: base R, by mean squares; before it, with the packages lme4 and lmerTest, the same by REML, which may
# take fewer degrees of freedom where subjects and scenes differ little (here min(subjects, scenes) - 1 or more).
# Tables with empty cells: REML by lmerTest, as in the report.
d <- read.csv("depth_rating_trials.csv", colClasses = c(participant_id = "character", scene = "character"))
{prepare}
of <- all_rises(d)
for (f in names(of)) {{
  cells <- of[[f]]
  cat("rise:", f, "\\n")
  whole <- nrow(cells) == length(unique(cells$scene)) * length(unique(cells$participant_id))
  if (whole && length(unique(cells$scene)) >= {fewest} && requireNamespace("lmerTest", quietly = TRUE)) {{
    fit <- lmerTest::lmer(log_ratio ~ 1 + (1 | participant_id) + (1 | scene), cells)
    print(summary(fit)$coefficients)
  }}
  print(headline(cells))
}}
"""

JASP = """# The same for JASP. By its menus: open depth_rating_wide.csv, a row for each subject and scene; Mixed Models,
# Linear Mixed Models; dependent variable nearest, farthest or difference (log ratios); random grouping factors
# participant_id and scene; no fixed effect but the intercept; degrees of freedom by Satterthwaite. By its R console:
# open depth_rating_trials.csv, then run this on `data`; base R only.
d <- data
d$participant_id <- as.character(d$participant_id); d$scene <- as.character(d$scene)
{prepare}
of <- all_rises(d)
for (f in names(of)) {{ cat("rise:", f, "\\n"); print(headline(of[[f]])) }}
"""

ORDINAL = """# The headline test of the report: the log odds of a higher answer at the largest aperture against the
# pinhole, by a cumulative-link mixed model. Run in the report's folder: Rscript headline_ordinal.R (package ordinal)
# In JASP, which has no such model: open depth_rating_wide.csv, a row for each subject and a column for each condition
# (mean step); T-Tests, Paired Samples T-Test, Wilcoxon signed-rank, the largest aperture with the pinhole.
# clmm integrates by Laplace's method, focalgradient by adaptive Gauss-Hermite quadrature: they agree to some percent.
library(ordinal)
d <- read.csv("depth_rating_trials.csv", colClasses = c(participant_id = "character", scene = "character"))
d <- d[as.character(d$included) %in% c("True", "TRUE", "1"), ]
d$y <- ordered(d$rating); d$participant_id <- factor(d$participant_id)
terms <- c()
known <- c("nearest", "farthest")
for (f in c(intersect(known, d$fixation), sort(setdiff(unique(d$fixation), known)))) {
  d[[paste0("blur_", f)]] <- d$aperture_mm / max(d$aperture_mm) * (d$fixation == f)  # 1 at the largest aperture
  terms <- c(terms, paste0("blur_", f))
}
fixed <- c(terms, if (length(terms) > 1) "fixation", if (length(unique(d$scene)) > 1) "scene")
model <- as.formula(paste("y ~", paste(fixed, collapse = " + "), "+ (1 +", paste(terms, collapse = " + "),
                          "| participant_id)"))
fit <- clmm(model, d, control = clmm.control(gradTol = 1e-4))
slope <- coef(fit)[terms]; v <- vcov(fit)[terms, terms, drop = FALSE]
if (length(terms) > 1) {
  pairs <- combn(length(terms), 2); k <- diag(length(terms))
  for (i in seq_len(ncol(pairs))) {
    k <- rbind(k, diag(length(terms))[pairs[1, i], ] - diag(length(terms))[pairs[2, i], ])
    terms <- c(terms, paste(terms[pairs[1, i]], "less", terms[pairs[2, i]]))
  }
  slope <- as.vector(k %*% slope); v <- k %*% v %*% t(k)
}
t <- slope / sqrt(diag(v)); p <- 2 * pt(-abs(t), nlevels(d$participant_id) - 1)
print(data.frame(term = terms, log_odds_at_largest = slope, error = sqrt(diag(v)), t = t, p = p,
                 p_holm = p.adjust(p, "holm"), odds_ratio = exp(slope)), row.names = FALSE, digits = 5)
# Over scenes, too: they are random here, as subjects are. z in place of t: clmm has no degrees of freedom; and its
# variance of the scenes is by maximum likelihood, where the report takes Cochran's Q.
blurs <- grep("^blur_", names(d), value = TRUE)
if (length(unique(d$scene)) >= FEWEST_SCENES) {
  own <- paste("(1 +", paste(blurs, collapse = " + "), "|")
  fixed <- paste(c(blurs, if (length(blurs) > 1) "fixation"), collapse = " + ")
  d$scene <- factor(d$scene)
  fit <- clmm(as.formula(paste("y ~", fixed, "+", own, "participant_id) +", own, "scene)")), d,
              control = clmm.control(gradTol = 1e-4))
  cat("over subjects and scenes:\\n"); print(summary(fit)$coefficients[blurs, , drop = FALSE])
}
"""

COMPARED = """# The headline tests of the report: does the answer change with the aperture, over subjects? Steps:
# straight lines of each subject, t over subjects (base R). Choices (0 or 1): one logistic line of all answers, errors
# between subjects (CR3, package clubSandwich). Below it the same over subjects and scenes: what scenes differ by is
# added to the variance, by mean squares of complete tables. Run in the report's folder: Rscript headline_comparisons.R
# In JASP steps alone: open depth_rating_wide.csv, a row for each subject and a column for each condition; ANOVA,
# Repeated Measures ANOVA, over the apertures of one fixation; under contrasts choose polynomial, the linear one.
d <- read.csv("depth_rating_trials.csv", colClasses = c(participant_id = "character", scene = "character"))
d <- d[as.character(d$included) %in% c("True", "TRUE", "1"), ]
table_of <- function(e, what) sapply(split(e, e$scene), function(o) sapply(split(o, o$participant_id), what))
over_both <- function(name, estimate, y, over, scale) {  # `over`: variance of the estimate over subjects
  if (is.null(dim(y)) || ncol(y) < FEWEST_SCENES || anyNA(y)) return(NULL)
  s <- nrow(y); n <- ncol(y); r <- rowMeans(y); k <- colMeans(y); free <- (s - 1) * (n - 1)
  between <- scale * s * var(k); within <- scale * sum((y - outer(r, k, "+") + mean(y))^2) / free
  v <- over + max(0, between - within); df <- s - 1
  if (between > within) df <- max(v^2 / (over^2 / (s - 1) + between^2 / (n - 1) + within^2 / free), min(s, n) - 1)
  t <- estimate / sqrt(v)
  data.frame(over_both = name, estimate = estimate, t = t, df = df, p = 2 * pt(-abs(t), df))
}
mean_over_both <- function(name, y) over_both(name, mean(y), y, var(rowMeans(y)) / nrow(y), 1 / length(y))
own_slopes <- list(); crossed <- NULL; crossed_largest <- NULL
choice <- all(d$rating %in% 0:1); known <- c("nearest", "farthest")
lines <- list(); found <- data.frame(); largest <- data.frame()
for (f in c(intersect(known, d$fixation), sort(setdiff(unique(d$fixation), known)))) {
  e <- d[d$fixation == f, ]; n <- length(unique(e$participant_id))
  if (choice) {
    fit <- glm(rating ~ aperture_mm, binomial, e)
    error <- sqrt(clubSandwich::vcovCR(fit, e$participant_id, "CR3")[2, 2]); t <- coef(fit)[[2]] / error
    found <- rbind(found, data.frame(slope_of = f, estimate = coef(fit)[[2]], t = t, p = 2 * pt(-abs(t), n - 1)))
    e$influence <- ((model.matrix(fit) * (e$rating - fitted(fit))) %*% summary(fit)$cov.unscaled)[, 2]
    y <- table_of(e, function(o) sum(o$influence))
    crossed <- rbind(crossed, over_both(f, coef(fit)[[2]], y, error^2, length(y)))
  } else {
    lines[[f]] <- sapply(split(e, e$participant_id), function(o) coef(lm(rating ~ aperture_mm, o))[[2]])
    t <- t.test(lines[[f]])
    found <- rbind(found, data.frame(slope_of = f, estimate = t$estimate, t = t$statistic, p = t$p.value))
    own_slopes[[f]] <- table_of(e, function(o) coef(lm(rating ~ aperture_mm, o))[[2]])
    crossed <- rbind(crossed, mean_over_both(f, own_slopes[[f]]))
  }
  e <- e[e$aperture_mm == max(e$aperture_mm), ]
  crossed_largest <- rbind(crossed_largest, mean_over_both(f, table_of(e, function(o) mean(o$rating)) - choice / 2))
  t <- t.test(tapply(e$rating, e$participant_id, mean), mu = if (choice) 0.5 else 0)
  largest <- rbind(largest, data.frame(largest_of = f, mean = t$estimate, t = t$statistic, p = t$p.value))
}
if (length(lines) > 1) for (pair in combn(names(lines), 2, simplify = FALSE)) {
  both <- intersect(names(lines[[pair[1]]]), names(lines[[pair[2]]]))
  t <- t.test(lines[[pair[1]]][both] - lines[[pair[2]]][both])
  found <- rbind(found, data.frame(slope_of = paste(pair, collapse = " less "), estimate = t$estimate, t = t$statistic,
                                   p = t$p.value))
  y <- own_slopes[pair]
  if (all(dim(y[[1]]) == dim(y[[2]]))) {
    crossed <- rbind(crossed, mean_over_both(paste(pair, collapse = " less "), y[[1]] - y[[2]]))
  }
}
found$p_holm <- p.adjust(found$p, "holm"); print(found, row.names = FALSE, digits = 5)
largest$p_holm <- p.adjust(largest$p, "holm"); print(largest, row.names = FALSE, digits = 5)
for (each in list(crossed, crossed_largest)) if (!is.null(each)) {
  each$p_holm <- p.adjust(each$p, "holm"); print(each, row.names = FALSE, digits = 5)
}
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
all_rises <- function(d) {{  # of each object in focus, and the difference of each pair
  known <- c("nearest", "farthest"); names <- unique(as.character(d$fixation))
  names <- c(intersect(known, names), sort(setdiff(names, known)))
  of <- sapply(names, function(f) rises(d, f), simplify = FALSE)
  if (length(names) > 1) for (pair in combn(names, 2, simplify = FALSE)) {{
    both <- merge(of[[pair[1]]], of[[pair[2]]], by = c("participant_id", "scene"))
    of[[paste(pair, collapse = " less ")]] <- data.frame(both[1:2], log_ratio = both$log_ratio.x - both$log_ratio.y)
  }}
  of
}}
by_lmertest <- function(cells) {{
  nested <- max(table(cells$scene)) == 1; single <- max(table(cells$participant_id)) == 1
  random <- c(if (!single) "(1 | participant_id)", if (!nested) "(1 | scene)")
  fit <- suppressMessages(lmerTest::lmer(as.formula(paste("log_ratio ~ 1 +", paste(random, collapse = " + "))), cells))
  found <- summary(fit)$coefficients[1, ]; half <- qt(.975, found[["df"]]) * found[["Std. Error"]]; m <- found[[1]]
  c(log_ratio = m, low = m - half, high = m + half, t = found[["t value"]], df = found[["df"]],
    p = found[["Pr(>|t|)"]], ratio = exp(m))
}}
headline <- function(cells) {{  # a table of subjects by scenes
  if (length(unique(cells$participant_id)) < 2) return("Fewer than two subjects have a ratio to the pinhole: no test.")
  y <- tapply(cells$log_ratio, list(cells$participant_id, cells$scene), mean)
  if (anyNA(y)) {{
    if (ncol(y) >= {fewest} && nrow(cells) > min(dim(y)) && requireNamespace("lmerTest", quietly = TRUE))
      return(by_lmertest(cells))
    if (ncol(y) >= {fewest}) cat("Some cells are empty: with lmerTest it generalises to scenes; over subjects only:\n")
    of <- expand.grid(participant_id = rownames(y), scene = colnames(y), stringsAsFactors = FALSE)
    filled <- suppressWarnings(predict(lm(log_ratio ~ participant_id + scene, cells), of))
    y[is.na(y)] <- filled[is.na(y)]
    t <- t.test(rowMeans(y))
    return(c(log_ratio = t$estimate[[1]], low = t$conf.int[1], high = t$conf.int[2], t = t$statistic[[1]],
             df = t$parameter[[1]], p = t$p.value, ratio = exp(t$estimate[[1]])))
  }}
  s <- nrow(y); n <- ncol(y); r <- rowMeans(y); k <- colMeans(y); free <- (s - 1) * (n - 1)
  ms <- c(subjects = n * var(r), scenes = s * var(k), residual = sum((y - outer(r, k, "+") + mean(y))^2) / free)
  v <- sum(ms * c(1, 1, -1)); df <- max(v^2 / sum(ms^2 / c(s - 1, n - 1, free)), min(s, n) - 1)
  if (n < {fewest} || ms[["scenes"]] <= ms[["residual"]]) {{ v <- ms[["subjects"]]; df <- s - 1 }}
  error <- sqrt(v / (s * n)); t <- mean(y) / error; half <- qt(.975, df) * error
  c(log_ratio = mean(y), low = mean(y) - half, high = mean(y) + half, t = t, df = df, p = 2 * pt(-abs(t), df),
    ratio = exp(mean(y)))
}}"""


def trial_files(
    table: pd.DataFrame, kept: pd.DataFrame, result: DepthRatingResult | ComparisonResult | None
) -> dict[str, bytes]:
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
    files = {
        "depth_rating_trials.csv": safe_csv(out),
        "depth_rating_trials_dictionary.csv": _dictionary(out, MEANING),
        "read_depth_rating_trials.R": reader("depth_rating_trials.csv", out),
    }
    if isinstance(result, ComparisonResult):
        tests = [*zip(result.fixations, result.slopes, strict=True), ("difference", result.interaction)]
        tests += [(f"{one} less {other}", test) for (one, other), test in result.differences.items()]
        script = COMPARED if result.analysis.alike is not None else _without_largest(COMPARED)
        files["headline_comparisons.R"] = (_with_fewest(script) + _found(tests)).encode()
    if result is not None and not result.analysis.ratios:
        files["depth_rating_wide.csv"] = safe_csv(_answers(out))
    if isinstance(result, DepthRatingResult) and isinstance(result.ordinal, OrdinalResult):
        tests = [*zip(result.ordinal.fixations, result.ordinal.rises, strict=True)]
        tests.append(("difference", result.ordinal.interaction))
        tests += [(f"{one} less {other}", test) for (one, other), test in result.ordinal.differences.items()]
        files["headline_ordinal.R"] = (_with_fewest(ORDINAL) + _found(tests)).encode()
    if isinstance(result, DepthRatingResult) and result.analysis.ratios:
        files["depth_rating_wide.csv"] = safe_csv(_rises(out))
        prepare = PREPARE.format(fewest=FEWEST_SCENES)
        rises = [(each.fixation, each.rise) for each in result.fixations]
        pairs = {names: test for names, (test, _) in result.differences.items()} or {FIXATIONS: result.interaction}
        found = _found([*rises, *((f"{one} less {other}", test) for (one, other), test in pairs.items())])
        files["headline.R"] = (HEADLINE.format(prepare=prepare, fewest=FEWEST_SCENES) + found).encode()
        files["headline_jasp.R"] = (JASP.format(prepare=prepare) + found).encode()
    return files


def _without_largest(script: str) -> str:
    """The script without the comparisons at the largest aperture, for answers of which none means alike."""
    start = script.index("  e <- e[e$aperture_mm == max(e$aperture_mm), ]\n")
    end = script.index("}\n", script.index("  largest <- rbind"))
    lines = (script[:start] + script[end:]).splitlines(keepends=True)
    return "".join(line for line in lines if not line.startswith("largest$"))


def _with_fewest(script: str) -> str:
    return script.replace("FEWEST_SCENES", str(FEWEST_SCENES))


def _found(tests: Sequence[tuple[str, Effect | NotComputed]]) -> str:
    """Our own results, for comparison, as comments."""
    return "".join(f"# focalgradient: {name}: {test.summary()}\n" for name, test in tests if isinstance(test, Effect))


def _answers(trials: pd.DataFrame) -> pd.DataFrame:
    """A row a subject, a column a condition: the mean step, or the share of choices."""
    rows = trials[trials["included"]]
    found = {}
    for fixation in fixations_of(rows):
        own = rows[rows["fixation"] == fixation].sort_values("aperture_mm")
        for aperture, answers in own.groupby("aperture", sort=False):
            found[f"{fixation} {aperture}"] = answers.groupby("participant_id")["rating"].mean()
    return pd.DataFrame(found).rename_axis("participant_id").reset_index()


def _rises(trials: pd.DataFrame) -> pd.DataFrame:
    """A row a subject and scene: log ratio of the largest aperture to the pinhole by fixation, and their difference."""
    rows = trials[trials["included"]]
    of = {}
    names = fixations_of(rows)
    for name in names:
        own = rows[rows["fixation"] == name]
        if own["aperture_mm"].nunique() > 1 and own["aperture_mm"].min() == 0:
            means = own.groupby(["participant_id", "scene", "aperture_mm"])["log_rating"].mean().unstack()
            of[name] = means.iloc[:, -1] - means.iloc[:, 0]
    if names == FIXATIONS and len(of) == 2:
        of["difference"] = of["nearest"] - of["farthest"]
    elif set(names) - {*FIXATIONS}:
        of |= {f"{one}_less_{other}": of[one] - of[other] for one, other in combinations([*of], 2)}
    wide = pd.DataFrame(of)
    return wide.rename_axis(["participant_id", "scene"]).reset_index() if of else wide


def report_files(table: pd.DataFrame, kept: pd.DataFrame, result: NeckerResult | None) -> dict[str, bytes]:
    """All reports on the cube as a long CSV, the meaning of its columns, and a script that repeats the headline test.

    Parameters
    ----------
    table, kept
        All reports, and those that the rules kept; rows of the same index are the same.
    result
        The analysis: the script names what it found.
    """
    out = table.assign(included=table.index.isin(kept.index) & ~table["catch"].astype(bool))
    out = out[[name for name in CUBE_MEANING if name in out]]
    files = {
        "necker_reports.csv": safe_csv(out),
        "necker_reports_dictionary.csv": _dictionary(out, CUBE_MEANING),
        "read_necker_reports.R": reader("necker_reports.csv", out),
    }
    found = "".join(
        f"# focalgradient: {each.gradient} {each.strength:g}: {each.share.summary()}\n"
        for each in (result.effects if result is not None else ())
        if isinstance(each.share, Effect)
    )
    if result is not None:
        shares = {
            (each.participant_id, f"{each.gradient} {each.strength:g}"): each.nonrigid for each in result.subject_shares
        }
        wide = pd.Series(shares, dtype=float).unstack().rename_axis("participant_id").reset_index()
        files["necker_wide.csv"] = safe_csv(wide)
    return files | ({"necker_headline.R": (CUBE + found).encode()} if found else {})


def reader(file: str, table: pd.DataFrame) -> bytes:
    """A script that reads a table into R with the type of each column, as `d`: texts as factors, truth as logical.

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


def _dictionary(table: pd.DataFrame, meaning: Mapping[str, str]) -> bytes:
    """What each column means, its type, and how many values and gaps it has."""
    rows = [
        (name, meaning[name], str(each.dtype), int(each.nunique(dropna=True)), int(each.isna().sum()))
        for name, each in ((str(column), table[column]) for column in table)
    ]
    return safe_csv(pd.DataFrame(rows, columns=["column", "meaning", "type", "values", "missing"]))


def safe_csv(table: pd.DataFrame) -> bytes:
    r"""A table as CSV; text that a spreadsheet would take for a formula gets an apostrophe before it.

    Truth values are TRUE and FALSE, which R, JASP and spreadsheets read as such.

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
