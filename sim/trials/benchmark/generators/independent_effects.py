"""Every effect of the contract's table in definitions of its own, and effects that are in no library.

Each effect is a function that draws its parameters in contract keys, for a unit size; what the parameters do to the
table, the readings, the reference or the samples stands in the functions further down, in the order of the chain.
"""

import numpy as np
from scipy.ndimage import gaussian_filter1d
from scipy.signal import lfilter

from sim.trials.benchmark.generators.independent_table import Rig

G = 9.80665
MG = G / 1000
LSB = 3.9 * MG
CHANNELS = tuple(f"a{chip}{axis}" for chip in range(1, 5) for axis in range(1, 4))
WHITE = MG * np.tile([2.67, 2.67, 4.14], 4)  # 0.75 and 1.1 LSB rms of the codes less the quantisation's own


def _some_channels(rng, unit, scale):
    """All channels, one chip's or a single channel."""
    chosen = [CHANNELS, CHANNELS[3 * (k := rng.integers(4)) : 3 * k + 3], (str(rng.choice(CHANNELS)),)][rng.integers(3)]
    return {f"{name}{unit}": float(scale * rng.standard_normal()) for name in chosen}


def _some_chips(rng, unit, scale):
    chosen = range(1, 5) if rng.random() < 0.5 else [rng.integers(1, 5)]
    return {f"a{chip}_{axis}{unit}": float(scale * rng.standard_normal()) for chip in chosen for axis in "xyz"}


def _two(rng, unit, scale):
    angle = rng.uniform(0, 2 * np.pi)
    return {f"x{unit}": scale * np.cos(angle), f"y{unit}": scale * np.sin(angle)}


def _sign(rng):
    return rng.choice([-1.0, 1.0])


def _phase(rng):
    return float(rng.uniform(-np.pi, np.pi))


# Parameters of a typical size; `hide` scales those that `SCALED` names.
DRAWS = {
    "bias": lambda rng, run: _some_channels(rng, "_m_s2", 20 * MG),
    "scale_factor": lambda rng, run: _some_channels(rng, "", 0.01),
    "misalignment": lambda rng, run: _some_chips(rng, "_rad", 5e-3),
    "sensor_position": lambda rng, run: _some_chips(rng, "_m", 1e-3),
    "eccentricity": lambda rng, run: _two(rng, "_m", 1e-3),
    "mount_tilt": lambda rng, run: _two(rng, "_rad", 5e-3),
    "table_tilt": lambda rng, run: _two(rng, "_rad", 3e-3),
    "axis_wobble": lambda rng, run: {
        "amplitude_rad": 1e-3,
        "phase_rad": _phase(rng),
        "direction_rad": float(rng.uniform(0, np.pi)),
    },
    "gravity": lambda rng, run: {"delta_m_s2": 0.02 * _sign(rng)},
    "cogging": lambda rng, run: {
        "amplitude_rad_s2": 1.0,
        "order": float(rng.integers(2, 13)),
        "phase_rad": _phase(rng),
    },
    "resonance": lambda rng, run: {
        "frequency_hz": float(rng.uniform(4, 20)),
        "damping_ratio": float(rng.uniform(0.02, 0.06)),
        "gain": 0.3,
    },
    "centrifugal_flex": lambda rng, run: {"stretch_s2_rad2": 2e-5},
    "sensor_lag": lambda rng, run: {"time_constant_s": 3e-3},
    "channel_skew": lambda rng, run: {"per_chip_s": 5e-4},
    "clock_error": lambda rng, run: {"ratio": 3e-4 * _sign(rng)},
    "tacho_latency": lambda rng, run: {"delay_s": 5e-3},
    "tacho_scale": lambda rng, run: {"ratio": 5e-3 * _sign(rng)},
    "bias_temperature": lambda rng, run: _some_channels(rng, "_m_s2_K", 0.5 * MG),
    "warm_up": lambda rng, run: {
        **_some_channels(rng, "_m_s2", 8 * MG),
        "time_constant_s": float(run.duration * rng.uniform(0.1, 0.6)),
    },
    "bias_random_walk": lambda rng, run: {"strength_m_s2_rts": float(rng.uniform(1, 5) * MG)},
    "quadratic": lambda rng, run: _some_channels(rng, "_s2_m", 3e-4),
    "cross_axis": lambda rng, run: {
        f"{CHANNELS[3 * chip + i]}_from_{CHANNELS[3 * chip + (i + 1) % 3]}": float(0.01 * rng.standard_normal())
        for chip in (range(4) if rng.random() < 0.5 else [rng.integers(4)])
        for i in range(3)
    },
    "hysteresis": lambda rng, run: {"lost_m_s2": 20 * MG, "width_m_s2": 20 * MG},
    "interference_tone": lambda rng, run: {
        "amplitude_m_s2": 2 * MG,
        "frequency_hz": float(rng.uniform(0.05, 0.45) * run.sample_rate),
        "phase_rad": _phase(rng),
    },
    "gain_drift": lambda rng, run: {"slope_1_s": 2e-4 * _sign(rng)},
    "vibration_rectification": lambda rng, run: _some_channels(rng, "_m_s2_per_rad4_s4", 3 * MG / 20.0**4),
    "tacho_ripple": lambda rng, run: {
        "amplitude": 0.01,
        "order": float(rng.integers(1, 5)),
        "phase_rad": _phase(rng),
    },
    "noise": lambda rng, run: {"factor": float(rng.uniform(1.6, 3.5))},
    "saturation": lambda rng, run: {"limit_m_s2": max(1.1 * G, run.top * rng.uniform(0.6, 0.9))},
    "coarse_resolution": lambda rng, run: {"step_m_s2": float(LSB * 2 ** rng.integers(1, 4))},
    "wrong_range": lambda rng, run: {
        "chip": f"a{rng.integers(1, 5)}",
        "factor": float(rng.choice([0.25, 0.5, 2.0, 4.0])),
    },
    "axis_swap": lambda rng, run: {"channels": _unlike_pair(rng)},
    "sign_flip": lambda rng, run: {"channel": str(rng.choice(CHANNELS))},
    "stuck_channel": lambda rng, run: {
        "channel": str(rng.choice(CHANNELS)),
        "start_s": (start := float(run.duration * rng.uniform(0.1, 0.7))),
        "stop_s": start + float(rng.uniform(1.5, 6.0)),
    },
    "dropped_frames": lambda rng, run: {"share": float(rng.uniform(0.003, 0.04))},
}

