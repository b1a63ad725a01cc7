"""Worlds outside the library drawn by lot: a place of the rig, what the error there goes with, a form, and where.

The generators of `foreign_world` make them with the effects ``lot_000`` … , exact physics (moved and turned chips, late
samples, …) with forms that are no functions of the engine's. Each half was drawn once. The first showed which terms the
engine lacked; the second was drawn afterwards, and nothing had been set on it when it was run.
"""

from dataclasses import dataclass, replace
from unittest.mock import patch

import foreign_world
import numpy as np

from sim.trials.benchmark.generators.foreign_effect import Foreign
from sim.trials.benchmark.generators.foreign_effects import FOREIGN
from sim.trials.study.cases import Case

__all__ = ["CASES", "LOTS", "Lot", "hide", "hide_in_campaign", "new_recording"]

SIZES = (150.0, 500.0, 1500.0)
OF_MOTION = ("omega", "alpha", "theta", "t", "T")
GOES_WITH = {
    **dict.fromkeys(("reads", "leans", "moves", "stretches", "tilts", "gain", "offset", "channel gain"), OF_MOTION),
    **dict.fromkeys(("late", "delay"), ("t", "T")),
    "own reading": ("y",),
}
"""What an error at each place may go with."""
STAGE = {"reads": "reference", "late": "reference", "delay": "times"} | dict.fromkeys(
    ("leans", "moves", "stretches", "tilts"), "places"
)
PLACE = {"reads": "reference", "late": "clock", "delay": "clock", "tilts": "bench", "gain": "supply"} | dict.fromkeys(
    ("leans", "moves", "stretches"), "cube"
)
UNIT = {"reads": 0.05, "late": 0.02, "delay": 0.005, "gain": 1e-3, "moves": 1e-4, "channel gain": 1e-3}
UNIT |= {"own reading": 0.02, "offset": 0.02}
"""Sizes to begin with: rad/s, s, 1, m, m/s²; 1e-3 rad or 1 for others."""


@dataclass(frozen=True)
class Lot:
    """A place, what the error there goes with, and the pattern of channels or chips that share it."""

    place: str
    quantity: str
    pattern: str


def _form(one, x):
    """One of four forms of a quantity whose values are of order one."""
    rise, bend = one["rise"], one["bend"]
    forms = (
        lambda u: np.tanh(3.0 * rise * (u - 0.5 * bend)) + np.tanh(1.5 * rise * bend),
        lambda u: np.abs(u) ** (1.2 + rise) * (1.0 + 0.3 * bend * np.sign(u)),
        lambda u: u**3 + bend * u**2 - 0.2 * rise * u,
        lambda u: np.log1p(np.exp(6.0 * (rise * u + 0.4 * bend))) / 6.0,
    )
    return forms[one["form"]](x)


def _function(one, run):
    """The error in units of its size, (n,)."""
    quantity = one["quantity"]
    if quantity == "theta":
        turn = one["order"] * run.angle + 3.0 * one["bend"]
        return np.sin(turn) + 0.5 * one["rise"] * np.exp(np.cos(turn + 1.0))
    if quantity == "t":
        since = np.clip((run.t - run.t[0]) / np.ptp(run.t), 0.0, 1.0)
        return _form(one, 2.0 * since - 1.0) - _form(one, np.array(-1.0))
    x = {"omega": run.rate, "alpha": run.acceleration, "T": run.temperature - run.temperature[0]}[quantity]
    return _form(one, x / max(2.0 * float(np.std(x)), 1e-9))


def _channels(one):
    """The weights of the channels, (12,)."""
    luck, weights = np.random.default_rng(one["luck"]), np.zeros(12)
    if one["pattern"] == "one":
        weights[luck.integers(12)] = 1.0
    elif one["pattern"] == "chip":
        chip = 3 * luck.integers(4)
        weights[chip : chip + 3] = luck.standard_normal(3)
    else:
        weights = luck.standard_normal(12)
    return weights


