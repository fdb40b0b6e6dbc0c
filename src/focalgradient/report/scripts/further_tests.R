# Tests beside those of the depth effect: confidence, factors of the design, and laboratory against browser. Base R
# (confidence with empty cells: lmerTest, where it is installed). Run in the report's folder: Rscript further_tests.R
d <- read.csv("depth_rating_trials.csv", colClasses = c(participant_id = "character", scene = "character"))
d <- d[as.logical(d$included), ]
# include means
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
