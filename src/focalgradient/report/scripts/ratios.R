d <- d[as.character(d$included) %in% c("True", "TRUE", "1"), ]
# include means
log_ratio <- function(e, mm) {  # of an aperture to the pinhole: subjects x scenes
  mean_at <- function(mm) {
    o <- e[e$aperture_mm == mm, ]
    of <- list(factor(o$participant_id, unique(d$participant_id)), factor(o$scene, scenes_of(e, d)))
    tapply(o$log_rating, of, mean)
  }
  if (mm > 0) mean_at(mm) - mean_at(0) else NA * mean_at(0)
}
intermediate <- function(d) {  # log ratios of the apertures between the pinhole and the largest one
  of <- list()
  for (f in fixations(d)) {
    e <- pooled(d[d$fixation == f, ]); all <- sort(unique(e$aperture_mm))
    if (all[1] == 0 && length(all) > 2) for (mm in all[2:(length(all) - 1)])
      of[[paste0(f, ", ", e$aperture[e$aperture_mm == mm][1])]] <- log_ratio(e, mm)
  }
  of
}
equivalence <- function(found, bound) {  # two one-sided tests, 90 % interval
  if (is.character(found)) return(found)
  m <- found[["estimate"]]; error <- found[["standard_error"]]; df <- found[["df"]]; half <- qt(.95, df) * error
  c(estimate = m, low = m - half, high = m + half, p = max(pt(-(m + bound) / error, df), pt(-(bound - m) / error, df)))
}
