"""Analysis beyond the fit: what the coefficients, the shape of the surface and single runs say."""
