# Tests of the conditions, as in the report. Base R (slopes over subjects and scenes with empty cells: lmerTest, where
# it is installed). Run in the report's folder: Rscript conditions.R
d <- read.csv("TRIALS.csv", na.strings = "", check.names = FALSE)
d <- d[as.logical(d$included), ]
# include means
shared <- function(factors) {  # conditions that vary within people, and of which half of them saw most levels
  people <- length(unique(d$participant_id))
  Filter(function(f) {
    seen <- unique(d[c("participant_id", f)]); seen <- seen[!is.na(seen[[f]]), ]
    max(table(seen$participant_id)) > 1 && median(table(as.character(seen[[f]]))) >= people / 2
  }, factors)
}
over <- function(y, row, column) {  # means of rows over all columns; with empty cells, as if rows and columns add
  cells <- tapply(y, list(row, column), mean)
  if (!anyNA(cells)) return(rowMeans(cells))
  at <- data.frame(y = as.vector(cells), row = factor(row(cells)), column = factor(col(cells)))
  fit <- lm(y ~ row + column, at)
  setNames(if (anyNA(coef(fit))) NA * cells[, 1] else tapply(predict(fit, at), at$row, mean), rownames(cells))
}
means <- function(answer, ratio, factor, factors, rows = d) {  # people x levels, over the other conditions
  y <- as.numeric(rows[[answer]]); if (ratio) y <- log(y)
  of <- aggregate(y, rows[c("participant_id", factors)], mean, na.rm = TRUE); of <- of[!is.na(of$x), ]
  who <- as.character(of$participant_id); at <- as.character(of[[factor]])
  made <- tapply(of$x, list(who, of[[factor]]), mean)
  others <- setdiff(shared(factors), factor)
  if (!length(others)) return(made)
  other <- as.character(interaction(of[others], drop = TRUE)); adjusted <- made
  if (max(rowSums(!is.na(made))) == 1) {
    if (!all(table(who, other) > 0)) adjusted[] <- ifelse(is.na(made), NA, over(of$x, who, other)[rownames(made)])
  } else for (one in unique(who)) {
    own <- who == one
    if (any(table(at[own], other[own]) == 0)) {
      of_one <- over(of$x[own], at[own], other[own])
      adjusted[one, match(names(of_one), as.character(colnames(made)))] <- of_one
    }
  }
  if (all(is.na(adjusted))) made else adjusted  # plain means where nobody's answers connect the levels
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
