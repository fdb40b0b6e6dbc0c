# Makes incomplete.csv (tables of subjects by scenes with gaps) and what R's lmerTest gives for each
# (incomplete_reference.csv). Not needed to run the tests, which read those files.
#
#     cd tests/statistics/reference && Rscript incomplete.R            # the 42 tables that are kept
#     Rscript incomplete.R 504 FOLDER; REML_TABLES=FOLDER pytest tests/statistics/test_against_r.py -k incomplete
#
# The deviance of some tables has two minima, and lmer ends in the one next to its start: of five starts, that with the
# least REML criterion is kept. Debian: r-base-core r-cran-lme4 r-cran-lmertest

suppressPackageStartupMessages(library(lmerTest))
given <- commandArgs(trailingOnly = TRUE)
count <- if (length(given)) as.integer(given[1]) else 42
folder <- if (length(given) > 1) given[2] else "."
set.seed(41)
control <- lmerControl(optimizer = "bobyqa", optCtrl = list(rhoend = 1e-10, maxfun = 1e5))
starts <- list(c(1, 1), c(.1, .1), c(.1, 3), c(3, .1), c(10, 10))
rows <- list(); found <- list()
while (length(rows) < count) {
  kind <- length(rows) %% 6; s <- sample(c(6, 8, 12, 16, 20), 1); n <- sample(c(5, 8, 12), 1)
  if (kind == 3) { # scenes nested in subjects
    d <- expand.grid(of = 1:sample(2:5, 1), subject = 1:s); d$scene <- seq_len(nrow(d)); d$of <- NULL
  } else {
    if (kind == 2) n <- 12
    d <- expand.grid(subject = 1:s, scene = 1:n)
    if (kind %in% c(0, 4)) d <- d[runif(nrow(d)) > .4, ] # cells lost by chance
    if (kind %in% c(1, 5)) d <- d[-sample(nrow(d), nrow(d) %/% 6), ]
    if (kind == 2) d <- d[unlist(lapply(split(seq_len(nrow(d)), d$subject), sample, 4)), ] # blocks: 4 of 12 scenes
  }
  if (length(unique(d$subject)) < 3 || length(unique(d$scene)) < 5) next
  people <- if (kind == 4) 0 else runif(1, 0, .3); scenes <- if (kind == 5) 0 else runif(1, 0, .2) # 4, 5: singular
  d$value <- round(0.1 + rnorm(s, 0, people)[d$subject] + rnorm(max(d$scene), 0, scenes)[d$scene] +
                   rnorm(nrow(d), 0, .2), 4)
  nested <- max(table(d$scene)) == 1
  if (!nested && nrow(d) <= max(length(unique(d$subject)), length(unique(d$scene)))) next
  formula <- if (nested) value ~ 1 + (1 | subject) else value ~ 1 + (1 | subject) + (1 | scene)
  fits <- lapply(if (nested) list(1) else starts, function(start)
    suppressWarnings(suppressMessages(lmer(formula, d, control = control, start = start))))
  fit <- fits[[which.min(sapply(fits, REMLcrit))]]
  row <- suppressWarnings(summary(fit))$coefficients[1, ]
  d$set <- length(rows) + 1; rows[[length(rows) + 1]] <- d[c("set", "subject", "scene", "value")]
  found[[length(found) + 1]] <- data.frame(set = length(rows), mean_ = row[[1]], error = row[[2]], df = row[[3]],
                                           p = row[[5]], singular = isSingular(fit, tol = 1e-5) + 0)
}
write.csv(do.call(rbind, rows), file.path(folder, "incomplete.csv"), row.names = FALSE, quote = FALSE)
write.csv(do.call(rbind, found), file.path(folder, "incomplete_reference.csv"), row.names = FALSE, quote = FALSE)
