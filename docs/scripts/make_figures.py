"""Draw the figures of the documentation: the paper's experiment (its figures 6 to 11) and the drift model.

Run ``python docs/scripts/make_figures.py [FOLDER]``; the folder is ``docs/figures`` unless given.
"""

from __future__ import annotations

import sys
from dataclasses import dataclass, replace
from pathlib import Path

import matplotlib as mpl

mpl.use("Agg")

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.figure import Figure

from gfimu import AccelerometerArray, Recording
from gfimu.base.units import STANDARD_GRAVITY
from gfimu.budget.drift import TILT_LIMIT, ErrorSources, drift_budget, equivalent_rate_drift
from gfimu.budget.drift.monte_carlo import monte_carlo_drift
from gfimu.motion.attitude import to_rotation
from gfimu.motion.estimate import Estimate
from gfimu.motion.navigation import navigate
from gfimu.motion.rest_bias import estimate_from_rest
from sim.effects import make_effect
from sim.scenarios import Scenario
from sim.simulation import simulate

SEED = 0
TILT = {"x_rad": 0.015, "y_rad": -0.010}
GREY, ORANGE, BLUE, VIOLET = "#7f7f7f", "#d95f02", "#1f9bcf", "#7b5fc0"
AXES = ("#d62728", "#2ca02c", "#1f77b4")
RUNS = 200

plt.style.use(Path(__file__).with_name("figures.mplstyle"))


@dataclass(frozen=True)
class Experiment:
    """The paper's run, simulated on a table that is not level, and what the package makes of it."""

    recording: Recording
    estimate: Estimate
    on_table: np.ndarray  # (n, 3) position with the attitude held to a turn about the vertical, m

    @classmethod
    def run(cls) -> Experiment:
        scenario = Scenario.load("paper_run")
        tilt = make_effect("table_tilt", TILT)
        recording = simulate(replace(scenario, effects=(tilt,)), seed=SEED)
        estimate = estimate_from_rest(recording, scenario.array, with_position=True)
        half = 0.5 * estimate.angle
        upright = np.column_stack([np.cos(half), np.zeros((len(half), 2)), np.sin(half)])
        on_table = navigate(recording.t_s, estimate.p, upright).position
        return cls(recording, estimate, on_table)

    def truth(self, quantity: str, unit: str) -> np.ndarray:
        return np.column_stack([self.recording.extra[f"truth_{quantity}_{axis}_{unit}"] for axis in "xyz"])


def main(folder: Path) -> list[Path]:
    """Draw every figure into a folder; returns the paths."""
    folder.mkdir(parents=True, exist_ok=True)
    experiment = Experiment.run()
    figures = {
        "paper_06_raw_data": raw_data(experiment),
        "paper_07_specific_force": specific_force(experiment),
        "paper_08_angular_acceleration": angular_acceleration(experiment),
        "paper_09_angular_rate": angular_rate(experiment),
        "paper_10_table_angle": table_angle(experiment),
        "paper_11_position_error": position_error(experiment),
        "drift": drift(),
    }
    paths = []
    for name, figure in figures.items():
        path = folder / f"{name}.png"
        figure.savefig(path, metadata={"Software": None})
        plt.close(figure)
        paths.append(path)
    return paths


def raw_data(experiment: Experiment) -> Figure:
    """Draw the paper's figure 6: the twelve channels, one panel per chip."""
    figure, panels = plt.subplots(4, 1, figsize=(7, 6.4), sharex=True, sharey=True, layout="constrained")
    for chip, panel in enumerate(panels):
        for axis in range(3):
            channel = 3 * chip + axis
            panel.plot(
                experiment.recording.t_s,
                experiment.recording.readings[:, channel],
                color=AXES[axis],
                linewidth=0.5,
                label=experiment.recording.channels[channel],
            )
        panel.legend(loc="center right", ncols=3)
        panel.set_ylabel(f"chip {chip + 1}, m/s²")
    panels[-1].set_xlabel("t, s")
    figure.suptitle("Readings of the twelve axes")
    return figure


