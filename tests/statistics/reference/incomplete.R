# Makes incomplete.csv (100 tables of subjects by scenes with gaps) and what R's lmerTest gives for each
# (incomplete_reference.csv). Not needed to run the tests, which read those files.
#
#     cd tests/statistics/reference && Rscript incomplete.R
#
# Debian: r-base-core r-cran-lme4 r-cran-lmertest

suppressPackageStartupMessages(library(lmerTest))
set.seed(41)
rows <- list(); found <- list()
control <- lmerControl(optimizer = "bobyqa", optCtrl = list(rhoend = 1e-10))
while (length(rows) < 100) {
  kind <- length(rows) %% 4; s <- sample(c(4, 6, 8, 12), 1); n <- sample(c(5, 6, 8, 12), 1)
  if (kind == 3) { # scenes nested in subjects
    d <- expand.grid(of = 1:sample(2:5, 1), subject = 1:s); d$scene <- seq_len(nrow(d)); d$of <- NULL
  } else {
    d <- expand.grid(subject = 1:s, scene = 1:n)
    if (kind == 0) d <- d[runif(nrow(d)) > .4, ] # cells lost by chance
    if (kind == 1) d <- d[-sample(nrow(d), nrow(d) %/% 6), ]
    if (kind == 2) d <- d[unlist(lapply(split(seq_len(nrow(d)), d$subject), sample, max(2, n %/% 3))), ] # blocks
  }
  if (length(unique(d$subject)) < 3 || length(unique(d$scene)) < 5) next
  d$value <- round(0.2 + rnorm(s, 0, runif(1, 0, .3))[d$subject] + rnorm(max(d$scene), 0, runif(1, 0, .2))[d$scene] +
                   rnorm(nrow(d), 0, .2), 4)
  nested <- max(table(d$scene)) == 1
  if (!nested && nrow(d) <= max(length(unique(d$subject)), length(unique(d$scene)))) next
  formula <- if (nested) value ~ 1 + (1 | subject) else value ~ 1 + (1 | subject) + (1 | scene)
  fit <- suppressWarnings(suppressMessages(lmer(formula, d, control = control)))
  row <- summary(fit)$coefficients[1, ]
  d$set <- length(rows) + 1; rows[[length(rows) + 1]] <- d[c("set", "subject", "scene", "value")]
  found[[length(found) + 1]] <- data.frame(set = length(rows), mean_ = row[[1]], error = row[[2]], df = row[[3]])
}
write.csv(do.call(rbind, rows), "incomplete.csv", row.names = FALSE, quote = FALSE)
write.csv(do.call(rbind, found), "incomplete_reference.csv", row.names = FALSE, quote = FALSE)
