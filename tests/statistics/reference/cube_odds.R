# Log odds of the nonrigid reading on the cube: each subject's own logistic regression of reports, bias-reduced (Firth),
# by brglm2; then a t test over subjects. Writes cube_odds_reference.csv. Run in this folder: Rscript cube_odds.R
# Debian: r-base-core r-cran-brglm2
suppressPackageStartupMessages(library(brglm2))
n <- read.csv("necker.csv", colClasses = c(participant_id = "character"))
n <- n[n$percept %in% c("rigid", "nonrigid"), ]
n$y <- as.numeric(n$percept == "nonrigid")
rows <- list()
for (g in c("rigid", "nonrigid")) {
  own <- sapply(split(n[n$gradient %in% c("none", g), ], n$participant_id[n$gradient %in% c("none", g)]), function(h)
    coef(glm(y ~ I(gradient == g), data = h, family = binomial, method = "brglm_fit",
             control = list(epsilon = 1e-12)))[[2]])
  test <- t.test(own)
  rows[[g]] <- data.frame(name = g, place = 1:4, value = sprintf("%.10g", c(mean(own), test$conf.int, test$p.value)))
}
write.csv(do.call(rbind, rows), "cube_odds_reference.csv", row.names = FALSE, quote = FALSE)
cat(R.version.string, "brglm2", as.character(packageVersion("brglm2")), "\n")
