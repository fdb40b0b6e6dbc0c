# The test of the report: log odds of the time of the nonrigid reading (half of the mean duration of
# a report added to each reading), each gradient against none, over subjects. Base R only. Run in the report's folder:
# Rscript necker_headline.R
# In JASP the same: open necker_wide.csv (log odds), then T-Tests, Paired Samples T-Test, each condition with "none 0".
# include necker_odds
