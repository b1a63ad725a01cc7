"""Draw the figures of docs/theory/rate.md, print its numbers: ``python docs/scripts/make_rate_figures.py [DIR]``."""

from __future__ import annotations

import sys
from pathlib import Path

import matplotlib as mpl

mpl.use("Agg")
import matplotlib.pyplot as plt
import numpy as np
from numpy.typing import NDArray

from gfimu.array.array import AccelerometerArray
from gfimu.array.parts.part import white_noise_std
from gfimu.budget.drift import ErrorSources, drift_budget, equivalent_rate_drift
from gfimu.motion.estimate import Estimate
from gfimu.motion.rest_bias import estimate_from_rest, rest_bias
from gfimu.rate.bounds.sample import alpha_std, rate_bound_isotropic, steady_rate_bound
from gfimu.rate.methods import RATE_METHODS, estimate_rate
from gfimu.rate.sensing import SensorErrors
from gfimu.rate.settings import FilterSettings
from gfimu.recording import Recording
from sim.scenarios import Scenario
from sim.simulation import simulate

RATE = 100.0
DRIFT_TIME = 30.0
CUBE = AccelerometerArray.load("cube12")
SHADES = ("0.45", "tab:green", "tab:olive", "tab:orange", "tab:blue", "tab:purple")
COLOURS = dict(zip(RATE_METHODS, SHADES, strict=True))


def steady_error(speed: float, noise: float, seed: int) -> dict[str, float]:
    """RMSE per axis of each method in steady turning about z that began 2 s after the start, biases calibrated."""
    rng = np.random.default_rng(seed)
    t = np.arange(round(24 * RATE)) / RATE
    u = np.clip((t - 2) / 4, 0, 1)
    omega = np.zeros((len(t), 3))
    omega[:, 2] = speed * (u - np.sin(2 * np.pi * u) / (2 * np.pi))
    alpha = np.zeros_like(omega)
    alpha[:, 2] = speed * (1 - np.cos(2 * np.pi * u)) / 4
    readings = alpha @ CUBE.regression_matrix[:, :3].T + omega[:, 2:] ** 2 @ CUBE.centripetal_matrix[:, 2:3].T
    readings += noise * rng.standard_normal(readings.shape)
    errors = SensorErrors.uniform(CUBE, noise)
    steady = t > 8
    found = {}
    for method in RATE_METHODS:
        estimate = estimate_rate(CUBE, t, readings, errors, method=method, settings=FilterSettings(rest=None)).omega
        signs = np.where(np.sum(estimate * omega, axis=1) < 0, -1.0, 1.0)[:, None]
        error = (estimate * signs if method in {"algebraic", "ml"} else estimate) - omega
        found[method] = float(np.sqrt(np.mean(error[steady] ** 2)))
    return found


def draw_bounds(folder: Path) -> Path:
    """Error of each method against speed, with the bounds drawn in."""
    noise = 0.03
    sigma = float(alpha_std(CUBE, noise)[0])
    speeds = np.geomspace(0.3, 50, 7)
    errors = [[steady_error(speed, noise, seed) for seed in range(3)] for speed in speeds]
    figure, axes = plt.subplots(figsize=(7.2, 4.4), layout="constrained")
    fine = np.geomspace(0.2, 60, 200)
    for label, bound, style in (
        ("Cramér–Rao, one sample", rate_bound_isotropic(sigma, fine), "k:"),
        ("posterior, samples so far", steady_rate_bound(sigma, 1 / RATE, fine), "k--"),
        ("posterior, all samples", steady_rate_bound(sigma, 1 / RATE, fine, smoother=True), "k-"),
    ):
        axes.plot(fine, np.sqrt((2 * bound[0] ** 2 + bound[1] ** 2) / 3), style, lw=1, label=label)
    for method in RATE_METHODS:
        values = [np.sqrt(np.mean([run[method] ** 2 for run in runs])) for runs in errors]
        axes.plot(speeds, values, "o", color=COLOURS[method], ms=5, label=method)
    axes.set(xscale="log", yscale="log", xlabel="|ω|, rad/s", ylabel="RMSE of ω per axis, rad/s")
    axes.set_title("cube12, 100 Hz, 0.03 m/s² of noise, no bias: steady turning, 2 to 18 s after it began", fontsize=9)
    axes.grid(visible=True, which="both", alpha=0.2)
    axes.legend(fontsize=8, ncols=2)
    path = folder / "rate_bounds.png"
    figure.savefig(path, dpi=110)
    plt.close(figure)
    return path


