# Tests of the conditions, as in the report. Base R (tests over subjects and scenes with empty cells: lmerTest, where
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
at_each <- function(column, what, rows = d) {  # people x levels of a column: what the rows of each level give
  people <- unique(as.character(d$participant_id)); levels <- unique(as.character(rows[[column]]))
  y <- sapply(levels, function(k) what(rows[as.character(rows[[column]]) == k, ])[people])
  matrix(y, length(people), dimnames = list(people, levels))
}
level <- function(of, name) {
  own <- match(TRUE, at(colnames(of), name)); setNames(if (is.na(own)) NA * of[, 1] else of[, own], rownames(of))
}
difference <- function(of, one, other) level(of, one) - level(of, other)
with_scenes <- function(found, answer, ratio, factor, one, other) {  # min F' of Clark (1973): error of scenes added
  y <- as.numeric(d[[answer]]); if (ratio) y <- log(y)
  own <- aggregate(y, d[c("participant_id", "scene", factor)], mean)
  own <- aggregate(own$x, own[c("scene", factor)], mean)
  scenes <- welch(own$x[at(own[[factor]], one)], own$x[at(own[[factor]], other)])
  v <- c(found[["standard_error"]], scenes[["standard_error"]])^2
  student(found[["estimate"]], sqrt(sum(v)), sum(v)^2 / sum(v^2 / c(found[["df"]], scenes[["df"]])))
}
each_person <- function(values) tapply(values, d$participant_id, function(own) own[1])
amount <- function(factor) each_person(as.numeric(d[[factor]]))
is_level <- function(factor, name) each_person(as.numeric(at(d[[factor]], name)))
compared_groups <- function(own, factor, one, other) {
  group <- function(name) own[names(own) %in% names(which(is_level(factor, name) == 1))]
  compared(group(one), group(other))
}
regressed <- function(own, term, terms) {  # a coefficient, by least squares over people with errors HC2
  own <- own[!is.na(own)]; x <- cbind(1, sapply(terms, function(of) of[names(own)]))
  if (length(own) <= ncol(x)) return("Too few subjects: no test.")
  if (qr(x)$rank < ncol(x)) return("The conditions vary together: no test.")
  solved <- solve(crossprod(x), t(x)); left <- diag(length(own)) - x %*% solved; free <- diag(left)
  of <- solved[term + 1, ]; alone <- free < 1e-9
  if (any(abs(of[alone]) > 1e-9 * max(abs(of)))) return("A level has a single subject: no test.")
  weights <- ifelse(alone, 0, of^2 / free); spread <- left %*% (weights * left)
  student(sum(of * own), sqrt(sum(weights * (left %*% own)^2)), sum(diag(spread))^2 / sum(spread^2))
}
