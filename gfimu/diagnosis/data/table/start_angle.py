"""The angle at which a table whose axis is not vertical began: gravity shows it, a tachometer does not."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gfimu.diagnosis.data.run import Run
from gfimu.diagnosis.data.table.spins import State
from gfimu.world_model import Effect, SpinState, WorldModel, axis_inclination

__all__ = ["ANGLE_STD", "gravity_angle"]

ANGLE_STD = 0.1
"""Standard deviation of the angle that is found, rad: that of 0.1 g of biases across the axis. By choice."""

_TURN, _LEAST = 0.5, 10  # rad that the table turns while the angle is read, and samples; numerical
_GRID = 72  # numerical: angles that are tried first


class _Turned:
    """A motion given at the samples of a run, with another angle at the start."""

    def __init__(self, t: NDArray[np.float64], state: State, angle: float) -> None:
        self._t, self._state, self._angle = t, state, angle

    def at(self, t: ArrayLike) -> SpinState:
        """Return the state at times (n,), s."""
        times = np.asarray(t, dtype=float)
        angle, rate, acceleration = (
            np.interp(times, self._t, one) for one in (self._state.angle, self._state.rate, self._state.acceleration)
        )
        return State(angle + self._angle, rate, acceleration)


def gravity_angle(
    model: WorldModel, run: Run, motion: State, effects: tuple[Effect, ...] = ()
) -> tuple[float, float] | None:
    """Return the table's angle at the first sample by gravity, and its standard deviation, rad.

    It compares the readings of the first half radian with predictions for every angle; least squares, the biases left
    out of account.

    Parameters
    ----------
    model : WorldModel
        The simulation.
    run : Run
        The samples.
    motion : State
        Angle turned since the first sample (rad), rate and acceleration at every sample, by the reference.
    effects : tuple of Effect
        Faults that the readings have.

    Returns
    -------
    tuple of float, or None
        None where the axis is vertical, or nothing counts.
    """
    if not axis_inclination(model):
        return None
    near = np.abs(motion.angle - motion.angle[0]) < _TURN
    stop = max(int(np.argmin(near)) if not near.all() else len(near), _LEAST)
    part = run.rows(0, stop)
    if not part.valid.any():
        return None
    at_first = State(motion.angle - motion.angle[0], motion.rate, motion.acceleration)

    def misfit(angle: float) -> float:
        spin = _Turned(run.t, at_first, angle)
        predicted, _ = model.predict(spin, part.t, effects=effects, mounting=run.mounting, start=float(run.t[0]))
        return float(np.sum(np.where(part.valid, part.readings - predicted, 0.0) ** 2))

    angles = np.arange(_GRID) * (2.0 * np.pi / _GRID)
    values = np.array([misfit(float(angle)) for angle in angles])
    # Gravity is a sine of the angle: so is the misfit, but for products that a fit of three terms leaves out.
    waves = np.column_stack([np.ones(_GRID), np.cos(angles), np.sin(angles)])
    _, cosine, sine = np.linalg.lstsq(waves, values, rcond=None)[0]
    return float(np.arctan2(-sine, -cosine)), ANGLE_STD
