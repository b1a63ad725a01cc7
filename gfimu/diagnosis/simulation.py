"""What a model makes of a stretch of a run: its channels and its reference, for a drive.

The drive is held in units of the reference: where effects change the reference's gain, the motion is the drive over
that gain. Held in true units, a gain that shrinks the drive would be paid for it by the roughness prior, once per
coefficient.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gfimu.diagnosis.data.run import Run
from gfimu.diagnosis.drive import JoinedSpin, ScaledSpin
from gfimu.world_model import Effect, ModelWithModes, ModelWithPlay, ModelWithRipple, Spin, WorldModel

__all__ = ["RunUp", "Simulation"]

_LEAST_GAIN = 0.05


@dataclass(frozen=True)
class RunUp:
    """The samples of a run before a block that is cut from it, and the drive there.

    A play, a mode or a filter has a state at the start of the block that only the motion before it determines.

    Parameters
    ----------
    t : ndarray, shape (m,)
        Times, s.
    temperature : ndarray, shape (m,), optional
        Temperature of the board, where the run has it.
    drive : Spin
        The drive in units of the reference.
    """

    t: NDArray[np.float64]
    temperature: NDArray[np.float64] | None
    drive: Spin


@dataclass(frozen=True)
class Simulation:
    """A model of one stretch of a run.

    Parameters
    ----------
    model : WorldModel
        The simulation.
    run : Run
        The stretch.
    start : float
        Time at which the whole run began, s.
    run_up : RunUp, optional
        What came before the stretch, where it is a block of a run.
    """

    model: WorldModel
    run: Run
    start: float
    run_up: RunUp | None = None

    def predict(self, effects: Sequence[Effect], drive: Spin) -> NDArray[np.float64]:
        """Predict channels and reference, shape (n, c + 1)."""
        if self.run_up is not None and self.remembers(effects):
            return self._after_run_up(effects, drive, self.run_up)
        return self.of_motion(effects, self.motion(effects, drive))

    def remembers(self, effects: Sequence[Effect]) -> bool:
        """Tell whether a reading depends on the motion before its own instant."""
        model = self.model
        return (
            model.sensing_lag(effects) > 0.0
            or (isinstance(model, ModelWithPlay) and model.play(effects) is not None)
            or (isinstance(model, ModelWithModes) and len(model.modes(effects)) > 0)
            or (isinstance(model, ModelWithRipple) and model.ripple(effects) is not None)
        )

    def _after_run_up(self, effects: Sequence[Effect], drive: Spin, before: RunUp) -> NDArray[np.float64]:
        """Predict the run-up and the stretch together, and return the stretch."""
        joined = JoinedSpin(before.drive, drive, 0.5 * float(before.t[-1] + self.run.t[0]))
        temperature = None
        if self.run.temperature is not None and before.temperature is not None:
            temperature = np.concatenate([before.temperature, self.run.temperature])
        channels, reference = self.model.predict(
            self.motion(effects, joined),
            np.concatenate([before.t, self.run.t]),
            effects=effects,
            temperature=temperature,
            mounting=self.run.mounting,
            start=self.start,
        )
        return np.column_stack([channels, reference])[len(before.t) :]

    def of_motion(
        self, effects: Sequence[Effect], motion: Spin, model: WorldModel | None = None
    ) -> NDArray[np.float64]:
        """Predict the same from a table's motion, by this or another model."""
        channels, reference = (model or self.model).predict(
            motion,
            self.run.t,
            effects=effects,
            temperature=self.run.temperature,
            mounting=self.run.mounting,
            start=self.start,
        )
        return np.column_stack([channels, reference])

    def motion(self, effects: Sequence[Effect], drive: Spin) -> Spin:
        """Return the table's motion for a drive under effects."""
        gain = self.gain(effects)
        return drive if gain == 1.0 else ScaledSpin(drive, gain)

    def gain(self, effects: Sequence[Effect]) -> float:
        """Return what the reference reads per unit of motion."""
        gain = self.model.reference_gain(effects)
        return float(np.copysign(max(abs(gain), _LEAST_GAIN), gain))
