"""Foreign effects of the reference, of when it and the chips are read, and of what hangs on those instants."""

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.ndimage import uniform_filter1d

from sim.trials.benchmark.generators.foreign_effect import Foreign, Places, _along, _azimuth, _low_passed, entering
from sim.trials.benchmark.generators.independent_effects import MG, WHITE, _phase, _sign

EFFECTS: dict[str, Foreign] = {}
_foreign = entering(EFFECTS)


# The reference, on the fine time base.


@_foreign(
    "reference", "reference", "ω³: the tachometer is not linear", lambda rng, plan: {"cubic_s2_rad2": 3e-5 * _sign(rng)}
)
def tacho_cubic(one, run, reading):
    return reading * (1.0 + one["cubic_s2_rad2"] * reading**2)


@_foreign(
    "reference", "reference", "|ω|: the tachometer's gain differs by direction", lambda rng, plan: {"ratio": 3e-3}
)
def tacho_asymmetry(one, run, reading):
    return reading + one["ratio"] * np.abs(reading)


@_foreign("reference", "reference", "none: a constant offset", lambda rng, plan: {"offset_rad_s": 0.05 * _sign(rng)})
def tacho_offset(one, run, reading):
    return reading + one["offset_rad_s"]


@_foreign(
    "reference",
    "reference",
    "the rate's being small: below a least rate the tachometer reads nothing",
    lambda rng, plan: {"least_rad_s": 0.5},
    most=("least_rad_s", 5.0),
)
def tacho_dead_band(one, run, reading):
    return np.where(np.abs(reading) < one["least_rad_s"], 0.0, reading)


@_foreign(
    "reference",
    "reference",
    "first-order lag of the tachometer",
    lambda rng, plan: {"time_constant_s": 0.02},
    kin=("tacho_latency",),
)
def tacho_low_pass(one, run, reading):
    return _low_passed(reading, run.step, one["time_constant_s"])


@_foreign(
    "reference",
    "reference",
    "ω times waves of the angle, once and twice per turn: the tachometer's disc sits off its centre and is oval",
    lambda rng, plan: {
        "once": 0.01,
        "twice": 0.01 * float(rng.uniform(0.3, 0.8)),
        "phase_rad": _phase(rng),
        "second_phase_rad": _phase(rng),
    },
    shape=("phase_rad", "second_phase_rad"),
    kin=("tacho_ripple",),
)
def tacho_disc(one, run, reading):
    once = one["once"] * np.cos(run.angle + one["phase_rad"])
    return reading * (1.0 + once + one["twice"] * np.cos(2 * run.angle + one["second_phase_rad"]))


@_foreign(
    "reference",
    "reference",
    "mean of the rate over the last gate of the counter, held until the next",
    lambda rng, plan: {"gate_s": 0.03},
    most=("gate_s", 0.1),
)
def tacho_gate(one, run, reading):
    gate = one["gate_s"]
    begin = run.t[0] + gate * run.luck().random()
    opened = np.maximum(begin + np.floor((run.t - begin) / gate) * gate, run.t[0])  # the last count was read here
    mean = uniform_filter1d(reading, max(1, round(gate / run.step)), mode="nearest")
    return np.interp(opened - gate / 2, run.t, mean)


# When the host stamps (n,) and the chips sample (n, 4).


@_foreign(
    "times",
    "clock",
    "time in sawteeth per chip: every chip runs on its own clock and the host reads its newest sample",
    lambda rng, plan: {
        f"a{chip}_hz": float(plan.sample_rate * multiple * (1 + 0.01 * rng.standard_normal()))
        for multiple in [int(rng.integers(1, 3))]
        for chip in range(1, 5)
    },
    sizeless=True,
)
def free_running_chips(one, run, stamps, times):
    rates = np.array([one[f"a{chip}_hz"] for chip in range(1, 5)])
    first = run.luck().random(4) / rates
    return stamps, np.floor((times - first) * rates) / rates + first