EXOTICS = {
    "stick_slip": lambda rng, run: {"angle_rad": 2e-3, "pitch_rad": float(rng.uniform(0.1, 0.4))},
    "cubic_channel": lambda rng, run: {"channel": _turning_channel(rng), "coefficient_s4_m2": 3e-5 * _sign(rng)},
    "tone_on_one_channel": lambda rng, run: {
        "channel": str(rng.choice(CHANNELS)),
        "amplitude_m_s2": 5 * MG,
        "frequency_hz": float(rng.uniform(0.05, 0.45) * run.sample_rate),
        "phase_rad": _phase(rng),
    },
    "bias_jump": lambda rng, run: {
        "channel": str(rng.choice(CHANNELS)),
        "step_m_s2": 10 * MG * _sign(rng),
        "time_s": float(run.duration * rng.uniform(0.25, 0.75)),
    },
    "square_wave": lambda rng, run: {"amplitude_m_s2": 3 * MG, "period_s": float(rng.uniform(0.4, 3.0))},
    "magnetic_pickup": lambda rng, run: {
        "channel": str(rng.choice(CHANNELS)),
        "coefficient_m_s": 1 * MG * _sign(rng),
        "phase_rad": _phase(rng),
    },
    "backlash": lambda rng, run: {"angle_rad": 4e-3},
}

SHAPE_KEYS = {
    "phase_rad",
    "direction_rad",
    "order",
    "frequency_hz",
    "damping_ratio",
    "time_constant_s",
    "pitch_rad",
    "channel",
    "time_s",
    "period_s",
}
SIZELESS = {
    "bias_random_walk",
    "noise",
    "saturation",
    "coarse_resolution",
    "wrong_range",
    "axis_swap",
    "sign_flip",
    "stuck_channel",
    "dropped_frames",
}


def scaled(name, parameters, factor):
    """Return the parameters with the size multiplied; shapes stay."""
    if name in SIZELESS:
        return parameters
    shape = SHAPE_KEYS - ({"time_constant_s"} if name == "sensor_lag" else set())
    return {key: value if key in shape else value * factor for key, value in parameters.items()}


