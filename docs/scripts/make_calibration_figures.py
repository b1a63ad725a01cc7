"""Draw the figures of docs/how_to/calibration.md and docs/theory/noise.md.

Run ``python docs/scripts/make_calibration_figures.py [FOLDER]``; the folder is ``docs/figures`` unless given.
"""

from __future__ import annotations

import itertools
import sys
from pathlib import Path

import matplotlib as mpl

mpl.use("Agg")

import matplotlib.pyplot as plt
import numpy as np

from gfimu.calibration.error_model import ErrorModel
from gfimu.calibration.observations import Observations
from gfimu.calibration.twelve_position import coarse_solution, twelve_position
from gfimu.sensor_noise import identify_noise, synthesise_noise
from gfimu.sensor_noise.identification import TERMS, model_variance

SEED = 4
GRAVITY = 9.8
RATE = 100.0
FACES = np.concatenate([np.eye(3), -np.eye(3)])
EDGES = np.array([v for v in itertools.product((-1, 0, 1), repeat=3) if np.abs(v).sum() == 2]) / np.sqrt(2)
MTI = ErrorModel.from_counts(
    [33086.641274, 33390.333418, 32648.679799],
    [409.675030, 411.752659, 412.014478],
    [[0, 1.959567, -1.561722], [-1.274475, 0, 0.278138], [5.723103, 9.353853, 0]],
)
NOISE = {"N": 0.003, "B": 0.0008, "K": 0.0001}


def mti_poses(rng: np.random.Generator) -> Observations:
    """Twelve poses of the Chinese paper's MTi, faces levelled to 0.3°, noise of the means 0.3 counts."""
    directions = np.concatenate([FACES, EDGES[[0, 1, 4, 6, 8, 11]]])
    true = directions + np.cross(np.deg2rad(0.3) * rng.normal(size=directions.shape), directions)
    true *= GRAVITY / np.linalg.norm(true, axis=1, keepdims=True)
    return Observations.from_means(MTI.read(true) + rng.normal(0, 0.3, true.shape), 0.09 * np.eye(3), unit="lsb")


def correlation(path: Path) -> dict[str, float]:
    """Correlation of the parameters in the 12- and 9-parameter magnitude problems; returns the three pairs."""
    observations = mti_poses(np.random.default_rng(SEED))
    twelve = twelve_position(observations, gravity=GRAVITY, levelling_std_rad=np.deg2rad(0.3))
    nine = twelve_position(observations, gravity=GRAVITY, gauge="x_axis")
    figure, axes = plt.subplots(1, 2, figsize=(9, 4.2), layout="constrained", dpi=90)
    for panel, result in zip(axes, (twelve, nine), strict=True):
        image = panel.imshow(result.correlation, cmap="RdBu_r", vmin=-1, vmax=1)
        names = [name.split("_", 1)[1] for name in result.names]
        panel.set_xticks(range(len(names)), names, rotation=90, fontsize=7)
        panel.set_yticks(range(len(names)), names, fontsize=7)
        panel.set_title(f"{len(names)} parameters", fontsize=9)
    figure.colorbar(image, ax=axes, shrink=0.8, label="correlation")
    figure.savefig(path)
    plt.close(figure)
    return {pair.upper(): twelve.correlation_of(f"a1_M_{pair}", f"a1_M_{pair[::-1]}") for pair in ("xy", "xz", "yz")}


def coarse_and_fine(path: Path) -> tuple[float, float]:
    """|a| − g at an arbitrary pose, coarse and fine calibration: the Chinese paper's figure 1; returns the means."""
    rng = np.random.default_rng(SEED)
    observations = mti_poses(rng)
    coarse = coarse_solution(observations, GRAVITY)
    fine = twelve_position(observations, gravity=GRAVITY).models["a1"]
    pose = np.array([0.3, -0.5, 0.8])
    readings = MTI.read(GRAVITY * pose / np.linalg.norm(pose)) + rng.normal(0, 3.0, (1000, 3))
    figure, panel = plt.subplots(figsize=(7, 3), layout="constrained", dpi=90)
    means = []
    for name, model, colour in (("coarse", coarse, "#7f7f7f"), ("fine", fine, "#d95f02")):
        miss = np.linalg.norm(model.correct(readings), axis=1) - GRAVITY
        means.append(float(miss.mean()))
        panel.plot(np.arange(1000) / RATE, 1e3 * miss, lw=0.6, color=colour, label=name)
        panel.axhline(1e3 * miss.mean(), color=colour, lw=1.2)
    panel.axhline(0, color="k", lw=0.5)
    panel.set_xlabel("time, s")
    panel.set_ylabel("|a| − g, mm/s²")
    panel.legend(frameon=False, ncols=2)
    figure.savefig(path)
    plt.close(figure)
    return means[0], means[1]


def allan(path: Path) -> dict[str, float]:
    """Allan deviation of synthetic noise, its fit, and the fit's terms; returns the coefficients found."""
    rng = np.random.default_rng(SEED)
    model = identify_noise(synthesise_noise(2_000_000, RATE, **NOISE, rng=rng), RATE)
    tau = np.geomspace(model.allan.tau[0], model.allan.tau[-1], 200)
    figure, panel = plt.subplots(figsize=(7, 4.2), layout="constrained", dpi=90)
    panel.loglog(
        model.allan.tau, model.allan.deviation, "o", ms=3, color="#1f9bcf", label="overlapping Allan deviation"
    )
    panel.loglog(tau, model.deviation(tau), color="#d95f02", lw=1.2, label="fit")
    shapes = model_variance(tau * RATE, RATE)
    for place, symbol in enumerate(TERMS):
        term = model[symbol]
        if term.found:
            label = f"{symbol} = {term.value:.3g} [{term.low:.3g}, {term.high:.3g}]"
            panel.loglog(tau, term.value * np.sqrt(shapes[:, place]), "--", lw=0.8, label=label)
    panel.set_ylim(0.5 * model.allan.deviation.min(), 2 * model.allan.deviation.max())
    panel.set_xlabel("averaging time τ, s")
    panel.set_ylabel("Allan deviation, m/s²")
    panel.grid(which="both", alpha=0.25, lw=0.4)
    panel.legend(frameon=False, fontsize=8)
    figure.savefig(path)
    plt.close(figure)
    return {symbol: model[symbol].value for symbol in model.found}


def main(folder: Path) -> dict[str, object]:
    """Draw every figure into a folder; returns what the pages quote."""
    folder.mkdir(parents=True, exist_ok=True)
    return {
        "correlation": correlation(folder / "calibration_correlation.png"),
        "coarse_and_fine": coarse_and_fine(folder / "calibration_coarse_fine.png"),
        "noise": allan(folder / "noise_allan.png"),
    }


if __name__ == "__main__":
    print(main(Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).resolve().parents[1] / "figures"))
