# d' and criterion of each person and condition, and their means, as in the report. Base R. Run in the
# report's folder: Rscript detection.R
d <- read.csv("detection_trials.csv", colClasses = c(participant_id = "character", condition = "character"))
d <- d[!d$catch, ]; d$condition[is.na(d$condition)] <- ""
# include tests
people <- do.call(rbind, lapply(split(d, list(d$participant_id, d$condition), drop = TRUE), function(e) {
  rate <- function(rows) (sum(e$answer[rows]) + .5) / (sum(rows) + 1)  # log-linear correction
  if (!any(e$signal) || all(e$signal)) return(NULL)
  p <- c(rate(e$signal), rate(!e$signal)); z <- qnorm(p); n <- c(sum(e$signal), sum(!e$signal)) + 1
  data.frame(participant_id = e$participant_id[1], condition = e$condition[1], d = z[1] - z[2], c = -sum(z) / 2,
             error = sqrt(sum(p * (1 - p) / n / dnorm(z)^2)))
}))
conditions <- unique(d$condition[paste(d$participant_id, d$condition) %in% paste(people$participant_id, people$condition)])
of <- function(condition, what) {
  own <- people[people$condition == condition, ]; setNames(own[[what]], own$participant_id)
}
