# d' and criterion of each person and condition, and their means, as in the report. Base R. Run in the
# report's folder: Rscript detection.R
d <- read.csv("detection_trials.csv", colClasses = c(participant_id = "character", condition = "character"))
d <- d[!d$catch, ]; d$condition[is.na(d$condition)] <- ""
found <- do.call(rbind, lapply(split(d, list(d$participant_id, d$condition), drop = TRUE), function(e) {
  z <- function(rows) qnorm((sum(e$answer[rows]) + .5) / (sum(rows) + 1))  # log-linear correction
  if (!any(e$signal) || all(e$signal)) return(NULL)
  data.frame(participant_id = e$participant_id[1], condition = e$condition[1], d_prime = z(e$signal) - z(!e$signal),
             criterion = -(z(e$signal) + z(!e$signal)) / 2)
}))
print(found, row.names = FALSE, digits = 6)
for (condition in unique(found$condition)) {
  own <- found[found$condition == condition, ]
  cat("mean", condition, "\n")
  if (nrow(own) < 2) next
  half <- qt(.975, nrow(own) - 1) * sd(own$d_prime) / sqrt(nrow(own))
  print(c(d = mean(own$d_prime), low = mean(own$d_prime) - half, high = mean(own$d_prime) + half,
          c = mean(own$criterion)), digits = 6)
}
