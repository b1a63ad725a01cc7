"""Foreign effects: physics of a rig on a table that no library of effects holds, each in a definition of its own.

An effect stands where it acts in the chain, and the functions stand in its order: the drive, where the chips are and
point, what they make of specific force, the reference, when they are read, and what hangs on the instants of sampling.
Each has its parameters for a typical size, a place, and in words what it depends on. Nothing here comes from `sim` or
`gfimu`. What is of a recording and not of the world (when somebody walks by) is drawn from the motion's ``luck``.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.ndimage import gaussian_filter1d, uniform_filter1d
from scipy.signal import bilinear, lfilter
from scipy.spatial.transform import Rotation

from sim.benchmark.generators.independent_effects import (
    CHANNELS,
    MG,
    WHITE,
    G,
    _phase,
    _sign,
    _some_channels,
    _turning_channel,
    _vector,
)
from sim.benchmark.generators.independent_table import Rig, read_positions

STAGES = ("drive", "places", "analogue", "reference", "times", "sampled", "noise")
PLACES = ("reference", "clock", "motion", "bench", "cube", "chip", "supply", "host", "nothing")


@dataclass(frozen=True)
class Motion:
    """Motion of the table on a fine, even time base, readings (n, 12) of ideal chips, and the board's temperature."""

    t: np.ndarray
    angle: np.ndarray
    rate: np.ndarray
    acceleration: np.ndarray
    readings: np.ndarray
    temperature: np.ndarray
    seed: tuple[int, ...] = (0,)

    @property
    def step(self):
        return self.t[1] - self.t[0]

    def luck(self):
        """What happens by chance in this recording, the same at every call."""
        return np.random.default_rng(self.seed)


@dataclass(frozen=True)
class Places:
    """Positions (n, 4, 3) and sensing axes (n, 4, 3 axes, 3) of the chips in the turning table's frame, and how far
    the whole bench is moved in the lab (n, 3); n may be 1. The origin is the foot of the cube, on the axis."""

    arms: np.ndarray
    axes: np.ndarray
    lab: np.ndarray

    @classmethod
    def at_rest(cls):
        rig = Rig()
        return cls(rig.arms[None], rig.axes[None], np.zeros((1, 3)))

    def turned(self, lean):
        """Turned about the foot by rotation vectors (n, 3)."""
        back = Rotation.from_rotvec(lean).as_matrix().transpose(0, 2, 1)
        return replace(self, arms=self.arms @ back, axes=self.axes @ back[:, None])

    def moved(self, lab):
        return replace(self, lab=self.lab + lab)


@dataclass(frozen=True)
class Foreign:
    """An effect: stage in the chain, place, dependence in words, draw(rng, plan) of its parameters at a typical size.

    ``act`` takes the parameters, the motion and what its stage passes on: places, readings (n, 12), the reference's
    reading, stamps and sample times, or sample times and channels; in the drive the parameters and the rig.

    ``shape`` are the parameters that no scaling touches, ``most`` is how large one of the others gets in practice,
    ``kin`` are names of a library that would be no wrong answer. Those without a continuous size are ``sizeless``.
    """

    stage: str
    place: str
    dependence: str
    draw: Callable
    act: Callable
    shape: tuple[str, ...] = ()
    most: tuple[str, float] | None = None
    kin: tuple[str, ...] = ()
    sizeless: bool = False

    def scaled(self, parameters, factor):
        """Return the parameters with the size multiplied, as far as it gets in practice."""
        if self.sizeless:
            return parameters
        if self.most:
            key, most = self.most
            factor = min(factor, most / abs(parameters[key]))
        return {key: value if key in self.shape else value * factor for key, value in parameters.items()}


FOREIGN: dict[str, Foreign] = {}


def _foreign(stage, place, dependence, draw, **more):
    def enter(act):
        FOREIGN[act.__name__] = Foreign(stage, place, dependence, draw, act, **more)
        return act

    return enter


def acting(hidden, stage):
    """The effects of a stage among those hidden (names and parameters), with their parameters."""
    return [(FOREIGN[name].act, one) for name, one in hidden.items() if FOREIGN[name].stage == stage]


