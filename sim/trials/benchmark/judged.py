"""What an answer is worth, as the judge finds it and files hold it."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated

from gfimu.base.declared import Declared, figure

__all__ = ["Judged"]


@dataclass(frozen=True)
class Judged(Declared):
    """What an answer is worth."""

    world: Annotated[str, figure("The world.")]
    method: Annotated[str, figure("The method.")]
    hidden: Annotated[tuple[str, ...], figure("Names that are hidden.")]
    said: Annotated[tuple[str, ...], figure("Claims of the answer; a set is written a|b.")]
    outcome: Annotated[
        str,
        figure(
            "alone (all hidden names and no other), set (in a set, or a tie of it), part (some of several), unknown, "
            "missed, wrong, error; with nothing hidden quiet or false_alarm; of measured data measured, or "
            "contradicted where a size is beyond what the makers state."
        ),
    ]
    points: Annotated[float, figure("Its points; null for measured data.", digits=".5g")]
    z: Annotated[
        tuple[float, ...],
        figure(
            "(estimate − truth)/std of each size that has a std, of causes that are hidden.",
            digits=".3f",
            before="points",
        ),
    ] = ()
    removed: Annotated[
        float,
        figure(
            "Share of the squared distance to the true world that the answer removes in a motion that no method saw; "
            "null where it can't be measured.",
            digits=".5g",
        ),
    ] = math.nan
    expected_ratio: Annotated[
        float,
        figure(
            "Rms error that the method expects on a new recording over the one that its answer has there; null "
            "likewise.",
            digits=".5g",
        ),
    ] = math.nan
    processor_s: Annotated[float, figure("Processor time; null where it is not given.", "s", digits=".5g")] = math.nan

    @property
    def set_name(self) -> str:
        """Set of the world."""
        return self.world.partition("/")[0]
