# The headline tests of the report: does the answer change with the aperture? A line on the aperture for
# each subject and scene (steps, places, or choices 0 and 1), its slope over subjects and scenes, both random
# (that of steps and places decides), and over subjects for these scenes (that of choices decides).
# Run in the report's folder: Rscript headline_comparisons.R (base R; tables with empty
# cells by lmerTest where it is installed, else by REML in base R)
# In JASP: open depth_rating_wide.csv, a row for each subject and a column for each condition; ANOVA,
# Repeated Measures ANOVA, over the apertures of one fixation; under contrasts choose polynomial, the linear one.
d <- read.csv("depth_rating_trials.csv", colClasses = c(participant_id = "character", scene = "character"))
d <- d[as.character(d$included) %in% c("True", "TRUE", "1"), ]
# include means
slopes <- slopes_of(d, "rating")
answer <- function(o) if (nrow(o)) mean(o$rating) else NA
largest <- each_fixation(d, function(e) table_of(e[e$aperture_mm == max(e$aperture_mm), ], d, answer))