def _azimuth(rng):
    return float(rng.uniform(0, 2 * np.pi))


def _mode(rng, low, high):
    return {"frequency_hz": float(rng.uniform(low, high)), "damping_ratio": float(rng.uniform(0.02, 0.06))}


_MODE = ("frequency_hz", "damping_ratio")


def _along(azimuth):
    return np.array([np.cos(azimuth), np.sin(azimuth), 0.0])


def _rung(push, step, one):
    """Solve x'' + 2ζω₀x' + ω₀²x = push by the bilinear transform, from rest."""
    natural = 2 * np.pi * one["frequency_hz"]
    return lfilter(*bilinear([1.0], [1.0, 2 * one["damping_ratio"] * natural, natural**2], 1 / step), push)


def _low_passed(signal, step, time_constant):
    """First-order low-pass along the first axis by the bilinear transform, settled at first."""
    x = step / (2 * time_constant)
    gain, pole = x / (1 + x), (1 - x) / (1 + x)
    return lfilter([gain, gain], [1, -pole], signal, axis=0, zi=(1 - gain) * signal[:1])[0]


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
        for number in range(luck.integers(4, 10)):
            since = np.maximum(run.t - begin - one["pace_s"] * (number + 0.05 * luck.standard_normal()), 0.0)
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


# What the chips make of specific force.


@_foreign(
    "analogue",
    "chip",
    "cube of the channel's own reading",
    lambda rng, plan: _some_channels(rng, "_s4_m2", 3e-5),
)
def cubic_channels(one, run, readings):
    return readings + _vector(one, "_s4_m2") * readings**3


def _pairs_of_chips(rng):
    pairs = {}
    for _ in range(rng.integers(1, 4)):
        to, source = rng.choice(4, 2, replace=False) * 3 + rng.integers(3, size=2)
        pairs[f"{CHANNELS[to]}_from_{CHANNELS[source]}"] = float(0.01 * rng.standard_normal())
    return pairs


@_foreign(
    "analogue",
    "chip",
    "reading of a channel of another chip: cross-talk on the wires between chips",
    lambda rng, plan: _pairs_of_chips(rng),
)
def chip_crosstalk(one, run, readings):
    out = readings.copy()
    for pair, ratio in one.items():
        to, _, source = pair.partition("_from_")
        out[:, CHANNELS.index(to)] += ratio * readings[:, CHANNELS.index(source)]
    return out


@_foreign(
    "analogue",
    "supply",
    "|ω| and |α|, common to all gains: the supply sags under the drive",
    lambda rng, plan: {"per_rate_s_rad": 2e-4, "per_acceleration_s2_rad": 1e-4},
)
def supply_sag(one, run, readings):
    sag = one["per_rate_s_rad"] * np.abs(run.rate) + one["per_acceleration_s2_rad"] * np.abs(run.acceleration)
    return readings * (1.0 - sag)[:, None]


@_foreign(
    "analogue",
    "supply",
    "waves of the angle, common to all gains: the slip ring's contact is worse on one side",
    lambda rng, plan: {"amplitude": 5e-3, "order": float(rng.integers(1, 4)), "phase_rad": _phase(rng)},
    shape=("order", "phase_rad"),
)
def slip_ring(one, run, readings):
    return readings * (1.0 + one["amplitude"] * np.cos(one["order"] * run.angle + one["phase_rad"]))[:, None]


@_foreign(
    "analogue",
    "supply",
    "driving torque (α, drag and friction), an offset per channel: the motor's current lifts the ground",
    lambda rng, plan: _some_channels(rng, "_m", 1 * MG),
)
def torque_offsets(one, run, readings):
    torque = run.acceleration + 0.5 * run.rate + 0.4 * np.tanh(run.rate / 0.05)  # rad/s², over the inertia
    return readings + np.outer(torque, _vector(one, "_m"))


@_foreign("analogue", "chip", "|ω|, an offset per channel", lambda rng, plan: _some_channels(rng, "_m_s", 1 * MG))
def rate_offsets(one, run, readings):
    return readings + np.outer(np.abs(run.rate), _vector(one, "_m_s"))


