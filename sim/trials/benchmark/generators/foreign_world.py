"""Recordings with one foreign effect each, from MuJoCo's table: what no library of effects holds.

`hide` measures the table with chips of its own and shares no physics with the project. `new_recording` measures the
same world once more: another profile, other noise, what happens by chance happens at other times.
"""

import zlib
from functools import lru_cache

import numpy as np

from sim.trials.benchmark.generators.foreign_effects import FOREIGN, Motion, acting, by_positions, noise_free
from sim.trials.benchmark.generators.independent_effects import LSB, WHITE
from sim.trials.benchmark.generators.independent_table import Rig, drive_table, random_command
from sim.trials.benchmark.generators.independent_world import HiddenRun, Setting, draw_temperature, measured

SIGMA = np.hypot(WHITE, LSB / np.sqrt(12))
"""White noise of each channel with its quantisation, m/s²."""
TOP = 15.0
"""Largest commanded rate, rad/s."""


def hide(seed, effects=(), size=500.0, *, again=0, **setting):
    """Hide effects in MuJoCo's table.

    Parameters
    ----------
    seed : int
        Seed of the world; its remainder by three is the kind of the profile: held speeds, waypoints, or chirps.
    effects : sequence of str
        Names of foreign effects.
    size : float
        Size of each as d′ = √Σ(Δ/σ)² over channels and tachometer, the drive known; no meaning for sizeless ones.
    again : int
        Which further recording of the same world this is: other profile, other noise.
    **setting
        Fields of `Setting`.
    """
    plan = Setting(**setting)
    hidden = draw_hidden(seed, effects, size, plan, table_motion(seed, 0, plan)[0])
    rig = Rig()
    for act, one in acting(hidden, "drive"):
        rig = act(one, rig)
    run, temperature = table_motion(seed, again, plan, rig.friction)
    t = sample_times(plan)
    stamps, times, channels, tacho = noise_free(run, t, hidden)
    for act, one in acting(hidden, "noise"):
        channels = act(one, run, times, channels)
    columns = measured(np.random.default_rng([seed, 81, again]), plan, t, channels, tacho, temperature, {})
    return HiddenRun(columns | {"t_s": stamps}, tuple(hidden.items()), least_distance(hidden, plan, run))


def new_recording(seed, effects=(), size=500.0, *, generator=hide, again=1, **setting):
    """Record the world that a generator draws from these arguments once more, on another profile."""
    return generator(seed, effects, size, again=again, **setting)


def sample_times(plan):
    return np.arange(round(plan.duration * plan.sample_rate)) / plan.sample_rate


def draw_hidden(seed, effects, size, plan, run, read=by_positions):
    """Draw parameters of effects, as large as wanted in a world's first recording."""
    hidden = {}
    for name in effects:
        rng = np.random.default_rng([seed, 79, zlib.crc32(name.encode())])
        drawn = FOREIGN[name].draw(rng, plan).items()
        unit = {key: value if isinstance(value, str | int) else float(value) for key, value in drawn}
        hidden[name] = unit if FOREIGN[name].sizeless else sized(name, unit, size, plan, run, read)
    return hidden


def sized(name, unit, size, plan, run, read=by_positions):
    """Scale an effect's parameters until it is ``size`` large, by secants between the logarithms."""
    factor, power, last, best = 1.0, 1.0, None, (np.inf, unit)
    for _ in range(9):
        parameters = FOREIGN[name].scaled(unit, factor)
        reached = max(distance({name: parameters}, plan, run, read), 1e-9)
        best = min(best, (abs(np.log(reached / size)), parameters), key=lambda one: one[0])
        if best[0] < 0.01 or (last and reached == last[1]):
            break
        if last:
            power = float(np.clip(np.log(reached / last[1]) / np.log(factor / last[0]), 0.3, 3.0))
        last = (factor, reached)
        factor *= float(np.clip((size / reached) ** (1 / power), 1e-2, 1e2))
    return best[1]


def distance(hidden, plan, run, read=by_positions):
    """Return d′ of effects against what ideal chips and tachometer read at the times that the file has."""
    stamps, _, channels, tacho = noise_free(run, sample_times(plan), hidden, read)
    _, _, ideal, rate = noise_free(run, stamps, {}, read)
    moved = np.sum(((tacho - rate) / plan.tacho_noise_rad_s) ** 2)
    return float(np.sqrt(np.sum(((channels - ideal) / SIGMA) ** 2) + moved))


def least_distance(hidden, plan, run, read=by_positions):
    """d′ of the least effect that has a noise-free form, in the recording at hand; infinite where none has."""
    formed = [name for name in hidden if FOREIGN[name].stage not in {"drive", "noise"}]
    return min((distance({name: hidden[name]}, plan, run, read) for name in formed), default=np.inf)


@lru_cache(maxsize=4)
def table_motion(seed, again, plan, friction=Rig().friction):
    """Drive MuJoCo's table: its motion, and the temperature as a function of time."""
    rng = np.random.default_rng([seed, 78, again])
    command = random_command(rng, plan.duration, TOP, kind=(seed + again) % 3)
    temperature = draw_temperature(rng, plan.duration)
    run = drive_table(command, Rig(friction=friction), plan.duration, plan.step_s)
    warm = temperature(run.t)
    return Motion(run.t, run.angle, run.rate, run.acceleration, run.readings, warm, (seed, 80, again)), temperature
