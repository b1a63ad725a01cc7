"""The registry of effects: adding one is a small class and a line here."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from gfimu.array.array import AccelerometerArray
from gfimu.base.errors import InputError, check_name
from gfimu.base.plugins import plugins
from sim.effects import body, chain, digital, drifting, mechanical, mounting, rig, sensing, timing
from sim.effects.base import Effect
from sim.effects.unknown import Unknown
from sim.effects.unlisted import Unlisted
from sim.world import World

__all__ = [
    "BODY_EFFECTS",
    "CARRIAGE_EFFECTS",
    "EFFECTS",
    "ENCODER_EFFECTS",
    "FURTHER_EFFECTS",
    "INCLINED_EFFECTS",
    "NOT_OF_AN_ENCODER",
    "NOT_OF_A_BODY",
    "NOT_OF_A_CARRIAGE",
    "SIMULATED_EFFECTS",
    "TABLE_EFFECTS",
    "added_effects",
    "apply_effects",
    "make_effect",
]

EFFECTS: dict[str, type[Effect]] = {
    effect.name: effect
    for effect in (
        sensing.Bias,
        sensing.ScaleFactor,
        mechanical.Misalignment,
        mechanical.SensorPosition,
        mounting.Eccentricity,
        mounting.MountTilt,
        mounting.TableTilt,
        mounting.AxisWobble,
        mounting.Gravity,
        mechanical.Cogging,
        mechanical.Resonance,
        mechanical.CentrifugalFlex,
        chain.SensorLag,
        timing.ChannelSkew,
        timing.ClockError,
        timing.TachoLatency,
        timing.TachoScale,
        drifting.BiasTemperature,
        drifting.WarmUp,
        digital.BiasRandomWalk,
        sensing.Quadratic,
        sensing.CrossAxis,
        chain.Hysteresis,
        chain.InterferenceTone,
        drifting.GainDrift,
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
"""Every effect of a rig on its table in the contract's first table, by its name there."""

FURTHER_EFFECTS: dict[str, type[Effect]] = {one.name: one for one in (rig.TachoLag, body.ChipDelay, rig.ChipLag)}
"""What a rig on its table may have besides, by names that the first table of the contract has not."""

INCLINED_EFFECTS: dict[str, type[Effect]] = {timing.AngleZero.name: timing.AngleZero}
"""What a rig whose axis leans may have besides, where its reference is an angle: gravity shows the angle itself."""

NOT_OF_A_BODY: dict[str, str] = {
    **dict.fromkeys(("eccentricity", "mount_tilt", "table_tilt", "axis_wobble"), "a body in the hand has no axis"),
    **dict.fromkeys(("cogging", "resonance", "tacho_ripple"), "a body in the hand has no table that drives it"),
    **dict.fromkeys(("centrifugal_flex", "vibration_rectification"), "defined by the rate about a table's axis"),
    "gravity": "the specific force is unknown; poses at rest see a wrong gravity as a gain common to all channels",
    "clock_error": "gyro and accelerometers share the board's clock",
    "tacho_latency": "a gyro may be early as well as late: gyro_latency",
    "sensor_lag": "against a motion that is itself unknown a lag of all channels is a delay: gyro_latency",
    "tacho_scale": "a gyro has three gains: gyro_scale",
    "interference_tone": "what all channels share looks like the body's own specific force",
    "hysteresis": "what depends on the past of a motion that is itself unknown can't be separated from it",
    "bias_random_walk": "a slow random walk is part of the noise that is fitted",
}
"""Effects that a diagnosis of a free body does not look for, and why."""

BODY_EFFECTS: dict[str, type[Effect]] = {
    **{name: effect for name, effect in EFFECTS.items() if name not in NOT_OF_A_BODY},
    **{effect.name: effect for effect in (body.ChipDelay, body.GyroLatency, body.GyroScale, body.GyroMisalignment)},
}
"""Every effect of a free body with a gyro, by its contract name."""

NOT_OF_AN_ENCODER: dict[str, str] = {
    "tacho_scale": "the marks of an encoder are counted, its full turn has no gain",
    "tacho_ripple": "the modulation of a rate; an angle has none",
    "tacho_lag": "the error of a rate; an angle has its own",
}
"""Effects that a diagnosis of a table whose reference is an angle does not look for, and why."""

