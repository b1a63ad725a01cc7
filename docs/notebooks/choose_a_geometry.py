# %% [markdown]
# # Choose a geometry
#
# You want to build an array of accelerometers. Where do the chips go, how many, and what do tolerances cost? This
# notebook compares arrays, searches for one in a volume of your own, and budgets what machining does to it.

# %%
import numpy as np

import gfimu

# %% [markdown]
# ## 1. Arrays that come with gfimu
#
# Rank by GDOP: the standard deviations of α and p together, for channels of unit noise. The condition number κ alone
# misleads, as the remark says. *GDOP joint* is the price where ω is not known.

# %%
scores = gfimu.score()
scores

# %%
scores.plot()

# %% [markdown]
# Eight chips at all corners have √2 less error by noise than four at alternate corners.

# %%
four, eight = gfimu.score(["cube12", "corners8"]).rigid
assert abs(four.gdop / eight.gdop - np.sqrt(2.0)) < 1e-6
print(f"GDOP {four.gdop:.4f} with four chips, {eight.gdop:.4f} with eight")

# %% [markdown]
# ## 2. The best array in a volume of your own
#
# A flat box, 120 × 120 × 40 mm, four tri-axial chips. The search starts from many random arrays; how many of them end
# at the same figure says how sure the result is. The certificate is a proven lower bound.

# %%
found = gfimu.optimize(4, box_m=(0.12, 0.12, 0.04), restarts=10, seed=1)
assert found.agreeing > 1
assert found.value >= found.gdop_lower_bound - 1e-9
found

# %%
found.array.plot()

# %% [markdown]
# ## 3. How well does it see a rate?
#
# The Cramér–Rao bound of one sample at 5 rad/s about z, for the noise of an ADXL345 at 100 Hz, against the edge of a
# cube. Twice the edge halves the standard deviation.

# %%
cube = gfimu.AccelerometerArray.load("cube12")
bounds = {}
for edge_m in (0.05, 0.1, 0.2):
    scaled = cube.with_geometry(cube.chip_positions * (edge_m / 0.1), [chip.axes for chip in cube.chips])
    bounds[edge_m] = gfimu.score(scaled, speed_rad_s=5.0).best.rate_bound_rad_s
    print(f"edge {1e3 * edge_m:.0f} mm: σ of ω along z {bounds[edge_m][2]:.4f} rad/s")
assert np.isclose(bounds[0.05][2], 2.0 * bounds[0.1][2], rtol=1e-6)

# %% [markdown]
# ## 4. What tolerances do
#
# Chips are placed to ±0.2 mm and turned by up to ±0.5°. Errors of α, ω and position, rms over units, by cause, before
# and after calibration:

# %%
budget = gfimu.tolerance(cube, closed_form=True)
budget.plot()

# %% [markdown]
# Before calibration the biases dominate everything. After a calibration from poses and a rest before the run, cross-
# axis sensitivity and angles limit ω: of both, poses in the hand do not show the rotation that all chips share.
# Placement to 0.2 mm is good enough.

# %%
table = budget.to_pandas()
calibrated = table[(table["calibration"] == "poses+rest") & (table["quantity"] == "omega")].set_index("cause")
assert calibrated.loc["placement", "share"] < 0.1 < calibrated.loc["angles", "share"]
calibrated[["rms", "unit", "share"]].sort_values("share", ascending=False)