def paper_run(seed: int) -> tuple[Recording, dict[str, Estimate]]:
    """The paper's run, biases read off at the first rest, by integration, filter and smoother."""
    recording = simulate(Scenario.load("paper_run"), seed=seed)
    estimates = {
        method: estimate_from_rest(recording, CUBE, method=method, with_position=True)
        for method in ("integrate", "filter", "smoother")
    }
    return recording, estimates


def truth(recording: Recording) -> NDArray[np.float64]:
    """True rate of a simulated recording, shape (n, 3)."""
    return np.column_stack([np.asarray(recording.extra[f"truth_omega_{axis}_rad_s"], dtype=float) for axis in "xyz"])


def draw_paper_run(folder: Path) -> Path:
    """Error of the rate along the paper's run with ±2σ bands."""
    recording, estimates = paper_run(1)
    omega = truth(recording)
    figure, axes = plt.subplots(3, 1, figsize=(7.2, 5.6), sharex=True, layout="constrained")
    for axis, (method, found) in zip(axes, estimates.items(), strict=True):
        error = found.omega - omega
        for component, colour in zip(range(3), ("tab:red", "tab:green", "tab:blue"), strict=True):
            axis.plot(found.t_s, error[:, component], color=colour, lw=0.7, label="xyz"[component])
        band = 2 * found.omega_std.max(axis=1)
        axis.fill_between(found.t_s, -band, band, color="0.85", label="±2σ")
        axis.set(ylabel=f"{method}\nerror, rad/s", ylim=(-0.5, 0.5) if method == "integrate" else (-0.15, 0.15))
    axes[0].legend(fontsize=7, ncols=4)
    axes[-1].set_xlabel("t, s")
    path = folder / "rate_paper_run.png"
    figure.savefig(path, dpi=110)
    plt.close(figure)
    return path


def drift_table(runs: int) -> dict[str, tuple[float, float, float]]:
    """Rate error at 30 s, °/h, position error, m, and equivalent rate drift, °/h: the drift model and the paper's run.

    Measured are root mean squares over ``runs`` runs, each with chips of its own. The model is told what the mean over
    the first rest leaves of the biases, and the noise; once at rest and once turning at the run's mean speed.
    """
    rates: dict[str, list[float]] = {}
    positions: dict[str, list[float]] = {}
    left, speed = [], 0.0
    for seed in range(1, runs + 1):
        recording, estimates = paper_run(seed)
        omega = truth(recording)
        left.append(rest_bias(recording, CUBE).std)
        speed = float(np.mean(np.linalg.norm(omega, axis=1)))
        for method, found in estimates.items():
            if found.position is None:
                raise TypeError("the estimate holds no position")
            rates.setdefault(method, []).append(float(np.linalg.norm(found.omega[-1] - omega[-1])))
            positions.setdefault(method, []).append(float(np.linalg.norm(found.position[-1])))
    sigma = float(np.sqrt(np.mean(white_noise_std(CUBE, RATE) ** 2)))
    sources = ErrorSources(float(np.sqrt(np.mean(np.square(left)))), sigma * np.sqrt(2.0 / RATE))
    rows = {}
    for name, turning in (("model, at rest", 0.0), (f"model, turning at {speed:.1f} rad/s", speed)):
        budget = drift_budget(CUBE, DRIFT_TIME, sources, rate=turning)
        sizes = {term.name: term.size for term in budget.terms}
        rate = np.hypot(sizes["bias of alpha"] * DRIFT_TIME, sizes["noise of alpha"] * np.sqrt(DRIFT_TIME))
        rows[name] = (float(np.sqrt(3.0) * rate), float(np.linalg.norm(budget.total_std)))
    for method, values in rates.items():
        rows[method] = (
            float(np.sqrt(np.mean(np.square(values)))),
            float(np.sqrt(np.mean(np.square(positions[method])))),
        )
    return {
        name: (float(np.degrees(rate)) * 3600.0, position, float(equivalent_rate_drift(position, DRIFT_TIME)))
        for name, (rate, position) in rows.items()
    }


def main(folder: Path) -> list[Path]:
    """Draw all figures into ``folder``."""
    folder.mkdir(parents=True, exist_ok=True)
    print(f"{'rms of 8 runs':<26}{'rate error, °/h':>16}{'position error, m':>19}{'equivalent drift, °/h':>23}")
    for name, (rate, position, drift) in drift_table(8).items():
        print(f"{name:<26}{rate:>16.0f}{position:>19.0f}{drift:>23.0f}")
    return [draw_bounds(folder), draw_paper_run(folder)]


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).resolve().parents[1] / "figures")
