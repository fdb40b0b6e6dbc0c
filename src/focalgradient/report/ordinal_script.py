"""R scripts that repeat the main test of ordinal answers: the mixed model, or within-subject effects."""

from __future__ import annotations

from focalgradient.statistics import OrdinalResult
from focalgradient.statistics.crossed import FEWEST_SCENES
from focalgradient.statistics.ordinal_people import FAR, LARGEST_STEP, LEVEL_SD, NEWTON, RISE_SD, ROUNDS

__all__ = ["ordinal_script"]

MIXED = """# The headline test of the report: the log odds of a higher answer at the largest aperture against the
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
  d[[paste0("blur_", f)]] <- d$aperture_mm / diff(range(d$aperture_mm)) * (d$fixation == f)  # smallest to largest: 1
  terms <- c(terms, paste0("blur_", f))
}
fixed <- c(terms, if (length(terms) > 1) "fixation"); of_scenes <- c(fixed, if (length(unique(d$scene)) > 1) "scene")
x <- model.matrix(as.formula(paste("~", paste(of_scenes, collapse = " + "))), d)
if (qr(x)$rank == ncol(x)) fixed <- of_scenes  # else scenes and apertures are confounded: no correction for scenes
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
                 odds_ratio = exp(slope)), row.names = FALSE, digits = 5)
# Over scenes, too: they are random here, as subjects are. z instead of t: clmm has no degrees of freedom; and its
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
MIXED = MIXED.replace("FEWEST_SCENES", str(FEWEST_SCENES))

AT_THE_FLOOR = """# The headline test of the report: the log odds of a higher answer at the largest aperture against the
# pinhole. The mixed model's errors cannot be trusted here (half of the answers or more at an end of the scale, no
# finite maximum, or a singular covariance): as in the report each subject's own depth effects are estimated, by a
# cumulative-link model with common thresholds and weak normal penalties, and tested by Student's t over subjects, for
# these scenes. Run in the report's folder: Rscript headline_ordinal.R (base R)
# In JASP, which has no such model: open depth_rating_wide.csv, a row for each subject and a column for each condition
# (mean step); T-Tests, Paired Samples T-Test, Wilcoxon signed-rank, the largest aperture with the pinhole.
d <- read.csv("depth_rating_trials.csv", colClasses = c(participant_id = "character", scene = "character"))
d <- d[as.character(d$included) %in% c("True", "TRUE", "1"), ]; options(width = 200)
k <- match(d$rating, sort(unique(d$rating))); who <- as.integer(factor(d$participant_id))
known <- c("nearest", "farthest")
names <- c(intersect(known, d$fixation), sort(setdiff(unique(d$fixation), known)))
x <- sapply(names, function(f) d$aperture_mm / diff(range(d$aperture_mm)) * (d$fixation == f))  # 1 at the largest
for (j in seq_along(names)) {  # within a subject and fixation: a subject with one answer only has no rise
  at <- d$fixation == names[j]; x[at, j] <- x[at, j] - ave(x[at, j], who[at])
}
x <- cbind(1, outer(d$fixation, names[-1], "==") + 0, x)
penalty <- diag(c(rep(LEVEL_SD, length(names)), rep(RISE_SD, length(names)))^-2)
ends <- function(cuts) c(-FAR, cuts, FAR)
own <- function(at, cuts, effects) {  # penalised effects of one subject, by Newton's method
  low <- ends(cuts)[k[at]]; high <- ends(cuts)[k[at] + 1]; z <- x[at, , drop = FALSE]
  for (i in 1:NEWTON_STEPS) {
    level <- as.vector(z %*% effects); below <- plogis(low - level); above <- plogis(high - level)
    gradient <- as.vector(t(z) %*% (below + above - 1) - penalty %*% effects)
    step <- solve(t(z) %*% (z * (below * (1 - below) + above * (1 - above))) + penalty, gradient)
    effects <- effects + pmin(pmax(step, -LARGEST_STEP), LARGEST_STEP)
  }
  effects
}
rising <- function(free) free[1] + c(0, cumsum(exp(free[-1])))
thresholds <- function(level, cuts) {  # most likely ones for given levels
  cost <- function(free) {
    edges <- ends(rising(free)); -sum(log(pmax(plogis(edges[k + 1] - level) - plogis(edges[k] - level), 1e-12)))
  }
  more <- length(cuts) - 1; start <- c(cuts[1], log(pmax(diff(cuts), 1e-3)))
  rising(nlminb(start, cost, lower = c(-20, rep(-7, more)), upper = c(20, rep(3, more)))$par)
}
cuts <- qlogis(head(cumsum(table(k)), -1) / length(k)); effects <- matrix(0, max(who), ncol(x))
for (i in 1:ROUNDS) {
  for (s in 1:max(who)) effects[s, ] <- own(who == s, cuts, effects[s, ])
  cuts <- thresholds(rowSums(x * effects[who, , drop = FALSE]), cuts)
}
rises <- sapply(seq_along(names), function(j) effects[, length(names) + j]); colnames(rises) <- names
if (length(names) > 1) {
  less <- combn(names, 2, function(pair) rises[, pair[1]] - rises[, pair[2]])
  colnames(less) <- combn(names, 2, paste, collapse = " less "); rises <- cbind(rises, less)
}
mean <- colMeans(rises); error <- apply(rises, 2, sd) / sqrt(nrow(rises)); df <- nrow(rises) - 1
p <- ifelse(error > 1e-12, 2 * pt(-abs(mean / error), df), NA); half <- qt(.975, df) * error
print(data.frame(term = colnames(rises), log_odds_at_largest = mean, low = mean - half, high = mean + half,
                 error = error, t = mean / error, df = df, p = p),
      row.names = FALSE, digits = 7)
"""
for name, value in {
    "LEVEL_SD": LEVEL_SD,
    "RISE_SD": RISE_SD,
    "FAR": FAR,
    "ROUNDS": ROUNDS,
    "NEWTON_STEPS": NEWTON,
    "LARGEST_STEP": LARGEST_STEP,
}.items():
    AT_THE_FLOOR = AT_THE_FLOOR.replace(name, f"{value:g}")


def ordinal_script(result: OrdinalResult) -> str:
    """Return the script of the test that the analysis used."""
    return AT_THE_FLOOR if result.by_people else MIXED