@_foreign(
    "times",
    "clock",
    "one chip alone is late by a constant time",
    lambda rng, plan: {"chip": f"a{rng.integers(1, 5)}", "delay_s": 2e-3},
    shape=("chip",),
    most=("delay_s", 0.03),
)
def late_chip(one, run, stamps, times):
    late = np.zeros(4)
    late[int(one["chip"][1]) - 1] = one["delay_s"]
    return stamps, times - late


@_foreign(
    "times",
    "clock",
    "integral of the board's temperature: the board's clock changes its rate as it warms up",
    lambda rng, plan: {"ratio_1_K": 2e-4 * _sign(rng)},
    most=("ratio_1_K", 5e-3),
    kin=("clock_error",),
)
def warming_clock(one, run, stamps, times):
    late = one["ratio_1_K"] * run.step * np.cumsum(run.temperature - 25.0)
    late = np.interp(times, run.t, late)
    return stamps, times - (late - late[0])


@_foreign(
    "times",
    "host",
    "time, from one moment on: a queue of samples is never emptied again and all chips are late",
    lambda rng, plan: {"delay_s": 0.01, "time_s": float(plan.duration * rng.uniform(0.2, 0.8))},
    shape=("time_s",),
    most=("delay_s", 0.1),
)
def late_from_then(one, run, stamps, times):
    return stamps, times - one["delay_s"] * (times >= one["time_s"])


_READ_S = 3e-4  # what reading a sample takes


@_foreign(
    "times",
    "host",
    "time, by chance: the host comes late to a sample, stamps it then and reads the tachometer then; nothing is lost",
    lambda rng, plan: {"mean_s": 2e-3},
    most=("mean_s", 0.02),
)
def stamp_jitter(one, run, stamps, times):
    queue = _READ_S * np.arange(len(stamps))
    come = stamps + run.luck().exponential(one["mean_s"], len(stamps))
    return np.maximum.accumulate(come - queue) + queue, times


@_foreign(
    "times",
    "host",
    "time in sawteeth: samples wait until a burst of them is read and stamped, one right after the other",
    lambda rng, plan: {"samples": int(rng.integers(2, 6))},
    sizeless=True,
)
def burst_reads(one, run, stamps, times):
    number = np.arange(len(stamps))
    within = number % one["samples"]
    last = np.minimum(number - within + one["samples"] - 1, len(stamps) - 1)
    return stamps[last] + _READ_S * within, times


# What hangs on the instants of sampling.


@_foreign(
    "sampled",
    "bench",
    "the angle at the ratio of a gear, far above half the sample rate: teeth shake the table, the samples alias it",
    lambda rng, plan: {
        "amplitude_m_s2": 3 * MG,
        "ratio": float(rng.uniform(60, 180)),
        "phase_rad": _phase(rng),
        "azimuth_rad": _azimuth(rng),
        "height_rad": float(rng.uniform(0.2, 1.3)),
    },
    shape=("ratio", "phase_rad", "azimuth_rad", "height_rad"),
)
def gear_teeth(one, run, times, channels):
    way = np.cos(one["height_rad"]) * _along(one["azimuth_rad"]) + [0.0, 0.0, np.sin(one["height_rad"])]
    angle, rate = CubicSpline(run.t, run.angle)(times), np.interp(times, run.t, run.rate)
    wave = np.tanh(np.abs(rate)) * np.sin(one["ratio"] * angle + one["phase_rad"])  # (n, 4); silent at rest
    weights = Places.at_rest().axes[0] @ way
    return channels + one["amplitude_m_s2"] * (wave[:, :, None] * weights).reshape(channels.shape)


@_foreign(
    "noise",
    "chip",
    "|ω|: noise that grows as the table turns",
    lambda rng, plan: {"per_rate_s_rad": float(rng.uniform(0.1, 0.4))},
    sizeless=True,
)
def rate_noise(one, run, times, channels):
    rms = one["per_rate_s_rad"] * np.abs(np.interp(times, run.t, run.rate))
    return channels + np.repeat(rms, 3, axis=1) * WHITE * run.luck().standard_normal(channels.shape)
