"""Recordings of foreign worlds: what no library of effects holds, hidden one at a time, by two generators.

`hide` measures MuJoCo's table with chips of its own and shares no physics with the project; `hide_in_campaign` hides
the same effects in a world of `sim` and measures it as its campaign does, with the cube's movements computed in the
turning frame. `new_recording` measures the same world once more: another profile, other noise, what happens by chance
happens at other times. As a program it draws one case and writes it:

    python tests/foreign_world.py --seed 3 --size 500 --out DIR bench_sway
"""

import argparse
import zlib
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import lru_cache, partial
from pathlib import Path

import numpy as np
from foreign_effects import FOREIGN, Motion, acting, by_positions, noise_free
from independent_effects import LSB, WHITE
from independent_table import INERTIA, LEAD, Rig, drive_table, random_command
from independent_world import HiddenRun, Setting, _draw_temperature, _measured
from scipy.interpolate import CubicSpline

from gfimu.geometry.array import AccelerometerArray
from gfimu.units import STANDARD_GRAVITY
from sim import forward
from sim.campaign import Measurement, measure, random_profile
from sim.motion import SplineSpin
from sim.study.cases import Case
from sim.twin import Twin

SIZES = (150.0, 500.0, 1500.0)
_SIGMA = np.hypot(WHITE, LSB / np.sqrt(12))
_TOP = 15.0  # rad/s


def _cases(first):
    """Every effect on each of the three kinds of profile, the sizes in turn; those without a size have none."""
    return [
        Case("foreign", first + 3 * number + kind, (name,), 0.0 if effect.sizeless else SIZES[(number + kind) % 3])
        for number, (name, effect) in enumerate(FOREIGN.items())
        for kind in range(3)
    ]


CASES = {"hide": _cases(300_000), "hide_in_campaign": _cases(330_000)}
"""Cases by the name of the generator; a seed's remainder by three is the kind of its profile."""


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
    hidden = _hidden(seed, effects, size, plan, _table_motion(seed, 0, plan)[0])
    rig = Rig()
    for act, one in acting(hidden, "drive"):
        rig = act(one, rig)
    run, temperature = _table_motion(seed, again, plan, rig.friction)
    t = _times(plan)
    stamps, times, channels, tacho = noise_free(run, t, hidden)
    for act, one in acting(hidden, "noise"):
        channels = act(one, run, times, channels)
    columns = _measured(np.random.default_rng([seed, 81, again]), plan, t, channels, tacho, temperature, {})
    return HiddenRun(columns | {"t_s": stamps}, tuple(hidden.items()), _least(hidden, plan, run))


def hide_in_campaign(seed, effects=(), size=500.0, *, again=0, **setting):
    """Hide effects in a world of the project's simulation, on a random profile; arguments as of `hide`."""
    plan = Setting(**setting)
    first, _ = _campaign_motion(seed, 0, plan)
    hidden = _hidden(seed, effects, size, plan, first, in_turning_frame)
    run, spin = _campaign_motion(seed, again, plan)
    for _, one in acting(hidden, "drive"):
        run, spin = _sensed(_held_by_bristles(one, spin, run.t), run.t, run.seed)
    twin = ForeignTwin(AccelerometerArray.load("cube12"), sample_rate=plan.sample_rate, hidden=hidden, run=run)
    least = _least(hidden, plan, run, in_turning_frame)
    instability = plan.bias_instability_m_s2
    measurement = Measurement(plan.duration, plan.sample_rate, instability, plan.tacho_noise_rad_s)
    recording = measure(np.random.default_rng([seed, 82, again]), twin, (), measurement, motion=spin)
    columns = {"t_s": noise_free(run, _times(plan), hidden, in_turning_frame)[0]} | {
        f"{name}_m_s2": recording.readings[:, k] for k, name in enumerate(twin.array.channels)
    }
    return HiddenRun(columns | dict(recording.reference), tuple(hidden.items()), least)


def new_recording(seed, effects=(), size=500.0, *, generator=hide, again=1, **setting):
    """Record the world that a generator draws from these arguments once more, on another profile."""
    return generator(seed, effects, size, again=again, **setting)


def _times(plan):
    return np.arange(round(plan.duration * plan.sample_rate)) / plan.sample_rate


def _hidden(seed, effects, size, plan, run, read=by_positions):
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
    stamps, _, channels, tacho = noise_free(run, _times(plan), hidden, read)
    _, _, ideal, rate = noise_free(run, stamps, {}, read)
    moved = np.sum(((tacho - rate) / plan.tacho_noise_rad_s) ** 2)
    return float(np.sqrt(np.sum(((channels - ideal) / _SIGMA) ** 2) + moved))


def _least(hidden, plan, run, read=by_positions):
    """d′ of the least effect that has a noise-free form, in the recording at hand; infinite where none has."""
    formed = [name for name in hidden if FOREIGN[name].stage not in {"drive", "noise"}]
    return min((distance({name: hidden[name]}, plan, run, read) for name in formed), default=np.inf)


