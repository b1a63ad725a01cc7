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

from gfimu.diagnosis.drive import ScaledSpin
from gfimu.diagnosis.model import Effect, Spin, WorldModel
from gfimu.diagnosis.run import Run

__all__ = ["Simulation"]

_LEAST_GAIN = 0.05


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
    """

    model: WorldModel
    run: Run
    start: float

    def predict(self, effects: Sequence[Effect], drive: Spin) -> NDArray[np.float64]:
        """Predict channels and reference, shape (n, c + 1)."""
        return self.of_motion(effects, self.motion(effects, drive))

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