def _act(one, run, *passed):
    """What becomes of what the stage passes on."""
    place, size = one["place"], one["size"]
    luck = np.random.default_rng(one["luck"])
    if place == "own reading":
        (readings,) = passed
        return readings + size * _channels(one) * _form(one, readings / 9.81)
    error = size * _function(one, run)
    if place in {"gain", "offset", "channel gain"}:
        (readings,) = passed
        weights = np.ones(12) if place == "gain" else _channels(one)
        return readings + np.outer(error, weights) * (1.0 if place == "offset" else readings)
    if place == "reads":
        return passed[0] + error
    if place == "late":
        return np.interp(run.t - error, run.t, passed[0])
    if place == "delay":
        stamps, times = passed
        late = np.interp(times[:, 0], run.t, error)
        chosen = luck.standard_normal(4) if one["pattern"] == "own" else np.eye(4)[luck.integers(4)]
        return stamps, times + np.outer(late, chosen)
    (places,) = passed
    azimuth = luck.uniform(0.0, 2.0 * np.pi)
    if place == "leans":
        return places.turned(np.outer(error, [np.cos(azimuth), np.sin(azimuth), 0.0]))
    if place == "tilts":
        behind = azimuth - run.angle
        return places.turned(error[:, None] * np.stack([np.cos(behind), np.sin(behind), 0.0 * error], axis=1))
    if place == "moves":
        way = luck.standard_normal(3)
        return replace(places, arms=places.arms + np.outer(error, way / np.linalg.norm(way))[:, None])
    return replace(places, arms=places.arms * (1.0 + error[:, None, None] * np.array([1.0, 1.0, 0.0])))


def _draw(lot, rng, plan):
    """The parameters of an effect at a size to begin with."""
    del plan
    return {
        "place": lot.place,
        "quantity": lot.quantity,
        "pattern": lot.pattern,
        "size": UNIT.get(lot.place, 1e-3) * float(rng.choice([-1.0, 1.0])),
        "form": int(rng.integers(4)),
        "order": int(rng.integers(1, 4)),
        "rise": float(rng.uniform(0.4, 1.0)),
        "bend": float(rng.uniform(-1.0, 1.0)),
        "luck": int(rng.integers(2**31)),
    }


def _effect(lot):
    shape = ("place", "quantity", "pattern", "form", "order", "rise", "bend", "luck")
    return Foreign(
        STAGE.get(lot.place, "analogue"),
        PLACE.get(lot.place, "chip"),
        f"{lot.quantity}: {lot.place}, {lot.pattern}",
        lambda rng, plan: _draw(lot, rng, plan),
        _act,
        shape=shape,
        most=("size", {"late": 0.1, "delay": 0.03}.get(lot.place, np.inf)),
    )


def _lots(seed):
    rng, found = np.random.default_rng(seed), []
    while len(found) < HALF:
        place = str(rng.choice(list(GOES_WITH)))
        pattern = str(rng.choice(["one", "chip", "own"])) if PLACE.get(place, "chip") == "chip" else "all"
        pattern = str(rng.choice(["one", "own"])) if place == "delay" else pattern
        lot = Lot(place, str(rng.choice(GOES_WITH[place])), pattern)
        if lot not in found:
            found.append(lot)
    return found


HALF = 42
LOTS = _lots(20261129) + _lots(20261130)
EFFECTS = {f"lot_{number:03d}": _effect(lot) for number, lot in enumerate(LOTS)}
_EVERY = [Case("lot", 700_000 + number, (name,), SIZES[number // 2 % 3]) for number, name in enumerate(EFFECTS)]
CASES = {"hide": _EVERY[::2], "hide_in_campaign": _EVERY[1::2]}
"""Cases by the name of the generator; a seed's remainder by three is the kind of its profile."""

_with_lots = patch.dict(FOREIGN, EFFECTS)  # while a generator runs, no longer
hide = _with_lots(foreign_world.hide)
hide_in_campaign = _with_lots(foreign_world.hide_in_campaign)
new_recording = _with_lots(foreign_world.new_recording)
