"""Readings of an array that turns, tumbles or rests, with the errors that a calibration leaves; numpy alone."""

from __future__ import annotations

import numpy as np

from gfimu import AccelerometerArray, SensorErrors

GRAVITY = 9.80665
RATE_HZ = 100.0
CUBE = AccelerometerArray.load("cube12")
CALIBRATED = SensorErrors.from_parts(CUBE, RATE_HZ, bias_std=0.02, scale_std=9e-4, placement_std=1e-4)


def readings(kind, seed, *, duration=20.0, gains=5e-4, axes=5e-4, places=1e-4, rest=0.0, array=CUBE):
    """Return times (n,), readings (n, c) and rates (n, 3): "turn" about z, "tumble" or "rest"; a rest before."""
    rng = np.random.default_rng([seed, ord(kind[1])])
    t = np.arange(int(duration * RATE_HZ)) / RATE_HZ - rest
    omega, alpha = np.zeros((len(t), 3)), np.zeros((len(t), 3))
    gravity = np.tile([0.0, 0.0, GRAVITY], (len(t), 1))
    for axis in {"turn": (2,), "tumble": (0, 1, 2), "rest": ()}[kind]:
        for _ in range(6):
            pace, size, phase = 2 * np.pi * rng.uniform(0.02, 0.8), rng.uniform(0.3, 1.2), rng.uniform(0.0, 6.28)
            omega[:, axis] += size * (np.sin(pace * t + phase) - np.sin(phase))
            alpha[:, axis] += size * pace * np.cos(pace * t + phase)
    omega[t < 0.0] = alpha[t < 0.0] = 0.0
    t = np.maximum(t, 0.0) if kind == "tumble" else t
    if kind == "tumble":
        tilt, heading = (
            sum(rng.uniform(0.5, 1.5) * np.sin(rng.uniform(0.1, 2.5) * t + rng.uniform(0.0, 6.28)) for _ in range(4))
            for _ in range(2)
        )
        gravity = GRAVITY * np.column_stack(
            [np.cos(heading) * np.sin(tilt), np.sin(heading) * np.sin(tilt), np.cos(tilt)]
        )
    x, y, z = omega.T
    products = np.column_stack([x * x, y * y, z * z, x * y, x * z, y * z])
    true = np.hstack([alpha, gravity]) @ array.regression_matrix.T + products @ array.centripetal_matrix.T
    c = array.n_channels
    mixing = np.eye(c) * (1.0 + gains * rng.standard_normal(c))
    same_chip = (array.chip_of_channel[:, None] == array.chip_of_channel) & ~np.eye(c, dtype=bool)
    mixing = mixing + axes * rng.standard_normal((c, c)) * same_chip
    moved = places * np.sum(omega**2, axis=1, keepdims=True) * rng.standard_normal(c)
    noise = SensorErrors.from_parts(array, RATE_HZ).noise_std * rng.standard_normal((len(t), c))
    t = np.arange(len(t)) / RATE_HZ
    return t, true @ mixing.T + moved + 3e-3 * rng.standard_normal(c) + noise, omega
