# Tests beside those of the depth effect: confidence, factors of the design, and laboratory against browser. Base R
# (confidence with empty cells: lmerTest, where it is installed). Run in the report's folder: Rscript further_tests.R
d <- read.csv("depth_rating_trials.csv", colClasses = c(participant_id = "character", scene = "character"))
d <- d[as.logical(d$included), ]
# include means
# include factors
