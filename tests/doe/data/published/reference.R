# R's numbers for the published data of this folder: Rscript reference.R, in the folder; writes reference.json.
# Packages: rsm (surfaces, canonical analysis), MASS (Box-Cox), sandwich (HC3), FrF2 (aliases), jsonlite (output).

suppressMessages({library(rsm); library(MASS); library(sandwich); library(FrF2); library(jsonlite)})

read <- function(name) read.csv(paste0(name, ".csv"), comment.char = "#")

coefficients_of <- function(fit) {
  s <- summary(fit)
  s <- if (inherits(fit, "rsm")) summary.lm(fit)$coefficients else s$coefficients
  X <- model.matrix(fit)
  centered <- sweep(X, 2, colMeans(X))
  # Variance inflation: the variance of a coefficient over what its column alone would give it.
  vif <- diag(solve(crossprod(X))) * colSums(centered^2)
  list(names = rownames(s), estimate = s[, 1], se = s[, 2], t = s[, 3], p = s[, 4], vif = vif)
}

anova_of <- function(fit) {
  a <- as.data.frame(summary(fit)$lof)
  list(names = trimws(rownames(a)), df = a[[1]], sum_sq = a[[2]], mean_sq = a[[3]], F = a[[4]], p = a[[5]])
}

diagnostics_of <- function(fit) {
  class(fit) <- "lm"
  e <- residuals(fit); h <- hatvalues(fit)
  list(fitted = fitted(fit), leverage = h, studentized = rstandard(fit), deleted = rstudent(fit),
       cook = cooks.distance(fit), dffits = dffits(fit), press = sum((e / (1 - h))^2),
       r2 = summary(fit)$r.squared, r2_adjusted = summary(fit)$adj.r.squared, sigma = sigma(fit))
}

# The ridge path to full precision, from the fitted b and B: rsm's steepest() prints three decimals. Checked
# against it to those.
ridge_of <- function(fit, radii, descend = FALSE) {
  sign <- if (descend) -1 else 1
  b <- sign * fit$b; B <- sign * fit$B
  top <- max(eigen(B, symmetric = TRUE)$values)
  points <- t(sapply(radii, function(r) {
    gap <- function(g) sqrt(sum(solve(B - (top + g) * diag(length(b)), -b / 2)^2)) - r
    g <- uniroot(gap, c(1e-9, sqrt(sum(b^2)) / r + 1), tol = 1e-15, maxiter = 10000)$root
    for (i in 1:3) {  # Newton steps to the last digit
      x <- solve(B - (top + g) * diag(length(b)), -b / 2)
      slope <- sum(x * solve(B - (top + g) * diag(length(b)), x)) / sqrt(sum(x^2))
      g <- g - (sqrt(sum(x^2)) - r) / slope
    }
    solve(B - (top + g) * diag(length(b)), -b / 2)
  }))
  printed <- steepest(fit, dist = radii, descent = descend)
  stopifnot(max(abs(as.matrix(printed[, seq_along(b) + 1]) - points)) < 6e-4)
  list(radii = radii, points = points)
}

surface <- function(fit, radii = c(0.5, 1)) {
  c(list(coefficients = coefficients_of(fit), anova = anova_of(fit),
         stationary = unname(-solve(fit$B, fit$b) / 2), curvatures = eigen(fit$B, symmetric = TRUE)$values,
         ridge = ridge_of(fit, radii), valley = ridge_of(fit, radii, TRUE)), diagnostics_of(fit))
}

out <- list()

d <- coded.data(read("chemical"), x1 ~ (time - 85) / 5, x2 ~ (temperature - 175) / 5)
d$block <- factor(d$block); contrasts(d$block) <- contr.sum(2)
out$chemical <- surface(rsm(y ~ block + SO(x1, x2), data = d))

d <- coded.data(read("cakes"), x1 ~ (time - 35) / 2, x2 ~ (temperature - 350) / 10)
d$block <- factor(d$block); contrasts(d$block) <- contr.sum(2)
out$cakes <- surface(rsm(y ~ block + SO(x1, x2), data = d))

d <- coded.data(read("helicopter"), x1 ~ (area - 12.4) / 0.6, x2 ~ (ratio - 2.52) / 0.26,
                x3 ~ (width - 1.25) / 0.25, x4 ~ (length - 2) / 0.5)
d$block <- factor(d$block); contrasts(d$block) <- contr.sum(2)
out$helicopter <- surface(rsm(y ~ block + SO(x1, x2, x3, x4), data = d), c(0.5, 1, 2))

d <- read("cement"); d$block <- factor(d$block); contrasts(d$block) <- contr.sum(2)
out$cement <- surface(rsm(y ~ block + SO(A, B, C), data = d), c(0.5, 1, 1.5))

