"""How chips are mounted, from a recording with a reference: the axes of each, and the distance of a single one.

The twin predicts the specific force f at each chip in the body's axes; a chip reads A f with a rotation A, its sensing
axes. A is the rotation that brings the predicted vectors nearest to the readings (W. Kabsch, Acta Cryst. A32, 1976,
p. 922). Each channel has a bias with a prior, so the means count no more than that allows. Where f stays in a plane the
third axis follows from the right hand.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize_scalar

from gfimu.base.difference_noise import difference_noise
from gfimu.diagnosis.data.run import prepare_run
from gfimu.diagnosis.fit.learn import predicted_by_reference
from gfimu.model.world_model import WorldModel
from gfimu.recording import Recording

__all__ = ["Mounted", "chip_axes", "chip_distance"]


@dataclass(frozen=True)
class MountingPolicy:
    """Numbers by which a mounting is found.

    Parameters
    ----------
    near_square : float
        Angle from a mounting along the rig's axes within which the chip is taken for mounted so [rad]. 11°: chips are
        soldered along the edges of a board, and a smaller angle is what a diagnosis finds as an error of the mounting.
    bias : float
        Standard deviation of the bias of a channel [m/s²]. 50 mg: zero-g offsets of data sheets are 20 to 80 mg.
    longest : float
        Longest distance of a chip from the axis that is searched [m]. By choice: longer than the arm of any table.
    """

    near_square: float = 0.2
    bias: float = 0.5
    longest: float = 5.0


_POLICY = MountingPolicy()


@dataclass(frozen=True)
class Mounted:
    """Axes of one chip.

    Parameters
    ----------
    axes : ndarray, shape (3, 3)
        Its sensing axes in the body's axes, one per row.
    off_square_rad : float
        Angle from the nearest mounting along the body's axes, which ``axes`` is where this is small.
    rms : float
        Distance of the readings from those predicted, without biases, m/s².
    """

    axes: NDArray[np.float64]
    off_square_rad: float
    rms: float


def chip_axes(recording: Recording, model: WorldModel) -> list[Mounted]:
    """Return the axes of each chip of a twin's array, whose own axes are left aside.

    Parameters
    ----------
    recording : Recording
        Readings in m/s², three channels per chip, and the reference that drives the twin.
    model : WorldModel
        The twin. The axes of its chips are the body's.

    Raises
    ------
    InputError
        As `gfimu.diagnosis.data.run.prepare_run`.
    """
    run = prepare_run(recording, model)
    return _mounted(run.readings, predicted_by_reference(model, run), run.valid)


def chip_distance(recording: Recording, at: Callable[[float], WorldModel]) -> float:
    """Return the distance of a single chip from the axis, m, at which its readings are nearest to the twin's.

    Parameters
    ----------
    recording : Recording
        Readings in m/s² and the reference.
    at : callable
        The twin with the chip at a distance, m.
    """
    run = prepare_run(recording, at(0.0))
    near = predicted_by_reference(at(0.0), run)
    per_metre = predicted_by_reference(at(1.0), run) - near  # what a rigid body adds grows with the distance

    def misfit(distance: float) -> float:
        return _mounted(run.readings, near + distance * per_metre, run.valid)[0].rms

    options = {"xatol": 1e-5}  # numerical: m
    return float(minimize_scalar(misfit, bounds=(0.0, _POLICY.longest), method="bounded", options=options).x)


def _mounted(readings: NDArray[np.float64], predicted: NDArray[np.float64], valid: NDArray[np.bool_]) -> list[Mounted]:
    found = []
    for first in range(0, readings.shape[1] - 2, 3):
        three = slice(first, first + 3)
        rows = valid[:, three].all(axis=1)
        measured, expected = readings[rows, three], predicted[rows, three]
        middle, around = measured.mean(axis=0), expected.mean(axis=0)
        noise = max(float(np.median([difference_noise(one) for one in measured.T])), 1e-6)  # numerical: ideal ones
        weight = 1.0 / (1.0 / len(measured) + (_POLICY.bias / noise) ** 2)  # samples that the means count as
        moment = (measured - middle).T @ (expected - around) + weight * np.outer(middle, around)
        left, _, right = np.linalg.svd(moment)
        axes = left @ np.diag([1.0, 1.0, np.linalg.det(left @ right)]) @ right
        square = _nearest_square(axes)
        angle = float(np.arccos(np.clip(0.5 * (np.trace(axes @ square.T) - 1.0), -1.0, 1.0)))
        misfit = (measured - middle) - (expected - around) @ axes.T
        rms = float(np.sqrt(np.mean(np.sum(misfit**2, axis=1))))
        found.append(Mounted(square if angle < _POLICY.near_square else axes, angle, rms))
    return found


def _nearest_square(axes: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the mounting along the body's axes that is nearest to a rotation, greedily by its largest elements."""
    square, left = np.zeros((3, 3)), np.abs(axes)
    for _ in range(3):
        row, column = np.unravel_index(int(np.argmax(left)), left.shape)
        square[row, column] = np.sign(axes[row, column])
        left[row, :] = left[:, column] = -1.0
    return square
