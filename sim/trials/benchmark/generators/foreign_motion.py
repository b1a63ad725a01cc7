"""Foreign effects of the drive, and of where the chips are and point."""

from dataclasses import replace

import numpy as np
from scipy.ndimage import gaussian_filter1d

from sim.trials.benchmark.generators.foreign_effect import (
    _MODE,
    Foreign,
    Places,
    _along,
    _azimuth,
    _mode,
    _rung,
    entering,
)
from sim.trials.benchmark.generators.independent_effects import CHANNELS, MG, _phase, _sign, _turning_channel

EFFECTS: dict[str, Foreign] = {}
_foreign = entering(EFFECTS)


# The drive.


@_foreign(
    "drive",
    "nothing",
    "none: the bearing's friction holds the table where it turns back, and the tachometer sees it",
    lambda rng, plan: {"coulomb_N_m": float(rng.uniform(0.03, 0.15))},
    sizeless=True,
)
def bearing_friction(one, rig):
    return replace(rig, friction=one["coulomb_N_m"])


# Where the chips are and point.


@_foreign(
    "places",
    "motion",
    "sawtooth of the angle, at low rates: the cube sticks on its seat, is wound up and lets go",
    lambda rng, plan: {"angle_rad": 2e-3, "pitch_rad": float(rng.uniform(0.1, 0.4)), "rate_rad_s": 3.0},
    shape=("pitch_rad", "rate_rad_s"),
)
def stick_slip(one, run, places):
    wound = (run.angle / one["pitch_rad"]) % 1.0 - 0.5
    wound = gaussian_filter1d(wound / (1 + (run.rate / one["rate_rad_s"]) ** 4), 6e-3 / run.step)
    return places.turned(np.outer(-one["angle_rad"] * wound, [0.0, 0.0, 1.0]))


@_foreign(
    "places",
    "bench",
    "mode of the bench in a horizontal line of the lab, driven by the unbalance: ω² and α, turned by the angle",
    lambda rng, plan: {
        "unbalance_m": 1e-4,  # eccentricity times the share of the whole mass
        "azimuth_rad": _azimuth(rng),
        "phase_rad": _phase(rng),
        **_mode(rng, 1.2, 3.0),
    },
    shape=("azimuth_rad", "phase_rad", *_MODE),
    most=("unbalance_m", 5e-3),
)
def bench_sway(one, run, places):
    heavy = run.angle + one["phase_rad"] - one["azimuth_rad"]
    push = one["unbalance_m"] * (run.rate**2 * np.cos(heavy) + run.acceleration * np.sin(heavy))
    return places.moved(np.outer(_rung(push, run.step, one), _along(one["azimuth_rad"])))


@_foreign(
    "places",
    "bench",
    "time: the bench sinks on soft feet, so that the axis leans over in the lab and settles",
    lambda rng, plan: {
        "lean_rad": 2e-3,
        "azimuth_rad": _azimuth(rng),
        "time_constant_s": float(plan.duration * rng.uniform(0.1, 0.6)),
    },
    shape=("azimuth_rad", "time_constant_s"),
    kin=("table_tilt",),
)
def sinking_bench(one, run, places):
    sunk = one["lean_rad"] * -np.expm1(-np.maximum(run.t - run.t[0], 0.0) / one["time_constant_s"])
    behind = one["azimuth_rad"] - run.angle  # a fixed direction of the lab, seen from the table
    return places.turned(sunk[:, None] * np.stack([np.cos(behind), np.sin(behind), 0 * sunk], axis=1))


@_foreign(
    "places",
    "bench",
    "time, by chance, in a band of frequencies: shaking of the floor along fixed directions of the lab",
    lambda rng, plan: {
        **{f"{axis}_m_s2": MG * rng.uniform(1.0, 3.0) for axis in "xyz"},
        "low_hz": (low := float(rng.uniform(4, 20))),
        "high_hz": low * float(rng.uniform(1.3, 2.5)),
    },
    shape=("low_hz", "high_hz"),
)
def floor_vibration(one, run, places):
    n, luck = len(run.t), run.luck()
    frequency = np.fft.rfftfreq(n, run.step)
    band = (frequency > one["low_hz"]) & (frequency < one["high_hz"])
    shaking = band * (luck.standard_normal((3, len(band))) + 1j * luck.standard_normal((3, len(band))))
    rms = np.fft.irfft(shaking, n).std(axis=1)
    moved = np.fft.irfft(-shaking / (2 * np.pi * np.maximum(frequency, 1e-3)) ** 2, n)
    return places.moved((moved / rms[:, None]).T * [one[f"{axis}_m_s2"] for axis in "xyz"])


