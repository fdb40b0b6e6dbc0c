# Makes conditions.csv (14 subjects of two groups rate six scenes in two conditions; nobody is affected by any) and what R
# says of it (conditions_reference.csv: name, place, value): contrasts over scenes (lmerTest), levels of different scenes
# (min F' of Clark 1973), groups that lack scenes, and groups of unequal variance adjusted for age (HC2 and Bell and
# McCaffrey's degrees of freedom). Not needed to run the tests, which read those files.
#
#     cd tests/statistics/reference && Rscript conditions.R
#
# Debian: r-base-core r-cran-lmertest

suppressMessages(library(lmerTest))
said <- list()
say <- function(name, values) said[[name]] <<- values

set.seed(1973)
d <- expand.grid(condition = c("dim", "lit"), scene = letters[1:6], subject = sprintf("%02d", 1:14),
                 stringsAsFactors = FALSE)
p <- as.integer(d$subject); scene <- match(d$scene, letters)
d$group <- ifelse(p > 9, "old", "young"); d$age <- round(c(runif(9, 20, 40), runif(5, 35, 60)))[p]
d$log <- rnorm(14, 0, ifelse(1:14 > 9, 0.8, 0.2))[p] + rnorm(6, 0, 0.5)[scene] +
  rnorm(12, 0, 0.3)[2 * scene - (d$condition == "lit")] + rnorm(nrow(d), 0, 0.4)
d$rating <- round(exp(d$log), 4); d$log <- log(d$rating)
d$lost <- runif(nrow(d)) < 0.15 | (d$group == "old" & d$scene > "d" & runif(nrow(d)) < 0.5)
write.csv(d[names(d) != "log"], "conditions.csv", row.names = FALSE, quote = FALSE)

contrast <- function(d) {
  wide <- merge(d[d$condition == "lit", ], d[d$condition == "dim", ], by = c("subject", "scene"))
  wide$apart <- wide$log.x - wide$log.y
  coef(summary(lmer(apart ~ 1 + (1 | subject) + (1 | scene), wide, control = lmerControl(calc.derivs = TRUE))))[1, ]
}
say("contrast", contrast(d)[c("Estimate", "Std. Error", "df", "Pr(>|t|)")])
say("contrast_lost", contrast(d[!d$lost, ])[c("Estimate", "Std. Error", "df", "Pr(>|t|)")])

nested <- d[(d$scene < "d") == (d$condition == "dim"), ]  # each condition in three scenes
by_subject <- tapply(nested$log, nested[c("subject", "condition")], mean)
by_scene <- tapply(nested$log, nested[c("scene", "condition")], mean)
one <- t.test(by_subject[, "lit"], by_subject[, "dim"], paired = TRUE)
two <- t.test(na.omit(by_scene[, "lit"]), na.omit(by_scene[, "dim"]))
f <- c(one$statistic, two$statistic)^2; df <- c(one$parameter, two$parameter)
least <- prod(f) / sum(f); free <- sum(f)^2 / (f[1]^2 / df[2] + f[2]^2 / df[1])
say("different_scenes", c(one$estimate, least, free, pf(least, 1, free, lower.tail = FALSE)))
mixed <- lmer(log ~ condition + (0 + condition | subject) + (1 | scene), nested)
say("different_scenes_lmer", coef(summary(mixed))[2, c("Estimate", "Std. Error")])

of_groups <- function(d) {  # each subject's mean over all scenes, as if subjects and scenes add
  cells <- aggregate(log ~ subject + scene, d, mean)
  all <- expand.grid(subject = unique(d$subject), scene = unique(d$scene), stringsAsFactors = FALSE)
  all$log <- predict(lm(log ~ subject + scene, cells), all)
  tapply(all$log, all$subject, mean)
}
own <- of_groups(d[d$condition == "dim" & !d$lost, ])
who <- d[!duplicated(d$subject), ]; own <- own[who$subject]
t <- t.test(own[who$group == "old"], own[who$group == "young"])
say("groups_lost", c(t$estimate[[1]] - t$estimate[[2]], t$parameter, t$p.value))

own <- as.vector(tapply(d$log, d$subject, mean)[who$subject])
fit <- lm(own ~ I(who$group == "old") + who$age); x <- model.matrix(fit); h <- hatvalues(fit); bread <- solve(crossprod(x))
hc2 <- bread %*% crossprod(x * residuals(fit) / sqrt(1 - h)) %*% bread
for (k in 2:3) {
  g <- (diag(14) - x %*% bread %*% t(x)) %*% diag(as.vector(x %*% bread[, k]) / sqrt(1 - h))
  lambda <- eigen(crossprod(g), symmetric = TRUE, only.values = TRUE)$values  # Imbens and Kolesar 2016
  df <- sum(lambda)^2 / sum(lambda^2); t <- coef(fit)[[k]] / sqrt(hc2[k, k])
  say(c("", "group", "age")[k], c(coef(fit)[[k]], sqrt(hc2[k, k]), df, 2 * pt(-abs(t), df)))
}

rows <- do.call(rbind, lapply(base::names(said), function(name)
  data.frame(name = name, place = seq_along(said[[name]]), value = sprintf("%.10g", unname(said[[name]])))))
write.csv(rows, "conditions_reference.csv", row.names = FALSE, quote = FALSE)
