# Makes the data sets of this folder (depth_rating.csv, ordinal.csv, necker.csv) and what R says of them
# (reference.csv: name, value). Not needed to run the tests, which read those files.
#
#     cd tests/statistics/reference && Rscript reference.R
#
# Debian: r-base-core r-cran-ordinal r-cran-fitdistrplus

suppressPackageStartupMessages({library(ordinal)
                                library(fitdistrplus)})

said <- list()
say <- function(name, values) said[[name]] <<- values

# --- depth rating: eight subjects, two scenes, two repetitions, some trials lost -------------------------------------
set.seed(1987)
names <- c("pinhole", "f/22", "f/11", "f/5.6")
d <- expand.grid(participant_id = sprintf("%02d", 1:8), fixation = c("nearest", "farthest"), aperture = names,
                 scene = c("room", "terrain"), repetition = 1:2, stringsAsFactors = FALSE)
d$aperture_mm <- c(0, 2.27, 4.55, 8.93)[match(d$aperture, names)]
own <- as.integer(d$participant_id)
intercept <- rnorm(8, 0, 0.15)
near <- rnorm(8, 0.05, 0.03)
far <- rnorm(8, 0, 0.015)
d$rating <- round(exp(intercept[own] + ifelse(d$fixation == "nearest", near[own], far[own]) * d$aperture_mm +
                      0.1 * (d$scene == "terrain") + rnorm(nrow(d), 0, 0.18)), 3)
d <- d[sample(nrow(d)), ]
d <- d[order(d$participant_id), ]
d$trial <- ave(seq_len(nrow(d)), d$participant_id, FUN = seq_along)
d$response_time <- round(rgamma(nrow(d), 8, 4), 3)
d$catch <- FALSE
d$dropped_frames <- 0
d <- d[-c(3, 40, 77, 131, 200), ]
write.csv(d, "depth_rating.csv", row.names = FALSE, quote = FALSE)
d$y <- log(d$rating)

rise <- list()
for (f in c("nearest", "farthest")) {
  e <- d[d$fixation == f, ]
  # repetitions are averaged first, then scenes: a lost trial does not weigh on its scene
  m <- apply(tapply(e$y, list(e$participant_id, e$scene, e$aperture), mean), c(1, 3), mean)[, names]
  say(paste0("ratio_", f), exp(colMeans(m - m[, 1]))[-1])
  p <- apply(m[, -1] - m[, 1], 2, function(v) t.test(v)$p.value)
  say(paste0("pinhole_p_", f), p)
  say(paste0("pinhole_dz_", f), apply(m[, -1] - m[, 1], 2, function(v) mean(v) / sd(v)))
  v <- (m[, 4] - m[, 1])
  say(paste0("pinhole_interval_", f), exp(t.test(v)$conf.int))
  rise[[f]] <- v
  bound <- log(1.2); b <- mean(v); e <- sd(v) / sqrt(8)
  say(paste0("tost_", f), c(pt((b + bound) / e, 7, lower.tail = FALSE), pt((b - bound) / e, 7)))
}
n <- rise$nearest - rise$farthest
say("interaction", c(mean(n), t.test(n)$conf.int, t.test(n)$p.value, mean(n) / sd(n)))
say("holm", p.adjust(c(said$pinhole_p_nearest, said$pinhole_p_farthest), "holm"))

# Cousineau (2005) with Morey's (2008) correction, over the eight cells; half widths on the logarithm
cells <- tapply(d$y, list(d$participant_id, paste(d$fixation, d$aperture)), mean)
cells <- cells[, c(paste("nearest", names), paste("farthest", names))]
normed <- cells - rowMeans(cells) + mean(cells)
say("cell_means", exp(colMeans(cells)))
say("cousineau_morey", qt(0.975, 7) * apply(normed, 2, sd) * sqrt(8 / 7) / sqrt(8))

# --- an ordinal scale of five steps ------------------------------------------------------------------------------------
o <- d[d$fixation == "nearest", c("participant_id", "trial", "scene", "aperture", "aperture_mm", "fixation", "repetition")]
own <- as.integer(o$participant_id)
lean <- rnorm(8, 0, 0.8); tilt <- rnorm(8, 0.35, 0.25)
latent <- lean[own] + tilt[own] * o$aperture_mm + 0.4 * (o$scene == "terrain") + rlogis(nrow(o))
o$rating <- as.integer(cut(latent, c(-Inf, -0.5, 0.8, 2, 3.5, Inf)))
write.csv(o, "ordinal.csv", row.names = FALSE, quote = FALSE)
o$y <- factor(o$rating, ordered = TRUE)
one <- clmm(y ~ aperture_mm + scene + (1 | participant_id), o, nAGQ = 15)
say("clmm_intercept", c(coef(one)[["aperture_mm"]], sqrt(vcov(one)["aperture_mm", "aperture_mm"]), as.numeric(logLik(one))))
two <- clmm(y ~ aperture_mm + scene + (1 + aperture_mm | participant_id), o, control = clmm.control(gradTol = 1e-6))
say("clmm_slope_laplace", c(coef(two)[["aperture_mm"]], sqrt(vcov(two)["aperture_mm", "aperture_mm"]), as.numeric(logLik(two))))

