options(width = 200)
show <- function(name, level, found) {  # a row of results.csv; p is not corrected
  cat(name, ": ", level, "\n", sep = ""); print(found, digits = 10)
}
student <- function(mean, error, df) {
  half <- qt(.975, df) * error
  c(estimate = mean, standard_error = error, low = mean - half, high = mean + half, statistic = mean / error, df = df,
    p = 2 * pt(-abs(mean / error), df))
}
over_people <- function(own) {  # mean of one value a person, by Student's t
  own <- own[!is.na(own)]
  if (length(own) < 2) return("Fewer than two subjects have a value: no test.")
  if (sd(own) <= 1e-12 * max(1, abs(own))) return("All subjects have the same value: no test.")
  student(mean(own), sd(own) / sqrt(length(own)), length(own) - 1)
}
interval <- function(own) {  # mean of one value a person with its interval
  found <- over_people(own)
  if (is.character(found)) c(estimate = mean(own, na.rm = TRUE)) else found[c("estimate", "low", "high")]
}
at <- function(labels, name) {  # which of them are a level
  as_g <- function(of) sprintf("%g", suppressWarnings(as.numeric(as.character(of))))
  if (name %in% as.character(labels)) as.character(labels) == name else as_g(labels) == as_g(name)
}
paired <- function(one, other) {  # difference of two named vectors within people
  both <- intersect(names(one), names(other))
  over_people(one[both] - other[both])
}
welch <- function(one, other) {  # of two groups
  if (min(length(one), length(other)) < 2) return("Fewer than two subjects in a group: no test.")
  v <- c(var(one) / length(one), var(other) / length(other)); n <- c(length(one), length(other)) - 1
  student(mean(one) - mean(other), sqrt(sum(v)), sum(v)^2 / sum(v^2 / n))
}
compared <- function(one, other) {  # within people, else of two groups
  one <- one[!is.na(one)]; other <- other[!is.na(other)]
  if (any(names(one) %in% names(other))) paired(one, other) else welch(one, other)
}
