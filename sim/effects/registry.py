"""The registry of effects: adding one is a small class and a line here."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from gfimu.array import AccelerometerArray
from gfimu.errors import unknown_name
from sim.effects import digital, mechanical, sensing, timing
from sim.effects.base import Effect
from sim.world import World

__all__ = ["EFFECTS", "apply_effects", "make_effect"]

EFFECTS: dict[str, type[Effect]] = {
    effect.name: effect
    for effect in (
        sensing.Bias,
        sensing.ScaleFactor,
        mechanical.Misalignment,
        mechanical.SensorPosition,
        mechanical.Eccentricity,
        mechanical.MountTilt,
        mechanical.TableTilt,
        mechanical.AxisWobble,
        mechanical.Gravity,
        mechanical.Cogging,
        mechanical.Resonance,
        mechanical.CentrifugalFlex,
        sensing.SensorLag,
        timing.ChannelSkew,
        timing.ClockError,
        timing.TachoLatency,
        timing.TachoScale,
        sensing.BiasTemperature,
        sensing.WarmUp,
        digital.BiasRandomWalk,
        sensing.Quadratic,
        sensing.CrossAxis,
        sensing.Hysteresis,
        sensing.InterferenceTone,
        sensing.GainDrift,
        sensing.VibrationRectification,
        timing.TachoRipple,
        digital.Noise,
        digital.Saturation,
        digital.CoarseResolution,
        digital.WrongRange,
        digital.AxisSwap,
        digital.SignFlip,
        digital.StuckChannel,
        digital.DroppedFrames,
    )
}
"""Every effect by its contract name."""

_PLACES = ("geometry", "motion", "timing", "sensing", "reference", "noise", "data")


def make_effect(
    name: str, parameters: Mapping[str, Any] | None = None, array: AccelerometerArray | None = None
) -> Effect:
    """Build an effect by name; raises `InputError` for an unknown name or, given the array, an unknown key."""
    if name not in EFFECTS:
        raise unknown_name("effect", name, EFFECTS)
    effect = EFFECTS[name](parameters or {})
    if array is not None:
        effect.check(array)
    return effect


def apply_effects(world: World, effects: Sequence[Effect]) -> World:
    """Apply effects in the order of their place in the chain."""
    for effect in sorted(effects, key=lambda effect: _PLACES.index(effect.place)):
        world = effect.apply(world)
    return world
