"""Foreign effects in worlds of the project's own simulation, besides those of MuJoCo's table.

`hide_in_campaign` hides the effects of `sim.trials.benchmark.generators.foreign_effects` in a world of `sim` and
measures it as its campaign does, with the cube's movements computed in the turning frame. As a program it draws one
case:

    python tests/foreign_world.py --seed 3 --size 500 --out DIR bench_sway
"""

import argparse
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import lru_cache, partial
from pathlib import Path

import numpy as np
from scipy.interpolate import CubicSpline

from gfimu import AccelerometerArray
from gfimu.base import STANDARD_GRAVITY
from sim import SplineSpin, forward
from sim.trials import Measurement, measure, random_profile
from sim.trials.benchmark.generators.foreign_effects import FOREIGN, Motion, acting, noise_free
from sim.trials.benchmark.generators.foreign_world import (
    TOP,
    draw_hidden,
    hide,
    least_distance,
    new_recording,
    sample_times,
)
from sim.trials.benchmark.generators.independent_table import INERTIA, LEAD
from sim.trials.benchmark.generators.independent_world import HiddenRun, Setting
from sim.trials.study.cases import Case
from sim.twin import Twin

__all__ = ["CASES", "SIZES", "hide", "hide_in_campaign", "new_recording"]

SIZES = (150.0, 500.0, 1500.0)


def _cases(first):
    """Every effect on each of the three kinds of profile, the sizes in turn; those without a size have none."""
    return [
        Case("foreign", first + 3 * number + kind, (name,), 0.0 if effect.sizeless else SIZES[(number + kind) % 3])
        for number, (name, effect) in enumerate(FOREIGN.items())
        for kind in range(3)
    ]


CASES = {"hide": _cases(300_000), "hide_in_campaign": _cases(330_000)}
"""Cases by the name of the generator; a seed's remainder by three is the kind of its profile."""


def hide_in_campaign(seed, effects=(), size=500.0, *, again=0, **setting):
    """Hide effects in a world of the project's simulation, on a random profile; arguments as of `hide`."""
    plan = Setting(**setting)
    first, _ = _campaign_motion(seed, 0, plan)
    hidden = draw_hidden(seed, effects, size, plan, first, in_turning_frame)
    run, spin = _campaign_motion(seed, again, plan)
    for _, one in acting(hidden, "drive"):
        run, spin = _sensed(_held_by_bristles(one, spin, run.t), run.t, run.seed)
    twin = ForeignTwin(AccelerometerArray.load("cube12"), sample_rate=plan.sample_rate, hidden=hidden, run=run)
    least = least_distance(hidden, plan, run, in_turning_frame)
    instability = plan.bias_instability_m_s2
    measurement = Measurement(plan.duration, plan.sample_rate, instability, plan.tacho_noise_rad_s)
    recording = measure(np.random.default_rng([seed, 82, again]), twin, (), measurement, motion=spin)
    columns = {"t_s": noise_free(run, sample_times(plan), hidden, in_turning_frame)[0]} | {
        f"{name}_m_s2": recording.readings[:, k] for k, name in enumerate(twin.array.channels)
    }
    return HiddenRun(columns | dict(recording.reference), tuple(hidden.items()), least)


@lru_cache(maxsize=4)
def _campaign_motion(seed, again, plan):
    """Draw a profile of the campaign: its motion on a fine time base, and as a function of time."""
    spin = random_profile(np.random.default_rng([seed, 83, again]), plan.duration, top_rate=TOP)
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
