"""The points of the grammar that the search tries (`sim.effects.grammar`), by name."""

from __future__ import annotations

from sim.effects.grammar import Unlisted
from sim.effects.unlisted_chips import (
    Cubic,
    GainByLoad,
    GainByRateSquared,
    GainBySpeed,
    GainTemperature,
    LaggedTemperature,
    OffsetByLoad,
    OffsetBySpeed,
    TemperatureGradient,
)
from sim.effects.unlisted_rig import (
    LeanByAcceleration,
    LeanByRate,
    LeanByRateSquared,
    LeanByTurns,
    ReferenceCube,
    ReferenceEven,
    ReferenceOffset,
    ReferenceSpeed,
    ReferenceSquare,
)

__all__ = ["UNLISTED", "Unlisted"]

UNLISTED: dict[str, type[Unlisted]] = {
    point.name: point
    for point in (
        ReferenceOffset,
        ReferenceSpeed,
        ReferenceSquare,
        ReferenceEven,
        ReferenceCube,
        LeanByRateSquared,
        LeanByRate,
        LeanByAcceleration,
        LeanByTurns,
        GainBySpeed,
        GainByRateSquared,
        GainByLoad,
        GainTemperature,
        OffsetBySpeed,
        OffsetByLoad,
        Cubic,
        LaggedTemperature,
        TemperatureGradient,
    )
}
"""Every point of the grammar that the search tries, by name."""
