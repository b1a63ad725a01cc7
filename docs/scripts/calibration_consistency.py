"""Are calibrations as sure as they are: errors over standard deviations, by method and array.

Run ``python docs/scripts/calibration_consistency.py [RUNS]``; it prints the table of docs/accuracy/calibration.md.
Every run draws the chips
anew from their data sheets (offsets, gains, cross-axis pick-up, non-linearity), simulates the poses of the
scenario ``calibration_poses`` with noise and quantisation, and calibrates the recording as ``gfimu calibrate`` does.
The truth is that of the simulated chips. Columns: root mean square of error over standard deviation for the
sensitivities M, the biases b and the bends q, and the shares within 2 and 3 standard deviations (theory: 1; 95.4 % and
99.7 %).
"""

from __future__ import annotations

import sys
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import fsolve
from scipy.spatial.transform import Rotation

from gfimu.array.array import AccelerometerArray
from gfimu.array.kinematics import specific_force
from gfimu.base.units import STANDARD_GRAVITY
from gfimu.calibration.error_model import ErrorModel
from gfimu.calibration.method import CalibrationTask, run_calibration
from gfimu.calibration.registry import METHODS, calibration_method
from gfimu.calibration.result import Calibration
from gfimu.recording import Recording
from gfimu.recording.carried_array import array_metadata
from sim.chips.adxl345 import Sensor, SensorSettings
from sim.motions.pose_sequence import PoseSequence

RATE = 100.0
CASES = (
    ("array", "cube12", None),
    ("array", "cube12_as_built", None),
    ("array", "mimu4444", None),
    ("multi-position", "cube12", 9),
    ("multi-position", "cube12", 12),
    ("twelve-position", "cube12", 12),
    ("twelve-position", "cube12", 9),
    ("six-position", "cube12", 12),
    ("six-position", "cube12", 9),
    ("recursive", "cube12", 12),
    ("recursive", "cube12", 9),
)


@dataclass(frozen=True)
class Poses:
    """Ideal readings of an array that is held in one pose after another."""

    array: AccelerometerArray
    t_s: np.ndarray
    force: np.ndarray

    @classmethod
    def of(cls, array: AccelerometerArray, poses: str = "faces_edges") -> Poses:
        """Poses of 6 s with turns of 2 s between them."""
        motion = PoseSequence(poses)
        t = np.arange(round(motion.duration * RATE)) / RATE
        state = motion.at(t)
        gravity = STANDARD_GRAVITY * state.rotation[:, 2]  # up in body axes
        return cls(array, t, specific_force(array, gravity, state.alpha, state.omega))

    def draw(
        self, rng: np.random.Generator, settings: SensorSettings, *, triangular: bool = False
    ) -> tuple[Recording, list[ErrorModel]]:
        """Return a recording of chips drawn anew, and their true models in the chips' axes."""
        sensor = Sensor.build(self.array, settings, rng)
        if triangular:  # what nine parameters on known poses take for granted
            lower = {key: np.tril(getattr(sensor.errors, key)) for key in ("cross_axis", "misalignment")}
            sensor = replace(sensor, errors=replace(sensor.errors, **lower))
        readings = sensor.sense(self.force, np.full(len(self.t_s), 25.0), rng)
        metadata = {**array_metadata(self.array), "part": self.array.chips[0].part, "lsb_m_s2": float(sensor.lsb[0])}
        errors, models = sensor.errors, []
        for number in range(len(self.array.chips)):
            own = np.flatnonzero(self.array.chip_of_channel == number)
            gain = 1.0 + errors.scale[own]
            picked = np.eye(3) + (errors.cross_axis + errors.misalignment)[np.ix_(own, own)]
            models.append(ErrorModel(gain[:, None] * picked, errors.bias[own], errors.quadratic[own] / gain))
        return Recording(self.t_s, readings, self.array.channels, metadata=metadata), models