@_foreign(
    "analogue",
    "chip",
    "board temperature behind a first-order lag, an offset per channel: the chips follow the board late",
    lambda rng, plan: {
        **_some_channels(rng, "_m_s2_K", 1 * MG),
        "time_constant_s": float(plan.duration * rng.uniform(0.15, 0.5)),
    },
    shape=("time_constant_s",),
    kin=("bias_temperature", "warm_up"),
)
def lagged_temperature(one, run, readings):
    late = _low_passed(run.temperature - 25.0, run.step, one["time_constant_s"])
    return readings + np.outer(late, _vector(one, "_m_s2_K"))


@_foreign(
    "analogue",
    "chip",
    "rate of the board's temperature, an offset per channel: a gradient across the package",
    lambda rng, plan: _some_channels(rng, "_m_s_K", 20 * MG),
)
def temperature_gradient(one, run, readings):
    return readings + np.outer(np.gradient(run.temperature, run.t), _vector(one, "_m_s_K"))


@_foreign(
    "analogue",
    "chip",
    "time since the start, an offset per channel that dies away: the chips start warm",
    lambda rng, plan: {
        **_some_channels(rng, "_m_s2", 8 * MG),
        "time_constant_s": float(plan.duration * rng.uniform(0.05, 0.4)),
    },
    shape=("time_constant_s",),
    kin=("warm_up", "bias"),
)
def warm_start(one, run, readings):
    left = np.exp(-np.maximum(run.t, 0.0) / one["time_constant_s"])
    return readings + np.outer(left, _vector(one, "_m_s2"))


@_foreign(
    "analogue",
    "chip",
    "none: constant offsets, new at every start",
    lambda rng, plan: {"rms_m_s2": 10 * MG},
    kin=("bias",),
)
def turn_on_bias(one, run, readings):
    return readings + one["rms_m_s2"] * run.luck().standard_normal(12)


@_foreign(
    "analogue",
    "chip",
    "first-order lag of one chip alone",
    lambda rng, plan: {"chip": f"a{rng.integers(1, 5)}", "time_constant_s": 3e-3},
    shape=("chip",),
    most=("time_constant_s", 0.05),
)
def chip_lag(one, run, readings):
    out, mine = readings.copy(), _channels_of(one["chip"])
    out[:, mine] = _low_passed(readings[:, mine], run.step, one["time_constant_s"])
    return out


def _channels_of(chip):
    first = 3 * int(chip[1]) - 3
    return slice(first, first + 3)


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


# From places to readings, from readings to samples.


def by_positions(run, places):
    """Readings (n, 12) from positions in the lab, differenced twice."""
    to_lab = Rotation.from_rotvec(np.outer(run.angle, [0.0, 0.0, 1.0])).as_matrix().transpose(0, 2, 1)
    positions = places.arms @ to_lab + places.lab[:, None]
    return read_positions(positions, places.axes @ to_lab[:, None], run.step, np.array([0.0, 0.0, -G]))


def noise_free(run, t, hidden, read=by_positions):
    """Stamps (n,), sample times (n, 4), channels (n, 12) and tachometer (n,) at times ``t``, without noise.

    ``read`` turns a motion and places into readings; its difference to places at rest adds to the motion's readings.
    """
    readings, places = run.readings, Places.at_rest()
    for act, one in acting(hidden, "places"):
        places = act(one, run, places)
    if acting(hidden, "places"):
        readings = readings + (read(run, places) - read(run, Places.at_rest()))
    for act, one in acting(hidden, "analogue"):
        readings = act(one, run, readings)
    reference = run.rate
    for act, one in acting(hidden, "reference"):
        reference = act(one, run, reference)
    stamps, times = t, np.repeat(t[:, None], 4, axis=1)
    for act, one in acting(hidden, "times"):
        stamps, times = act(one, run, stamps, times)
    chips = [CubicSpline(run.t, readings[:, 3 * k : 3 * k + 3])(times[:, k]) for k in range(4)]
    channels = np.hstack(chips)
    for act, one in acting(hidden, "sampled"):
        channels = act(one, run, times, channels)
    return stamps, times, channels, np.interp(stamps, run.t, reference)