NOT_OF_A_CARRIAGE: dict[str, str] = {
    **dict.fromkeys(("eccentricity", "sensor_position"), "what does not turn reads the same at every place"),
    **dict.fromkeys(
        ("axis_wobble", "cogging", "centrifugal_flex", "vibration_rectification", "tacho_ripple"),
        "a linear axis has no revolutions",
    ),
    "mount_tilt": "the array may be turned about all three axes: mount_turn",
    "tacho_scale": "steps are counted, and the pitch of belt or screw is known better than the gain of a chip",
    **dict.fromkeys(("tacho_lag", "bearing_shake", "bench_sway"), "an effect of a table that turns"),
}
"""Effects that a diagnosis of a linear axis does not look for, and why."""

CARRIAGE_EFFECTS: dict[str, type[Effect]] = {
    **{name: effect for name, effect in EFFECTS.items() if name not in NOT_OF_A_CARRIAGE},
    **{one.name: one for one in (mounting.MountTurn, mounting.RailTilt)},
}
"""Every effect of an array on a linear axis, by its contract name."""

TABLE_EFFECTS: dict[str, type[Effect]] = EFFECTS | FURTHER_EFFECTS
"""Every effect of a rig on its table whose reference is a rate."""

SIMULATED_EFFECTS: dict[str, type[Effect]] = {
    one.name: one for one in (chain.ProofMass, rig.BearingShake, rig.BenchSway, drifting.ColdStart)
}
"""What scenarios and twins may have and no diagnosis looks for: the usual effects hold its limit, or functions at
places describe it."""

ENCODER_EFFECTS: dict[str, type[Effect]] = {
    name: effect for name, effect in TABLE_EFFECTS.items() if name not in NOT_OF_AN_ENCODER
}
"""Every effect of a rig whose reference is an angle, by its contract name."""


def added_effects() -> dict[str, type[Effect]]:
    """Return the effects that other packages add (``gfimu.effects``), by name.

    Raises
    ------
    InputError
        If a package adds something else, or an effect under another name than its own.
    """
    added: dict[str, type[Effect]] = {}
    for name, found in plugins("gfimu.effects", type, TABLE_EFFECTS | BODY_EFFECTS).items():
        if not issubclass(found, Effect) or found.name != name:
            raise InputError(
                f"entry point {name!r} of gfimu.effects: {found.__name__} is no sim.effects.base.Effect of that name"
            )
        added[name] = found
    return added


_PLACES = ("geometry", "motion", "timing", "sensing", "reference", "noise", "data")


def make_effect(
    name: str, parameters: Mapping[str, Any] | None = None, array: AccelerometerArray | None = None
) -> Effect:
    """Build an effect by name; raises `InputError` for an unknown name or, given the array, an unknown key."""
    known = CARRIAGE_EFFECTS | TABLE_EFFECTS | BODY_EFFECTS | INCLINED_EFFECTS | SIMULATED_EFFECTS
    known = known | {one.name: one for one in (Unknown, Unlisted)}
    if name not in known:
        known = known | added_effects()
    check_name("effect", name, known)
    effect = known[name](parameters or {})
    if array is not None:
        effect.check(array)
    return effect


_CHAIN = (
    *(
        "sensor_position",
        "misalignment",
        "mount_turn",
        "mount_tilt",
        "eccentricity",
        "centrifugal_flex",
        "table_tilt",
        "axis_wobble",
    ),
    *("cross_axis", "scale_factor", "gain_drift", "quadratic", "vibration_rectification", "hysteresis"),
    *("bias", "bias_temperature", "warm_up", "cold_start", "interference_tone", "sensor_lag", "proof_mass", "unknown"),
    "unlisted",
)


def _place_in_chain(effect: Effect) -> tuple[int, int]:
    within = _CHAIN.index(effect.name) if effect.name in _CHAIN else 0
    return _PLACES.index(effect.place), within


def apply_effects(world: World, effects: Sequence[Effect]) -> World:
    """Apply effects in the order of the chain, whatever the order they are given in.

    From the chip in the array to the table in the world; from the proof mass (axes, gain, curvature) to the offset of
    the circuit and its filter. Those that neither place nor chain order keep their order.
    """
    for effect in sorted(effects, key=_place_in_chain):
        world = effect.apply(world)
    return world
