# Tests of the conditions, as in the report. Base R. Run in the report's folder: Rscript conditions.R
d <- read.csv("TRIALS.csv", na.strings = "", check.names = FALSE)
if (!is.null(d$catch)) d <- d[!as.logical(d$catch), ]
# include tests
means <- function(answer, ratio, factor, factors) {  # people x levels, averaged over the other factors
  y <- as.numeric(d[[answer]]); if (ratio) y <- log(y)
  of <- aggregate(y, d[c("participant_id", factors)], mean, na.rm = TRUE)
  tapply(of$x, list(of$participant_id, of[[factor]]), mean, na.rm = TRUE)
}
slopes <- function(of) {  # of each person
  x <- as.numeric(colnames(of))
  apply(of, 1, function(y) if (sum(!is.na(y)) < 2) NA else cov(x[!is.na(y)], y[!is.na(y)]) / var(x[!is.na(y)]))
}
level <- function(of, name) {
  labels <- colnames(of); if (!name %in% labels) labels <- sprintf("%g", suppressWarnings(as.numeric(labels)))
  of[, match(name, labels)]
}
