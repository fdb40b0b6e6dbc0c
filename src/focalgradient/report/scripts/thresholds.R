# Geometric mean thresholds and their ratios, as in the report, from the thresholds that psignifit fitted to each person.
# Base R. Run in the report's folder: Rscript thresholds.R
d <- read.csv("THRESHOLDS.csv", colClasses = c(participant = "character"))
if (is.null(d$condition) && !is.null(d$enough.of.them)) d <- d[d$enough.of.them == "yes", ]  # with exclusions
d$log <- log(d[[grep("^threshold", names(d))[1]]]); d <- d[!is.na(d$log), ]
d$condition <- if (is.null(d$condition)) rep("", nrow(d)) else ifelse(is.na(d$condition), "", as.character(d$condition))
# include tests
of <- function(condition) {  # of each person, averaged over sessions
  own <- d[d$condition == condition, ]; tapply(own$log, own$participant, mean)
}