def specific_force(experiment: Experiment) -> Figure:
    """Draw the paper's figure 7: the specific force of the cube's centre."""
    figure, panels = plt.subplots(3, 1, figsize=(7, 4.8), sharex=True, layout="constrained")
    truth = experiment.truth("p", "m_s2")
    for axis, panel in enumerate(panels):
        panel.plot(experiment.recording.t_s, experiment.estimate.p[:, axis], color=ORANGE, linewidth=0.5)
        panel.plot(experiment.recording.t_s, truth[:, axis], color=GREY)
        panel.set_ylabel(f"p_{'xyz'[axis]}, m/s²")
    panels[0].legend(["estimate", "truth"], loc="upper center", ncols=2)
    panels[0].set_ylim(top=0.3)
    panels[-1].set_xlabel("t, s")
    figure.suptitle("Specific force of the cube's centre, body axes")
    return figure


def angular_acceleration(experiment: Experiment) -> Figure:
    """Draw the paper's figure 8: the angular acceleration about z."""
    figure, panel = plt.subplots(figsize=(7, 2.6), layout="constrained")
    panel.plot(experiment.recording.t_s, experiment.estimate.alpha[:, 2], color=ORANGE, linewidth=0.5, label="estimate")
    panel.plot(experiment.recording.t_s, experiment.truth("alpha", "rad_s2")[:, 2], color=GREY, label="truth")
    panel.set(xlabel="t, s", ylabel="α_z, rad/s²", title="Angular acceleration about the table's axis")
    panel.legend(loc="lower right", ncols=2)
    return figure


def angular_rate(experiment: Experiment) -> Figure:
    """Draw the paper's figure 9: the rate about z beside tachometer and command."""
    figure, (panel, error) = plt.subplots(
        2, 1, figsize=(7, 4.4), sharex=True, layout="constrained", height_ratios=[2, 1]
    )
    t, reference = experiment.recording.t_s, experiment.recording.reference
    panel.plot(t, reference["tacho_rad_s"], color=BLUE, linestyle=":", linewidth=2.0, label="tachometer")
    panel.plot(t, reference["command_rad_s"], color=VIOLET, linestyle="--", label="command")
    panel.plot(t, experiment.estimate.omega[:, 2], color=ORANGE, label="gyro-free IMU")
    panel.set(ylabel="ω_z, rad/s", title="Angular rate by Runge–Kutta integration")
    panel.legend(loc="upper right")
    std = experiment.estimate.omega_std[:, 2]
    error.fill_between(t, -2 * std, 2 * std, color=ORANGE, alpha=0.2, linewidth=0, label="±2σ stated")
    difference = experiment.estimate.omega[:, 2] - experiment.truth("omega", "rad_s")[:, 2]
    error.plot(t, difference, color=ORANGE, label="error")
    error.set(xlabel="t, s", ylabel="error, rad/s")
    error.legend(loc="upper left", ncols=2)
    return figure


def table_angle(experiment: Experiment) -> Figure:
    """Draw the paper's figure 10: the table angle."""
    figure, panel = plt.subplots(figsize=(7, 2.6), layout="constrained")
    panel.plot(
        experiment.recording.t_s, experiment.recording.reference["angle_rad"], color=BLUE, linestyle=":", linewidth=2.0
    )
    panel.plot(experiment.recording.t_s, experiment.estimate.angle, color=ORANGE)
    panel.legend(["encoder", "gyro-free IMU"])
    panel.set(xlabel="t, s", ylabel="θ, rad", title="Table angle, the rate integrated again")
    return figure


