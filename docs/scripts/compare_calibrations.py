"""Redo the Persian calibration paper's comparison on synthetic poses: three methods times three inputs.

Run ``python docs/scripts/compare_calibrations.py [FOLDER]``; it prints the tables of docs/accuracy/calibration.md and
draws the histograms. The truth is a triad with a triangular sensitivity matrix, as the paper's model has it, so that no
method suffers from the model. Six-position and recursive least squares get the six faces, each tilted by a levelling
error; multi-position gets 18 poses of the same length with the same tilts, which it does not care about. The check is
the paper's: RMS of |a| − g over rest poses that no calibration has seen.
"""

from __future__ import annotations

import itertools
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import matplotlib as mpl

mpl.use("Agg")

import matplotlib.pyplot as plt
import numpy as np

from gfimu.calibration.error_model import ErrorModel
from gfimu.calibration.multi_position import multi_position
from gfimu.calibration.observations import (
    INPUTS,
    THRESHOLDS,
    averaged_poses,
    denoised_samples,
    every_sample,
    observations_from,
)
from gfimu.calibration.recursive import recursive
from gfimu.calibration.result import Calibration
from gfimu.calibration.six_position import six_position
from gfimu.recording import Recording
from gfimu.recording.rest import Rest
from gfimu.sensor_noise import synthesise_noise

GRAVITY = 9.81
RATE, SECONDS = 100.0, 8.0
NOISE = {"N": 0.003, "B": 0.0005}
LEVELLING_DEG = (0.0, 0.1, 0.5)
CHECK_POSES = 40
WAVELET_LEVELS = (1, 2, 3, 4, 5, 6)
WAVELET_TRIALS = 16
FACES = np.concatenate([np.eye(3), -np.eye(3)])
DIRECTIONS = np.array([v for v in itertools.product((-1, 0, 1), repeat=3) if 0 < np.abs(v).sum() < 3], dtype=float)
DIRECTIONS /= np.linalg.norm(DIRECTIONS, axis=1, keepdims=True)
METHODS: dict[str, tuple[Callable[..., Calibration], np.ndarray]] = {
    "six-position (SPS)": (six_position, FACES),
    "recursive (RLS)": (recursive, FACES),
    "multi-position (MP)": (multi_position, DIRECTIONS),
}


@dataclass(frozen=True)
class Comparison:
    """Residuals |a| − g on check poses, m/s², by levelling error (degrees), method and input: (trials, poses)."""

    residuals: dict[tuple[float, str, str], np.ndarray]

    def rms(self, levelling: float, method: str, kind: str) -> np.ndarray:
        """Return the RMS of each trial, m/s², shape (trials,)."""
        return np.sqrt(np.mean(self.residuals[levelling, method, kind] ** 2, axis=1))


def compare(trials: int, *, seed: int = 1, levelling: tuple[float, ...] = LEVELLING_DEG) -> Comparison:
    """Calibrate ``trials`` random triads in every way and check each."""
    rng = np.random.default_rng(seed)
    residuals: dict[tuple[float, str, str], list[np.ndarray]] = {}
    for _ in range(trials):
        truth = ErrorModel(np.tril(np.eye(3) + rng.normal(0, 0.01, (3, 3))), rng.normal(0, 0.3, 3))
        check = rng.normal(size=(CHECK_POSES, 3))
        check *= GRAVITY / np.linalg.norm(check, axis=1, keepdims=True)
        for tilt in levelling:
            recordings = {size: _record(truth, poses, tilt, rng) for size, poses in ((6, FACES), (18, DIRECTIONS))}
            for (name, (method, poses)), kind in itertools.product(METHODS.items(), INPUTS):
                observations = observations_from(*recordings[len(poses)], kind)
                model = method(observations, gravity=GRAVITY, gauge="x_axis").models["a1"]
                miss = np.linalg.norm(model.correct(truth.read(check)), axis=1) - GRAVITY
                residuals.setdefault((tilt, name, kind), []).append(miss)
    return Comparison({key: np.array(values) for key, values in residuals.items()})


