# Difference scales of simulated judgements by R's glm: the model and the coding that MLDS::mlds fits with its method
# "glm" (Knoblauch & Maloney 2008): quadruples weigh their stimuli by 1, -1, -1, 1 and triads by 1, -2, 1, ascending, a
# descending triad's answer turned. MLDS itself is not loaded. Writes difference_scaling_reference.csv.
# Run in this folder: Rscript difference_scaling.R
# Debian: r-base-core
rows <- list()
for (kind in c("quadruples", "triads")) {
  d <- read.csv(paste0("difference_scaling_", kind, ".csv"))
  shown <- as.matrix(d[, -1])
  x <- matrix(0, nrow(d), max(shown))
  for (i in seq_len(nrow(d))) {
    of <- shown[i, ]
    if (kind == "triads") {
      x[i, of] <- c(1, -2, 1)
      if (of[1] > of[3]) d$larger[i] <- 1 - d$larger[i]
    } else {
      x[i, sort(of[3:4])] <- x[i, sort(of[3:4])] + c(-1, 1)
      x[i, sort(of[1:2])] <- x[i, sort(of[1:2])] + c(1, -1)
    }
  }
  fit <- glm(d$larger ~ x[, -1] - 1, family = binomial("probit"), control = glm.control(epsilon = 1e-14, maxit = 50000))
  values <- summary(fit)$coefficients
  rows[[kind]] <- data.frame(kind = kind, name = c(rep("value", nrow(values)), rep("error", nrow(values)), "logLik"),
                             place = c(seq_len(nrow(values)), seq_len(nrow(values)), 0),
                             number = sprintf("%.10g", c(values[, 1], values[, 2], logLik(fit))))
}
write.csv(do.call(rbind, rows), "difference_scaling_reference.csv", row.names = FALSE, quote = FALSE)
cat(R.version.string, "\n")
