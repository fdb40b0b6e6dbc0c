d <- d[as.character(d$included) %in% c("True", "TRUE", "1"), ]
depth_effect <- function(d, fixation) {  # log ratio of the largest aperture to the pinhole: subjects x scenes
  e <- pooled(d[d$fixation == fixation, ]); largest <- max(e$aperture_mm)
  mean_at <- function(mm) {
    o <- e[e$aperture_mm == mm, ]
    of <- list(factor(o$participant_id, unique(d$participant_id)), factor(o$scene, scenes_of(e, d)))
    tapply(o$log_rating, of, mean)
  }
  if (largest > 0) mean_at(largest) - mean_at(0) else NA * mean_at(0)
}
depth_effects <- function(d) {  # of each object in focus
  known <- c("nearest", "farthest"); names <- unique(as.character(d$fixation))
  names <- c(intersect(known, names), sort(setdiff(names, known)))
  sapply(names, function(f) depth_effect(d, f), simplify = FALSE)
}
# include means
headline <- function(y) {
  found <- crossed(y)
  if (is.character(found)) return(found)
  c(found, ratio = exp(found[["mean"]]))
}