@_foreign(
    "places",
    "bench",
    "time, by chance: vertical bursts that die away, in a row while somebody walks by",
    lambda rng, plan: {
        "amplitude_m_s2": 15 * MG,
        "pace_s": float(rng.uniform(0.48, 0.62)),
        "frequency_hz": float(rng.uniform(8, 25)),
        "damping_ratio": float(rng.uniform(0.03, 0.08)),
    },
    shape=("pace_s", *_MODE),
)
def footsteps(one, run, places):
    luck, natural = run.luck(), 2 * np.pi * one["frequency_hz"]
    up = np.zeros_like(run.t)
    for begin in luck.uniform(run.t[0], run.t[-1], max(2, int(np.ptp(run.t) / 12))):
        for index in range(luck.integers(4, 10)):
            since = np.maximum(run.t - begin - one["pace_s"] * (index + 0.05 * luck.standard_normal()), 0.0)
            ring = np.exp(-one["damping_ratio"] * natural * since) * np.sin(natural * since)
            up += luck.uniform(0.5, 1.5) * ring * -np.expm1(-((since / 0.01) ** 2))
    return places.moved(np.outer(one["amplitude_m_s2"] / natural**2 * up, [0.0, 0.0, 1.0]))


@_foreign(
    "places",
    "bench",
    "the angle at an order that is no whole number, growing with ω²: balls of the bearing lift the table",
    lambda rng, plan: {
        "amplitude_m": 5e-6,
        "order": float(rng.integers(2, 8) + rng.uniform(0.15, 0.85)),
        "phase_rad": _phase(rng),
    },
    shape=("order", "phase_rad"),
    most=("amplitude_m", 3e-4),
)
def bearing_shake(one, run, places):
    up = one["amplitude_m"] * np.cos(one["order"] * run.angle + one["phase_rad"])
    return places.moved(np.outer(up, [0.0, 0.0, 1.0]))


@_foreign(
    "places",
    "cube",
    "ω²: the cube leans about its foot as its heavy side pulls outwards; axes and positions turn",
    lambda rng, plan: {"lean_s2_rad": 2e-5, "azimuth_rad": _azimuth(rng)},
    shape=("azimuth_rad",),
)
def lean_with_rate(one, run, places):
    return places.turned(np.outer(one["lean_s2_rad"] * run.rate**2, _along(one["azimuth_rad"])))


@_foreign(
    "places",
    "cube",
    "turns made: a cable winds up and pulls the cube over; axes and positions turn",
    lambda rng, plan: {"lean_per_turn_rad": 2e-4, "azimuth_rad": _azimuth(rng)},
    shape=("azimuth_rad",),
)
def lean_with_turns(one, run, places):
    return places.turned(np.outer(one["lean_per_turn_rad"] * run.angle / (2 * np.pi), _along(one["azimuth_rad"])))


@_foreign(
    "places",
    "cube",
    "mode of the cube on its foot, driven by the angular acceleration: it rocks about a horizontal line of the table",
    lambda rng, plan: {"gain": 0.1 * _sign(rng), "azimuth_rad": _azimuth(rng), **_mode(rng, 3.0, 9.0)},
    shape=("azimuth_rad", *_MODE),
)
def rocking_foot(one, run, places):
    return places.turned(np.outer(_rung(-one["gain"] * run.acceleration, run.step, one), _along(one["azimuth_rad"])))


@_foreign(
    "places",
    "cube",
    "ω²: the arms grow in the plane of the table, heights stay",
    lambda rng, plan: {"stretch_s2_rad2": 2e-5},
    kin=("centrifugal_flex",),
)
def stretch_in_plane(one, run, places):
    longer = np.outer(one["stretch_s2_rad2"] * run.rate**2, [1.0, 1.0, 0.0])
    return replace(places, arms=places.arms * (1.0 + longer[:, None]))


@_foreign(
    "places",
    "chip",
    "own specific force through a mode with a dead band: a chip rattles along one of its axes on a loose screw",
    lambda rng, plan: {"channel": _turning_channel(rng), "gap_m": 5e-5, "frequency_hz": float(rng.uniform(50, 90))},
    shape=("channel", "frequency_hz"),
    most=("gap_m", 1e-3),
)
def loose_chip(one, run, places):
    chip, axis = divmod(CHANNELS.index(one["channel"]), 3)
    stiffness = (2 * np.pi * one["frequency_hz"]) ** 2
    bound, free = 0.4 * np.sqrt(stiffness), 2.0  # 1/s, damping on the stop (ζ = 0.2) and between
    gap, step, place, speed = one["gap_m"], run.step, 0.0, 0.0
    path = np.empty_like(run.t)
    for row, force in enumerate(run.readings[:, 3 * chip + axis].tolist()):
        deep = place - gap if place > gap else place + gap if place < -gap else 0.0
        speed = (speed - step * (force + stiffness * deep)) / (1 + step * (bound if deep else free))
        place += step * speed
        path[row] = place
    moved = np.zeros((len(run.t), 4, 3))
    moved[:, chip] = np.outer(gaussian_filter1d(path, 2e-3 / step), Places.at_rest().axes[0, chip, axis])
    return replace(places, arms=places.arms + moved)
