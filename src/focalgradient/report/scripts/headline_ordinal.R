# The headline tests of the report: the log odds of a higher answer at the largest aperture against the
# pinhole, by a cumulative-link mixed model. Run in the report's folder: Rscript headline_ordinal.R (package ordinal)
# In JASP, which has no such model: open depth_rating_wide.csv, a row for each subject and a column for each condition
# (mean step); T-Tests, Paired Samples T-Test, Wilcoxon signed-rank, the largest aperture with the pinhole.
# clmm integrates by Laplace's method, focalgradient by adaptive Gauss-Hermite quadrature: they agree to some percent.
# clmm has that quadrature for a single random intercept only, and this model has random slopes, too.
suppressMessages(library(ordinal))
d <- read.csv("depth_rating_trials.csv", colClasses = c(participant_id = "character", scene = "character"))
d <- d[as.character(d$included) %in% c("True", "TRUE", "1"), ]
# include tests
d$y <- ordered(d$rating); d$participant_id <- factor(d$participant_id); range_mm <- diff(range(d$aperture_mm))
known <- c("nearest", "farthest"); seen <- c(intersect(known, d$fixation), sort(setdiff(unique(d$fixation), known)))
blurs <- paste0("blur_", seq_along(seen))
for (i in seq_along(seen)) d[[blurs[i]]] <- d$aperture_mm / range_mm * (d$fixation == seen[i])  # smallest to largest: 1
effects <- sapply(seen, function(f) as.numeric(seen == f), simplify = FALSE); differing <- list()
if (length(seen) > 1) for (pair in combn(seen, 2, simplify = FALSE))
  differing[[paste(pair, collapse = " less ")]] <- effects[[pair[1]]] - effects[[pair[2]]]
model <- function(fixed, random) {
  fit <- clmm(as.formula(paste("y ~", paste(c(fixed, random), collapse = " + "))), d,
              control = clmm.control(gradTol = 1e-4))
  list(mean = coef(fit)[blurs], v = vcov(fit)[blurs, blurs, drop = FALSE])
}
of_people <- paste("(1 +", paste(blurs, collapse = " + "), "| participant_id)")
fixed <- c(blurs, if (length(seen) > 1) "fixation"); with_scenes <- c(fixed, if (length(unique(d$scene)) > 1) "scene")
x <- model.matrix(as.formula(paste("~", paste(with_scenes, collapse = " + "))), d)
here <- model(if (qr(x)$rank == ncol(x)) with_scenes else fixed, of_people)  # else scenes and apertures are confounded
tested_here <- function(k)
  student(sum(k * here$mean), sqrt(sum(k * (here$v %*% k))), nlevels(d$participant_id) - 1)
tested <- tested_here
# Over scenes, too: they are random here, as subjects are. z instead of t: clmm has no degrees of freedom; and its
# variance of the scenes is by maximum likelihood, where the report takes Cochran's Q.
if (length(unique(d$scene)) >= FEWEST_SCENES) {
  d$scene <- factor(d$scene)
  over <- model(fixed, c(of_people, sub("participant_id", "scene", of_people)))
  tested <- function(k) student(sum(k * over$mean), sqrt(sum(k * (over$v %*% k))), Inf)[-6]
}
per_mm <- function(k) {
  found <- tested(k); size <- names(found) %in% c("estimate", "standard_error", "low", "high")
  found[size] <- found[size] / range_mm
  found
}
