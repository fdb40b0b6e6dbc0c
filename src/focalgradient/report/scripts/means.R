# include tests
cells_of <- function(y) {  # a row for each cell that has a value
  cells <- expand.grid(participant_id = rownames(y), scene = colnames(y), stringsAsFactors = FALSE)
  na.omit(cbind(cells, value = as.vector(y)))
}
by_lmertest <- function(y) {  # a table with empty cells, by REML
  cells <- cells_of(y)
  random <- c(if (max(table(cells$participant_id)) > 1) "(1 | participant_id)",
              if (max(table(cells$scene)) > 1) "(1 | scene)")
  model <- as.formula(paste("value ~ 1 +", paste(random, collapse = " + ")))
  found <- summary(suppressMessages(lmerTest::lmer(model, cells)))$coefficients[1, ]
  student(found[["Estimate"]], found[["Std. Error"]], found[["df"]])
}
by_reml <- function(y) {  # the same in base R: deviance in relative SDs, Satterthwaite by its Hessian
  at <- which(!is.na(y), arr.ind = TRUE); v <- y[at]; v <- v / sd(v); n <- length(v)
  same <- lapply(1:2, function(k) outer(at[, k], at[, k], "==") + 0)
  free <- which(sapply(1:2, function(k) max(table(at[, k]))) > 1)
  solved <- function(theta) {
    root <- chol(diag(n) + theta[1]^2 * same[[1]] + theta[2]^2 * same[[2]])
    one <- backsolve(root, rep(1, n), transpose = TRUE); w <- backsolve(root, v, transpose = TRUE)
    m <- sum(one * w) / sum(one^2)
    c(mean = m, information = sum(one^2), square = sum((w - m * one)^2), logdet = 2 * sum(log(diag(root))))
  }
  full <- function(some) { theta <- c(0, 0); theta[free] <- some; theta }
  profiled <- function(some) {  # by variances: by SDs, its slope at 0 is always 0
    s <- solved(full(sqrt(abs(some)))); (n - 1) * log(s[["square"]] / (n - 1)) + s[["logdet"]] + log(s[["information"]])
  }
  starts <- list(c(1, 1), c(.01, .01), c(.01, 3), c(3, .01), c(100, 10))
  minimum <- function(start) nlminb(start[free], profiled, lower = 0, upper = 1e6, control = list(rel.tol = 1e-13))
  fits <- lapply(starts, minimum)
  theta <- sqrt(full(fits[[which.min(sapply(fits, `[[`, "objective"))]]$par)); s <- solved(theta)
  point <- c(theta, sqrt(s[["square"]] / (n - 1)))
  deviance <- function(x) {
    s <- solved(x[1:2]); 2 * (n - 1) * log(x[3]) + s[["square"]] / x[3]^2 + s[["logdet"]] + log(s[["information"]])
  }
  variance <- function(x) x[3]^2 / solved(x[1:2])[["information"]]
  used <- c(free, 3); size <- 1e-3 * c(pmax(theta, 1), point[3])
  step <- function(k, h) replace(c(0, 0, 0), k, h * size[k])
  extrapolated <- function(difference) (4 * difference(1) - difference(2)) / 3  # Richardson
  gradient <- sapply(used, function(k)
    extrapolated(function(h) (variance(point + step(k, h)) - variance(point - step(k, h))) / (2 * h * size[k])))
  hessian <- outer(used, used, Vectorize(function(i, j) extrapolated(function(h)
    (deviance(point + step(i, h) + step(j, h)) - deviance(point + step(i, h) - step(j, h)) -
     deviance(point - step(i, h) + step(j, h)) + deviance(point - step(i, h) - step(j, h))) /
    (4 * h^2 * size[i] * size[j]))))
  e <- eigen(hessian, symmetric = TRUE); kept <- e$values > 1e-8 * max(e$values, 1)
  along <- as.vector(t(e$vectors[, kept, drop = FALSE]) %*% gradient)
  df <- 2 * variance(point)^2 / sum(2 * along^2 / e$values[kept]); unit <- sd(y[at])
  student(s[["mean"]] * unit, point[3] / sqrt(s[["information"]]) * unit, df)
}
less <- function(a, b) {  # differences within scenes; of the subjects' means where no scene has both
  y <- if (identical(colnames(a), colnames(b))) a - b
  if (is.null(y) || all(is.na(y)))
    y <- matrix(rowMeans(a, na.rm = TRUE) - rowMeans(b, na.rm = TRUE), dimnames = list(rownames(a), "all scenes"))
  y
}
pooled <- function(e) {  # without scenes where no subject has a scene at two apertures
  seen <- tapply(e$aperture_mm, list(e$participant_id, e$scene), function(mm) length(unique(mm)))
  if (max(seen, na.rm = TRUE) < 2 && length(unique(e$aperture_mm)) > 1) e$scene <- "all scenes"
  e
}
scenes_of <- function(e, d) if ("all scenes" %in% e$scene) "all scenes" else unique(d$scene)
own_means <- function(y) {  # of subjects; empty cells are filled by subject + scene where that is possible
  y <- y[rowSums(!is.na(y)) > 0, colSums(!is.na(y)) > 0, drop = FALSE]
  if (!anyNA(y)) return(rowMeans(y))
  line <- lm(value ~ participant_id + scene, cells_of(y))
  if (anyNA(coef(line))) return(rowMeans(y, na.rm = TRUE))
  of <- expand.grid(participant_id = rownames(y), scene = colnames(y), stringsAsFactors = FALSE)
  y[is.na(y)] <- predict(line, of)[is.na(y)]
  rowMeans(y)
}
over_subjects <- function(y) over_people(own_means(y))
crossed <- function(y) {  # the mean of a table of subjects by scenes, both random where there are FEWEST_SCENES scenes
  y <- y[rowSums(!is.na(y)) > 0, colSums(!is.na(y)) > 0, drop = FALSE]
  s <- nrow(y); n <- ncol(y); fixed <- over_subjects(y)
  if (is.character(fixed)) return(fixed)
  if (n >= FEWEST_SCENES && anyNA(y) && !(sum(!is.na(y)) == s && s == n))
    return(if (requireNamespace("lmerTest", quietly = TRUE)) by_lmertest(y) else by_reml(y))
  if (n < FEWEST_SCENES || anyNA(y)) return(fixed)
  r <- rowMeans(y); k <- colMeans(y); free <- (s - 1) * (n - 1)
  ms <- c(subjects = n * var(r), scenes = s * var(k), residual = sum((y - outer(r, k, "+") + mean(y))^2) / free)
  if (ms[["scenes"]] <= ms[["residual"]]) return(fixed)
  v <- sum(ms * c(1, 1, -1)); df <- max(v^2 / sum(ms^2 / c(s - 1, n - 1, free)), min(s, n) - 1)
  student(mean(y), sqrt(v / (s * n)), df)
}
fixations <- function(d) {
  known <- c("nearest", "farthest"); names <- unique(as.character(d$fixation))
  c(intersect(known, names), sort(setdiff(names, known)))
}
each_fixation <- function(d, what) sapply(fixations(d), function(f) what(pooled(d[d$fixation == f, ])), simplify = FALSE)
table_of <- function(e, d, what) {  # a row a subject, a column a scene
  of <- list(factor(e$participant_id, unique(d$participant_id)), factor(e$scene, scenes_of(e, d)))
  y <- sapply(levels(of[[2]]), function(k) sapply(levels(of[[1]]), function(s) what(e[of[[1]] == s & of[[2]] == k, ])))
  matrix(y, nlevels(of[[1]]), dimnames = lapply(of, levels))
}
slope <- function(all, answer) function(o) {  # on the apertures
  m <- tapply(o[[answer]], factor(o$aperture_mm, all), mean); w <- all - mean(all); used <- w != 0
  if (!any(used) || anyNA(m[used])) NA else sum(w[used] * m[used]) / sum(w^2)
}
slopes_of <- function(d, answer) each_fixation(d, function(e) {  # subjects x scenes
  all <- sort(unique(e$aperture_mm)); y <- table_of(e, d, slope(all, answer))
  if (!all(is.na(y))) return(y)  # no subject has a scene at all apertures: the slope of the means over scenes
  m <- aggregate(e[answer], e[c("participant_id", "scene", "aperture_mm")], mean); m$scene <- "all scenes"
  table_of(m, d, slope(all, answer))
})
differences <- function(of) {  # of each two fixations
  if (length(of) < 2) return(list())
  pairs <- combn(names(of), 2, simplify = FALSE)
  setNames(lapply(pairs, function(pair) less(of[[pair[1]]], of[[pair[2]]])), sapply(pairs, paste, collapse = " less "))
}
