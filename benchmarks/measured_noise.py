"""Errors, their standard deviations and signs on a real board against its gyros: the table of docs/theory/rate.md.

Run ``python benchmarks/measured_noise.py FOLDER`` with the folder of the MIMU4444 recordings ``exp_1.bin.gz`` and
``exp_2.bin.gz`` (Carlsson, Skog & Jaldén, IEEE Sensors J. 21, 2021). Both are calibrated on the first. The gyros are
read 1.5 ms before the accelerometers' times, by which they differ there.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

from gfimu.array.array import AccelerometerArray
from gfimu.calibration.array_calibration import calibrate_array
from gfimu.rate.methods import estimate_rate
from gfimu.rate.sensing import SensorErrors
from gfimu.recording.mimu4444 import read_mimu4444

NOISE = 0.047  # m/s², of the chips at rest
DELAY = 1.5e-3  # s
RAIL = 156.5  # m/s²
SLOWEST = np.radians(100)
METHODS = ("ml", "algebraic", "filter", "smoother")


def table(folder: Path) -> None:
    """Print a row per recording and method."""
    drawing = AccelerometerArray.load("mimu4444")
    calibration = calibrate_array(read_mimu4444(folder / "exp_1.bin.gz"), drawing, gravity=9.81)
    array = calibration.calibrated_array(drawing)
    print("| recording | method | median error, °/s | normalised | within 3 σ, % | decided, wrong of these, % |")
    print("|---|---|---|---|---|---|")
    for name in ("exp_1", "exp_2"):
        raw = read_mimu4444(folder / f"{name}.bin.gz")
        recording = calibration.apply(raw)
        readings = recording.for_array(array).copy()
        readings[np.abs(raw.for_array(drawing)) > RAIL] = np.nan
        gyro = np.column_stack([recording.reference[f"gyro_{axis}_rad_s"] for axis in "xyz"])
        known = np.isfinite(gyro).all(axis=1)
        times = recording.t_s
        reference = np.column_stack([np.interp(times - DELAY, times[known], axis[known]) for axis in gyro.T])
        errors = SensorErrors.uniform(array, NOISE, 0.1)
        for method in METHODS:
            found = estimate_rate(array, times, readings, errors, method=method)
            rows = known & (np.linalg.norm(reference, axis=1) > SLOWEST) & np.isfinite(found.omega).all(axis=1)
            error = (found.omega - reference)[rows]
            each = np.abs(error / found.std[rows])
            decided = np.ones(rows.sum(), dtype=bool)
            if found.sign_probability is not None:
                decided = found.sign_probability[rows] > 0.99
            wrong = np.sum((found.omega * reference)[rows], axis=1) < 0
            print(
                f"| {name} | {method} | {_axes(np.degrees(np.median(np.abs(error), axis=0)), 0)} "
                f"| {_axes(np.median(each, axis=0) / 0.6745, 2)} | {_axes(100 * np.mean(each < 3, axis=0), 1)} "
                f"| {100 * decided.mean():.1f}, {100 * wrong[decided].mean():.2f} |"
            )


def _axes(values: np.ndarray, digits: int) -> str:
    return " ".join(f"{value:.{digits}f}" for value in values)


if __name__ == "__main__":
    table(Path(sys.argv[1]))
