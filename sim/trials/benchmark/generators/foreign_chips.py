"""Foreign effects of what the chips make of specific force."""

import numpy as np

from sim.trials.benchmark.generators.foreign_effect import Foreign, _low_passed, entering
from sim.trials.benchmark.generators.independent_effects import CHANNELS, MG, _phase, _some_channels, _vector

EFFECTS: dict[str, Foreign] = {}
_foreign = entering(EFFECTS)


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
