"""Calibration beside its peers: scipy's least_squares, and imucal.

Run ``python benchmarks/calibration.py``. The multi-position fit and scipy's ``least_squares`` minimise the same
residuals |a| − g from the same start, scipy with the same analytic Jacobian, by its default method and by MINPACK's
Levenberg–Marquardt, and with its own finite differences. Six-position and imucal's Ferraris calibration solve the same
six poses. Each pair is timed back to back in CPU time, ratios pair by pair; our times include the coverage checks and
the covariance. imucal is an optional peer: ``pip install imucal``.
"""

from __future__ import annotations

import itertools
import os
import time

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
os.environ.setdefault("OMP_NUM_THREADS", "1")

import numpy as np
from scipy.optimize import least_squares

from gfimu.calibration.error_model import ErrorModel
from gfimu.calibration.multi_position import magnitude_condition, multi_position
from gfimu.calibration.observations import Observations
from gfimu.calibration.six_position import six_position

GRAVITY = 9.81
PAIRS = 15
DIRECTIONS = np.array([v for v in itertools.product((-1, 0, 1), repeat=3) if 0 < np.abs(v).sum() < 3], dtype=float)
DIRECTIONS /= np.linalg.norm(DIRECTIONS, axis=1, keepdims=True)
FACES = np.concatenate([np.eye(3), -np.eye(3)])
TRUTH = ErrorModel(np.array([[1.012, 0, 0], [0.004, 0.985, 0], [-0.005, 0.007, 1.007]]), np.array([0.31, -0.22, 0.45]))


def main() -> None:
    for samples in (1, 200, 2000):
        against_scipy(samples)
    against_imucal()


def against_scipy(samples: int) -> None:
    """Multi-position fit of 18 poses with this many samples each."""
    rng = np.random.default_rng(samples)
    true = GRAVITY * np.repeat(DIRECTIONS, samples, axis=0)
    readings = TRUTH.read(true) + rng.normal(0, 0.02, true.shape)
    pose = np.repeat(np.arange(18), samples)
    covariance = np.tile(4e-4 * np.eye(3), (18, 1, 1))
    observations = Observations(readings, pose, covariance, ("a11", "a12", "a13"), "m_s2", np.arange(18.0), "raw")
    condition = magnitude_condition(GRAVITY, "x_axis")
    start = ErrorModel.nominal()

    def residual(parameters):
        return condition(parameters, readings)[0][:, 0]

    def jacobian(parameters):
        return condition(parameters, readings)[1][:, 0]

    tight = {"xtol": 1e-15, "ftol": 1e-15, "gtol": 1e-15}
    x0 = start.parameters("x_axis")
    peers = (
        ("default, analytic Jacobian", {"jac": jacobian}),
        ("lm, analytic Jacobian", {"jac": jacobian, "method": "lm"}),
        ("default, finite differences", {}),
    )
    for name, options in peers:
        own, theirs = [], []
        for _ in range(PAIRS):
            seconds, result = _timed(multi_position, observations, gravity=GRAVITY, weighting="uniform", start=start)
            own.append(seconds)
            seconds, reference = _timed(least_squares, residual, x0, **options, **tight)
            theirs.append(seconds)
        difference = np.abs(result.values - reference.x).max()
        ratio = np.array(theirs) / own
        print(
            f"multi-position, {len(readings):6,} rows: gfimu {np.median(own) * 1e3:6.2f} ms, "
            f"scipy ({name}) {np.median(theirs) * 1e3:6.2f} ms, {np.median(ratio):4.1f} × (least {ratio.min():.1f}); "
            f"difference {difference:.0e}"
        )


def against_imucal() -> None:
    """Six-position calibration of six poses of 1000 samples."""
    try:
        from imucal import FerrarisCalibration, FerrarisSignalRegions
    except ImportError:
        print("six-position: imucal is not installed (pip install imucal)")
        return
    rng = np.random.default_rng(7)
    samples = [TRUTH.read(GRAVITY * face) + rng.normal(0, 0.02, (1000, 3)) for face in FACES]
    still = np.zeros((1000, 3)) + rng.normal(0, 0.01, (1000, 3))
    turns = {
        f"{kind}_{axis}_rot": still + 36 * np.eye(3)[i] * (kind == "gyr")
        for kind in ("acc", "gyr")
        for i, axis in enumerate("xyz")
    }
    regions = {f"acc_{axis}_{sign}": samples[i + 3 * (sign == "a")] for i, axis in enumerate("xyz") for sign in "pa"}
    regions |= {f"gyr_{axis}_{sign}": still for axis in "xyz" for sign in "pa"}
    region = FerrarisSignalRegions(**regions, **turns)
    own, theirs = [], []
    for _ in range(PAIRS):
        begin = time.process_time()
        means = np.array([part.mean(axis=0) for part in samples])
        spread = np.array([np.cov(part, rowvar=False) / len(part) for part in samples])
        ours = six_position(Observations.from_means(means, spread), gravity=GRAVITY)
        own.append(time.process_time() - begin)
        seconds, reference = _timed(
            FerrarisCalibration(grav=GRAVITY).compute, region, 100.0, from_acc_unit="m/s^2", from_gyr_unit="deg/s"
        )
        theirs.append(seconds)
    model = ours.models["a1"]
    bias = np.abs(model.bias - reference.b_a).max()
    matrix = np.abs(model.sensitivity - reference.K_a @ reference.R_a).max()
    std = ours.std
    print(
        f"six-position: gfimu {np.median(own) * 1e3:.2f} ms with covariance, imucal {np.median(theirs) * 1e3:.2f} ms; "
        f"matrix difference {matrix:.0e} (std {std[:9].max():.0e}), bias difference {bias:.0e} "
        f"(std {std[9:].max():.0e}): imucal takes an axis's bias from its own two faces, least squares from all six"
    )
    error = [np.abs(b - TRUTH.bias).max() for b in (model.bias, reference.b_a)]
    print(f"six-position: largest bias error against the truth: gfimu {error[0]:.1e}, imucal {error[1]:.1e} m/s²")


def _timed(function, *arguments, **options):
    begin = time.process_time()
    result = function(*arguments, **options)
    return time.process_time() - begin, result


if __name__ == "__main__":
    main()
