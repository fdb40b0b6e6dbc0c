# The same for JASP. By its menus: open depth_rating_wide.csv, a row for each subject and scene; Mixed Models,
# Linear Mixed Models; dependent variable nearest, farthest or difference (log ratios); random grouping factors
# participant_id and scene; no fixed effect but the intercept; degrees of freedom by Satterthwaite. Where the scene is
# "all scenes", no scene was rated at both apertures (or with both objects in focus): T-Tests, One Sample T-Test, of
# that column. By its R console: open depth_rating_trials.csv, then run this on `data`; base R only.
d <- data
d$participant_id <- as.character(d$participant_id); d$scene <- as.character(d$scene)
# include ratios
by_lmer <- function(y) NULL
