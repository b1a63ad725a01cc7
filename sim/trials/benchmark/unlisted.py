"""Right answers for effects that the library lacks: place, names that state place and dependence, nearest names.

The names on the right are words of the release for such effects; an answer without a name gives the place, and what it
goes with.
"""

from __future__ import annotations

import re
from dataclasses import dataclass

__all__ = ["GOES_WITH", "PLACES", "PLACES_OF_LISTED", "SAME_PLACE", "UNLISTED_TRUTH", "UnlistedTruth", "quantities_of"]

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
    "lean_with_rate": UnlistedTruth("cube", ("lean_by_rate_squared",)),
    "lean_with_turns": UnlistedTruth("cube", ("lean_by_turns",)),
    "rocking_foot": UnlistedTruth("cube"),
    "stretch_in_plane": UnlistedTruth("cube", (), ("centrifugal_flex",)),
    "stick_slip": UnlistedTruth("motion"),
    "backlash": UnlistedTruth("motion"),
    "loose_chip": UnlistedTruth("chip"),
    "cubic_channel": UnlistedTruth("chip", ("cubic",)),
    "cubic_channels": UnlistedTruth("chip", ("cubic",)),
    "chip_crosstalk": UnlistedTruth("chip"),
    "tone_on_one_channel": UnlistedTruth("chip"),
    "bias_jump": UnlistedTruth("chip"),
    "square_wave": UnlistedTruth("supply"),
    "magnetic_pickup": UnlistedTruth("chip"),
    "supply_sag": UnlistedTruth("supply", ("gain_by_speed", "gain_by_load")),
    "slip_ring": UnlistedTruth("supply"),
    "torque_offsets": UnlistedTruth("supply"),
    "rate_offsets": UnlistedTruth("chip", ("offset_by_speed",)),
    "lagged_temperature": UnlistedTruth("chip", ("lagged_temperature",), ("bias_temperature", "warm_up")),
    "temperature_gradient": UnlistedTruth("chip", ("temperature_gradient",)),
    "warm_start": UnlistedTruth("chip", ("cold_start",), ("warm_up", "bias")),
    "turn_on_bias": UnlistedTruth("chip", (), ("bias",)),
    "chip_lag": UnlistedTruth("chip", ("chip_lag",)),
    "tacho_cubic": UnlistedTruth("reference", ("reference_rate_cubed",)),
    "tacho_asymmetry": UnlistedTruth("reference", ("reference_by_direction",)),
    "tacho_offset": UnlistedTruth("reference", ("reference_offset",)),
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

GOES_WITH: dict[str, tuple[str, ...]] = {
    **dict.fromkeys(("lean_with_rate", "stretch_in_plane", "rate_offsets", "rate_noise"), ("omega",)),
    **dict.fromkeys(("tacho_cubic", "tacho_asymmetry", "tacho_dead_band"), ("omega",)),
    **dict.fromkeys(("footsteps", "floor_vibration", "sinking_bench", "bias_jump", "square_wave"), ("t",)),
    **dict.fromkeys(("tone_on_one_channel", "late_from_then", "stamp_jitter", "burst_reads"), ("t",)),
    **dict.fromkeys(("bearing_shake", "gear_teeth", "slip_ring", "magnetic_pickup"), ("theta",)),
    **dict.fromkeys(("cubic_channel", "cubic_channels"), ("y",)),
    **dict.fromkeys(("late_chip", "turn_on_bias", "tacho_offset"), ("1",)),
    **dict.fromkeys(("lagged_temperature", "temperature_gradient"), ("T", "t")),
    **dict.fromkeys(("tacho_low_pass", "tacho_gate", "rocking_foot"), ("alpha",)),
    **dict.fromkeys(("stick_slip", "backlash"), ("theta", "omega", "t")),
    "bench_sway": ("omega", "alpha", "theta"),
    "lean_with_turns": ("theta",),
    "tacho_disc": ("theta", "omega"),
    "supply_sag": ("omega", "alpha"),
    "torque_offsets": ("alpha", "omega"),
    "warm_start": ("t", "T"),
    "warming_clock": ("T", "t"),
    "free_running_chips": ("t", "1"),
    "loose_chip": ("y", "t"),
    "chip_crosstalk": ("y", "omega"),
    "chip_lag": ("1", "y", "omega", "alpha"),
}
"""Quantities that each goes with, in the words of ``verdict.json``; one of them in a description is right."""


def quantities_of(dependence: str) -> frozenset[str]:
    """Return the quantities that a dependence of ``verdict.json`` is of, such as omega of f(omega) or of omega^3."""
    words = dict.fromkeys(("tone", "time", "step"), "t") | dict.fromkeys(("revolution", "order", "unbalance"), "theta")
    found = re.findall(r"[A-Za-z]+|^1$", dependence.replace("dT/dt", "T"))
    return frozenset(words.get(word, word) for word in found) & {"1", "omega", "alpha", "theta", "t", "T", "y"}
