"""Further rows, which the study ``hidden`` runs: other sizes, pairs, worlds, and what was answered wrongly once."""

from __future__ import annotations

from hidden_table import CONSTANT, PLACE, Hidden

from sim.effects import EFFECTS

_SIZES = (60.0, 300.0, 1500.0)
_PAIRS = (
    *("table_tilt+clock_error", "scale_factor+interference_tone", "eccentricity+sign_flip", "mount_tilt+noise"),
    *("sensor_lag+axis_wobble", "cross_axis+tacho_ripple", "tacho_latency+misalignment", "wrong_range+channel_skew"),
    *("hysteresis+table_tilt", "gain_drift+sensor_position", "quadratic+dropped_frames", "cogging+tacho_scale"),
    *("vibration_rectification+stuck_channel", "warm_up+axis_swap"),
)
_TAKEN_OUT = {
    "table_tilt": "bench",
    "axis_wobble": "bench",
    "channel_skew": "clock",
    "clock_error": "clock",
    "tacho_ripple": "reference",
    "interference_tone": "supply channel",
    "cogging": "motion",
}
_BODY = (
    *("bias", "scale_factor", "sensor_position", "misalignment", "chip_delay", "channel_skew", "gyro_latency"),
    *("gyro_scale", "gyro_misalignment", "quadratic", "axis_swap", "sign_flip", "wrong_range"),
)
_OF_INDEPENDENT = {"resonance", "saturation"}  # in so short a run of the campaign hardly to be seen
_SETS = {
    "bias": {"or_else": "cross_axis", "why": CONSTANT},
    "scale_factor": {"or_else": "bias quadratic", "why": CONSTANT},
}


def _generator(number: int, name: str = "") -> str:
    return "independent" if number % 2 or name in _OF_INDEPENDENT else "campaign"


SINGLES = [
    Hidden(name, _generator(number, name), 100 + number, _SIZES[number % 3], **_SETS.get(name, {}))
    for number, name in enumerate(EFFECTS)
]
"""Every effect at another size, half of them by the other generator."""

PAIRS = [Hidden(names, _generator(number + 1), 300 + number) for number, names in enumerate(_PAIRS)]

OUTSIDE = [
    Hidden("stick_slip", "independent", 401, 600.0, or_else="motion", why=PLACE),
    Hidden("cubic_channel", "independent", 402, 600.0, or_else="channel", why=PLACE),
    Hidden("square_wave", "independent", 405, 600.0, or_else="supply channel", why=PLACE),
    Hidden("magnetic_pickup", "independent", 406, 600.0, or_else="channel", why=PLACE),
    Hidden("backlash", "independent", 407, 600.0, or_else="motion", why=PLACE),
]

TAKEN_OUT = [
    Hidden(name, _generator(number), 420 + number, 600.0, or_else=place, why=PLACE, setting={"without": name})
    for number, (name, place) in enumerate(_TAKEN_OUT.items())
]
"""Effects that are taken out of the library: the place that they have is what can be said."""

NULLS = [
    Hidden("", generator, 200 + number, seconds=setting.pop("seconds", 12.0), setting=setting)
    for number, (generator, setting) in enumerate(
        (
            ("campaign", {"bias_instability_mg": 0.05}),
            ("independent", {"bias_instability_mg": 0.15}),
            ("campaign", {"bias_instability_mg": 0.5}),
            ("independent", {"tacho_noise": 0.05}),
            ("campaign", {"seconds": 20.0, "sample_rate": 25.0}),
            ("independent", {"seconds": 20.0, "sample_rate": 50.0, "bias_instability_mg": 0.5}),
            ("campaign", {"encoder_counts": 4096}),
            ("campaign", {"array": "corners8", "bias_instability_mg": 0.05}),
            ("campaign", {"array": "p3_three_plus_one"}),
            ("independent", {"sample_rate": 200.0, "bias_instability_mg": 0.05}),
            ("programmed", {}),
            ("programmed", {"seconds": 20.0, "bias_instability_mg": 0.5}),
            ("programmed", {"seconds": 20.0, "sample_rate": 50.0, "tacho_noise": 0.01}),
            ("campaign", {"seconds": 20.0, "residue": True}),
        )
    )
]

BODIES = [
    Hidden(name, "body", 510 + number, 1500.0, seconds=20.0, setting={"array": "mimu4444"})
    for number, name in enumerate(_BODY)
]

_LONG = {"sample_rate": 200.0, "bias_instability_mg": 0.045, "tacho_noise": 0.0326}
HARD = [
    # A drive that has the state of the instant only named a mode, a lag and a slow clock for the rest of a backlash.
    Hidden("hysteresis", "campaign", 91_003, 1000.0, seconds=40.0),
    # The width of a narrow backlash is known no better than readings are estimated: 11 standard deviations off once.
    Hidden("hysteresis", "independent", 970_003, 30.0),
    # The servo's answer to a ripple is uncertain: 4.2 standard deviations off with the covariance alone.
    Hidden("cogging", "independent", 10_046, 60.0, seconds=40.0),
    # Two servos that differ leave a ripple of the same order, which was unknown.
    Hidden("cogging", "independent", 10_048, 1500.0, seconds=40.0, setting={"bias_instability_mg": 0.05}),
    # A strong ripple holds its table: steps of a drive that does not know that ended 0.8 rad off in its phase.
    Hidden("cogging", "campaign", 709, 1500.0, seconds=20.0),
    # No listed time constant is near enough to compete with a temperature that rises much alike.
    Hidden("warm_up+scale_factor", "independent", 872_024, 791.6, seconds=40.0, setting=_LONG),
    # A mode that pushes its table back bends the drive to the mode itself.
    Hidden("resonance", "independent", 511, 600.0, seconds=20.0),
    # A candidate that several rivals have is listed once.
    Hidden(
        "scale_factor",
        "campaign",
        10_180,
        15.0,
        seconds=40.0,
        setting={"bias_instability_mg": 0.05},
        **_SETS["scale_factor"],
    ),
    # Where an offset would meet other edges of coarse steps, slow noise comes through.
    Hidden("coarse_resolution", "campaign", 993_012, seconds=40.0, setting={"bias_instability_mg": 0.5}),
    # Slow sampling is no discrepancy.
    Hidden("eccentricity", "independent", 251, seconds=20.0, setting={"sample_rate": 25.0}),
    # An encoder of few counts instead of a tachometer.
    Hidden("table_tilt", "campaign", 252, seconds=20.0, setting={"encoder_counts": 360}),
    # A calibration residue beside an effect.
    Hidden("axis_wobble", "campaign", 253, 1500.0, seconds=20.0, setting={"residue": True}),
    # Programmed motion, under which any function of the angle explains a part of a swing.
    Hidden("cross_axis", "programmed", 254, 600.0, seconds=20.0),
]
"""Each was answered wrongly once, for a reason of its own."""

_CHANCE = "one of several hundred sizes of this table; 1 in 370 lies there by chance"
KNOWN_MISSES = {
    "vibration_rectification-independent-125-12s": _CHANCE,
    "table_tilt-campaign-252-20s": _CHANCE,
    "cubic_channel-independent-402-12s": "saturation and a gain: the flat ends of the curve resemble a limit",
}
"""Rows that are not answered as they should be, and why; an improvement fails the test too."""

EXTRAS = [*SINGLES, *PAIRS, *OUTSIDE, *TAKEN_OUT, *NULLS, *BODIES, *HARD]
