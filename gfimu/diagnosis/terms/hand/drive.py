"""The drive of a free body as a nuisance parameter: its specific force, of which nothing is known beforehand."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gfimu.diagnosis.data.body.stretch import BodyStretch
from gfimu.motion.body_drive import BodyDrive

__all__ = ["HandDrive"]


@dataclass(frozen=True)
class HandDrive:
    """The drive of one stretch of a free body; its rate is the gyro's, and its prior is flat.

    Parameters
    ----------
    spin : BodyDrive
        Rate and specific force.
    """

    spin: BodyDrive

    @classmethod
    def of(cls, stretch: BodyStretch) -> HandDrive:
        """Return the drive whose specific force fits the readings of a body that does not turn."""
        run = stretch.run
        force = run.bridged @ np.linalg.pinv(stretch.model.array.axes * stretch.alive[:, None]).T
        return cls(BodyDrive(run.t, run.rate, np.asarray(force)))

    @property
    def is_learnt(self) -> bool:
        """Whether its prior has parameters to learn."""
        return False

    def moved(self, step: NDArray[np.float64]) -> HandDrive:
        """Return the drive with a step (3 n,) of the specific force added, m/s²."""
        return HandDrive(self.spin.with_force(self.spin.force + step.reshape(-1, 3)))

    def following(self, other: HandDrive) -> HandDrive:
        """Return this drive's prior with the motion of another."""
        return other

    def covering(self, times: NDArray[np.float64]) -> HandDrive:
        """Return the drive; it has the times of the samples only."""
        return self