@lru_cache(maxsize=4)
def _table_motion(seed, again, plan, friction=Rig().friction):
    """Drive MuJoCo's table: its motion, and the temperature as a function of time."""
    rng = np.random.default_rng([seed, 78, again])
    command = random_command(rng, plan.duration, _TOP, kind=(seed + again) % 3)
    temperature = _draw_temperature(rng, plan.duration)
    run = drive_table(command, Rig(friction=friction), plan.duration, plan.step_s)
    warm = temperature(run.t)
    return Motion(run.t, run.angle, run.rate, run.acceleration, run.readings, warm, (seed, 80, again)), temperature


@lru_cache(maxsize=4)
def _campaign_motion(seed, again, plan):
    """Draw a profile of the campaign: its motion on a fine time base, and as a function of time."""
    spin = random_profile(np.random.default_rng([seed, 83, again]), plan.duration, top_rate=_TOP)
    fine = np.arange(round((plan.duration + 2 * LEAD) / plan.step_s) + 1) * plan.step_s - LEAD
    return _sensed(spin, fine, (seed, 80, again))


def _sensed(spin, fine, seed):
    """Motion with what ideal chips read, at the temperature that sizes are taken at; the spin comes second."""
    state = spin.at(fine)
    readings = forward.channels(Twin(AccelerometerArray.load("cube12")).world(), spin, fine)
    warm = 25.0 + 3.0 * -np.expm1(-np.maximum(fine, 0.0) / 15.0)
    return Motion(fine, state.angle, state.rate, state.acceleration, readings, warm, seed), spin


def in_turning_frame(run, places):
    """Readings (n, 12) from positions in the table's frame: relative, Coriolis, Euler and centripetal acceleration."""
    zero = np.zeros((1, 1, 3))
    arms, speed, acceleration = places.arms, zero, zero
    if len(arms) > 1:
        path = CubicSpline(run.t, arms)
        speed, acceleration = path(run.t, 1), path(run.t, 2)
    rate, alpha = run.rate[:, None, None], run.acceleration[:, None, None]
    across = [[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, 0.0]]  # row vectors times this: z × vector
    inward = [[-1.0, 0.0, 0.0], [0.0, -1.0, 0.0], [0.0, 0.0, 0.0]]
    force = acceleration + 2 * rate * (speed @ across) + alpha * (arms @ across) + rate**2 * (arms @ inward)
    shaken = CubicSpline(run.t, places.lab)(run.t, 2) if len(places.lab) > 1 else np.zeros((1, 3))
    x, y, z = shaken.T
    cos, sin = np.cos(run.angle), np.sin(run.angle)
    force = force + np.stack([cos * x + sin * y, cos * y - sin * x, z + STANDARD_GRAVITY + 0 * cos], axis=-1)[:, None]
    return (places.axes @ force[..., None]).reshape(len(run.t), 12)


@dataclass(frozen=True)
class ForeignTwin(Twin):
    """A nominal twin whose world has foreign effects, for one motion."""

    hidden: dict = field(default_factory=dict)
    run: Motion | None = None

    def world(self, effects=(), mounting=None, start=None):
        """Return the twin's world; what is hidden changes its readings and its reference."""
        told = []

        def sense(readings, context):
            run = replace(self.run, temperature=np.interp(self.run.t, context.t, context.temperature))
            _, times, channels, tacho = noise_free(run, context.t, self.hidden, in_turning_frame)
            for act, one in acting(self.hidden, "noise"):
                channels = act(one, run, times, channels)
            ideal, rate = noise_free(run, context.t, {})[2:]
            told[:] = [tacho - rate]
            return readings + (channels - ideal)

        def refer(reading, spin, t):
            return reading + told[0]  # the channels are always read first

        nominal = super().world(effects, mounting, start)
        return nominal.changed(sensing_steps=(sense,), reference_steps=(refer,))


def _held_by_bristles(one, spin, fine):
    """The table under LuGre's friction, driven after a spin by a speed loop; bristles give way after 1 mrad."""
    state, step = spin.at(fine), fine[1] - fine[0]
    friction, stretch = one["coulomb_N_m"] / INERTIA, 1e-3
    rate, bristle, integral = state.rate[0], 0.0, 0.0
    path = np.empty_like(fine)
    for row, (wanted, forward_acceleration) in enumerate(
        zip(state.rate.tolist(), state.acceleration.tolist(), strict=True)
    ):
        error = wanted - rate
        integral += step * error
        bristle = (bristle + step * rate) / (1 + step * abs(rate) / stretch)
        rate += step * (forward_acceleration + 10.0 * error + 15.0 * integral - friction * bristle / stretch)
        path[row] = rate
    return SplineSpin.through(fine, path)


def main():
    parser = argparse.ArgumentParser(description="Write a recording with foreign effects, and the truth beside it.")
    parser.add_argument("effects", nargs="*", metavar="EFFECT", help=", ".join(FOREIGN))
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--size", type=float, default=500.0, help="d′ of each effect")
    parser.add_argument("--again", type=int, default=0, help="which further recording of the same world")
    parser.add_argument("--campaign", action="store_true", help="hide it in a world of the project's simulation")
    parser.add_argument("--out", type=Path, required=True)
    options = parser.parse_args()
    options.out.mkdir(parents=True, exist_ok=True)
    draw: Callable = partial(hide_in_campaign if options.campaign else hide, again=options.again)
    for path in draw(options.seed, options.effects, options.size).write(options.out):
        print(path)


if __name__ == "__main__":
    main()
