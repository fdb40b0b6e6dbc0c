d <- read.csv("necker_reports.csv", colClasses = c(participant_id = "character"))
d <- d[as.character(d$included) %in% c("True", "TRUE", "1"), ]
d$condition <- paste(d$gradient, d$strength)
time <- function(of) tapply(ifelse(d$percept == of, d$duration, 0), list(d$participant_id, d$condition), sum)
half <- mean(d$duration[d$percept %in% c("rigid", "nonrigid")]) / 2
odds <- log((time("nonrigid") + half) / (time("rigid") + half))
odds[time("nonrigid") + time("rigid") == 0] <- NA
# include tests
