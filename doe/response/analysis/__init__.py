"""Analysis beyond the fit: the shape of the surface, its best settings, diagnostics, formulas."""
