# The headline test of the report: the log odds of a higher answer at the largest aperture against the
# pinhole, by a cumulative-link mixed model. Run in the report's folder: Rscript headline_ordinal.R (package ordinal)
# In JASP, which has no such model: open depth_rating_wide.csv, a row for each subject and a column for each condition
# (mean step); T-Tests, Paired Samples T-Test, Wilcoxon signed-rank, the largest aperture with the pinhole.
# clmm integrates by Laplace's method, focalgradient by adaptive Gauss-Hermite quadrature: they agree to some percent.
# clmm has that quadrature for a single random intercept only, and this model has random slopes, too.
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
  cat("over subjects and scenes:\n"); print(summary(fit)$coefficients[blurs, , drop = FALSE])
}
