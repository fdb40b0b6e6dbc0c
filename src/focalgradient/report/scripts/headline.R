# The tests of the report: the depth effect (log ratio of the ratings at the largest aperture to the pinhole)
# over subjects and scenes crossed as random effects, and the others. Run in the report's folder: Rscript headline.R
# Complete tables: base R, by mean squares; after it, with the packages lme4 and lmerTest, the same by REML, which may
# take fewer degrees of freedom where subjects and scenes differ little (here min(subjects, scenes) - 1 or more).
# Tables with empty cells: REML, by lmerTest where it is installed, else in base R.
d <- read.csv("depth_rating_trials.csv", colClasses = c(participant_id = "character", scene = "character"))
# include ratios
by_lmer <- function(y) {
  if (anyNA(y) || ncol(y) < FEWEST_SCENES || !requireNamespace("lmerTest", quietly = TRUE)) return(invisible())
  fit <- try(lmerTest::lmer(value ~ 1 + (1 | participant_id) + (1 | scene), cells_of(y)), silent = TRUE)
  if (!inherits(fit, "try-error")) print(summary(fit)$coefficients)
}
