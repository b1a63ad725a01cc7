"""How the array of a diagnosis stood in its rig, for its pictures."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from gfimu.diagnosis.criticism.views.run_view import RunView
from gfimu.geometry.array import AccelerometerArray
from gfimu.geometry.turning_axis import TurningAxis

if TYPE_CHECKING:
    from gfimu.visual.scene import Shape

__all__ = ["DrawnRig"]


@dataclass(frozen=True)
class DrawnRig:
    """Where the array stood on its table, and what the table looks like.

    Parameters
    ----------
    mounting : ndarray, shape (3,)
        Rotation vector from the body as it stood to the table frame, rad.
    centre : ndarray, shape (3,)
        Body origin in the table frame, m.
    shapes : mapping of str to sequence of Shape, optional
        Shapes of ``base``, ``table`` and ``cube`` of the extended rig; a plain rig sized from the array otherwise.
    slide : ndarray, shape (3,), optional
        Direction in which a carriage moves, in place of a table that turns.
    """

    mounting: NDArray[np.float64] = field(default_factory=lambda: np.zeros(3))
    centre: NDArray[np.float64] = field(default_factory=lambda: np.array([0.0, 0.0, 0.06]))
    shapes: Mapping[str, Sequence[Shape]] | None = None
    slide: NDArray[np.float64] | None = None

    def seen_from(
        self, array: AccelerometerArray, run: RunView | None
    ) -> tuple[TurningAxis | None, NDArray[np.float64] | None, str]:
        """Return the axis of rotation and the direction of gravity in the body frame, and what its arrow is called.

        A free body has no axis but the array's own, and gravity is that of its first sample.
        """
        if run is not None and run.attitude is not None:
            known = np.flatnonzero(np.isfinite(run.attitude).all(axis=1))
            if not len(known):
                return array.turning_axis, None, ""
            first = Rotation.from_quat(run.attitude[known[0]], scalar_first=True)
            return array.turning_axis, first.inv().apply(_down()), "gravity at the start"
        turn = Rotation.from_rotvec(self.mounting).inv()
        if self.slide is not None:
            return array.turning_axis, turn.apply(_down()), "gravity"
        table = TurningAxis(turn.apply(-_down()), turn.apply(-np.asarray(self.centre, dtype=float)))
        return array.turning_axis or table, turn.apply(_down()), "gravity"


def _down() -> NDArray[np.float64]:
    """Return the direction of gravity in the world, (3,)."""
    return np.array([0.0, 0.0, -1.0])
