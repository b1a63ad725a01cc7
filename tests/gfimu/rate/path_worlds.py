"""Worlds in which a body rests and then moves along a known path: what it reads, and how wrong an estimate is."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from rate_worlds import GRAVITY, cube, sensor_errors, smooth_step, total_noise_std
from scipy.spatial.transform import Rotation

from gfimu import estimate_rate, integrate_attitude, level
from gfimu.rate import PathStart

RATE = 100.0
CUBE = cube()
GAIN, BIAS = 0.01, 0.3


class World:
    """A body that rests for 2 s and then tumbles, turns on a table or comes to rest again; what it reads."""

    def __init__(self, name, seed, kind="uncalibrated", *, noise=1.0, duration=12.0, size=2.5):
        rng = np.random.default_rng([seed, len(name)])
        fine = np.arange(round(1000 * duration)) / 1000.0
        rise, _ = smooth_step(fine, 2.0, 4.0)
        fall, _ = smooth_step(fine, 6.0, 8.0)
        omega, force = np.zeros((2, len(fine), 3))
        if name == "table":
            omega[:, 2] = rise * (3.0 + 2.5 * np.sin(rng.uniform(0.7, 1.0) * fine + rng.uniform(0, 6)))
        else:
            for axis in range(3):
                omega[:, axis] = sum(size * rng.normal() * np.sin(rng.uniform(0.5, 4) * fine) for _ in range(3))
                force[:, axis] = rise * 2.0 * rng.normal() * np.sin(rng.uniform(1, 6) * fine)
            omega *= rise[:, None]
        if name == "stop":
            omega, force = omega * (1.0 - fall[:, None]), 0.0 * force
        alpha = np.gradient(omega, 1e-3, axis=0)
        turned = Rotation.from_quat(integrate_attitude(fine, omega, alpha)[:, [1, 2, 3, 0]])
        first = Rotation.identity() if name == "table" else Rotation.from_rotvec(0.5 * rng.normal(size=3))
        upright = level(first.inv().apply([0.0, 0.0, GRAVITY]))
        attitude = Rotation.from_quat(upright[[1, 2, 3, 0]]) * turned
        p = attitude.inv().apply(force + np.array([0.0, 0.0, GRAVITY]))
        velocity = _sum(force)
        every = slice(None, None, 10)
        self.t, self.omega, self.alpha, self.p = fine[every], omega[every], alpha[every], p[every]
        self.attitude, self.velocity, self.position = attitude[every], velocity[every], _sum(velocity)[every]
        self.angle = _sum(omega[:, 2:])[every, 0]
        columns = []
        for chip in CUBE.chips:
            w = self.omega
            there = self.p + np.cross(self.alpha, chip.position) + np.cross(w, np.cross(w, chip.position))
            for axis in chip.axes:
                tilt = GAIN * rng.normal(size=3)
                seen = axis * (1.0 + GAIN * rng.normal()) + tilt - axis * (tilt @ axis)
                columns.append(there @ (seen if kind == "uncalibrated" else axis))
        bias = BIAS if kind == "uncalibrated" else 0.01
        white = noise * total_noise_std(CUBE, RATE) * rng.normal(size=(len(self.t), 12))
        self.readings = np.column_stack(columns) + (noise > 0) * bias * rng.normal(size=12) + white
        stated = {"scale_std": GAIN, "axis_std": GAIN} if kind == "uncalibrated" else {}
        errors = replace(sensor_errors(CUBE, RATE), bias_std=np.full(12, bias), full_range=None, stuck_after=0)
        self.errors = replace(errors, **stated)

    def estimate(self, method, references=()):
        """The estimate of a method; references are pairs of one and its values."""
        measured = [one.measured(values, len(self.t)) for one, values in references]
        return estimate_rate(
            CUBE, self.t, self.readings, self.errors, method=method, path=PathStart(), references=measured
        )

    def scores(self, found):
        """Errors over their standard deviations, by output."""
        path = found.path
        turn = (Rotation.from_quat(path.quaternion[:, [1, 2, 3, 0]]) * self.attitude.inv()).as_rotvec()
        return {
            "tilt": (turn / np.maximum(path.attitude_std, 1e-12))[:, :2],
            "velocity": (path.velocity - self.velocity) / np.maximum(path.velocity_std, 1e-12),
            "position": (path.position - self.position) / np.maximum(path.position_std, 1e-12),
            "angle": ((path.angle - self.angle) / np.maximum(path.angle_std, 1e-12))[:, None],
            "alpha": (path.alpha - self.alpha) / path.alpha_std,
            "p": (path.p - self.p) / path.p_std,
        }


def _sum(values):
    return np.vstack([np.zeros(values.shape[1]), np.cumsum(0.5e-3 * (values[1:] + values[:-1]), axis=0)])
