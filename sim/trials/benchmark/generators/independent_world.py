"""Recordings with effects hidden by seed, from a generator that shares no physics with the project.

`hide` draws a table run (MuJoCo, stepped, real drive), puts effects into it, measures it with chips and a tachometer
of its own, and returns the file's columns apart from the truth. As a program it writes both:

    python -m sim.trials.benchmark.generators.independent_world --seed 3 --size 300 --out DIR table_tilt
"""

import argparse
import hashlib
import json
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.fft import irfft, next_fast_len, rfft
from scipy.interpolate import CubicSpline

from sim.trials.benchmark.generators.independent_effects import (
    CHANNELS,
    DRAWS,
    EXOTICS,
    LSB,
    MG,
    SIZELESS,
    WHITE,
    analogue,
    cube_angle,
    digital,
    reference_reading,
    rig_with,
    scaled,
)
from sim.trials.benchmark.generators.independent_table import Rig, differenced_readings, drive_table, random_command


@dataclass(frozen=True)
class Setting:
    """How a world is measured; ``top`` is the largest reading without effects, m/s²."""

    duration: float = 40.0
    sample_rate: float = 100.0
    bias_instability_m_s2: float = 0.15 * MG
    tacho_noise_rad_s: float = 0.02
    step_s: float = 1e-3
    top: float = 0.0


@dataclass(frozen=True)
class HiddenRun:
    """Columns of the file, and apart from them what is hidden and the d′ of the least of it."""

    columns: dict
    truth: tuple
    detectability: float

    def write(self, folder):
        """Write the recording (CSV) and, in a file of its own named alike, the truth; return both paths."""
        table = np.column_stack(list(self.columns.values()))
        digest = hashlib.sha256(table.tobytes()).hexdigest()[:12]
        recording, truth = Path(folder) / f"run-{digest}.csv", Path(folder) / f"truth-{digest}.json"
        header = "# array: cube12\n" + ",".join(self.columns)
        np.savetxt(recording, table, delimiter=",", fmt="%.9g", header=header, comments="")
        truth.write_text(json.dumps([{"effect": name, "parameters": values} for name, values in self.truth], indent=2))
        return recording, truth


def hide(seed, effects=(), size=300.0, *, draw_command=random_command, drive=drive_table, **setting):
    """Hide effects in a run drawn from a seed.

    Parameters
    ----------
    seed : int
        Seed of profile, parameters and noise.
    effects : sequence of str
        Names from the contract's table, or exotic ones.
    size : float
        Size of each as d′ = √Σ(Δ/σ)² over channels and tachometer, the drive known; no meaning for discrete ones.
    draw_command : callable
        Draws a commanded rate from a generator, a duration and the largest rate.
    drive : callable
        Drives the table after it, as `drive_table` does.
    **setting
        Fields of `Setting`.
    """
    rng = np.random.default_rng([seed, 77])
    plan = Setting(**setting)
    top = 25.0 if "saturation" in effects else 15.0  # rad/s: something has to reach the limit
    command = draw_command(rng, plan.duration, top)
    plain = drive(command, Rig(), plan.duration, plan.step_s)
    plan = Setting(**{**setting, "top": float(np.abs(plain.readings).max())})
    temperature = draw_temperature(rng, plan.duration)
    hidden = {}
    for name in effects:
        unit = (DRAWS | EXOTICS)[name](rng, plan)
        if name == "resonance":  # the mode's twist comes from a table that has this mode
            plain = drive(command, rig_with({name: unit}), plan.duration, plan.step_s)
        hidden[name] = _sized(plain, plan, temperature, name, unit, size)
    rig = rig_with(hidden)
    run = drive(command, rig, plan.duration, plan.step_s) if _differs(rig) else plain
    t, readings, tacho = noise_free(run, plan, temperature, hidden, rig, run.readings)
    columns = measured(rng, plan, t, readings, tacho, temperature, hidden)
    least = min((_reached(plain, plan, temperature, name, hidden[name], size) for name in hidden), default=np.inf)
    return HiddenRun(columns, tuple(hidden.items()), least)


def _reached(run, plan, temperature, name, parameters, size):
    """d′ of one effect, infinite for those without a noise-free form; what wiring does is never small."""
    if name == "cogging":
        return size
    if name == "saturation":
        return float(np.linalg.norm(np.maximum(np.abs(run.readings[::10]) - parameters["limit_m_s2"], 0.0) / WHITE))
    return np.inf if name in SIZELESS else _distance(run, plan, temperature, {name: parameters})


def _differs(rig):
    """Whether MuJoCo's table has to be stepped again for this rig."""
    ideal = Rig()
    same = (rig.gravity, rig.table_tilt, rig.mount_tilt, rig.eccentricity, rig.cogging[0], rig.torsion_hz)
    return (
        same != (ideal.gravity, ideal.table_tilt, ideal.mount_tilt, ideal.eccentricity, 0.0, ideal.torsion_hz)
        or rig.moved.any()
        or rig.turned.any()
    )


def _sized(run, plan, temperature, name, unit, size):
    """Scale an effect's parameters until it is ``size`` large."""
    if name in SIZELESS:
        return unit
    if name == "cogging":  # it changes the motion itself: rms of the tangential acceleration while turning
        turning = np.mean(np.abs(run.rate) > 0.3)
        force = unit["amplitude_rad_s2"] * 0.05 * np.sqrt(8 * turning * plan.duration * plan.sample_rate / 2)
        return scaled(name, unit, size * np.hypot(WHITE[0], LSB / np.sqrt(12)) / force)
    factor = 1.0
    for _ in range(6):
        reached = _distance(run, plan, temperature, {name: scaled(name, unit, factor)})
        ratio = np.clip(size / max(reached, 1e-9), 1e-2, 1e2)
        factor *= ratio
        if abs(ratio - 1) < 0.03:
            break
    found = scaled(name, unit, float(factor))
    if name == "resonance":  # 1 is the whole inertia on the spring; more is no mounting any more
        found["gain"] = min(found["gain"], 1.0)
    return found


