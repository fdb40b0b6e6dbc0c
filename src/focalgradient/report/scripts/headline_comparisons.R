# The headline tests of the report: does the answer change with the aperture? A line on the aperture for
# each subject and scene (steps, places, or choices 0 and 1), its slope over subjects and scenes, both random
# (that of steps and places decides), and over subjects for these scenes (that of choices decides).
# Run in the report's folder: Rscript headline_comparisons.R (base R; tables with empty
# cells by lmerTest where it is installed, else by REML in base R)
# In JASP: open depth_rating_wide.csv, a row for each subject and a column for each condition; ANOVA,
# Repeated Measures ANOVA, over the apertures of one fixation; under contrasts choose polynomial, the linear one.
d <- read.csv("depth_rating_trials.csv", colClasses = c(participant_id = "character", scene = "character"))
d <- d[as.character(d$included) %in% c("True", "TRUE", "1"), ]; options(width = 200)
# include means
table_of <- function(e, what) {  # a row a subject, a column a scene
  of <- list(factor(e$participant_id, unique(d$participant_id)), factor(e$scene, scenes_of(e, d)))
  y <- sapply(levels(of[[2]]), function(k) sapply(levels(of[[1]]), function(s) what(e[of[[1]] == s & of[[2]] == k, ])))
  matrix(y, nlevels(of[[1]]), dimnames = lapply(of, levels))
}
slope <- function(all) function(o) {
  m <- tapply(o$rating, factor(o$aperture_mm, all), mean); w <- all - mean(all); used <- w != 0
  if (!any(used) || anyNA(m[used])) NA else sum(w[used] * m[used]) / sum(w^2)
}
slopes <- list(); largest <- list(); known <- c("nearest", "farthest"); choice <- all(d$rating %in% 0:1)
for (f in c(intersect(known, d$fixation), sort(setdiff(unique(d$fixation), known)))) {
  e <- pooled(d[d$fixation == f, ]); all <- sort(unique(e$aperture_mm)); slopes[[f]] <- table_of(e, slope(all))
  if (all(is.na(slopes[[f]]))) {  # no subject has a scene at all apertures: the slope of the means over scenes
    m <- aggregate(rating ~ participant_id + scene + aperture_mm, e, mean); m$scene <- "all scenes"
    slopes[[f]] <- table_of(m, slope(all))
  }
  largest[[f]] <- table_of(e[e$aperture_mm == max(all), ], function(o) if (nrow(o)) mean(o$rating) else NA) - choice / 2
}
if (length(slopes) > 1 && !choice) for (pair in combn(names(slopes), 2, simplify = FALSE))
  slopes[[paste(pair, collapse = " less ")]] <- less(slopes[[pair[1]]], slopes[[pair[2]]])
here <- function(y) {
  reason <- no_test(y); own <- own_means(y)
  if (is.null(reason)) student(mean(own), sd(own) / sqrt(length(own)), length(own) - 1) else reason
}
show <- function(title, tables, test) {
  found <- lapply(tables, test); found <- found[!sapply(found, is.character)]
  if (!length(found)) return(invisible())
  cat(title, "\n"); print(as.data.frame(do.call(rbind, found)), digits = 7)  # p is not corrected
}
