# Estimate, standard error and Satterthwaite's degrees of freedom by lmerTest of many tables of subjects by scenes:
#     Rscript benchmarks/error_rates.R tables.csv fits.csv    (called by statistics_error_rates.py)
# Columns of the first: set, subject, scene, value. Debian: r-base-core r-cran-lme4 r-cran-lmertest
suppressPackageStartupMessages(library(lmerTest))
given <- commandArgs(trailingOnly = TRUE)
rows <- read.csv(given[1])
fits <- lapply(split(rows, rows$set), function(d) {
  nested <- max(table(d$scene)) == 1
  formula <- if (nested) value ~ 1 + (1 | subject) else value ~ 1 + (1 | subject) + (1 | scene)
  fit <- suppressWarnings(suppressMessages(lmer(formula, d)))
  row <- suppressWarnings(summary(fit))$coefficients[1, ]
  data.frame(set = d$set[1], mean = row[[1]], error = row[[2]], df = row[[3]])
})
write.csv(do.call(rbind, fits), given[2], row.names = FALSE)
