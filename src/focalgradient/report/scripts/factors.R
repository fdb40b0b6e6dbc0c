mean_at <- function(answer, name, level) {  # of each person, over the apertures
  e <- d[at(d[[name]], level), ]
  rowMeans(tapply(e[[answer]], list(e$participant_id, e$aperture_mm), mean), na.rm = TRUE)
}
change_at <- function(answer, name, level) {  # of each person, largest less smallest aperture
  own <- function(mm) {
    e <- d[at(d[[name]], level) & d$aperture_mm == mm, ]
    tapply(e[[answer]], e$participant_id, mean)
  }
  large <- own(max(d$aperture_mm)); small <- own(min(d$aperture_mm)); both <- intersect(names(large), names(small))
  large[both] - small[both]
}