def _distance(run, plan, temperature, hidden):
    """d′ of what has a noise-free form, from readings by differenced positions."""
    rig = rig_with(hidden)
    before = _ideal(run, plan, temperature)
    after = noise_free(run, plan, temperature, hidden, rig)
    sigma = np.hypot(WHITE, LSB / np.sqrt(12))
    channels = np.sum(((after[1] - before[1]) / sigma) ** 2)
    return float(np.sqrt(channels + np.sum(((after[2] - before[2]) / plan.tacho_noise_rad_s) ** 2)))


_last_ideal = []


def _ideal(run, plan, temperature):
    """What a run reads with nothing hidden; kept for the next question about the same run."""
    if not (_last_ideal and _last_ideal[0] is run and _last_ideal[1] == plan):
        _last_ideal[:] = [run, plan, noise_free(run, plan, temperature, {}, Rig())]
    return _last_ideal[2]


def noise_free(run, plan, temperature, hidden, rig, sensed=None):
    """Sample times, channels (n, 12) and tachometer (n,) without noise.

    ``sensed`` are MuJoCo's accelerometers; without them the readings come from differenced positions. What the table
    of MuJoCo does not have (nod, stretch, twist of the cube) is added to them as a difference of differenced readings.
    """
    angle = cube_angle(run, hidden)
    moved = rig.wobble[0] or rig.stretch or angle is not run.angle
    readings = differenced_readings(rig, run.t, angle, run.rate) if sensed is None or moved else 0.0
    if sensed is not None:
        rigid = Rig(**{**vars(rig), "wobble": (0.0, 0.0, 0.0), "stretch": 0.0})
        readings = sensed + (readings - differenced_readings(rigid, run.t, run.angle, run.rate) if moved else 0.0)
    fine = analogue(np.array(readings), run.t, run.angle, run.rate, temperature(run.t), hidden)
    t = np.arange(round(plan.duration * plan.sample_rate)) / plan.sample_rate
    true = t / (1.0 + hidden.get("clock_error", {}).get("ratio", 0.0))
    skew = hidden.get("channel_skew", {}).get("per_chip_s", 0.0)
    chips = [CubicSpline(run.t, fine[:, 3 * k : 3 * k + 3])(true + k * skew) for k in range(4)]
    tacho = reference_reading(t, CubicSpline(run.t, run.angle), CubicSpline(run.t, run.rate), hidden)
    return t, np.hstack(chips), tacho


def measured(rng, plan, t, readings, tacho, temperature, hidden):
    """Columns of the file: noise, 1/f noise, counts, wiring, lost rows."""
    white = WHITE * np.sqrt(max(plan.sample_rate, 100.0) / 100.0) * hidden.get("noise", {}).get("factor", 1.0)
    samples = readings + white * rng.standard_normal(readings.shape)
    samples += plan.bias_instability_m_s2 * rng.uniform(0.7, 1.4, 12) * pink_noise(rng, len(t), 12)
    walk = hidden.get("bias_random_walk", {}).get("strength_m_s2_rts", 0.0)
    samples += walk / np.sqrt(plan.sample_rate) * np.cumsum(rng.standard_normal(readings.shape), axis=0)
    counts, kept = digital(samples, t, hidden, rng)
    columns = {"t_s": t[kept]}
    columns |= {f"{name}_m_s2": counts[kept, index] for index, name in enumerate(CHANNELS)}
    columns["tacho_rad_s"] = (tacho + plan.tacho_noise_rad_s * rng.standard_normal(len(t)))[kept]
    columns["temperature_degC"] = np.round(temperature(t[kept]) * 16) / 16
    return columns


def pink_noise(rng, n, columns):
    """1/f noise (n, columns) of unit rms over 8 n samples: white noise through the autoregressive filter of Kasdin
    (1995, eq. 116) with α = 1, as its impulse response."""
    length = next_fast_len(8 * n, real=True)
    order = np.arange(1, length)
    response = np.concatenate([[1.0], np.cumprod((order - 0.5) / order)])
    white = rng.standard_normal((length, columns))
    noise = irfft(rfft(white, 2 * length, axis=0) * rfft(response, 2 * length)[:, None], 2 * length, axis=0)[:length]
    noise -= noise.mean(axis=0)
    return (noise / noise.std(axis=0))[-n:]


def draw_temperature(rng, duration):
    rise, settling = rng.uniform(1.0, 4.0), rng.uniform(0.2, 0.8) * duration
    swing, period = rng.uniform(0.1, 0.6), rng.uniform(0.3, 1.2) * duration
    return lambda t: 25.0 + rise * (1 - np.exp(-np.maximum(t, 0.0) / settling)) + swing * np.sin(2 * np.pi * t / period)


def main():
    parser = argparse.ArgumentParser(description="Write a recording with hidden effects, and the truth beside it.")
    parser.add_argument("effects", nargs="*", metavar="EFFECT", help=", ".join([*DRAWS, *EXOTICS]))
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--size", type=float, default=300.0, help="d′ of each effect")
    parser.add_argument("--duration", type=float, default=40.0)
    parser.add_argument("--sample-rate", type=float, default=100.0)
    parser.add_argument("--out", type=Path, required=True)
    options = parser.parse_args()
    options.out.mkdir(parents=True, exist_ok=True)
    run = hide(options.seed, options.effects, options.size, duration=options.duration, sample_rate=options.sample_rate)
    for path in run.write(options.out):
        print(path)


if __name__ == "__main__":
    main()
