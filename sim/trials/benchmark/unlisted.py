"""Right answers for effects that the library lacks: place, names that state place and dependence, nearest names.

The names on the right are those of gfimu's wider library; an answer in one's own words gives the place alone.
"""

from __future__ import annotations

from dataclasses import dataclass

__all__ = ["PLACES", "UNLISTED_TRUTH", "UnlistedTruth"]

PLACES = ("reference", "clock", "motion", "bench", "cube", "chip", "supply", "host", "nothing")
"""Places in the chain by which an answer may describe what has no name."""


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
