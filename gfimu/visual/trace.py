"""The way of the body origin in the world: a line in space, and a point that runs along it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import rerun as rr
import rerun.blueprint as rrb
from numpy.typing import NDArray

from gfimu.base.results.colours import Colour
from gfimu.visual.colours import ESTIMATE, TRUTH
from gfimu.visual.scene import TIMELINE

__all__ = ["PositionTrace"]

_MOST_POINTS = 5000
_ENTITY = "trace"


@dataclass(frozen=True)
class PositionTrace:
    """Estimated positions in the world, with the true ones where they are known.

    Parameters
    ----------
    t : ndarray, shape (n,)
        Times, s.
    position : ndarray, shape (n, 3)
        Estimated position, m; NaN where unknown.
    truth : ndarray, shape (m, 3), optional
        True positions, m.
    """

    t: NDArray[np.float64]
    position: NDArray[np.float64]
    truth: NDArray[np.float64] | None = None

    def log(self, stream: rr.RecordingStream) -> None:
        """Write the lines, and the running point by columns."""
        known = np.flatnonzero(np.isfinite(self.position).all(axis=1))
        keep = known[:: max(1, len(known) // _MOST_POINTS)]
        if not len(keep):
            return
        places = self.position[keep]
        self._log_line(stream, "estimate", places, ESTIMATE)
        if self.truth is not None:
            self._log_line(stream, "truth", self.truth[np.isfinite(self.truth).all(axis=1)], TRUTH)
        ends = np.stack([places[0], places[-1]])
        labels = rr.Points3D(ends, labels=["start", "end"], radii=rr.Radius.ui_points(4.0), colors=[ESTIMATE] * 2)
        stream.log(f"{_ENTITY}/ends", labels, static=True)
        point = f"{_ENTITY}/now"
        stream.log(point, rr.Points3D.from_fields(radii=rr.Radius.ui_points(6.0), colors=[ESTIMATE]), static=True)
        stream.send_columns(
            point, [rr.TimeColumn(TIMELINE, duration=self.t[keep])], rr.Points3D.columns(positions=places)
        )

    @staticmethod
    def _log_line(stream: rr.RecordingStream, name: str, places: NDArray[np.float64], colour: Colour) -> None:
        line = rr.LineStrips3D([places], colors=[colour], radii=rr.Radius.ui_points(1.5))
        stream.log(f"{_ENTITY}/{name}", line, static=True)

    def view(self) -> rrb.Spatial3DView:
        """Return the view of the trace for a blueprint: the whole line from the side, above."""
        places = self.position[np.isfinite(self.position).all(axis=1)]
        places = places if len(places) else np.zeros((1, 3))
        centre = 0.5 * (places.min(axis=0) + places.max(axis=0))
        size = max(float(np.ptp(places, axis=0).max()), 1e-3)
        return rrb.Spatial3DView(
            origin=f"/{_ENTITY}",
            name="way in the world, m",
            eye_controls=rrb.EyeControls3D(
                kind=rrb.Eye3DKind.Orbital,
                position=list(centre + 1.3 * size * np.array([0.7, -1.0, 0.8])),
                look_target=list(centre),
                eye_up=[0, 0, 1],
            ),
        )