def _turning_channel(rng):
    return str(rng.choice([name for name in CHANNELS if name[2] != "3"]))


def _unlike_pair(rng):
    """Two channels that don't read the same on an upright table: the vertical ones do, and x of one is y of another."""
    twins = [{"a11", "a32"}, {"a12", "a21"}, {"a22", "a41"}, {"a31", "a42"}]
    while True:
        pair = sorted(str(name) for name in rng.choice(CHANNELS, 2, replace=False))
        if set(pair) not in twins and not (pair[0][2] == pair[1][2] == "3"):
            return pair


def _vector(parameters, unit):
    return np.array([parameters.get(f"{name}{unit}", 0.0) for name in CHANNELS])


def _chip_vectors(parameters, unit):
    return np.array([[parameters.get(f"a{chip}_{axis}{unit}", 0.0) for axis in "xyz"] for chip in range(1, 5)])


def rig_with(hidden):
    """The rig that has the mechanical effects in it."""
    get = lambda name: hidden.get(name, {})
    tilt, mount, off = get("table_tilt"), get("mount_tilt"), get("eccentricity")
    nod, ripple, mode = get("axis_wobble"), get("cogging"), get("resonance")
    return Rig(
        gravity=G + get("gravity").get("delta_m_s2", 0.0),
        table_tilt=(tilt.get("x_rad", 0.0), tilt.get("y_rad", 0.0)),
        mount_tilt=(mount.get("x_rad", 0.0), mount.get("y_rad", 0.0)),
        eccentricity=(off.get("x_m", 0.0), off.get("y_m", 0.0)),
        moved=_chip_vectors(get("sensor_position"), "_m"),
        turned=_chip_vectors(get("misalignment"), "_rad"),
        torsion_hz=mode.get("frequency_hz", 12.0),
        torsion_damping=mode.get("damping_ratio", 0.03),
        cogging=(ripple.get("amplitude_rad_s2", 0.0), ripple.get("order", 1.0), ripple.get("phase_rad", 0.0)),
        wobble=(nod.get("amplitude_rad", 0.0), nod.get("phase_rad", 0.0), nod.get("direction_rad", 0.0)),
        stretch=get("centrifugal_flex").get("stretch_s2_rad2", 0.0),
    )


def cube_angle(run, hidden):
    """Angle of the cube: the table's, twist of the mounting, and play and stick-slip that the tachometer misses."""
    angle = run.angle + hidden.get("resonance", {}).get("gain", 0.0) * run.twist
    if "backlash" in hidden:
        half = hidden["backlash"]["angle_rad"]
        behind = _play(run.angle[:, None], half)[:, 0] - run.angle
        angle = angle + gaussian_filter1d(behind, 8e-3 / (run.t[1] - run.t[0]))
    if "stick_slip" in hidden:
        size, pitch = hidden["stick_slip"]["angle_rad"], hidden["stick_slip"]["pitch_rad"]
        saw = (run.angle / pitch) % 1.0 - 0.5
        slow = np.exp(-((run.rate / 3.0) ** 2))
        angle = angle - size * gaussian_filter1d(saw * slow, 6e-3 / (run.t[1] - run.t[0]))
    return angle