# --- Necker cube: eight subjects, three gradients, two trials of 40 s each ------------------------------------------------
rows <- list(); k <- 0
bias <- rnorm(8, 0, 0.3)
for (i in 1:8) { trial <- 0; for (g in c("none", "rigid", "nonrigid")) for (r in 1:2) {
  trial <- trial + 1; now <- round(runif(1, 0.3, 1), 3); seen <- "rigid"
  while (now < 40) {
    mean <- if (seen == "rigid") 8 * exp(-0.7 * (g == "nonrigid") + bias[i]) else 3 * exp(0.6 * (g == "nonrigid") - 0.2 * (g == "rigid"))
    lasts <- max(0.05, round(rgamma(1, 3, 3 / mean), 3)); cut <- now + lasts >= 40
    k <- k + 1
    rows[[k]] <- data.frame(participant_id = sprintf("%02d", i), trial = trial, gradient = g, strength = if (g == "none") 0 else 10,
                            catch = FALSE, onset = now, duration = round(min(lasts, 40 - now), 3), percept = seen, censored = cut,
                            trial_duration = 40)
    now <- round(now + lasts, 3); seen <- if (seen == "rigid") "nonrigid" else "rigid"
    if (now < 40 && runif(1) < 0.15) {
      gap <- min(round(runif(1, 0.1, 0.8), 3), round(40 - now, 3)); k <- k + 1
      rows[[k]] <- data.frame(participant_id = sprintf("%02d", i), trial = trial, gradient = g, strength = if (g == "none") 0 else 10,
                              catch = FALSE, onset = now, duration = gap, percept = "none", censored = now + gap >= 40, trial_duration = 40)
      now <- round(now + gap, 3)
    }
  }
}}
n <- do.call(rbind, rows)
write.csv(n, "necker.csv", row.names = FALSE, quote = FALSE)
n$cell <- factor(n$gradient, levels = c("none", "rigid", "nonrigid"))

time <- sapply(levels(n$cell), function(g) sapply(split(n[n$cell == g, ], n$participant_id[n$cell == g]), function(h)
  c(sum(h$duration[h$percept == "nonrigid"]), sum(h$duration[h$percept == "rigid"]))), simplify = FALSE)
share <- sapply(time, function(m) m[1, ] / colSums(m))
say("share_nonrigid", colMeans(share))
whole <- sapply(time, function(m) m[1, ] / 80)
say("time_nonrigid", colMeans(whole))
half <- mean(n$duration[n$percept %in% c("rigid", "nonrigid")]) / 2
odds <- sapply(time, function(m) log((m[1, ] + half) / (m[2, ] + half)))
for (g in c("rigid", "nonrigid")) {
  v <- odds[, g] - odds[, "none"]
  say(paste0("odds_", g), c(mean(v), t.test(v)$conf.int, t.test(v)$p.value))
}
for (g in levels(n$cell)) for (p in c("rigid", "nonrigid")) {
  h <- n[n$cell == g & n$percept == p, ]
  c2 <- data.frame(left = h$duration, right = ifelse(h$censored, NA, h$duration))
  a <- fitdistcens(c2, "gamma", control = list(reltol = 1e-14)); l <- fitdistcens(c2, "lnorm", control = list(reltol = 1e-14))
  say(paste0("gamma_", g, "_", p), c(a$estimate[["shape"]], 1 / a$estimate[["rate"]], a$loglik))
  say(paste0("lognormal_", g, "_", p), c(l$estimate[["meanlog"]], l$estimate[["sdlog"]], l$loglik))
}

rows <- do.call(rbind, lapply(base::names(said), function(name)
  data.frame(name = name, place = seq_along(said[[name]]), value = sprintf("%.10g", unname(said[[name]])))))
write.csv(rows, "reference.csv", row.names = FALSE, quote = FALSE)
versions <- sapply(c("ordinal", "fitdistrplus"), function(p) as.character(packageVersion(p)))
writeLines(c(R.version.string, paste(base::names(versions), versions)), "versions.txt")
