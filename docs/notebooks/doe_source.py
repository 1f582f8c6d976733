# %% [markdown]
# # A cake, from nine guesses to a recipe
#
# A bakery wants a cake that rises well, costs little time and does not dry out. Nine things might matter,
# an oven batch holds a handful of cakes, and every cake is an hour. This notebook goes the way that such
# an experiment goes: screen, look at what interacts, fit a surface in blocks, and choose a recipe with
# its uncertainty. Nothing here knows of grains or simulations: the cakes are drawn from a rule that the
# analysis does not see, so that each answer can be compared with the truth at the end.

# %%
import numpy as np
import pandas as pd

from doe import (
    Factor,
    Wish,
    add_center,
    alias_structure,
    box_cox,
    canonical,
    central_composite,
    design_quality,
    fit_surface,
    fractional_factorial,
    influence,
    most_desirable,
    plackett_burman,
    plots,
    power_table,
    ridge_path,
    screen,
    stationary_region,
    two_level_effects,
)

pd.set_option("display.width", 110)
pd.set_option("display.float_format", "{:.3f}".format)


def bake(settings: pd.DataFrame, seed: int, ovens: pd.Series | None = None) -> pd.DataFrame:
    """Return height [mm] and moisture [%] of cakes: the truth that the analysis does not see."""
    rng = np.random.default_rng(seed)
    t = (settings["oven"] - 172.0) / 12.0
    m = (settings["minutes"] - 36.0) / 6.0
    powder = (settings["powder"] - 8.5) / 3.0
    height = 62.0 - 5.0 * t**2 - 3.0 * m**2 - 4.0 * powder**2 + 2.5 * t * m - 1.5 * t * powder
    moisture = 31.0 - 3.0 * t - 4.0 * m + 0.8 * t * m
    if ovens is not None:
        height = height + ovens.map({1: 0.0, 2: -6.0, 3: -4.0}).to_numpy()
    noise = rng.normal(size=(2, len(settings)))
    return pd.DataFrame({"height": height + 0.8 * noise[0], "moisture": moisture + 0.5 * noise[1]})


# %% [markdown]
# ## Which of nine factors matter?
#
# A Plackett-Burman design tells main effects from 12 runs. It mixes interactions into them, by a third at
# most. Before baking, ask what such a design can find: with noise of about 0.8 mm, is an effect of 2 mm
# seen?

# %%
NAMES = {
    "oven": (150, 170, "degC"), "minutes": (26, 34, "min"), "powder": (4, 8, "g"), "eggs": (2, 3, ""),
    "butter": (90, 120, "g"), "sugar": (120, 160, "g"), "milk": (80, 110, "ml"), "rest": (0, 20, "min"),
    "whisk": (2, 6, "min"),
}  # fmt: skip
nine = [Factor(name, low, high, unit) for name, (low, high, unit) in NAMES.items()]
screening = plackett_burman(nine, seed=4)
print(screening)
print(*screening.notes, sep="\n")
print(power_table(screening, [2.0, 4.0], sd=0.8).head(3))

# %% [markdown]
# Only two dummy columns are left to test against, so that 2 mm would often be missed. Twenty runs leave
# ten.

# %%
screening = plackett_burman(nine, runs=20, seed=4)
print(power_table(screening, [2.0, 4.0], sd=0.8).head(3))

# %% [markdown]
# The cakes are baked in the drawn run order, and the heights come back in that order. A labelled Series
# is read by its labels, so that nothing has to be sorted.

# %%
sheet = screening.natural.loc[screening.run_order]
height = bake(sheet, seed=1)["height"]
screened = screen(screening, height)
print(screened.summary())

# %% [markdown]
# Oven, powder and minutes stand far ahead. Sugar and whisk pass 0.05 too, with effects of 2 mm and less,
# and the note says why that is not yet to be believed: an interaction of two strong factors falls onto
# other columns by up to 60 % of its size. The three go on, and the next design keeps their interactions
# apart.

# %%
figure = plots.pareto_chart(screened)

# %% [markdown]
# ## Do they interact, and does the middle lie on the plane?
#
# Three factors need eight corners. Center runs show whether a plane will do at all. The six other factors
# stay at their middles from now on.

# %%
three = [nine[0], nine[1], nine[2]]
corners = add_center(fractional_factorial(three, 8, seed=2), 4)
print(alias_structure(corners))
answer = bake(corners.natural, seed=2)
first = screen(corners, answer["height"], error="pure")
print(first.anova.round(3).to_string(na_rep=""))

# %% [markdown]
# The curvature is significant: no plane. Lenth's method needs no replicates and agrees on the effects.
# Oven and minutes interact by about 3 mm, which is what sugar and whisk had borrowed.

# %%
print(two_level_effects(corners, answer["height"]).table)

# %%
figure = plots.main_effects_plot(corners, answer["height"], "height [mm]")

# %% [markdown]
# ## A surface, in three ovens
#
# The surface needs more cakes than one oven holds, and ovens differ by millimetres. A central composite
# design in three orthogonal blocks keeps that difference out of the answer.

# %%
wider = [
    Factor("oven", 160, 180, "degC"), Factor("minutes", 30, 40, "min"), Factor("powder", 6, 11, "g"),
]  # fmt: skip
design = central_composite(wider, "blocks", center=2, blocks=3, seed=5)
print(design)
print(design_quality(design))
cakes = bake(design.natural, seed=3, ovens=design.blocks)
surface = fit_surface(design, cakes["height"])
print(surface.summary())

# %% [markdown]
# Without the blocks the same cakes say much less: the ovens' difference is counted as noise.

# %%
blind = fit_surface(type(design)(design.factors, design.coded), cakes["height"])
print(f"residual sd with blocks {surface.residual_ms**0.5:.2f}, without {blind.residual_ms**0.5:.2f} mm")

# %% [markdown]
# Is a run wrong, or the scale of the response? Neither.

# %%
remarks = influence(surface)["remark"]
print("remarks:", remarks[remarks != ""].to_dict() or "none")
print(box_cox(surface))

# %% [markdown]
# ## Where is the top, and how well is it known?

# %%
print(canonical(surface))
print(ridge_path(surface, [0.0, 0.5, 1.0])[["oven", "minutes", "powder", "mean", "se"]])
print(stationary_region(surface, extent=1.5).ranges)

# %%
figure = plots.contour_plot(
    surface, point=canonical(surface).stationary.natural, response_label="height [mm]"
)

# %% [markdown]
# ## High and moist, in a compromise
#
# Moisture falls with heat and time, so that the highest cake is too dry. Two wishes and their
# desirability find the recipe between them.

# %%
surfaces = {"height [mm]": surface, "moisture [%]": fit_surface(design, cakes["moisture"])}
wishes = {"height [mm]": Wish(48.0, 60.0), "moisture [%]": Wish(28.0, 36.0, target=33.0)}
best = most_desirable(surfaces, wishes)
print(best)

# %%
figure = plots.profile_plot(surfaces, best.natural, wishes)

# %% [markdown]
# Against the truth, which nobody at the bakery has: the recipe's height and moisture without noise, in
# the average oven.

# %%
recipe = best.natural.to_frame().T
many = recipe.loc[recipe.index.repeat(4000)].reset_index(drop=True)
truth = bake(many, seed=9).mean() + np.array([(-6.0 - 4.0) / 3.0, 0.0])
for (name, row), value in zip(best.responses.iterrows(), truth, strict=True):
    held = row["confidence_low"] <= value <= row["confidence_high"]
    print(f"{name}: predicted {row['mean']:.2f}, true {value:.2f}, inside the 95 % interval: {held}")
