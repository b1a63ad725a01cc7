"""The other generator with commands as people program them: swings, stairs, sweeps between two speeds, one speed.

The table follows them exactly, unless what is hidden is in its drive or its mounting: MuJoCo's table has a mode.
"""

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.ndimage import gaussian_filter1d

from sim.trials.benchmark.generators.independent_table import LEAD, Rig, TableRun, differenced_readings, drive_table
from sim.trials.benchmark.generators.independent_world import hide as hide_in

_STEP = 1e-3  # s


def swing(rng, fine, begun, top):
    return begun * rng.uniform(0.4, 1.0) * top * np.sin(2 * np.pi * rng.uniform(0.08, 0.8) * (fine - 0.5))


def two_sines(rng, fine, begun, top):
    waves = [
        rng.uniform(0.2, 0.5) * np.sin(2 * np.pi * rng.uniform(0.05, 1.2) * (fine - 0.5) + rng.uniform(0, 2 * np.pi))
        for _ in range(2)
    ]
    return begun * top * sum(waves)


def rocking(rng, fine, begun, top):
    """Rock by less than a quarter turn, as by hand: neither quite a sine nor quite steady."""
    turns, angle = 2 * np.pi * rng.uniform(0.3, 1.5), rng.uniform(0.3, 1.5)
    return begun * min(angle * turns, top) * np.cos(turns * (fine - 0.5) + 0.3 * np.sin(0.7 * fine))


def stairs(rng, fine, begun, top):
    steps = int(rng.integers(4, 10))
    length = (fine[-1] - 2.5) / steps
    signs = rng.choice([-1.0, 1.0], steps, p=[0.1, 0.9])
    return sum(sign * np.clip((fine - 0.5 - k * length) / 0.4, 0, 1) for k, sign in enumerate(signs)) * top / steps


def one_speed(rng, fine, begun, top):
    ramp = np.clip((fine - rng.uniform(1.0, 4.0)) / rng.uniform(0.5, 3.0), 0, 1)
    return ramp * rng.uniform(0.4, 1.0) * top * rng.choice([-1.0, 1.0])


def to_and_fro(rng, fine, begun, top):
    """Sweep from one speed to the opposite one, jump back, and again."""
    sweep = 2 * (((fine - 0.5) / rng.uniform(4.0, 12.0)) % 1) - 1
    return gaussian_filter1d(begun * top * rng.uniform(0.5, 1.0) * sweep, 150)


def speeds_and_rests(rng, fine, begun, top):
    length, rate, wanted = rng.uniform(3.0, 8.0), 0.0, np.zeros_like(fine)
    for index, begin in enumerate(np.arange(0.5, fine[-1], length)):
        target = 0.0 if index % 2 else rng.uniform(0.2, 1.0) * top * (-1.0 if index % 4 else 1.0)
        wanted += (target - rate) * np.clip((fine - begin) / rng.uniform(0.3, 1.5), 0, 1)
        rate = target
    return wanted


def slow(rng, fine, begun, top):
    swing = rng.uniform(1.0, 4.0) * np.sin(2 * np.pi * rng.uniform(0.02, 0.1) * (fine - 0.5))
    return begun * (swing + rng.uniform(0.5, 2.0))


def bursts(rng, fine, begun, top):
    bells = [
        np.exp(-(((fine - middle) / rng.uniform(0.2, 1.0)) ** 2)) for middle in rng.uniform(0.05, 0.9, 6) * fine[-1]
    ]
    return begun * top * sum(rng.uniform(-1.0, 1.0) * bell for bell in bells)


PROFILES = (swing, two_sines, rocking, stairs, one_speed, to_and_fro, speeds_and_rests, slow, bursts)


def programmed_command(rng, duration, top=15.0, name=""):
    """Draw a commanded rate (a function of time) of the named kind, of any by default; the table rests at first."""
    fine = np.arange(-2.0, duration + 2.0, _STEP)
    begun = np.clip((fine - 0.5) / 0.5, 0, 1)
    named = {profile.__name__: profile for profile in PROFILES}
    profile = named[name] if name else PROFILES[rng.integers(len(PROFILES))]
    return CubicSpline(fine, gaussian_filter1d(profile(rng, fine, begun, top), 30.0))


def follow(command, rig, duration, step=1e-3):
    """Move the table exactly as commanded, by MuJoCo where the drive or the mounting is not ideal."""
    if rig.cogging[0] or rig.torsion_hz != Rig().torsion_hz:
        return drive_table(command, rig, duration, step)
    t = np.arange(round((duration + 2 * LEAD) / step) + 1) * step - LEAD
    turned = command.antiderivative()
    angle, rate = turned(t) - turned(0.0), command(t)
    readings = differenced_readings(rig, t, angle, rate)
    return TableRun(t, angle, rate, command(t, 1), np.zeros_like(t), readings)


def hide(seed, effects=(), size=300.0, **setting):
    """Hide effects in a run as `independent_world.hide` does, under a programmed command."""
    return hide_in(seed, effects, size, draw_command=programmed_command, drive=follow, **setting)
