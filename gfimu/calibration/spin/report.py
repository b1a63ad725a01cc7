"""What a calibration by spin says: what it saw, what it took for granted, what it did not determine, and bucking."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from gfimu.calibration.result import Calibration
from gfimu.calibration.spin.plateaus import Plateaus
from gfimu.calibration.spin.policy import SpinPolicy
from gfimu.calibration.spin.prior import SensorPrior

__all__ = ["spin_statements", "spin_statistics"]

Floats = NDArray[np.float64]
Places = Mapping[str, NDArray[np.intp]]


def spin_statements(
    prior: SensorPrior,
    result: Calibration,
    plateaus: Plateaus,
    covariance: Floats,
    at: Places,
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
    table : SpinPolicy
        Priors of the table.
    """
    speeds = ", ".join(f"{speed:.3g}" for speed in plateaus.speeds(table.distinct))
    lines = [
        f"spin: {int(plateaus.spinning.sum())} plateaus that turn, at {speeds} rad/s; K0, K1 and alignment start from "
        f"{prior.source}",
        f"priors of the table, standard deviations: radius of a chip {1e3 * table.radius_std_m:.3g} mm per coordinate, "
        f"arm stretch {table.stretch_std_s2_rad2:.3g} s²/rad², dynamic levelling "
        f"{table.dynamic_levelling_std_s2_rad:.3g} s²/rad, scale of the tachometer {table.tacho_scale_std:.3g}",
    ]
    weak = _undetermined(prior.calibration, result, table.undetermined)
    if weak:
        lines.append(
            f"not determined by this run: {', '.join(weak)} (standard deviations above {table.undetermined:.0%} of those "
            "before it); they need faster plateaus, or a run with these axes across the table's axis"
        )
    return (*lines, _bucking(result, covariance, at))


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


def _undetermined(before: Calibration, after: Calibration, share: float) -> list[str]:
    """Return the bends whose standard deviation is hardly smaller than before."""
    return [
        name
        for name, old, new in zip(after.names, before.std, after.std, strict=True)
        if name.split("_")[1] in "qc" and new > share * old
    ]


def _bucking(result: Calibration, covariance: Floats, at: Places) -> str:
    """Name the largest correlations of each kind, which the standard calls bucking."""
    std = np.sqrt(np.maximum(np.diag(covariance), np.finfo(float).tiny))
    correlation = covariance / np.outer(std, std)
    place = dict(zip(result.names, at["parameters"].tolist(), strict=True))

    def strongest(kind: str, others: dict[str, NDArray[np.intp]]) -> str:
        pairs = {
            name: float(max(correlation[place[name], others[name]], key=abs))
            for name in result.names
            if name in others and name.split("_")[1] == kind
        }
        worst = max(pairs, key=lambda name: abs(pairs[name]))
        return f"{pairs[worst]:+.2f} ({worst})"

    bends = [name for name in result.names if name.split("_")[1] == "q"]
    cubic = {name: np.array([place[name.replace("_q_", "_c_")]]) for name in bends}
    stretch = {name: at["stretch"] for name in bends}
    radii = {}
    for number, chip in enumerate(result.chips):
        own = at["radii"][3 * number : 3 * number + 3]
        radii |= {f"{chip}_M_{axis}{axis}": own for axis in "xyz"}
    return (
        f"bucking, largest correlations: q with c {strongest('q', cubic)}, q with arm stretch {strongest('q', stretch)}, "
        f"M with the radius {strongest('M', radii)}"
    )
