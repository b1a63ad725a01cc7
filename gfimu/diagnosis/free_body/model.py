"""What the diagnosis of a free body needs of a world model, beyond `gfimu.diagnosis.model`."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from gfimu.diagnosis.free_body.motion import BodyDrive
from gfimu.diagnosis.model import Effect, WorldModel

__all__ = ["BodyModel"]


class BodyModel(WorldModel, Protocol):
    """A simulation of an array on a free body."""

    @property
    def local_gravity(self) -> float:
        """Magnitude of the specific force at rest, m/s²."""
        ...

    def predict_body(
        self,
        drive: BodyDrive,
        t: NDArray[np.float64],
        *,
        effects: Sequence[Effect] = (),
        temperature: NDArray[np.float64] | None = None,
        start: float | None = None,
    ) -> NDArray[np.float64]:
        """Predict noise-free channels (n, c), m/s², from gyro and specific force."""
        ...
