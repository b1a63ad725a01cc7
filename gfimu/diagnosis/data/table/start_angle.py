"""The angle at which a table whose axis is not vertical began: gravity shows it, a tachometer does not."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gfimu.diagnosis.data.run import Run
from gfimu.diagnosis.data.table.spins import State
from gfimu.model.world_model import Effect, SpinState, WorldModel

__all__ = ["AngleReading", "gravity_angle"]


@dataclass(frozen=True)
class AngleReading:
    """How the angle at the start is read from gravity; all by choice.

    Parameters
    ----------
    turn : float
        Angle by which the table turns meanwhile [rad].
    samples : int
        Fewest samples that are read [count].
    angles : int
        Angles that are tried [count].
    std : float
        Standard deviation of the angle that is found [rad]: that of 0.1 g of biases across the axis.
    """

    turn: float = 0.5
    samples: int = 10
    angles: int = 72
    std: float = 0.1


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
    model: WorldModel, run: Run, motion: State, effects: tuple[Effect, ...] = (), how: AngleReading = AngleReading()
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
    how : AngleReading
        How long and how finely.

    Returns
    -------
    tuple of float, or None
        None where the axis is vertical, or nothing counts.
    """
    if not getattr(model, "axis_inclination", 0.0):  # rad from the vertical; other rigs need not say so
        return None
    near = np.abs(motion.angle - motion.angle[0]) < how.turn
    stop = max(int(np.argmin(near)) if not near.all() else len(near), how.samples)
    part = run.rows(0, stop)
    if not part.valid.any():
        return None
    at_first = State(motion.angle - motion.angle[0], motion.rate, motion.acceleration)

    def misfit(angle: float) -> float:
        spin = _Turned(run.t, at_first, angle)
        predicted, _ = model.predict(spin, part.t, effects=effects, mounting=run.mounting, start=float(run.t[0]))
        return float(np.sum(np.where(part.valid, part.readings - predicted, 0.0) ** 2))

    angles = np.arange(how.angles) * (2.0 * np.pi / how.angles)
    values = np.array([misfit(float(angle)) for angle in angles])
    # Gravity is a sine of the angle: so is the misfit, but for products that a fit of three terms leaves out.
    waves = np.column_stack([np.ones(how.angles), np.cos(angles), np.sin(angles)])
    _, cosine, sine = np.linalg.lstsq(waves, values, rcond=None)[0]
    return float(np.arctan2(-sine, -cosine)), how.std
