"""What a calibration by spin says: what it saw, what it took for granted, what it did not determine, and bucking."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from gfimu.calibration.parameter_names import kind_of
from gfimu.calibration.result import Calibration
from gfimu.calibration.spin.plateaus import Plateaus
from gfimu.calibration.spin.policy import SpinPolicy
from gfimu.calibration.spin.prior import SensorPrior

__all__ = ["spin_statements", "spin_statistics"]

Floats = NDArray[np.float64]
_OPEN, _BUCKING = "spin, not determined", "spin, bucking"
"""How the statements begin that another run replaces."""

Places = Mapping[str, NDArray[np.intp]]


def spin_statements(
    prior: SensorPrior,
    result: Calibration,
    plateaus: Plateaus,
    covariance: Floats,
    at: Places,
    arms: Mapping[str, Floats],
    table: SpinPolicy,
) -> tuple[str, ...]:
    """Say what the run shows and what it does not, a sentence each.

    Parameters
    ----------
    prior : SensorPrior
        Before the run.
    result : Calibration
        After it.
    plateaus : Plateaus
        Of the run.
    covariance : ndarray, shape (u, u)
        Of all unknowns after the run.
    at : mapping of str to ndarray of int
        Where they stand.
    arms : mapping of str to ndarray, shape (u,)
        Arm along each sensing axis across the table's, as weights of the unknowns, by the name of its K1.
    table : SpinPolicy
        Priors of the table.
    """
    speeds = ", ".join(f"{speed:.3g}" for speed in plateaus.speeds(table.distinct))
    seen = (
        f"spin: {int(plateaus.spinning.sum())} plateaus that turn, at {speeds} rad/s; K0, K1 and alignment start from "
        f"{prior.source}"
    )
    taken = (
        f"spin, priors of the table, standard deviations: radius of a chip {1e3 * table.radius_std_m:.3g} mm per "
        f"coordinate, arm stretch {table.stretch_std_s2_rad2:.3g} s²/rad², dynamic levelling "
        f"{table.dynamic_levelling_std_s2_rad:.3g} s²/rad and {table.shift_std_m_s2_rad2:.3g} m s²/rad², scale of the "
        f"tachometer {table.tacho_scale_std:.3g}"
    )
    lines = [seen, taken]
    weak = [name for name, std in prior.bends_std.items() if result.std_of(name) > table.undetermined * std]
    if weak:
        lines.append(
            f"{_OPEN}: {', '.join(weak)} (standard deviations above {table.undetermined:.0%} of those before it); they "
            "need faster plateaus, or a run with these axes across the table's axis"
        )
    earlier = [text for text in prior.calibration.statements if not text.startswith((_OPEN, _BUCKING))]
    return (*earlier, *lines, _bucking(result, covariance, at, arms))


def spin_statistics(
    plateaus: Plateaus, values: Floats, covariance: Floats, at: Places, table: SpinPolicy
) -> dict[str, float | str]:
    """Return the figures of the run and of the table, units in the keys."""
    found: dict[str, float | str] = {
        "plateaus": float(len(plateaus)),
        "plateaus_turning": float(plateaus.spinning.sum()),
        "speeds": float(len(plateaus.speeds(table.distinct))),
        "largest_rate_rad_s": float(np.abs(plateaus.rate).max()),
    }
    for name, key in (
        ("stretch", "arm_stretch_s2_rad2"),
        ("tacho_scale", "tacho_scale"),
    ):
        (place,) = at[name]
        found[key] = float(values[place])
        found[f"{key}_std"] = float(np.sqrt(covariance[place, place]))
    for name, key in (("levelling", "dynamic_levelling_s2_rad"), ("radii", "radius_change_m")):
        found[f"{key}_rms"] = float(np.sqrt(np.mean(values[at[name]] ** 2)))
        found[f"{key}_std_rms"] = float(np.sqrt(np.mean(np.diag(covariance)[at[name]])))
    return found


def _bucking(result: Calibration, covariance: Floats, at: Places, arms: Mapping[str, Floats]) -> str:
    """Name the largest correlations of each kind, which the standard calls bucking."""
    place = dict(zip(result.names, at["parameters"].tolist(), strict=True))

    def unit(index: int) -> Floats:
        return np.eye(1, len(covariance), index)[0]

    def strongest(pairs: Mapping[str, tuple[Floats, Floats]]) -> str:
        found = {}
        for name, (first, second) in pairs.items():
            size = float(np.sqrt((first @ covariance @ first) * (second @ covariance @ second)))
            found[name] = float(first @ covariance @ second) / max(size, float(np.finfo(float).tiny))
        worst = max(found, key=lambda name: abs(found[name]))
        return f"{found[worst]:+.2f} ({worst})"

    bends = [name for name in result.names if kind_of(name) == "q"]
    stretch = unit(int(at["stretch"][0]))
    cubic = strongest({name: (unit(place[name]), unit(place[name.replace("_q_", "_c_")])) for name in bends})
    stretched = strongest({name: (unit(place[name]), stretch) for name in bends})
    radius = strongest({name: (unit(place[name]), arm) for name, arm in arms.items()})
    return (
        f"{_BUCKING}, largest correlations: q with c {cubic}, q with arm stretch {stretched}, "
        f"K1 with the radius {radius}"
    )