def position_error(experiment: Experiment) -> Figure:
    """Draw the paper's figure 11: the position error of strapdown navigation."""
    figure, (free, held) = plt.subplots(1, 2, figsize=(7, 2.9), layout="constrained")
    truth = experiment.truth("position", "m")
    t = experiment.recording.t_s
    assert experiment.estimate.position is not None
    for panel, position, title in (
        (free, experiment.estimate.position, "attitude from α in three axes"),
        (held, experiment.on_table, "attitude held to a turn about the vertical"),
    ):
        for axis in range(3):
            panel.plot(t, position[:, axis] - (truth[:, axis] - truth[0, axis]), color=AXES[axis], label="xyz"[axis])
        panel.set(xlabel="t, s", ylabel="position error, m", title=title)
        panel.legend()
    return figure


def drift() -> Figure:
    """Draw the drift model beside the Monte Carlo: at rest and turning."""
    array = AccelerometerArray.load("cube12")
    sources = ErrorSources(bias=1e-3 * STANDARD_GRAVITY, noise_density=290e-6 * STANDARD_GRAVITY)
    figure, panels = plt.subplots(1, 2, figsize=(7, 3.4), sharey=True, layout="constrained")
    for panel, rate in zip(panels, (0.0, 2 * np.pi), strict=True):
        times = np.geomspace(0.05, 20.0, 60)
        budgets = [drift_budget(array, time, sources, rate=rate) for time in times]
        for number, term in enumerate(budgets[0].terms[:4]):
            panel.loglog(times, [b.terms[number].std[0] for b in budgets], linewidth=0.8, label=term.name)
        panel.loglog(times, [b.total_std[0] for b in budgets], color="black", linewidth=1.6, label="total")
        sample = monte_carlo_drift(array, 20.0, sources, runs=RUNS, rng=np.random.default_rng(SEED), rate=rate)
        rows = np.unique(np.geomspace(5, len(sample.t_s) - 1, 24).astype(int))
        panel.loglog(sample.t_s[rows], sample.std[rows, 0], "o", color=ORANGE, markersize=3, label="Monte Carlo")
        limit = budgets[-1].valid_until
        panel.axvline(limit, color=GREY, linestyle="--")
        if limit < times[-1]:
            panel.annotate(f"attitude error\n{TILT_LIMIT} rad", (1.1 * limit, 3e-6), color=GREY)
        panel.set(
            xlabel="t, s",
            title="at rest" if rate == 0 else "turning, one turn per second",
            ylim=(1e-6, 1e5),
            xlim=(0.05, 20),
        )
    panels[0].set_ylabel("horizontal position error, m (1 σ)")
    panels[0].legend(loc="upper left")
    return figure


def figures_in_numbers(experiment: Experiment) -> dict[str, float]:
    """Return what the text of the documentation quotes."""
    truth = experiment.truth("position", "m")
    assert experiment.estimate.position is not None
    free = experiment.estimate.position[-1] - (truth[-1] - truth[0])
    held = experiment.on_table[-1] - (truth[-1] - truth[0])
    up = to_rotation(experiment.estimate.quaternion[-1]).as_matrix()[2, 2]
    return {
        "rate_rmse_rad_s": float(
            np.sqrt(np.mean((experiment.estimate.omega[:, 2] - experiment.truth("omega", "rad_s")[:, 2]) ** 2))
        ),
        "angle_error_rad": float(experiment.estimate.angle[-1] - experiment.recording.reference["angle_rad"][-1]),
        "tilt_of_estimate_rad": float(np.arccos(up)),
        "free_m": float(np.hypot(*free[:2])),
        "held_m": float(np.hypot(*held[:2])),
        "free_deg_h": float(equivalent_rate_drift(np.hypot(*free[:2]), 30.0)),
        "held_deg_h": float(equivalent_rate_drift(np.hypot(*held[:2]), 30.0)),
    }


if __name__ == "__main__":
    target = Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).resolve().parents[1] / "figures"
    for written in main(target):
        print(f"wrote {written} ({written.stat().st_size / 1024:.0f} kB)")
