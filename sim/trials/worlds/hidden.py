"""Campaigns: worlds with hidden effects, drawn by seed, and recordings of them.

A hidden world is a nominal twin plus effects of random kind, place, shape and size, on a random profile of the table,
measured by sensors with data-sheet noise, quantisation, bias instability and a noisy tachometer.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter1d

from gfimu.base.units import MILLI_G
from gfimu.recording import Recording
from sim import forward
from sim.effects import EFFECTS, Effect, make_effect
from sim.motions.motion import SpinMotion, SplineSpin
from sim.twin import Twin

__all__ = [
    "FORMLESS",
    "Measurement",
    "bias_instability",
    "clipped_motion",
    "detectability",
    "discrete_parameters",
    "drawn_profile",
    "hidden_effect",
    "level_factors",
    "measure",
    "profile_grid",
    "random_profile",
    "temperature_course",
]

FORMLESS = frozenset({"noise", "bias_random_walk", "coarse_resolution", "stuck_channel", "dropped_frames"})
"""Effects without a noise-free form: no prediction shows them."""

GRID, SMOOTHING = 5e-3, 0.08
"""Step of a drawn profile and standard deviation of the Gaussian that smooths it, s."""

_POWERS = (0.25, 0.5, 2.0, 4.0)
_CLIPPED_ABOVE, _FASTEST_SHARE = 1.07, 0.02  # of gravity; of the readings that have to be above it


@dataclass(frozen=True)
class Measurement:
    """How a world is measured.

    Parameters
    ----------
    duration : float
        Length, s.
    sample_rate : float
        Samples per second, Hz.
    bias_instability : float
        Rms of 1/f noise per channel, m/s².
    tacho_noise : float
        White noise of the tachometer, rad/s.
    encoder_step : float
        Count of the table's encoder, rad; 0 where it has none.
    """

    duration: float = 40.0
    sample_rate: float = 100.0
    bias_instability: float = 0.15 * MILLI_G
    tacho_noise: float = 0.02
    encoder_step: float = 0.0


def random_profile(rng: np.random.Generator, duration: float, *, top_rate: float = 15.0) -> SplineSpin:
    """Draw a profile of the table: ramps, plateaus, rests and a gentle sweep.

    Parameters
    ----------
    rng : numpy.random.Generator
        Random number generator.
    duration : float
        Length, s.
    top_rate : float
        Largest plateau rate, rad/s.
    """
    fine = profile_grid(duration)
    return SplineSpin.through(fine, gaussian_filter1d(drawn_profile(rng, fine, duration, top_rate), SMOOTHING / GRID))


def clipped_motion(draw: Callable[[], SpinMotion], twin: Twin, setting: Measurement) -> SpinMotion:
    """Draw motions until one has readings beyond gravity, often enough for clipping there to be seen.

    Parameters
    ----------
    draw : callable
        Draws a motion.
    twin : Twin
        The nominal world.
    setting : Measurement
        Length and rate.
    """
    t = np.arange(round(setting.duration * setting.sample_rate)) / setting.sample_rate
    level = _CLIPPED_ABOVE * twin.gravity
    while True:
        motion = draw()
        if np.quantile(np.abs(twin.predict(motion, t)[0]), 1.0 - _FASTEST_SHARE) > level:
            return motion


def profile_grid(duration: float) -> NDArray[np.float64]:
    """Return the times at which a profile of a length is drawn, s; they begin and end 2 s beyond it."""
    return np.arange(-2.0, duration + 2.0, GRID)


def drawn_profile(
    rng: np.random.Generator, fine: NDArray[np.float64], duration: float, top_rate: float = 15.0
) -> NDArray[np.float64]:
    """Draw the rates of `random_profile` at times of `profile_grid`, rad/s, before they are smoothed."""
    knots, rates = [-5.0, -1.0], [0.0, 0.0]
    now, rate = -1.0, 0.0
    while now < duration + 1.0:
        now += rng.uniform(1.5, 4.0)
        knots.append(now)
        rates.append(rate)
        now += rng.uniform(0.5, 2.0)
        rate = rng.uniform(-top_rate, top_rate) if rng.random() > 0.2 else 0.0
        knots.append(now)
        rates.append(rate)
    profile = np.interp(fine, knots, rates)
    begin = rng.uniform(0.1, 0.7) * duration
    first, last = np.searchsorted(fine, [begin, begin + 0.15 * duration])
    since = fine[first:last] - begin
    profile[first:last] += 2.0 * np.sin(2 * np.pi * (0.3 * since + 0.1 * since**2))
    return profile


def bias_instability(rng: np.random.Generator, n: int, channels: int, rms: float) -> NDArray[np.float64]:
    """Draw 1/f noise of a given rms over four times the run, shape (n, channels), by shaping a spectrum."""
    long = 4 * n
    frequency = np.fft.rfftfreq(long)
    frequency[0] = np.inf
    spectrum = rng.standard_normal((len(frequency), channels)) + 1j * rng.standard_normal((len(frequency), channels))
    noise = np.fft.irfft(spectrum / np.sqrt(frequency)[:, None], long, axis=0)
    noise *= rms / noise.std(axis=0)
    return noise[:n]


def temperature_course(rng: np.random.Generator, t: NDArray[np.float64]) -> NDArray[np.float64]:
    """Draw the temperature of a board that warms up in a room that sways, (n,), °C."""
    temperature = 25.0 + rng.uniform(1.0, 4.0) * (1 - np.exp(-t / rng.uniform(8.0, 30.0)))
    return temperature + 0.5 * np.sin(2 * np.pi * t / rng.uniform(12.0, 40.0) + rng.uniform(0, 6))


def level_factors(rng: np.random.Generator, channels: int) -> NDArray[np.float64]:
    """Draw how the bias instability of each channel differs from the usual one, (channels,)."""
    return np.exp(0.3 * rng.standard_normal(channels))


def measure(
    rng: np.random.Generator,
    twin: Twin,
    effects: Sequence[Effect] = (),
    setting: Measurement = Measurement(),
    *,
    motion: SpinMotion | None = None,
    mounting: NDArray[np.float64] | None = None,
) -> Recording:
    """Record a world: the twin's, plus effects, on a random profile unless a motion is given.

    Parameters
    ----------
    rng : numpy.random.Generator
        Random number generator.
    twin : Twin
        The nominal world.
    effects : sequence of Effect
        What is hidden in it.
    setting : Measurement
        Length, rate and noise.
    motion : SpinMotion, optional
        Motion of the table.
    mounting : ndarray, shape (3,), optional
        How the cube was turned from upright, rad.
    """
    spin = random_profile(rng, setting.duration) if motion is None else motion
    t = np.arange(round(setting.duration * setting.sample_rate)) / setting.sample_rate
    world = twin.world(effects, mounting)
    temperature = temperature_course(rng, t)
    readings = forward.channels(world, spin, t, temperature)
    expected = twin.expected_noise(setting.sample_rate)
    white = np.sqrt(expected.white**2 - expected.quantum**2 / 12.0) * world.noise_factor
    readings = readings + white * rng.standard_normal(readings.shape)
    level = setting.bias_instability * level_factors(rng, readings.shape[1])
    readings += bias_instability(rng, readings.shape[0], readings.shape[1], 1.0) * level
    if world.bias_walk:
        step = world.bias_walk / np.sqrt(setting.sample_rate)
        readings += np.cumsum(step * rng.standard_normal(readings.shape), axis=0)
    # The converter rounds once: a coarser step takes the place of the part's own.
    steps = [effect.value("step_m_s2") for effect in effects if effect.name == "coarse_resolution"]
    quantum = max(steps, default=expected.quantum)
    readings = quantum * np.round(readings / quantum)
    for data_step in world.data_steps:
        readings = data_step(t, readings, rng)
    tacho = forward.reference(world, spin, t) + setting.tacho_noise * rng.standard_normal(len(t))
    reference = {"tacho_rad_s": tacho, "temperature_degC": temperature}
    if setting.encoder_step:
        moved = spin
        for motion_step in world.motion_steps:
            moved = motion_step(moved, t)
        angle = moved.at(t - world.tacho_delay).angle
        reference["angle_rad"] = setting.encoder_step * np.floor(angle / setting.encoder_step)
    kept = np.isfinite(readings).any(axis=1)
    metadata = {} if mounting is None else {"mounting_rotvec_rad": [float(v) for v in mounting]}
    return Recording.from_arrays(
        t[kept],
        readings[kept],
        twin.array,
        reference={name: column[kept] for name, column in reference.items()},
        metadata={"array": twin.array_name or twin.array.name, **metadata},
    )


def detectability(
    twin: Twin, effects: Sequence[Effect], motion: SpinMotion, setting: Measurement = Measurement()
) -> float:
    """Return d′ = √Σ(Δ/σ)² of effects over all channels and the tachometer, the drive known."""
    t = np.arange(round(setting.duration * setting.sample_rate)) / setting.sample_rate
    temperature = 25.0 + 3.0 * (1 - np.exp(-t / 15.0))
    before = twin.predict(motion, t, temperature=temperature)
    after = twin.predict(motion, t, effects=effects, temperature=temperature)
    white = twin.expected_noise(setting.sample_rate).white
    return float(
        np.sqrt(
            np.sum(((after[0] - before[0]) / white) ** 2) + np.sum(((after[1] - before[1]) / setting.tacho_noise) ** 2)
        )
    )


def hidden_effect(
    rng: np.random.Generator,
    twin: Twin,
    name: str,
    motion: SpinMotion,
    target: float,
    setting: Measurement = Measurement(),
) -> Effect:
    """Draw an effect of a kind: place, shape and direction by chance, size so that d′ is about ``target``.

    Effects without a continuous size (wiring, ranges, lost frames, noise) are drawn from what occurs in practice.
    """
    if name in _DISCRETE:
        t = np.arange(round(setting.duration * setting.sample_rate)) / setting.sample_rate
        return make_effect(name, _DISCRETE[name](rng, twin, np.abs(twin.predict(motion, t)[0]), setting))
    family = EFFECTS[name]
    sizes = family.sizes(twin.array)
    patterns = family.patterns(twin.array)
    pattern = patterns[0] if rng.random() < 0.5 else patterns[rng.integers(len(patterns))]
    shape = _shape(rng, name, setting)
    direction = pattern.mixing @ rng.standard_normal(pattern.mixing.shape[1])
    direction = direction * np.array([size.prior_std for size in sizes])
    direction = np.where([size.positive for size in sizes], np.abs(direction), direction)
    scale = 1.0
    for _ in range(8):
        reached = detectability(twin, [family.from_sizes(twin.array, scale * direction, shape)], motion, setting)
        if reached <= 0:
            scale *= 10.0
            continue
        ratio = np.clip(target / reached, 1e-3, 1e3)
        scale *= float(ratio)
        if abs(ratio - 1) < 0.02:
            break
    if name == "resonance":
        # A participation beyond 1 is no mounting any more.
        scale = min(scale, 1.0 / max(direction[0], 1e-12))
    return family.from_sizes(twin.array, scale * direction, shape)


def discrete_parameters(
    rng: np.random.Generator, twin: Twin, name: str, magnitude: NDArray[np.float64], duration: float, sample_rate: float
) -> dict[str, Any]:
    """Draw parameters of an effect without a continuous size, given the magnitude of the readings (n, c), m/s²."""
    return _DISCRETE[name](rng, twin, magnitude, Measurement(duration, sample_rate))


def _shape(rng: np.random.Generator, name: str, setting: Measurement) -> dict[str, float]:
    """Draw shape parameters off the grid that diagnosis screens over."""
    nyquist = setting.sample_rate / 2
    draws: dict[str, dict[str, float]] = {
        "interference_tone": {"frequency_hz": float(rng.uniform(0.03, 0.95) * nyquist)},
        "cogging": {"order": float(rng.integers(1, 25))},
        "tacho_ripple": {"order": float(rng.integers(1, 7))},
        "resonance": {
            "frequency_hz": float(rng.uniform(3.0, min(25.0, 0.5 * nyquist))),
            "damping_ratio": float(rng.uniform(0.01, 0.08)),
        },
        "warm_up": {"time_constant_s": float(setting.duration * rng.uniform(0.08, 0.8))},
        "hysteresis": {"width_m_s2": float(MILLI_G * np.exp(rng.uniform(np.log(5.0), np.log(400.0))))},
        "axis_wobble": {"direction_rad": 0.0},
    }
    return draws.get(name, {})


def _saturation(rng, twin, magnitude, setting) -> dict[str, object]:  # type: ignore[no-untyped-def]
    top = float(np.quantile(magnitude, rng.uniform(0.9, 0.985)))
    return {"limit_m_s2": max(top, 1.05 * twin.gravity)}


_DISCRETE: Mapping[str, Callable[..., dict[str, Any]]] = {
    "noise": lambda rng, twin, magnitude, setting: {"factor": float(rng.uniform(1.5, 4.0))},
    "bias_random_walk": lambda rng, twin, magnitude, setting: {
        "strength_m_s2_rts": float(rng.uniform(0.7, 6.0) * MILLI_G)
    },
    "saturation": _saturation,
    "coarse_resolution": lambda rng, twin, magnitude, setting: {
        "step_m_s2": float(twin.expected_noise(setting.sample_rate).quantum * 2 ** rng.integers(1, 4))
    },
    "wrong_range": lambda rng, twin, magnitude, setting: {
        "chip": twin.array.chips[rng.integers(len(twin.array.chips))].name,
        "factor": float(rng.choice(_POWERS)),
    },
    "axis_swap": lambda rng, twin, magnitude, setting: {"channels": _distinguishable_pair(rng, twin)},
    "sign_flip": lambda rng, twin, magnitude, setting: {"channel": str(rng.choice(twin.array.channels))},
    "stuck_channel": lambda rng, twin, magnitude, setting: _stuck(rng, twin, setting),
    "dropped_frames": lambda rng, twin, magnitude, setting: {"share": float(rng.uniform(0.002, 0.05))},
}


def _stuck(rng, twin, setting) -> dict[str, object]:  # type: ignore[no-untyped-def]
    start = float(rng.uniform(0.1, 0.7) * setting.duration)
    return {
        "channel": str(rng.choice(twin.array.channels)),
        "start_s": start,
        "stop_s": start + float(rng.uniform(1.0, 8.0)),
    }


def _distinguishable_pair(rng: np.random.Generator, twin: Twin) -> list[str]:
    """Draw two channels that read differently on a table; swapping twins leaves a perfect recording."""
    array = twin.array
    reading = np.column_stack([array.axes[:, 2], array.regression_matrix[:, 2], array.centripetal_matrix[:, 2]])
    while True:
        one, two = rng.choice(array.n_channels, size=2, replace=False)
        if np.linalg.norm(reading[one] - reading[two]) > 1e-6:
            return [array.channels[one], array.channels[two]]