d <- coded.data(read("carbon_monoxide"), x1 ~ (ethanol - 0.2) / 0.1, x2 ~ ratio - 15)
out$carbon_monoxide <- surface(rsm(y ~ SO(x1, x2), data = d))

out$trebuchet <- surface(rsm(y ~ SO(A, B, C), data = read("trebuchet")), c(0.5, 1, 1.4))

d <- read("lathe"); fit <- rsm(y ~ SO(feed, speed), data = d); plain <- fit; class(plain) <- "lm"
out$lathe <- surface(fit)
out$lathe$hc3 <- sqrt(diag(vcovHC(plain, type = "HC3")))
bc <- boxcox(y ~ feed + speed + I(feed * speed) + I(feed^2) + I(speed^2), data = d, plotit = FALSE,
             lambda = seq(-1, 1, 1e-4))
inside <- bc$x[bc$y > max(bc$y) - qchisq(0.95, 1) / 2]
out$lathe$boxcox <- c(bc$x[which.max(bc$y)], min(inside), max(inside))  # on a grid of 1e-4

d <- read("etch"); fit <- lm(y ~ (A + B + C)^3, data = d)
out$etch <- c(list(coefficients = coefficients_of(fit)), diagnostics_of(fit))

lenth <- function(effects) {
  s0 <- 1.5 * median(abs(effects))
  1.5 * median(abs(effects)[abs(effects) < 2.5 * s0])
}
d <- read("reaction"); fit <- lm(y ~ A * B * C * D, data = d)
effects <- 2 * coef(fit)[-1]
out$reaction <- list(names = names(effects), effects = unname(effects), pseudo_error = lenth(effects))

d <- read("injection"); corner <- d[d$A != 0, ]; d$curvature <- as.numeric(d$A == 0)
fit <- lm(y ~ A + B + C + D + E + F + G + A:B + A:C + A:D + A:E + A:F + A:G + B:D, data = corner)
effects <- 2 * coef(fit)[-1]
structure <- aliases(lm(y ~ (A + B + C + D + E + F + G)^2, data = corner), code = TRUE, condense = FALSE)
main <- lm(y ~ A + B + C + D + E + F + G + curvature, data = d)
out$injection <- list(names = names(effects), effects = unname(effects), pseudo_error = lenth(effects),
                      coefficients = coefficients_of(main), anova = unclass(drop1(main, test = "F")[-1, ]))
out$injection$aliases <- sapply(structure$aliases, paste, collapse = " = ")

d <- read("fatigue"); fit <- lm(y ~ A + B + C + D + E + F + G, data = d)
out$fatigue <- c(list(coefficients = coefficients_of(fit)), diagnostics_of(fit))

d <- read("polvoron"); fit <- lm(y ~ -1 + x1 + x2 + x3 + x1:x2 + x1:x3 + x2:x3, data = d)
s <- summary(fit)$coefficients
out$polvoron <- list(names = rownames(s), estimate = s[, 1], se = s[, 2], t = s[, 3], p = s[, 4],
                     predicted = predict(fit, data.frame(x1 = 0.5, x2 = 0.3, x3 = 0.2), interval = "prediction")[1, ])

for (k in 4:7) {
  design <- as.data.frame(bbd(k, n0 = 0, randomize = FALSE))
  x <- apply(design[, paste0("x", 1:k)], 1, paste, collapse = " ")
  blocks <- if (is.null(design$Block)) rep("1", nrow(design)) else as.character(design$Block)
  out$box_behnken[[as.character(k)]] <- list(runs = unname(x), blocks = blocks)
}
for (alpha in c("rotatable", "orthogonal")) for (k in 2:5) {
  design <- ccd(k, n0 = c(3, 2), alpha = alpha, randomize = FALSE, inscribed = FALSE)
  out$composite_alpha[[alpha]][[as.character(k)]] <- max(as.matrix(as.data.frame(design)[, paste0("x", 1:k)]))
}
for (n in c(28, 36)) {
  x <- pb(n, nfactors = n - 1, randomize = FALSE, default.levels = c(-1, 1))
  x <- sapply(as.data.frame(x)[, 1:(n - 1)], function(v) as.numeric(as.character(v)))
  out$plackett_burman[[as.character(n)]] <- apply(x, 1, function(r) paste(ifelse(r > 0, "+", "-"), collapse = ""))
}
versions <- sapply(c("rsm", "MASS", "sandwich", "FrF2"), function(p) as.character(packageVersion(p)))
out$versions <- as.list(c(R = paste(R.version$major, R.version$minor, sep = "."), versions))
write(toJSON(out, digits = NA, auto_unbox = TRUE, pretty = 1), "reference.json")
