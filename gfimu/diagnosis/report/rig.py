"""How the array of a diagnosis stood in its rig, for its pictures."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from gfimu.array.array import AccelerometerArray
from gfimu.array.turning_axis import TurningAxis
from gfimu.diagnosis.criticism.views.run_view import RunView
from gfimu.diagnosis.policy import Policy
from gfimu.diagnosis.verdict.parts import NamedCause
from gfimu.diagnosis.verdict.verdict import Diagnosis
from gfimu.visual.rig.figure import Marked

if TYPE_CHECKING:
    from gfimu.visual.scene import Shape

__all__ = ["DrawnRig", "marked_of", "marked_words"]


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
    lean : ndarray, shape (3,), optional
        Rotation vector from the world to the frame of an axis that is not a table's but a pendulum's, rad.
    """

    mounting: NDArray[np.float64] = field(default_factory=lambda: np.zeros(3))
    centre: NDArray[np.float64] = field(default_factory=lambda: np.array([0.0, 0.0, 0.06]))
    shapes: Mapping[str, Sequence[Shape]] | None = None
    slide: NDArray[np.float64] | None = None
    lean: NDArray[np.float64] | None = None

    def seen_from(
        self, array: AccelerometerArray, run: RunView | None
    ) -> tuple[TurningAxis | None, NDArray[np.float64] | None, str]:
        """Return the axis of rotation and the direction of gravity in the body frame, and what its arrow is called.

        A free body has no axis but the array's own. Gravity is that of the first sample where it turns in the body.
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
        own = array.turning_axis or self.axis
        if self.lean is None:
            return own, turn.apply(_down()), "gravity"
        angle = 0.0 if run is None or not np.isfinite(run.angle[0]) else float(run.angle[0])
        first = self.attitude(np.array([angle]))[0]
        return own, first.inv().apply(_down()), "gravity at the start"

    @property
    def axis(self) -> TurningAxis:
        """The axis of the rig in the body frame."""
        turn = Rotation.from_rotvec(self.mounting).inv()
        return TurningAxis(turn.apply(-_down()), turn.apply(-np.asarray(self.centre, dtype=float)))

    def attitude(self, angle: NDArray[np.float64]) -> Rotation:
        """Return the attitudes of the body, body to world, at angles (n,) about the rig's axis, rad."""
        about = Rotation.from_rotvec(np.outer(angle, -_down()))
        axis = Rotation.identity() if self.lean is None else Rotation.from_rotvec(self.lean)
        return axis * about * Rotation.from_rotvec(self.mounting)

    def places(self, angle: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the places of the body's origin, m, (n, 3); those of a pendulum are lifted above the ground."""
        centre = np.asarray(self.centre, dtype=float)
        about = Rotation.from_rotvec(np.outer(angle, -_down()))
        if self.lean is None:
            return np.asarray(about.apply(centre))
        lift = -float(np.linalg.norm(centre)) * _down()
        return np.asarray(Rotation.from_rotvec(self.lean).apply(about.apply(centre)) + lift)


_OF_AXIS = {"geometry", "motion", "reference", "timing", "clock", "bench"}
"""Places of effects and of errors without a name that are the rig's, and not the array's."""


def marked_of(diagnosis: Diagnosis) -> Marked:
    """Return where the causes of a diagnosis are: their chips, or the package, or the axis with what turns about it."""
    array, families = diagnosis.twin.array, diagnosis.twin.families()
    chips, kinds = set[int](), set[str]()
    for cause in diagnosis.causes:
        if own := _chips(cause, array):
            chips |= own
        elif cause.unlisted is not None:
            kinds.add(cause.unlisted.place)
        elif cause.effect in families:
            kinds.add(families[cause.effect].place)
    if kinds & {"sensing", "supply"}:
        chips |= set(range(len(array.chips)))
    return Marked(frozenset(chips), bool(kinds & {"geometry", "array"}), bool(kinds & _OF_AXIS))


def _chips(cause: NamedCause, array: AccelerometerArray) -> set[int]:
    """Return the chips that a cause names: by its series, or by the keys of its sizes that stand out."""
    seen = [key for key, std in cause.std.items() if abs(float(cause.parameters[key])) > Policy.stds * std]
    words = [*(cause.unlisted.series if cause.unlisted is not None else seen), *cause.place.split()]
    names = {word.partition("_")[0] for word in words}
    of_channels = zip(array.channels, array.chip_of_channel, strict=True)
    found = {int(chip) for channel, chip in of_channels if channel in names}
    return found | {number for number, chip in enumerate(array.chips) if chip.name in names}


def marked_words(marked: Marked, array: AccelerometerArray, *, has_axis: bool) -> str:
    """Return what a drawing marks."""
    parts = ["the array as a whole"] if marked.package else []
    if marked.chips:
        names = [array.chips[number].name for number in sorted(marked.chips)]
        parts.append("every chip" if len(names) == len(array.chips) else f"chip {', '.join(names)}")
    if marked.axis:
        parts.append("the axis, with the table and its reference" if has_axis else "the gyro, which is not drawn")
    return "; ".join(parts) or "nowhere in the array"


def _down() -> NDArray[np.float64]:
    """Return the direction of gravity in the world, (3,)."""
    return np.array([0.0, 0.0, -1.0])
