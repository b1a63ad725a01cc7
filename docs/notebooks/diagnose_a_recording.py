# %% [markdown]
# # Diagnose a recording
#
# A simulation of your rig and a recording of it do not agree. What is wrong, how sure is that, and what is it worth
# to repair the simulation? This notebook hides two errors in a simulated rig, and lets `gfimu` find them by the
# recording.
#
# With data of your own, replace the next cell by `run = gfimu.open_recording("run.parquet")`, or give a pandas table:
# `run = gfimu.Recording.from_table(table, array="cube12")`.

# %%
import gfimu

HIDDEN = {
    ("table_tilt", "x_rad"): 0.004,  # the table's axis leans by 0.23° and 0.11°
    ("table_tilt", "y_rad"): -0.002,
    ("eccentricity", "x_m"): 0.001,  # the cube stands 1.1 mm off the axis
    ("eccentricity", "y_m"): 0.0005,
}
effects = (
    "effect=["
    '{name="table_tilt", parameters={x_rad=0.004, y_rad=-0.002}},'
    '{name="eccentricity", parameters={x_m=0.001, y_m=0.0005}}]'
)
run = gfimu.simulate("paper_run", seed=7, changes=[effects, "sensor.errors=false"])
run

# %% [markdown]
# ## 1. What can this motion show?
#
# Before any fit: the detectability d′ of each effect of usual size, in standard deviations. What is below about 5
# can't be seen in this run.

# %%
check = gfimu.check(run, twin="cube12_turntable")
check.plot()

# %% [markdown]
# ## 2. The diagnosis
#
# The twin `cube12_turntable` is the simulation: a level table with the cube on its axis. The tachometer drives it.

# %%
found = gfimu.diagnose(run, twin="cube12_turntable")
found

# %% [markdown]
# The verdict names both effects and nothing else. Each size is right within three standard deviations.

# %%
assert found.verdict == "explained"
assert {cause.effect for cause in found.causes} == {"table_tilt", "eccentricity"}
table = found.to_pandas().set_index(["effect", "parameter"])
table["hidden"] = HIDDEN
table["error / σ"] = (table["value"] - table["hidden"]) / table["std"]
assert (table["error / σ"].abs() < 3.0).all()
table[["hidden", "value", "std", "error / σ"]]

# %%
found.plot()

# %% [markdown]
# ## 3. What is it worth?
#
# The gain is measured on blocks of the recording that the fit did not see. Of the error beyond the sensors' noise,
# this share is gone:

# %%
gain = found.gain
print(f"{100 * gain.share_of_excess_removed:.1f} % ± {100 * gain.share_std:.1f} %")
print(f"position drift of the unseen stretch: {gain.drift_before:.2f} m before, {gain.drift_after:.2f} m after")
assert gain.share_of_excess_removed > 0.95

# %% [markdown]
# ## 4. The repaired simulation
#
# The extended twin is a simulation again. Against a second recording of the same rig, with other noise, it leaves
# nothing to explain.

# %%
again = gfimu.simulate("paper_run", seed=8, changes=[effects, "sensor.errors=false"])
second = gfimu.diagnose(again, twin=found.twin)
print(second.verdict.replace("_", " "))
assert second.verdict == "nothing_found"

# %% [markdown]
# For people who were not here, `gfimu.write_report(found, "diagnosis")` writes a folder with the verdict, the twin, a
# report that needs no network, and a rerun recording of the rig. `gfimu.view(found)` opens the latter.
