# %% [markdown]
# # A campaign in Python
#
# `calibrate` goes from a study to a material, and hands back the result of every stage. This notebook
# calibrates glass beads: 200 spheres, two unknown frictions, small enough to run in a minute or two on two
# cores. Then it looks at the stages one by one, with the tables and figures of `doe`.

# %%
import tempfile
from pathlib import Path

import pandas as pd

from doe import plots
from experiments.api import calibrate

pd.set_option("display.width", 110)
pd.set_option("display.float_format", "{:.3f}".format)

STUDY = """
name = "beads"

[grain]
sphere = "2 mm"
density = "2500 kg/m^3"
shear_modulus = "30 MPa"
poisson_ratio = 0.25

[wall]
density = "7800 kg/m^3"
shear_modulus = "70 GPa"
poisson_ratio = 0.3

[contact.grain-grain]
restitution = 0.5

[contact.grain-wall]
restitution = 0.5
static_friction = 0.4
rolling_friction = 0.05

[scene.lifted-cylinder]
diameter = "28 mm"
height = "40 mm"
grain_count = 200

[numerics]
modulus_scale = 400.0

[target.twin]
truth = { mu = 0.4, mu_r = 0.12 }
replicates = 5

[[factor]]
name = "mu"
label = "friction"
parameter = "contact.grain-grain.static_friction"
low = 0.1
high = 0.8

[[factor]]
name = "mu_r"
label = "rolling friction"
parameter = "contact.grain-grain.rolling_friction"
low = 0.01
high = 0.3
"""

# %% [markdown]
# The target is a *twin*: five heaps simulated with frictions that the campaign does not see. So the answer
# can be compared with the truth. `on_stage` is called as each stage ends.

# %%
folder = Path(tempfile.mkdtemp())
(folder / "beads.toml").write_text(STUDY, encoding="utf-8")
done = calibrate(
    folder / "beads.toml",
    folder / "campaign",
    device="cpu",
    on_stage=lambda name, result: print(name, "ended"),
)
campaign = done.campaign
print(campaign.outcome)

# %% [markdown]
# ## Noise floor and target
#
# Heaps of one setting, and the heaps that are to be met.

# %%
floor = campaign.noise_floor.leading
low, high = floor.sd_interval
print(f"noise floor: {floor.mean:.2f} deg, sd {floor.sd:.2f} (95 % {low:.2f} to {high:.2f})")
target = campaign.target.leading
print(f"target: {target.mean:.2f} deg, sd {target.sd:.2f}, n {target.n}")

# %% [markdown]
# ## Which friction matters?

# %%
screened = campaign.screening.leading.screen
print(screened.summary())

# %%
figure = plots.pareto_chart(screened)

# %% [markdown]
# ## The surface, and everything that fits
#
# The white band is the compatible region: the settings that the target does not contradict at 95 %.

# %%
surface = campaign.surface.leading.reduced
print(surface.anova.round(3).to_string(na_rep=""))

# %%
region = campaign.optimum.region
chosen = pd.Series(campaign.optimum.settings)
figure = plots.contour_plot(surface, target.mean, chosen, region, response_label="repose angle [deg]")

# %%
print(region.ranges)
truth = campaign.optimum.truth
print(f"truth: compatible {truth.compatible}, inside the design {truth.inside_design}")

# %% [markdown]
# ## Do fresh heaps agree?

# %%
test = campaign.verification.leading
print(f"difference {test.difference:+.2f} deg, p = {test.p:.2f}")
print(f"equivalent within {test.margin:.2f} deg: {test.equivalent}")
