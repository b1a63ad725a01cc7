"""Right answers for effects that the library lacks: place, names that state place and dependence, nearest names.

The names on the right are those of effects beyond the first table of the contract; an answer without a name gives the
place.
"""

from __future__ import annotations

from dataclasses import dataclass

__all__ = ["PLACES", "UNLISTED_TRUTH", "UnlistedTruth"]

PLACES = ("reference", "clock", "motion", "bench", "cube", "chip", "supply", "host", "nothing")
"""Places in the chain by which an answer may describe what has no name."""

SAME_PLACE = {"array": "cube", "channel": "chip"}
"""Words of ``verdict.json`` for some of these places."""

_OF_CHIP = (
    *("bias", "scale_factor", "misalignment", "sensor_position", "quadratic", "cross_axis", "hysteresis", "noise"),
    *("bias_temperature", "warm_up", "bias_random_walk", "vibration_rectification", "saturation", "coarse_resolution"),
    *("wrong_range", "axis_swap", "sign_flip", "stuck_channel"),
)
PLACES_OF_LISTED: dict[str, tuple[str, ...]] = {
    **dict.fromkeys(_OF_CHIP, ("chip",)),
    **dict.fromkeys(("eccentricity", "mount_tilt", "centrifugal_flex"), ("cube",)),
    **dict.fromkeys(("table_tilt", "axis_wobble", "gravity"), ("bench",)),
    "cogging": ("motion",),
    "resonance": ("cube", "motion"),
    "sensor_lag": ("clock", "chip"),
    **dict.fromkeys(("channel_skew", "clock_error"), ("clock",)),
    "tacho_latency": ("clock", "reference"),
    **dict.fromkeys(("tacho_scale", "tacho_ripple"), ("reference",)),
    **dict.fromkeys(("interference_tone", "gain_drift"), ("supply", "chip")),
    "dropped_frames": ("host",),
}
"""Places of the effects that have a name, as right descriptions of these."""


@dataclass(frozen=True)
class UnlistedTruth:
    """What is right for one unlisted effect.

    Parameters
    ----------
    place : str
        Where it acts.
    right : tuple of str
        Names that state its place and its dependence.
    near : tuple of str
        Names of the usual effects that come nearest: no wrong answer, and not the right one.
    """

    place: str
    right: tuple[str, ...] = ()
    near: tuple[str, ...] = ()


UNLISTED_TRUTH: dict[str, UnlistedTruth] = {
    "bearing_friction": UnlistedTruth("nothing"),
    "bench_sway": UnlistedTruth("bench", ("bench_sway",)),
    "sinking_bench": UnlistedTruth("bench", (), ("table_tilt",)),
    "floor_vibration": UnlistedTruth("bench"),
    "footsteps": UnlistedTruth("bench"),
    "bearing_shake": UnlistedTruth("bench", ("bearing_shake",)),
    "lean_with_rate": UnlistedTruth("cube"),
    "lean_with_turns": UnlistedTruth("cube"),
    "rocking_foot": UnlistedTruth("cube"),
    "stretch_in_plane": UnlistedTruth("cube", (), ("centrifugal_flex",)),
    "stick_slip": UnlistedTruth("motion"),
    "backlash": UnlistedTruth("motion"),
    "loose_chip": UnlistedTruth("chip"),
    "cubic_channel": UnlistedTruth("chip"),
    "cubic_channels": UnlistedTruth("chip"),
    "chip_crosstalk": UnlistedTruth("chip"),
    "tone_on_one_channel": UnlistedTruth("chip"),
    "bias_jump": UnlistedTruth("chip"),
    "square_wave": UnlistedTruth("supply"),
    "magnetic_pickup": UnlistedTruth("chip"),
    "supply_sag": UnlistedTruth("supply"),
    "slip_ring": UnlistedTruth("supply"),
    "torque_offsets": UnlistedTruth("supply"),
    "rate_offsets": UnlistedTruth("chip"),
    "lagged_temperature": UnlistedTruth("chip", (), ("bias_temperature", "warm_up")),
    "temperature_gradient": UnlistedTruth("chip"),
    "warm_start": UnlistedTruth("chip", ("cold_start",), ("warm_up", "bias")),
    "turn_on_bias": UnlistedTruth("chip", (), ("bias",)),
    "chip_lag": UnlistedTruth("chip", ("chip_lag",)),
    "tacho_cubic": UnlistedTruth("reference"),
    "tacho_asymmetry": UnlistedTruth("reference"),
    "tacho_offset": UnlistedTruth("reference"),
    "tacho_dead_band": UnlistedTruth("reference"),
    "tacho_low_pass": UnlistedTruth("reference", ("tacho_lag",), ("tacho_latency",)),
    "tacho_disc": UnlistedTruth("reference", (), ("tacho_ripple",)),
    "tacho_gate": UnlistedTruth("reference", ("tacho_lag", "tacho_latency")),
    "free_running_chips": UnlistedTruth("clock"),
    "late_chip": UnlistedTruth("clock", ("chip_delay", "channel_skew")),
    "warming_clock": UnlistedTruth("clock", (), ("clock_error",)),
    "late_from_then": UnlistedTruth("host"),
    "stamp_jitter": UnlistedTruth("host"),
    "burst_reads": UnlistedTruth("host"),
    "gear_teeth": UnlistedTruth("bench"),
    "rate_noise": UnlistedTruth("chip", (), ("noise",)),
}
"""By the name of the effect in its generator; where a mean over a gate is half a gate late, both names are right."""
