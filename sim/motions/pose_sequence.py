"""The motion of a calibration by hand: one static pose after another, with a smooth turn between them."""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial.transform import Rotation

from gfimu.base.errors import InputError, check_name
from sim.motions.motion import BodyState

__all__ = ["POSE_SETS", "PoseSequence"]

_UNITS = np.array(
    sorted((v for v in itertools.product((-1, 0, 1), repeat=3) if any(v)), key=lambda v: np.abs(v).sum()), dtype=float
)

POSE_SETS = {"faces": 6, "faces_edges": 18, "faces_edges_corners": 26}
"""Sets of poses and how many there are: the 6 faces up in turn, with the 12 edges, with the 8 corners."""


@dataclass(frozen=True)
class PoseSequence:
    """Body that rests with each of a set of directions up in turn; its origin stays where it is.

    Parameters
    ----------
    poses : str
        A key of `POSE_SETS`.
    rest : float
        Time at rest in each pose, s.
    turn : float
        Time of a turn to the next pose, s.
    """

    poses: str = "faces_edges"
    rest: float = 6.0
    turn: float = 2.0

    def __post_init__(self) -> None:
        check_name("set of poses", self.poses, POSE_SETS)
        if not (self.rest > 0 and self.turn > 0):
            raise InputError("poses: rest_s and turn_s must be positive")

    @property
    def duration(self) -> float:
        """Time until the last rest is over, s."""
        count = POSE_SETS[self.poses]
        return count * self.rest + (count - 1) * self.turn

    @cached_property
    def _turns(self) -> tuple[Rotation, NDArray[np.float64]]:
        """Attitude in each pose, and the rotation vectors from one to the next in body axes, (m − 1, 3), rad."""
        up = _UNITS[: POSE_SETS[self.poses]]
        up = up / np.linalg.norm(up, axis=1, keepdims=True)
        attitudes = Rotation.concatenate([Rotation.align_vectors([[0.0, 0.0, 1.0]], [d])[0] for d in up])
        return attitudes, (attitudes[:-1].inv() * attitudes[1:]).as_rotvec()

    def at(self, t: ArrayLike) -> BodyState:
        """State of the body at times ``t``, s, shape (n,)."""
        time = np.asarray(t, dtype=float)
        attitudes, turns = self._turns
        period = self.rest + self.turn
        pose = np.clip(np.floor(time / period).astype(int), 0, len(turns))
        x = np.clip((time - pose * period - self.rest) / self.turn, 0.0, 1.0)
        step = np.vstack([turns, np.zeros(3)])[pose]  # (n, 3)
        share = x**3 * (10 - 15 * x + 6 * x**2)
        speed = 30 * x**2 * (1 - x) ** 2 / self.turn
        slope = 60 * x * (1 - x) * (1 - 2 * x) / self.turn**2
        still = np.zeros((len(time), 3))
        return BodyState(
            position=still,
            rotation=(attitudes[pose] * Rotation.from_rotvec(share[:, None] * step)).as_matrix(),
            velocity=still,
            acceleration=still,
            omega=speed[:, None] * step,
            alpha=slope[:, None] * step,
        )
