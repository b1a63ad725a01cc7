"""What a case of the kind ``measure`` does: a measured world of a turntable, and how far a linear solution is off."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from gfimu.base.errors import GeometryError, InputError, unknown_name
from gfimu.base.units import MILLI_G
from sim.effects import EFFECTS, Effect
from sim.trials.campaign.effects import FORMS, drawn_effects, names_effect
from sim.trials.worlds.factory import WorldFactory
from sim.trials.worlds.hidden import Measurement, hidden_effect
from sim.twin import Twin

if TYPE_CHECKING:
    from sim.trials.sweep.design import Case
    from sim.trials.sweep.plan import PlanFile, Value

__all__ = ["check_world_factors", "measure_case"]

Floats = NDArray[np.float64]

_TWIN = "cube12_turntable"
_UNKNOWNS = 12  # α, p and the six products of ω
_OWN = ("twin", "duration_s", "sample_rate_hz", "bias_instability_mg", "tacho_noise_rad_s", "effect", "d_prime")
_D_PRIME = 10.0  # of a hidden effect where the plan says nothing: plain in the data, small to the eye


@dataclass(frozen=True)
class _Solution:
    """Linear solution of an array, with the nominal world that it assumes.

    Parameters
    ----------
    factory : WorldFactory
        Its worlds.
    inverse : ndarray, shape (7, c)
        Least-squares solution for α, p and |ω|² per reading.
    white : ndarray, shape (c,)
        White noise that the part's data sheet has, quantisation included, m/s².
    """

    factory: WorldFactory
    inverse: Floats
    white: Floats


def measure_case(case: Case) -> Mapping[str, float]:
    """Measure a world of `sim.trials.worlds.factory`; compare the nominal array's linear solution with the truth.

    Factors: ``twin``, ``duration_s``, ``sample_rate_hz``, ``bias_instability_mg``, ``tacho_noise_rad_s``; ``effect``
    (hidden by chance with the size ``d_prime``); ``EFFECT.KEY``, a parameter of an effect such as ``table_tilt.x_rad``;
    ``EFFECT.std_UNIT``, the standard deviation by which all its sizes are drawn, such as ``sensor_position.std_m``.

    Returns
    -------
    dict
        Root mean square errors of α, ω (α integrated from the true start) and p (norms) over the run, of ω at its end,
        of the speed ω from its squares alone; and the rms of the readings' deviation from the nominal world over the
        data sheet's noise.
    """
    solution, effects = _world(case)
    made = solution.factory.world(np.random.default_rng(case.seed), effects)
    deviation, rate, t = made.recording.readings - made.ideal, made.motion.rate, made.recording.t_s
    # The solution is linear: its error is that of the deviation from the nominal world alone.
    errors = deviation @ solution.inverse.T  # (n, 7)
    alpha, p, square = errors[:, :3], errors[:, 3:6], errors[:, 6]
    speed = np.sqrt(np.maximum(rate**2 + square, 0.0)) - np.abs(rate)
    omega = np.cumsum(alpha[:-1] * np.diff(t)[:, None], axis=0)
    power = np.einsum("nc,nc->c", deviation, deviation) / len(t)
    return {
        "alpha_rms_rad_s2": _rms(alpha),
        "omega_rms_rad_s": _rms(omega),
        "omega_end_rad_s": float(np.linalg.norm(omega[-1])),
        "speed_rms_rad_s": float(np.sqrt(speed @ speed / len(t))),
        "p_rms_m_s2": _rms(p),
        "deviation_over_noise": float(np.sqrt(np.mean(power / solution.white**2))),
    }


def check_world_factors(plan: PlanFile, first: Case) -> None:
    """Raise `InputError` where a factor of kind ``measure`` is unknown, or the first case can't be set up."""
    for name in plan.factors:
        if "." in name and not names_effect(name):
            raise unknown_name("effect", name.partition(".")[0], EFFECTS)
        if "." not in name and name not in _OWN:
            raise unknown_name("factor of kind 'measure'", name, (*_OWN, *FORMS))
    if "d_prime" in plan.factors and "effect" not in plan.factors:
        raise InputError("d_prime is the size of a hidden effect; give effect too")
    _world(first)


def _world(case: Case) -> tuple[_Solution, list[Effect]]:
    """Return the solution of a case with the noise of its worlds, and the effects that are hidden in it."""
    values = case.values
    setting = Measurement()
    duration, rate = (
        _number(values, "duration_s", setting.duration),
        _number(values, "sample_rate_hz", setting.sample_rate),
    )
    if not (duration * rate >= 2.0 and rate > 0.0):
        raise InputError(f"duration_s = {duration:g} at sample_rate_hz = {rate:g} has less than two samples")
    found = _solution(str(values.get("twin", _TWIN)), duration, rate)
    factory = found.factory.with_noise(
        _level(values, "bias_instability_mg", setting.bias_instability / MILLI_G) * MILLI_G,
        _level(values, "tacho_noise_rad_s", setting.tacho_noise),
    )
    return replace(found, factory=factory), _effects(case, factory)


@lru_cache(maxsize=16)  # a campaign asks for the same ones in every case
def _solution(twin_name: str, duration: float, rate: float) -> _Solution:
    twin = Twin.load(twin_name)
    array = twin.array
    H = np.hstack([array.regression_matrix, array.centripetal_matrix])  # (c, 12)
    if np.linalg.matrix_rank(H) < _UNKNOWNS:
        raise GeometryError(
            f"{twin_name}: kind 'measure' solves for α, p and ω² at once, which array {array.name!r} can't see; "
            "use one of at least four triads not in a plane, or kind 'estimate'"
        )
    inverse = np.linalg.pinv(H)
    factory = WorldFactory(twin, Measurement(duration, rate))
    solved = np.vstack([inverse[:6], inverse[6:9].sum(axis=0)])  # |ω|² is the sum of the first three products
    return _Solution(factory, solved, twin.expected_noise(rate).white)


def _effects(case: Case, factory: WorldFactory) -> list[Effect]:
    twin, setting = factory.twin, factory.setting
    rng = np.random.default_rng([case.seed, 1])  # apart from the world's own chance
    effects = []
    hidden = str(case.values.get("effect", "none"))
    if hidden != "none":
        if hidden not in EFFECTS:
            raise unknown_name("effect", hidden, ("none", *EFFECTS))
        from sim.trials.worlds.hidden import random_profile

        size = _number(case.values, "d_prime", _D_PRIME)
        effects.append(hidden_effect(rng, twin, hidden, random_profile(rng, setting.duration), size, setting))
    return [*effects, *drawn_effects(case.values, twin.array, rng)]


def _number(values: Mapping[str, Value], name: str, usual: float) -> float:
    value = values.get(name, usual)
    if isinstance(value, str | bool):
        raise InputError(f"{name} = {value!r} is no number")
    return float(value)


def _level(values: Mapping[str, Value], name: str, usual: float) -> float:
    value = _number(values, name, usual)
    if value < 0.0:
        raise InputError(f"{name} = {value:g} is below zero")
    return value


def _rms(errors: Floats) -> float:
    """Return the root of the mean square of the norms of errors (n, 3)."""
    return float(np.sqrt(np.einsum("nk,nk->", errors, errors) / len(errors)))