def truth_of(result: Calibration, array: AccelerometerArray, models: list[ErrorModel]) -> np.ndarray:
    """Return the true values of a result's parameters, in its gauge."""
    if result.gauge == "array":
        inner = [chip.axes.T @ one.sensitivity @ chip.axes for chip, one in zip(array.chips, models, strict=True)]

        def skew(turn: np.ndarray) -> np.ndarray:
            mean = np.mean([m @ Rotation.from_rotvec(turn).as_matrix() for m in inner], axis=0)
            return np.array([mean[2, 1] - mean[1, 2], mean[0, 2] - mean[2, 0], mean[1, 0] - mean[0, 1]])

        turn = Rotation.from_rotvec(fsolve(skew, np.zeros(3))).as_matrix()
        models = [
            replace(one, sensitivity=one.sensitivity @ chip.axes @ turn @ chip.axes.T)
            for chip, one in zip(array.chips, models, strict=True)
        ]
    elif result.method == "multi-position" and result.gauge == "coarse":  # any rotation will do: the nearest one
        turned = []
        for chip, one in zip(array.chips, models, strict=True):
            u, _, vt = np.linalg.svd(one.sensitivity.T @ result.models[chip.name].sensitivity)
            turned.append(replace(one, sensitivity=one.sensitivity @ u @ vt))
        models = turned
    elif result.gauge in {"x_axis", "z_axis"}:
        models = [one.in_gauge(result.gauge) for one in models]
    values = {}
    for chip, one in zip(array.chips, models, strict=True):
        for i, row in enumerate("xyz"):
            values |= {f"{chip.name}_b_{row}": one.bias[i], f"{chip.name}_q_{row}": one.quadratic[i]}
            values |= {f"{chip.name}_M_{row}{column}": one.sensitivity[i, j] for j, column in enumerate("xyz")}
    return np.array([values[name] for name in result.names])


def normalised_errors(
    method: str, poses: Poses, parameters: int | None, runs: int, settings: SensorSettings | None = None, seed: int = 0
) -> dict[str, np.ndarray]:
    """Return (estimate − truth) / standard deviation by kind of parameter (M, b, q), each (runs, number)."""
    found = []
    triangular = parameters == 9 and method in {"six-position", "recursive"}
    levelled = {"levelling_std_rad": 0.0} if "levelling_std_rad" in METHODS[method].options else {}
    names: tuple[str, ...] = ()
    for run in range(runs):
        recording, models = poses.draw(
            np.random.default_rng([seed, run]), settings or SensorSettings(), triangular=triangular
        )
        drawing = poses.array if method == "array" else None
        task = CalibrationTask(recording, n_parameters=parameters, array=drawing, **levelled)
        result = run_calibration(calibration_method(method), task)
        error, std = result.values - truth_of(result, poses.array, models), result.std
        if method == "multi-position" and result.null_space.size:  # the rotation stays at its start: compare the rest
            shown = np.eye(len(error)) - result.null_space @ result.null_space.T
            error, std = shown @ error, np.sqrt(np.diag(shown @ result.covariance @ shown))
        found.append(error / std)
        names = result.names
    table, kinds = np.array(found), np.array([name.split("_")[1] for name in names])
    return {kind: table[:, kinds == kind] for kind in ("M", "b", "q") if kind in kinds}


def main(runs: int) -> None:
    """Print the table."""
    print("| method | array | rms M | rms b | rms q | within 2 σ | within 3 σ |")
    print("|---|---|---|---|---|---|---|")
    for method, name, parameters in CASES:
        poses = Poses.of(AccelerometerArray.load(name))
        errors = normalised_errors(method, poses, parameters, runs)
        rms = [f"{np.sqrt(np.mean(errors[kind] ** 2)):.2f}" if kind in errors else "–" for kind in ("M", "b", "q")]
        flat = np.abs(np.concatenate([part.ravel() for part in errors.values()]))
        shares = [f"{100 * np.mean(flat < limit):.1f} %" for limit in (2.0, 3.0)]
        label = method if parameters is None else f"{method}, {parameters}"
        print(f"| {label} | {name} | {' | '.join([*rms, *shares])} |", flush=True)


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 300)
