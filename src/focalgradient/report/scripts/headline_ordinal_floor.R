# The headline tests of the report: the log odds of a higher answer at the largest aperture against the
# pinhole. The mixed model's errors cannot be trusted here (half of the answers or more at an end of the scale, no
# finite maximum, or a singular covariance): as in the report each subject's own depth effects are estimated, by a
# cumulative-link model with common thresholds and weak normal penalties, and tested by Student's t over subjects, for
# these scenes. Run in the report's folder: Rscript headline_ordinal.R (base R)
# In JASP, which has no such model: open depth_rating_wide.csv, a row for each subject and a column for each condition
# (mean step); T-Tests, Paired Samples T-Test, Wilcoxon signed-rank, the largest aperture with the pinhole.
d <- read.csv("depth_rating_trials.csv", colClasses = c(participant_id = "character", scene = "character"))
d <- d[as.character(d$included) %in% c("True", "TRUE", "1"), ]
# include tests
k <- match(d$rating, sort(unique(d$rating))); who <- as.integer(factor(d$participant_id))
known <- c("nearest", "farthest")
names <- c(intersect(known, d$fixation), sort(setdiff(unique(d$fixation), known)))
x <- sapply(names, function(f) d$aperture_mm / diff(range(d$aperture_mm)) * (d$fixation == f))  # 1 at the largest
for (j in seq_along(names)) {  # within a subject and fixation: a subject with one answer only has no rise
  at <- d$fixation == names[j]; x[at, j] <- x[at, j] - ave(x[at, j], who[at])
}
x <- cbind(1, outer(d$fixation, names[-1], "==") + 0, x)
penalty <- diag(c(rep(LEVEL_SD, length(names)), rep(RISE_SD, length(names)))^-2)
ends <- function(cuts) c(-Inf, cuts, Inf)
own <- function(at, cuts, effects) {  # penalised effects of one subject, by Newton's method
  low <- ends(cuts)[k[at]]; high <- ends(cuts)[k[at] + 1]; z <- x[at, , drop = FALSE]
  for (i in 1:NEWTON) {
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
rises <- effects[, length(names) + seq_along(names), drop = FALSE]
effects <- sapply(names, function(f) rises[, names == f], simplify = FALSE); differing <- list()
if (length(names) > 1) for (pair in combn(names, 2, simplify = FALSE))
  differing[[paste(pair, collapse = " less ")]] <- effects[[pair[1]]] - effects[[pair[2]]]
tested <- tested_here <- over_people
per_mm <- function(own) over_people(own / diff(range(d$aperture_mm)))