def compare_wavelets(
    trials: int, *, seed: int = 1, levels: tuple[int, ...] = WAVELET_LEVELS
) -> dict[tuple[str, int, str], float]:
    """Compare the wavelet input, by level and threshold, with averages, for level faces.

    Returns
    -------
    dict
        By method, level and threshold: RMS of |a| − g on poses that the fit has not seen over that of the averaged
        input, pooled over the triads. Level 0 are the raw samples.
    """
    rng = np.random.default_rng(seed)
    squares: dict[tuple[str, int, str], float] = {}
    inputs = [(level, threshold) for level in levels for threshold in THRESHOLDS]
    for _ in range(trials):
        truth = ErrorModel(np.tril(np.eye(3) + rng.normal(0, 0.01, (3, 3))), rng.normal(0, 0.3, 3))
        check = rng.normal(size=(CHECK_POSES, 3))
        check *= GRAVITY / np.linalg.norm(check, axis=1, keepdims=True)
        for name, (method, poses) in METHODS.items():
            recording, rest = _record(truth, poses, 0.0, rng)
            rows = {(-1, ""): averaged_poses(recording, rest), (0, "none"): every_sample(recording, rest)}
            rows |= {one: denoised_samples(recording, rest, level=one[0], threshold=one[1]) for one in inputs}
            for (level, threshold), observations in rows.items():
                model = method(observations, gravity=GRAVITY, gauge="x_axis").models["a1"]
                miss = np.linalg.norm(model.correct(truth.read(check)), axis=1) - GRAVITY
                key = (name, level, threshold)
                squares[key] = squares.get(key, 0.0) + float(np.mean(miss**2))
    return {key: float(np.sqrt(value / squares[key[0], -1, ""])) for key, value in squares.items() if key[1] >= 0}


def wavelet_table(ratios: dict[tuple[str, int, str], float]) -> str:
    """Return the ratios of `compare_wavelets` as a Markdown table: a row per level, thresholds none, soft, hard."""
    lines = ["| level | " + " | ".join(METHODS) + " |", "|---|" + "---|" * len(METHODS)]
    for level in dict.fromkeys(level for _, level, _ in ratios):
        kinds = [kind for kind in THRESHOLDS if (next(iter(METHODS)), level, kind) in ratios]
        cells = [" / ".join(f"{ratios[name, level, kind]:.3f}" for kind in kinds) for name in METHODS]
        lines.append(f"| {level or 'raw'} | " + " | ".join(cells) + " |")
    return "\n".join(lines)


def table(comparison: Comparison) -> str:
    """Return the medians over the trials as a Markdown table, mm/s²."""
    lines = ["| levelling error | method | " + " | ".join(INPUTS) + " |", "|---|---|" + "---|" * len(INPUTS)]
    for tilt in sorted({key[0] for key in comparison.residuals}):
        for name in METHODS:
            cells = [f"{1e3 * np.median(comparison.rms(tilt, name, kind)):.2f}" for kind in INPUTS]
            lines.append(f"| {tilt:g}° | {name} | " + " | ".join(cells) + " |")
    return "\n".join(lines)


def draw(comparison: Comparison, path: Path) -> None:
    """Draw the histograms of the residuals, averaged input, at the largest levelling error."""
    tilt = max(key[0] for key in comparison.residuals)
    figure, axes = plt.subplots(1, 3, figsize=(10, 3), sharey=True, layout="constrained", dpi=90)
    for panel, name in zip(axes, METHODS, strict=True):
        values = 1e3 * comparison.residuals[tilt, name, "averaged"].ravel()
        panel.hist(values, bins=40, color="#1f9bcf")
        panel.set_title(f"{name}\nRMS {np.sqrt(np.mean(values**2)):.2f} mm/s²", fontsize=9)
        panel.set_xlabel("|a| − g on check poses, mm/s²")
    axes[0].set_ylabel("check poses")
    figure.suptitle(f"faces levelled to {tilt:g}° (standard deviation per axis)", fontsize=9)
    figure.savefig(path)
    plt.close(figure)


def main(folder: Path, trials: int = 60) -> Comparison:
    """Run the comparison, print its table and draw its histograms."""
    comparison = compare(trials)
    print(f"RMS of |a| − g on {CHECK_POSES} check poses, median of {trials} triads, mm/s²:\n")
    print(table(comparison))
    print(f"\nWavelet input, the same over that of averages, {WAVELET_TRIALS} triads:\n")
    print(wavelet_table(compare_wavelets(WAVELET_TRIALS)))
    folder.mkdir(parents=True, exist_ok=True)
    draw(comparison, folder / "calibration_comparison.png")
    return comparison


def _record(
    truth: ErrorModel, directions: np.ndarray, levelling_deg: float, rng: np.random.Generator
) -> tuple[Recording, Rest]:
    """Record every pose for `SECONDS`, each tilted at random; the rests are known here."""
    tilt = np.deg2rad(levelling_deg) * rng.normal(size=directions.shape)
    true = directions + np.cross(tilt, directions)
    true *= GRAVITY / np.linalg.norm(true, axis=1, keepdims=True)
    n = int(RATE * SECONDS)
    readings = np.repeat(truth.read(true), n, axis=0)
    readings += np.column_stack([synthesise_noise(len(readings), RATE, **NOISE, rng=rng) for _ in range(3)])
    start = np.arange(len(directions)) * n
    rest = Rest(start, start + n, 1.0, False, 101, "m_s2")
    return Recording(np.arange(len(readings)) / RATE, readings, ("a11", "a12", "a13")), rest


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).resolve().parents[1] / "figures")
