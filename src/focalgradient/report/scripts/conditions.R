# Tests of the conditions, as in the report. Base R (slopes over subjects and scenes with empty cells: lmerTest, where
# it is installed). Run in the report's folder: Rscript conditions.R
d <- read.csv("TRIALS.csv", na.strings = "", check.names = FALSE)
d <- d[as.logical(d$included), ]
# include means
means <- function(answer, ratio, factor, factors, rows = d) {  # people x levels, averaged over the other factors
  y <- as.numeric(rows[[answer]]); if (ratio) y <- log(y)
  of <- aggregate(y, rows[c("participant_id", factors)], mean, na.rm = TRUE)
  tapply(of$x, list(of$participant_id, of[[factor]]), mean, na.rm = TRUE)
}
slopes <- function(of) {  # of each person
  x <- as.numeric(colnames(of))
  apply(of, 1, function(y) if (sum(!is.na(y)) < 2) NA else cov(x[!is.na(y)], y[!is.na(y)]) / var(x[!is.na(y)]))
}
scene_slopes <- function(...) {  # people x scenes
  people <- unique(as.character(d$participant_id)); scenes <- unique(as.character(d$scene))
  y <- sapply(scenes, function(k) slopes(means(..., rows = d[as.character(d$scene) == k, ]))[people])
  matrix(y, length(people), dimnames = list(people, scenes))
}
level <- function(of, name) of[, match(TRUE, at(colnames(of), name))]
difference <- function(of, one, other) level(of, one) - level(of, other)
each_person <- function(values) tapply(values, d$participant_id, function(own) own[1])
amount <- function(factor) each_person(as.numeric(d[[factor]]))
is_level <- function(factor, name) each_person(as.numeric(at(d[[factor]], name)))
compared_groups <- function(own, factor, one, other) {
  group <- function(name) own[names(own) %in% names(which(is_level(factor, name) == 1))]
  compared(group(one), group(other))
}
regressed <- function(own, term, terms) {  # a coefficient, by least squares over people
  own <- own[!is.na(own)]; x <- sapply(terms, function(of) of[names(own)])
  if (length(own) <= length(terms) + 1) return("Too few subjects: no test.")
  fit <- lm(own ~ x)
  if (anyNA(coef(fit))) return("The conditions vary together: no test.")
  found <- summary(fit)$coefficients[term + 1, ]
  student(found[[1]], found[[2]], fit$df.residual)
}
