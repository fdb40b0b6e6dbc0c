# Laboratory against browser, as in the report: log odds of the nonrigid reading over the conditions, and their change
# from the gradient for the rigid reading to that for the nonrigid one. Base R. Run in the report's folder:
# Rscript necker_places.R
# include necker_odds
cells <- expand.grid(participant_id = rownames(odds), condition = colnames(odds), stringsAsFactors = FALSE)
cells$log_odds <- as.vector(odds)
sign <- c(rigid = -1, none = 0, nonrigid = 1)[sub(" .*", "", cells$condition)]
cells$aperture_mm <- sign * as.numeric(sub(".* ", "", cells$condition))
cells$place <- tapply(as.character(d$place), d$participant_id, function(own) own[1])[cells$participant_id]
d <- cells[!is.na(cells$log_odds), ]
# include factors
