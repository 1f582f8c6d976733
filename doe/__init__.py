"""Designs of experiments and their analysis.

In the order of an experiment:

factors         Factor, Category
screening       plackett_burman, definitive_screening, full_factorial, fractional_factorial
surfaces        central_composite, box_behnken, optimal_design
simulations     latin_hypercube, sobol
mixtures        simplex_lattice, simplex_centroid
more runs       foldover, add_center, add_axial, join
before it runs  alias_structure, design_quality, power_table, detectable_effect, effect_power
screened        screen, two_level_effects, steepest_path, climb_table
fitted          fit_surface, fit_formula, fit_mixture; influence, box_cox, robust_coefficients
best settings   canonical, ridge_path, stationary_region, maximize, minimize, most_desirable
compared        compare_means, agreement, noise_floor, joint_fit, ProfileSample
carried over    transfer, transfer_points, spread_points

``doe.plots`` draws them.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
