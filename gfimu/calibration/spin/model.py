"""What the channels of an array read on a table at a constant rate, with the derivatives by all that is unknown.

In the array's frame the table's axis is the line through o along the unit vector n. A chip at r is at the arm
ρ = r − o − n nᵀ(r − o), and its specific force at the rate ω is

    a = g n − ω² (1 + s ω²) ρ + ω̇ n × ρ,    n and o of a plateau: n + ω² d and o + ω² h,

with arm stretch s, and dynamic levelling: with the load the array leans against the axis (d) and moves across it (h).
At rest the lean of the axis adds a constant across n. ω² is that of the tachometer times (1 + 2 e), e being its scale
error.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from gfimu.array.array import AccelerometerArray
from gfimu.calibration.error_model import ErrorModel
from gfimu.calibration.spin.plateaus import Plateaus

__all__ = ["Geometry", "SpinGeometry", "read_plateaus"]

Floats = NDArray[np.float64]

_CROSS = -np.cross(np.eye(3)[:, None], np.eye(3)[None])  # numerical: n × ρ = nⱼ ρᵢ of it
_STEP = 1e-4  # numerical: of a prior standard deviation; the forces are all but linear in every unknown


@dataclass(frozen=True)
class Geometry:
    """Unknowns of the table, as slices of one vector of m numbers.

    Parameters
    ----------
    radii : slice
        Displacement of each chip from its drawing, three per chip, m.
    offset, direction : slice
        Place (m) and direction (rad) of the axis against the start, two each.
    levelling, shift : slice
        Dynamic levelling: lean d, rad per (rad/s)², and shift h, m per (rad/s)², two each.
    stretch, tacho_scale : slice
        Arm stretch s, s²/rad², and scale error e of the tachometer.
    squares : slice
        ω² of each plateau that turns against the tachometer's, rad²/s².
    leans : slice
        Lean of the vertical against the axis at each rest, two per rest, rad.
    drawing : slice
        Drawing against the frame of the calibration, three, rad: the mean rotation of the sensing axes, which defines
        that frame, is not that of the chips' places.
    rotations : slice
        Frame of each chip against that of the array, three per chip, rad; empty where it is the array's own.
    """

    radii: slice
    offset: slice
    direction: slice
    levelling: slice
    shift: slice
    stretch: slice
    tacho_scale: slice
    squares: slice
    leans: slice
    drawing: slice
    rotations: slice

    @classmethod
    def of(cls, chips: int, plateaus: Plateaus, *, own_frames: bool) -> Geometry:
        """Lay the unknowns out one after another."""
        turning = int(plateaus.spinning.sum())
        sizes = [3 * chips, 2, 2, 2, 2, 1, 1, turning, 2 * (len(plateaus) - turning), 3, 3 * chips * own_frames]
        ends = np.cumsum(sizes)
        return cls(*(slice(int(end - size), int(end)) for end, size in zip(ends, sizes, strict=True)))

    @property
    def size(self) -> int:
        """Number of unknowns."""
        return int(self.rotations.stop)


@dataclass(frozen=True)
class SpinGeometry:
    """The array on the table, as far as it is known before the fit.

    Parameters
    ----------
    array : AccelerometerArray
        The drawing, with fitted positions where there are any.
    plateaus : Plateaus
        k plateaus.
    frame : ndarray, shape (3, 3)
        Rows: two directions across the axis and the axis n, array's frame.
    offset : ndarray, shape (3,)
        A point of the axis, m.
    gravity : float
        Component of gravity along the axis, m/s².
    layout : Geometry
        Where the unknowns stand.
    """

    array: AccelerometerArray
    plateaus: Plateaus
    frame: Floats
    offset: Floats
    gravity: float
    layout: Geometry

    def forces(self, unknowns: Floats) -> Floats:
        """Return the specific force along each chip's frame, shape (k, chips, 3), m/s²."""
        at, runs = self.layout, self.plateaus
        across, axis = self.frame[:2], self.frame[2]
        square = runs.square * (1.0 + 2.0 * unknowns[at.tacho_scale])
        square[runs.spinning] += unknowns[at.squares]
        lean = unknowns[at.direction] + square[:, None] * unknowns[at.levelling]  # (k, 2)
        n = axis + lean @ across
        n /= np.linalg.norm(n, axis=1, keepdims=True)  # (k, 3)
        turned = Rotation.from_rotvec(unknowns[at.drawing]).apply(self.array.chip_positions)
        places = turned + unknowns[at.radii].reshape(-1, 3)
        point = self.offset + (unknowns[at.offset] + square[:, None] * unknowns[at.shift]) @ across  # (k, 3)
        arms = places - point[:, None, :]  # (k, chips, 3)
        arms = arms - np.einsum("kci,ki->kc", arms, n)[:, :, None] * n[:, None, :]
        load = square * (1.0 + square * unknowns[at.stretch])
        force = self.gravity * n[:, None, :] - load[:, None, None] * arms
        force += runs.slope[:, None, None] * np.einsum("kj,kci,ijl->kcl", n, arms, _CROSS)
        force[~runs.spinning] += self.gravity * (unknowns[at.leans].reshape(-1, 2) @ across)[:, None, :]
        axes = np.array([chip.axes for chip in self.array.chips])  # (chips, 3, 3)
        if at.rotations.stop > at.rotations.start:
            axes = Rotation.from_rotvec(unknowns[at.rotations].reshape(-1, 3)).as_matrix() @ axes
        return np.asarray(np.einsum("cij,kcj->kci", axes, force), dtype=np.float64)

    def slopes(self, unknowns: Floats, std: Floats) -> Floats:
        """Return the derivatives of `forces` by the unknowns, shape (k, chips, 3, m), by central differences."""
        found = []
        for index in range(len(unknowns)):
            step = np.zeros(len(unknowns))
            step[index] = _STEP * std[index]
            found.append((self.forces(unknowns + step) - self.forces(unknowns - step)) / (2.0 * step[index]))
        return np.stack(found, axis=-1)