def analogue(readings, t, angle, rate, temperature, hidden):
    """What the chips make of specific force (n, 12) on the fine time base, before it becomes numbers."""
    get = lambda name: hidden.get(name, {})
    out = readings + _vector(get("quadratic"), "_s2_m") * readings**2
    for pair, ratio in get("cross_axis").items():
        to, _, source = pair.partition("_from_")
        out[:, CHANNELS.index(to)] += ratio * readings[:, CHANNELS.index(source)]
    if "cubic_channel" in hidden:
        channel = CHANNELS.index(hidden["cubic_channel"]["channel"])
        out[:, channel] += hidden["cubic_channel"]["coefficient_s4_m2"] * readings[:, channel] ** 3
    out = out * (1.0 + _vector(get("scale_factor"), ""))
    out = out * (1.0 + get("gain_drift").get("slope_1_s", 0.0) * t)[:, None]
    out += _vector(get("bias"), "_m_s2")
    out += np.outer(temperature - 25.0, _vector(get("bias_temperature"), "_m_s2_K"))
    out += np.outer(rate**4, _vector(get("vibration_rectification"), "_m_s2_per_rad4_s4"))
    if "warm_up" in hidden:
        settled = 1.0 - np.exp(-t / hidden["warm_up"]["time_constant_s"])
        out += np.outer(settled, _vector(hidden["warm_up"], "_m_s2"))
    if "magnetic_pickup" in hidden:
        one = hidden["magnetic_pickup"]
        out[:, CHANNELS.index(one["channel"])] += one["coefficient_m_s"] * rate * np.sin(angle + one["phase_rad"])
    if "sensor_lag" in hidden:
        x = (t[1] - t[0]) / (2 * hidden["sensor_lag"]["time_constant_s"])  # bilinear transform of 1/(1 + τs)
        gain, pole = x / (1 + x), (1 - x) / (1 + x)
        out = lfilter([gain, gain], [1, -pole], out, axis=0, zi=(1 - gain) * out[:1])[0]
    if "hysteresis" in hidden:
        out = _play(out, hidden["hysteresis"]["width_m_s2"])
    for name in ("interference_tone", "tone_on_one_channel"):
        if name in hidden:
            one = hidden[name]
            wave = one["amplitude_m_s2"] * np.sin(2 * np.pi * one["frequency_hz"] * t + one["phase_rad"])
            out[:, slice(None) if "channel" not in one else [CHANNELS.index(one["channel"])]] += wave[:, None]
    if "square_wave" in hidden:
        one = hidden["square_wave"]
        out += (one["amplitude_m_s2"] * np.where((t / one["period_s"]) % 1.0 < 0.5, 1.0, -1.0))[:, None]
    if "bias_jump" in hidden:
        one = hidden["bias_jump"]
        out[t >= one["time_s"], CHANNELS.index(one["channel"])] += one["step_m_s2"]
    return out


def _play(signal, half_width):
    """Backlash of columns (n, k): the output moves only after the input has crossed the play."""
    out = np.empty_like(signal)
    state = signal[0].copy()
    for row, value in enumerate(signal):
        state = np.minimum(np.maximum(state, value - half_width), value + half_width)
        out[row] = state
    return out


def reference_reading(t, angle_at, rate_at, hidden):
    """What the tachometer says at times t, without noise."""
    get = lambda name, key: hidden.get(name, {}).get(key, 0.0)
    late = t - get("tacho_latency", "delay_s")
    reading = rate_at(late) * (1.0 + get("tacho_scale", "ratio"))
    if "tacho_ripple" in hidden:
        one = hidden["tacho_ripple"]
        reading = reading * (1.0 + one["amplitude"] * np.sin(one["order"] * angle_at(late) + one["phase_rad"]))
    return reading


def digital(samples, t, hidden, rng):
    """What happens to analogue samples (n, 12) on their way to the file; rows to drop come second."""
    get = lambda name: hidden.get(name, {})
    limit = get("saturation").get("limit_m_s2", 16 * G)
    step = get("coarse_resolution").get("step_m_s2", LSB)
    out = step * np.round(np.clip(samples, -limit, limit) / step) + 0.0  # no minus zero
    if "wrong_range" in hidden:
        chip = int(hidden["wrong_range"]["chip"][1]) - 1
        out[:, 3 * chip : 3 * chip + 3] *= hidden["wrong_range"]["factor"]
    if "axis_swap" in hidden:
        one, two = (CHANNELS.index(name) for name in hidden["axis_swap"]["channels"])
        out[:, [one, two]] = out[:, [two, one]]
    if "sign_flip" in hidden:
        out[:, CHANNELS.index(hidden["sign_flip"]["channel"])] *= -1
    if "stuck_channel" in hidden:
        one = hidden["stuck_channel"]
        frozen = np.flatnonzero((t >= one["start_s"]) & (t < one["stop_s"]))
        out[frozen, CHANNELS.index(one["channel"])] = out[frozen[0], CHANNELS.index(one["channel"])]
    kept = np.ones(len(t), dtype=bool)
    if "dropped_frames" in hidden:
        while np.mean(~kept) < hidden["dropped_frames"]["share"]:
            start = rng.integers(1, len(t) - 6)
            kept[start : start + rng.integers(1, 5)] = False
    return out, kept
