# %% [markdown]
# # The paper's experiment
#
# Four tri-axial accelerometers stand on the corners of a cube. The cube turns on a table, and no gyroscope is on
# board. This notebook simulates that run of 30 s, estimates the motion from the twelve channels alone, and compares
# it with the truth. Then it shows how far a position would drift.
#
# You need `pip install 'gfimu[sim,plot,tables]'`. All numbers below follow from the seed; change it and run again.

# %%
import numpy as np

import gfimu

# %% [markdown]
# ## 1. The array
#
# `cube12` is the array of the paper: chips at alternate corners of a cube of 0.1 m, sensing axes along the body's
# axes.

# %%
cube = gfimu.AccelerometerArray.load("cube12")
cube.plot()

# %% [markdown]
# Its figures of merit. The GDOP says how channel noise becomes errors of angular acceleration α and specific force p.
# No array inside this cube has a lower one.

# %%
score = gfimu.score(cube).best
assert abs(score.gdop - 1.0607) < 1e-4
score

# %% [markdown]
# ## 2. The run
#
# MuJoCo turns the table left and right at two speeds, with rests between. The chips are ADXL345 with the errors that
# their data sheet allows: biases, gains, axis errors, noise, rounding to 3.9 mg.

# %%
run = gfimu.simulate("paper_run", seed=1)
run

# %%
run.plot()

# %% [markdown]
# A step in the channels of axes 1 and 2 is the centripetal acceleration ω² r. The offsets are the biases. As a table:

# %%
run.to_pandas()[["t_s", "a11_m_s2", "a12_m_s2", "a13_m_s2", "tacho_rad_s"]].head()

# %% [markdown]
# ## 3. Motion from the channels
#
# `rest_bias=True` reads the biases off the first rest. `filter` integrates α and corrects ω by the centripetal terms:
# then ω does not drift.

# %%
estimate = gfimu.estimate(run, method="filter", rest_bias=True)
estimate.plot()

# %% [markdown]
# The simulation knows the truth. The error of ω about the table's axis, with the filter and with the paper's
# integration of α alone:

# %%
truth = run.extra["truth_omega_z_rad_s"]
integrated = gfimu.estimate(run, method="integrate", rest_bias=True)
late = run.t_s > 25.0
errors = {
    name: float(np.sqrt(np.nanmean((found.omega[late, 2] - truth[late]) ** 2)))
    for name, found in (("filter", estimate), ("integrate", integrated))
}
for name, error in errors.items():
    print(f"{name}: {error:.3f} rad/s rms over the last 5 s")
assert errors["filter"] < 0.1
assert errors["filter"] < 0.5 * errors["integrate"]

# %% [markdown]
# The filter also says how well it knows ω: the band of ±2σ in the picture, by the noise of the channels.

# %%
inside = np.abs(estimate.omega[late, 2] - truth[late]) < 2.0 * estimate.omega_std[late, 2]
print(f"{100 * inside.mean():.0f} % of the last 5 s are inside ±2σ")
assert inside.mean() > 0.8

# %% [markdown]
# ## 4. What a position would do
#
# Tilt by the integrated α turns gravity into acceleration, and the error grows with a high power of time. The budget
# below is that of perfectly calibrated ADXL345 (noise alone) after 30 s at rest. The Monte Carlo beside it simulates
# the same errors without linearisation.

# %%
drift = gfimu.drift(cube, duration=30.0, noise_ug=290.0, monte_carlo=200, seed=1)
drift

# %%
drift.plot()

# %%
first_order, simulated = drift.budget.total_std[0], drift.sample.std[-1, 0]
print(f"first order: {first_order:.0f} m, simulated: {simulated:.0f} m")
assert abs(simulated / first_order - 1.0) < 0.5

# %% [markdown]
# About a kilometre after half a minute. An array like this measures rates well; it does not replace a navigation-
# grade gyroscope. More: *Position drift* in the theory part of the documentation.
