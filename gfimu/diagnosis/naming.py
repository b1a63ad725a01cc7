"""Naming: probabilities, parameters with their uncertainty, rivals, and the verdict in words."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.special import softmax
from scipy.stats import chi2

from gfimu.diagnosis.causes import WHOLE_NUMBERS, Cause
from gfimu.diagnosis.explanation import Explanation
from gfimu.diagnosis.fit import Fit
from gfimu.diagnosis.verdict.verdict import Rival
from gfimu.geometry.array import AccelerometerArray

__all__ = [
    "AMBIGUOUS_ODDS",
    "MOST_CERTAIN",
    "TEMPERATURE",
    "cause_parameters",
    "conflicting",
    "describe",
    "mimics",
    "probabilities",
    "rival_list",
    "suspicious_pattern",
]

TEMPERATURE = 1.2
"""Softening of log posteriors, as the linear-Gaussian model is never quite true.

From 1.1 to 1.2 what was hidden in the runs of `faint` of `sim.study` is the most likely.
"""
MOST_CERTAIN = 0.997
"""Largest probability that is stated: of causes surer than 0.99 3 of 1000 were wrong in `sim.study`."""
AMBIGUOUS_ODDS = 2.0
"""Log odds within which a rival set counts as not told from the best one."""
_MIMIC_ENERGY = 6.0


def probabilities(explanation: Explanation) -> dict[str, float]:
    """Return the probability of each effect to be among the causes, over all sets that were refined."""
    fits = _all_fits(explanation)
    if explanation.beside_residue is not None:
        fits.append(explanation.beside_residue)
    weight = softmax(np.array([fit.log_posterior for fit in fits]) / TEMPERATURE)
    names = {name for fit in fits for name in fit.names}
    return {
        name: float(
            np.clip(sum(w for w, fit in zip(weight, fits, strict=True) if name in fit.names), 0.0, MOST_CERTAIN)
        )
        for name in names
    }


def _all_fits(explanation: Explanation) -> list[Fit]:
    fits = [explanation.fit, *explanation.rivals, *explanation.without.values()]
    if explanation.fit.causes:
        fits.append(explanation.nothing)
    unique = {fit.key: fit for fit in reversed(fits)}
    return list(unique.values())


def cause_parameters(cause: Cause, array: AccelerometerArray, run: int = 0) -> tuple[dict[str, Any], dict[str, float]]:
    """Return the contract parameters of a cause and their standard deviations (delta method)."""
    parameters = cause.effect(array, run).parameters
    numbers = [key for key, value in parameters.items() if isinstance(value, float)]
    slopes = np.zeros((len(numbers), len(cause.coordinates)))
    for place in range(len(cause.coordinates)):
        step = 1e-4 * max(1.0, float(np.abs(cause.coordinates).max()))
        moved = cause.coordinates.copy()
        moved[place] += step
        other = cause.at(moved).effect(array, run).parameters
        slopes[:, place] = [(_unwrapped(key, other[key], parameters[key]) - parameters[key]) / step for key in numbers]
    variance = np.einsum("ik,kl,il->i", slopes, cause.covariance, slopes)
    std = {key: float(np.sqrt(max(v, 0.0))) for key, v in zip(numbers, variance, strict=True)}
    std |= {key: value for key, value in cause.shape_std.items() if key in parameters}
    kept = {
        key: value
        for key, value in parameters.items()
        if key in cause.shape or not isinstance(value, float) or value != 0.0 or std.get(key, 0.0) > 0.0
    }
    return kept, {key: value for key, value in std.items() if key in kept and key not in WHOLE_NUMBERS}


def _unwrapped(key: str, value: float, near: float) -> float:
    return near + float(np.angle(np.exp(1j * (value - near)))) if key == "phase_rad" else value


def mimics(explanation: Explanation, cause: Cause) -> list[str]:
    """Return effects of the library that could imitate a cause in these data, however unlikely they are.

    An effect imitates another where hardly any of the other's energy is left after the best fit by it (twice the
    distinguishability D of Eriksson, Frisk and Krysander, Automatica 49, 2013).
    """
    signatures = explanation.signatures
    mine = next((one for one in signatures.signatures if one.family.name == cause.name), None)
    if mine is None:
        return []
    vector = np.zeros(len(signatures.score))
    vector[mine.columns] = cause.mixing @ cause.coordinates
    pull = signatures.gram @ vector
    energy = float(vector @ pull)
    if energy < 2 * _MIMIC_ENERGY:
        return []
    found: dict[str, None] = {}
    present = explanation.fit.names
    for other in signatures.signatures:
        name = str(other.family.name)
        if name == cause.name or name in found or name in present:
            continue
        inner = signatures.gram[np.ix_(other.columns, other.columns)]
        right = pull[other.columns]
        ridge = 1e-9 * (1.0 + float(inner.diagonal().max()))
        explained = float(right @ np.linalg.solve(inner + ridge * np.eye(len(right)), right))
        if energy - explained < _MIMIC_ENERGY:
            found[name] = None
    return list(found)


def conflicting(explanation: Explanation) -> list[Fit]:
    """Return rival sets that the data can't tell from the best one."""
    best = explanation.fit
    return [
        rival
        for rival in explanation.rivals
        if rival.names != best.names
        and len(rival.causes) <= len(best.causes)
        and rival.log_posterior > best.log_posterior - AMBIGUOUS_ODDS
    ]


