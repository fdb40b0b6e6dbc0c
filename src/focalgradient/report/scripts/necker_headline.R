# The headline test of the report: log odds of the time of the nonrigid reading (half of the mean duration of
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
tested <- unique(d[d$gradient != "none", c("gradient", "strength")])
tested <- tested[order(tested$gradient, -tested$strength), ]  # the primary one first
tested <- paste(tested$gradient, tested$strength)
found <- do.call(rbind, lapply(tested, function(name) {
  change <- na.omit(odds[, name] - odds[, "none 0"])
  if (length(change) < 2 || sd(change) < 1e-12) return(NULL)  # no test
  t <- t.test(change)
  data.frame(condition = name, change = mean(change), low = t$conf.int[1], high = t$conf.int[2], t = t$statistic,
             df = t$parameter, p = t$p.value)
}))
others <- found$condition != tested[1]; found$p_holm <- NA  # the primary p is not corrected
found$p_holm[others] <- p.adjust(found$p[others], "holm")
print(found, row.names = FALSE, digits = 6)
