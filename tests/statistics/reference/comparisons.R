# Makes comparisons.csv (eight subjects compare pictures in steps from -3 to 3, and choose the deeper one) and what R
# says of it (comparisons_reference.csv: name, place, value). Not needed to run the tests, which read those files.
#
#     cd tests/statistics/reference && Rscript comparisons.R
#
# Debian: r-base-core

said <- list()
say <- function(name, values) said[[name]] <<- values

set.seed(1988)
names <- c("f/22", "f/11", "f/5.6")
d <- expand.grid(participant_id = sprintf("%02d", 1:8), fixation = c("nearest", "farthest"), aperture = names,
                 scene = c("room", "terrain", "bottle"), repetition = 1:2, stringsAsFactors = FALSE)
d$aperture_mm <- c(2.27, 4.55, 8.93)[match(d$aperture, names)]
own <- as.integer(d$participant_id)
near <- rnorm(8, 0.25, 0.1); far <- rnorm(8, 0, 0.1)
drive <- ifelse(d$fixation == "nearest", near[own], far[own]) * d$aperture_mm
d$steps <- pmax(-3, pmin(3, round(drive + rnorm(nrow(d), 0, 0.8))))
d$choice <- as.integer(drive + rlogis(nrow(d), 0, 0.8) > 0)
d <- d[order(d$participant_id), ]
d$trial <- ave(seq_len(nrow(d)), d$participant_id, FUN = seq_along)
d$catch <- FALSE
write.csv(d, "comparisons.csv", row.names = FALSE, quote = FALSE)

slopes <- list()
for (f in c("nearest", "farthest")) {
  e <- d[d$fixation == f, ]
  slopes[[f]] <- sapply(split(e, e$participant_id), function(o) coef(lm(steps ~ aperture_mm, o))[[2]])
  t <- t.test(slopes[[f]])
  say(paste0("bipolar_slope_", f), c(t$estimate, t$conf.int, t$p.value))
  largest <- e[e$aperture == "f/5.6", ]
  for (kind in c("steps", "choice")) {
    t <- t.test(tapply(largest[[kind]], largest$participant_id, mean), mu = if (kind == "steps") 0 else 0.5)
    say(paste0(kind, "_largest_", f), c(t$estimate - if (kind == "steps") 0 else 0.5, t$p.value))
  }
  t <- t.test(sapply(split(e, e$participant_id), function(o) coef(lm(choice ~ aperture_mm, o))[[2]]))
  say(paste0("choice_slope_", f), c(t$estimate, t$conf.int, t$p.value))
}
t <- t.test(slopes$nearest, slopes$farthest, paired = TRUE)
say("bipolar_interaction", c(t$estimate, t$conf.int, t$p.value))

rows <- do.call(rbind, lapply(base::names(said), function(name)
  data.frame(name = name, place = seq_along(said[[name]]), value = sprintf("%.10g", unname(said[[name]])))))
write.csv(rows, "comparisons_reference.csv", row.names = FALSE, quote = FALSE)
writeLines(R.version.string, "comparisons_versions.txt")
