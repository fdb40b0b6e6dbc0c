# Makes crossed.csv (depth ratings by ten subjects of twelve scenes, both of which differ in their rise) and what R's
# lmerTest gives for them with subjects and scenes crossed as random effects (crossed_reference.csv: name, value). Not
# needed to run the tests, which read those files.
#
#     cd tests/statistics/reference && Rscript crossed.R
#
# Debian: r-base-core r-cran-lme4 r-cran-lmertest

suppressPackageStartupMessages(library(lmerTest))

said <- list()
say <- function(name, values) said[[name]] <<- values

set.seed(14)
names <- c("pinhole", "f/22", "f/11", "f/5.6")
d <- expand.grid(participant_id = sprintf("%02d", 1:10), scene = sprintf("scene-%02d", 1:12), aperture = names,
                 fixation = c("nearest", "farthest"), repetition = 1:2, stringsAsFactors = FALSE)
d$aperture_mm <- c(0, 2.27, 4.55, 8.93)[match(d$aperture, names)]
share <- 1 - exp(-d$aperture_mm / 4)  # a curve that saturates
own <- as.integer(d$participant_id); of <- match(d$scene, unique(d$scene))
near <- rnorm(10, 0.25, 0.2); far <- rnorm(10, 0, 0.2); tilt <- rnorm(12, 0, 0.15); lean <- rnorm(12, 0, 0.15)
level <- matrix(rnorm(120, 0, 0.1), 10)
d$rating <- round(exp(level[cbind(own, of)] + share * ifelse(d$fixation == "nearest", near[own] + tilt[of], far[own] + lean[of]) +
                      rnorm(nrow(d), 0, 0.2)), 4)
d <- d[sample(nrow(d)), ]
d <- d[order(d$participant_id), ]
d$trial <- ave(seq_len(nrow(d)), d$participant_id, FUN = seq_along)
d$catch <- FALSE
write.csv(d, "crossed.csv", row.names = FALSE, quote = FALSE)
d$y <- log(d$rating)

control <- lmerControl(optimizer = "bobyqa", optCtrl = list(rhoend = 1e-10))
crossed <- function(name, cells) {
  fit <- lmer(value ~ 1 + (1 | participant_id) + (1 | scene), cells, control = control)
  stopifnot(!isSingular(fit))
  row <- summary(fit)$coefficients[1, ]
  sd <- as.data.frame(VarCorr(fit))$sdcor[match(c("participant_id", "scene", "Residual"), as.data.frame(VarCorr(fit))$grp)]
  say(name, c(row, confint(fit, method = "Wald", oldNames = FALSE)["(Intercept)", ], sd))
}
wide <- function(e) {
  m <- tapply(e$y, list(e$participant_id, e$scene, e$aperture_mm), mean)
  grid <- expand.grid(participant_id = dimnames(m)[[1]], scene = dimnames(m)[[2]])
  list(m = m, grid = grid)
}
rises <- list()
for (f in c("nearest", "farthest")) {
  w <- wide(d[d$fixation == f, ])
  rises[[f]] <- cells <- cbind(w$grid, value = as.vector(w$m[, , 4] - w$m[, , 1]))
  crossed(paste0("rise_", f), cells)
  x <- c(0, 2.27, 4.55, 8.93)
  slope <- apply(w$m, c(1, 2), function(y) coef(lm(y ~ x))[[2]])
  crossed(paste0("slope_", f), cbind(w$grid, value = as.vector(slope)))
  own <- tapply(cells$value, cells$participant_id, mean)
  say(paste0("these_", f), c(t.test(own)$estimate, t.test(own)$conf.int, t.test(own)$p.value))
}
both <- merge(rises$nearest, rises$farthest, by = c("participant_id", "scene"))
both$value <- both$value.x - both$value.y
crossed("interaction", both)

# a sixth of the cells lost
lost <- rises$nearest[-seq(3, 120, 6), ]
write.csv(lost, "crossed_lost.csv", row.names = FALSE, quote = FALSE)
crossed("lost", lost)

rows <- do.call(rbind, lapply(base::names(said), function(name)
  data.frame(name = name, place = seq_along(said[[name]]), value = sprintf("%.10g", unname(said[[name]])))))
write.csv(rows, "crossed_reference.csv", row.names = FALSE, quote = FALSE)
versions <- sapply(c("lme4", "lmerTest"), function(p) as.character(packageVersion(p)))
writeLines(c(R.version.string, paste(base::names(versions), versions)), "crossed_versions.txt")
