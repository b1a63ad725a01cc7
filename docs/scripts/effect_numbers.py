"""The rivals of each effect as they are stored: in the standard motions, and in experiments that separate them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from effect_rivals import BODY, CARRIAGE, TABLE, Rig, Table, data_table, experiment_tables, motion_tables

from gfimu.diagnosis.design.proposal import SEPARATED
from gfimu.diagnosis.policy import Policy
from sim.effects.base import Effect
from sim.effects.description import describe

__all__ = ["CLOSE", "rivalry"]

CLOSE = 0.9
"""Share of an effect that a rival must explain to be listed, where the two can be separated."""
MOST_RIVALS = 8
MOST_CLOSE = 3


def rivalry(effects: Mapping[str, type[Effect]]) -> dict[str, dict[str, Any]]:
    """Return motions and experiments of each effect, by name, as they are stored."""
    motions = {rig: motion_tables(rig_of) for rig, rig_of in _RIGS.items()}
    experiments = {rig: experiment_tables(rig_of) for rig, rig_of in _RIGS.items()}
    return {name: _of(name, effect, motions, experiments) for name, effect in effects.items()}


_RIGS: dict[str, Rig] = {"table": TABLE, "body": BODY, "carriage": CARRIAGE}


def _of(
    name: str,
    effect: type[Effect],
    motions: Mapping[str, Mapping[str, Table]],
    experiments: Mapping[str, Mapping[str, Table]],
) -> dict[str, Any]:
    found: dict[str, Any] = {"motions": {}, "experiments": {}}
    for rig in _RIGS:
        known = {motion: table.of(name) for motion, table in motions[rig].items()}
        known = {motion: one for motion, one in known.items() if one is not None}
        found["motions"] |= {motion: _listed(one) for motion, one in known.items()}
        rivals = _inseparable(known)
        trials = {trial: table.of(name) for trial, table in experiments[rig].items()}
        if rivals and all(trials.values()):
            found["experiments"][rig] = _separation(rivals, trials)
    if not found["motions"] and effect.place == "data" and name != "dropped_frames":
        found["motions"]["speed sweep"] = _listed(data_table(name, describe(effect).example))
        found["of_samples"] = True
    return found


def _listed(one: Mapping[str, Any]) -> dict[str, Any]:
    """Return d′ and the rivals to list, each with the share that it explains and the nats that remain."""
    if one["detectability"] < Policy().seen:
        return {"detectability": _short(one["detectability"]), "rivals": []}
    by_nats = sorted(one["rivals"].items(), key=lambda item: item[1][1])
    close = [item for item in by_nats if item[1][1] >= SEPARATED and item[1][0] >= CLOSE][:MOST_CLOSE]
    alike = [item for item in by_nats if item[1][1] < SEPARATED]
    kept = (alike + close)[:MOST_RIVALS]
    return {
        "detectability": _short(one["detectability"]),
        "rivals": [[rival, round(share, 4), _short(nats)] for rival, (share, nats) in kept],
        "more": [rival for rival, _ in alike[MOST_RIVALS:]],
    }


def _inseparable(known: Mapping[str, Mapping[str, Any]]) -> list[str]:
    """Return the rivals that some motion, in which the effect shows, does not separate from it; the closest first."""
    nats: dict[str, float] = {}
    for one in known.values():
        if one["detectability"] < Policy().seen:
            continue
        for rival, (share, left) in one["rivals"].items():
            if left < SEPARATED or share >= CLOSE:
                nats[rival] = min(left, nats.get(rival, float("inf")))
    return sorted(nats, key=lambda rival: nats[rival])


def _separation(rivals: list[str], trials: Mapping[str, Mapping[str, Any]]) -> dict[str, Any]:
    """Return the nats between an effect and its rivals in each experiment, and the first that separates them all."""
    nats = {trial: [_short(one["rivals"][rival][1]) for rival in rivals] for trial, one in trials.items()}
    # Those that the first experiment separates least are the ones worth a look.
    order = sorted(range(len(rivals)), key=lambda place: next(iter(nats.values()))[place])[:MOST_RIVALS]
    separating = [trial for trial, values in nats.items() if min(values) >= SEPARATED]
    best = max(nats, key=lambda trial: sum(value >= SEPARATED for value in nats[trial]))
    chosen = separating[0] if separating else best
    return {
        "rivals": [rivals[place] for place in order],
        "nats": {trial: [values[place] for place in order] for trial, values in nats.items()},
        "separates": separating[0] if separating else None,
        "best": chosen,
        "remaining": [rivals[place] for place, value in enumerate(nats[chosen]) if value < SEPARATED],
    }


def _short(value: float) -> float:
    return float(f"{max(value, 0.0):.3g}")
