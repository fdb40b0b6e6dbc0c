# The test of the report: log odds of the time of the nonrigid reading (half of the mean duration of
# a report added to each reading), each gradient against none, over subjects. Base R only. Run in the report's folder:
# Rscript necker_headline.R
# In JASP the same: open necker_wide.csv (log odds), then T-Tests, Paired Samples T-Test, each condition with "none 0".
d <- read.csv("necker_reports.csv", colClasses = c(participant_id = "character"))
d <- d[as.character(d$included) %in% c("True", "TRUE", "1"), ]
d$condition <- paste(d$gradient, d$strength)
time <- function(of) tapply(ifelse(d$percept == of, d$duration, 0), list(d$participant_id, d$condition), sum)
half <- mean(d$duration[d$percept %in% c("rigid", "nonrigid")]) / 2
odds <- log((time("nonrigid") + half) / (time("rigid") + half))
odds[time("nonrigid") + time("rigid") == 0] <- NA
# include tests