def rival_list(explanation: Explanation) -> tuple[Rival, ...]:
    """Return the other explanations and why they lost."""
    best = explanation.fit
    rivals = []
    for fit in [*explanation.rivals, *([explanation.nothing] if best.causes else [])]:
        odds = fit.log_posterior - best.log_posterior
        worse = fit.objective - best.objective
        more = sum(len(c.coordinates) for c in fit.causes) - sum(len(c.coordinates) for c in best.causes)
        if not fit.causes:
            why = f"without any cause the misfit is larger by {worse:.0f} (χ²)"
        elif worse > 2.0 * abs(odds):
            why = f"it fits worse: χ² is larger by {worse:.0f}"
        elif more > 0:
            why = f"it fits as well (χ² {worse:+.0f}) but needs {more} more free numbers to coincide"
        else:
            why = f"it is less probable (χ² {worse:+.0f})"
        rivals.append(Rival(tuple(sorted(fit.names)) or ("nothing",), float(odds), why))
    return tuple(rivals)


def suspicious_pattern(cause: Cause, array: AccelerometerArray) -> str:
    """Tell when the many sizes of a wide effect lie on a narrow pattern: then a common cause is more likely."""
    if cause.name not in {"sensor_position", "misalignment"} or len(cause.coordinates) < 2 * len(array.chips):
        return ""
    per_chip = len(cause.coordinates) // len(array.chips)
    values = cause.coordinates.reshape(len(array.chips), per_chip)
    weight = np.linalg.pinv(cause.covariance)
    common = np.tile(np.eye(per_chip), (len(array.chips), 1))
    inner = common.T @ weight @ common
    mean = np.linalg.lstsq(inner, common.T @ weight @ values.ravel(), rcond=None)[0]
    rest = values.ravel() - common @ mean
    misfit = float(rest @ weight @ rest)
    total = float(values.ravel() @ weight @ values.ravel())
    freedom = max(np.linalg.matrix_rank(weight) - np.linalg.matrix_rank(inner), 1)
    if misfit < chi2.ppf(0.99, freedom) and total > 10 * freedom:
        what = "moved" if cause.name == "sensor_position" else "turned"
        return (
            f"all chips are {what} alike: a cause common to the whole cube (its mounting on the table) "
            "is more likely than as many coinciding chips"
        )
    return ""


def describe(cause: Cause, array: AccelerometerArray, share: Mapping[str, float]) -> str:
    """Return one sentence: what it is, where it acts and which channels show it."""
    strongest = sorted(share, key=lambda name: -share[name])[:3]
    where = f" ({cause.pattern})" if cause.pattern and not cause.pattern.startswith("all ch") else ""
    shows = f"; it shows most in {', '.join(strongest)}" if strongest and share[strongest[0]] > 0 else ""
    note = suspicious_pattern(cause, array)
    return f"{cause.family.summary}{where}{shows}" + (f"; {note}" if note else "")


def channel_share(before: NDArray[np.float64], channels: Sequence[str]) -> dict[str, float]:
    """Return the rms per channel of what a cause changes."""
    return {name: float(np.sqrt(np.mean(before[:, place] ** 2))) for place, name in enumerate(channels)}