def read_plateaus(
    geometry: SpinGeometry,
    unknowns: Floats,
    std: Floats,
    models: list[ErrorModel],
    place: Callable[[int, str], int],
    sensors: int,
) -> tuple[Floats, Floats]:
    """Return the readings of all plateaus and their derivatives.

    Parameters
    ----------
    geometry : SpinGeometry
        The array on the table.
    unknowns, std : ndarray, shape (m,)
        Unknowns of the table, and their standard deviations before the data.
    models : list of ErrorModel
        Of each chip.
    place : callable
        Where a chip's parameter (number, ``M_xy`` …) stands among the ``sensors`` parameters; −1 where it is none.
    sensors : int
        Number of sensor parameters.

    Returns
    -------
    readings : ndarray, shape (k, c)
        Reading unit.
    jacobian : ndarray, shape (k, c, sensors + m)
        By the sensor parameters, then by those of the table. With u − q u² − c u³ = M a and u = l − b:
        ∂u/∂(M a) = 1/(1 − 2 q u − 3 c u²), of which ∂u/∂q is u² times as much and ∂u/∂c u³ times.
    """
    forces = geometry.forces(unknowns)
    slopes = geometry.slopes(unknowns, std)
    k, chips, _ = forces.shape
    readings = np.zeros((k, chips, 3))
    jacobian = np.zeros((k, chips, 3, sensors + len(unknowns)))
    for index, model in enumerate(models):
        force = forces[:, index]
        readings[:, index] = model.read(force)
        u = readings[:, index] - model.bias
        gain = 1.0 / (1.0 - u * (2.0 * model.quadratic + 3.0 * model.cubic * u))  # (k, 3)
        jacobian[:, index, :, sensors:] = gain[:, :, None] * (model.sensitivity @ slopes[:, index])
        for row, i in enumerate("xyz"):
            own = jacobian[:, index, row]
            own[:, place(index, f"b_{i}")] = 1.0
            own[:, place(index, f"q_{i}")] = gain[:, row] * u[:, row] ** 2
            own[:, place(index, f"c_{i}")] = gain[:, row] * u[:, row] ** 3
            for column, j in enumerate("xyz"):
                if (at := place(index, f"M_{i}{j}")) >= 0:
                    own[:, at] = gain[:, row] * force[:, column]
    return readings.reshape(k, -1), jacobian.reshape(k, 3 * chips, -1)
