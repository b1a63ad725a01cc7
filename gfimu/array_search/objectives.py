"""Objectives by name: figures of `gfimu score` and `gfimu drift` as criteria of a search."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Annotated, Literal

import numpy as np
from numpy.typing import NDArray

from gfimu.array.parts.part import Part
from gfimu.array.parts.part_file import PartFile
from gfimu.array_search.criteria import Criterion, FaultCriterion, Goal, KappaCriterion, Term, TraceCriterion
from gfimu.array_search.problem import Problem
from gfimu.base.declared import Declared, figure
from gfimu.base.errors import GeometryError, InputError, unknown_name
from gfimu.base.files.schema import NotNegative, Positive, Table, about
from gfimu.base.units import MILLI_G
from gfimu.budget.drift import ErrorSources
from gfimu.budget.drift.weight import drift_weight
from gfimu.rate.bounds.sample import omega_products_jacobian
from gfimu.rate.health.detectable import least_fault

__all__ = ["OBJECTIVES", "WORST", "Aim", "Conditions", "Objective", "ObjectiveTable", "Reached", "objective"]

WORST = "_worst"
"""Ending of the name of an objective that is judged by the worst draw of the tolerance."""

_Vector = NDArray[np.float64]

_UNSEEN_PRIOR = 1e-8  # numerical: information on the products of ω, so that those no channel sees do no harm
_SEEN_SHARE = 1e-6  # numerical: weight of the variances of all six motions beside the figure, so that all are seen
_FEWEST_CHANNELS = {"gdop_joint": 9, "rate": 9, "fault": 7}  # six motions, and ω or a check besides


class ObjectiveTable(Table, frozen=True):
    """What is to be small, and under which conditions."""

    name: Annotated[
        str,
        about(
            "gdop, gdop_joint, kappa, sigma_alpha, sigma_p, rate, drift or fault; with _worst at the end, the largest "
            "over the tolerances."
        ),
    ] = "gdop"
    length_unit_m: Annotated[
        Positive | None,
        about("Length that counts as 1 in GDOP and κ.", "m", default="half the longest edge around the volume"),
    ] = None
    noise_m_s2: Annotated[
        Positive | None, about("White noise of a channel per sample.", "m/s²", default="the part's at sample_rate_hz")
    ] = None
    bias_m_s2: Annotated[
        NotNegative | None, about("Bias of a channel, for drift.", "m/s²", default="the part's at switch-on")
    ] = None
    speed_rad_s: Annotated[Positive, about("Speed at which the bound of the rate error is taken.", "rad/s")] = math.tau
    spin_axis: Annotated[Literal["x", "y", "z", "any"], about("Body axis of that spin; any: the three alike.")] = "z"
    time_s: Annotated[Positive, about("Time after which drift counts.", "s")] = 30.0
    fault_time_s: Annotated[Positive, about("Time within which a fault of a channel is to be found.", "s")] = 1.0
    sample_rate_hz: Annotated[Positive, about("Sample rate, for noise, faults and drift.", "Hz")] = 100.0


class Conditions(ObjectiveTable, frozen=True):
    """An objective with the part of the chips, of which noise and bias are taken where they are not given."""

    part: str = "adxl345"

    @property
    def noise(self) -> float:
        """White noise of a channel per sample, m/s², root mean square of its axes."""
        if self.noise_m_s2 is not None:
            return self.noise_m_s2
        return float(np.sqrt(np.mean(Part.load(self.part).noise_std(self.sample_rate_hz) ** 2)))

    @property
    def sources(self) -> ErrorSources:
        """Errors of a channel that drift comes from."""
        bias = self.bias_m_s2
        if bias is None:
            typical = PartFile.load(self.part, needs=("offset_std_m_s2",)).offset_std_m_s2
            bias = float(np.sqrt(np.mean(np.square(np.asarray(typical, dtype=float)))))
        return ErrorSources(bias=bias, noise_density=self.noise * math.sqrt(2.0 / self.sample_rate_hz))


@dataclass(frozen=True)
class Aim(Declared):
    """What is made small."""

    name: Annotated[str, figure("Its name, with _worst at the end where the worst draw counts.")]
    meaning: Annotated[str, figure("In words.")]
    unit: Annotated[str, figure("Its unit; empty of a ratio.")]

    @property
    def label(self) -> str:
        """Name and unit."""
        return f"{self.name}, {self.unit}" if self.unit else self.name


@dataclass(frozen=True)
class Reached(Aim):
    """What was made small, and how small it is."""

    value: Annotated[float, figure("Its value, in that unit.")]


@dataclass(frozen=True)
class Objective(Aim):
    """A figure to be small, whose logarithm is a criterion of a design."""

    criterion: Criterion

    @property
    def is_worst(self) -> bool:
        """Whether the worst draw of the tolerance counts."""
        return self.name.endswith(WORST)

    @property
    def goal(self) -> Goal:
        """The figure itself."""
        return Goal(((1.0, self.criterion, self.is_worst),))

    def sought(self, share: float = 1.0) -> tuple[tuple[float, Criterion, bool], ...]:
        """Return what a search makes small, with weight ``share``: the figure, and a little of all variances.

        Several figures are least, or no larger, where a motion they don't ask for is not seen at all: σ of α without
        p, and the least fault, whose leverages add up to the number of motions that are seen.
        """
        found = self.criterion
        if isinstance(found, FaultCriterion):
            return (share, found, self.is_worst), (share, _all_seen(), False)
        if isinstance(found, TraceCriterion):
            found = replace(found, terms=tuple(_with_all_motions(term) for term in found.terms))
        return ((share, found, self.is_worst),)


def objective(name: str, problem: Problem, conditions: Conditions) -> Objective:
    """Return an objective by name.

    Parameters
    ----------
    name : str
        One of `OBJECTIVES`, or one of them with `WORST` at the end.
    problem : Problem
        What may be built: its unit of length and its number of channels.
    conditions : Conditions
        Noise, speed and times.

    Raises
    ------
    InputError
        If there is no such objective, or a worst case is asked for without a tolerance.
    GeometryError
        If so few channels can't have a finite figure.
    """
    plain = name.removesuffix(WORST)
    if plain not in OBJECTIVES:
        raise unknown_name("objective", name, OBJECTIVES)
    if plain != name and problem.tolerance is None:
        raise InputError(f"objective {name}: a worst case needs [tolerance] in a brief (gfimu new brief)")
    channels, fewest = problem.n_chips * problem.axes_per_chip, _FEWEST_CHANNELS.get(plain, 6)
    if channels < fewest:
        raise GeometryError(
            f"objective {name}: {channels} channels; it is infinite for fewer than {fewest}: "
            "use more chips or more axes"
        )
    meaning, unit, make = OBJECTIVES[plain]
    meaning = meaning.format(bias_mg=conditions.sources.bias / MILLI_G if plain == "drift" else 0.0, given=conditions)
    worst = ", worst over the tolerances" if plain != name else ""
    return Objective(name, meaning + worst, unit, make(problem, conditions))


def _with_all_motions(term: Term) -> Term:
    """Return the term with a little weight on all six motions, unless it weighs all of them as it is."""
    whole = float(np.trace(term.weight))
    if np.linalg.eigvalsh(term.weight[:6, :6])[0] > _SEEN_SHARE * whole:
        return term
    little = np.diag([_SEEN_SHARE * whole] * 6 + [0.0] * (len(term.weight) - 6))
    return replace(term, weight=term.weight + little)


def _all_seen() -> TraceCriterion:
    """Root of 1 + a little tr M⁻¹: next to 1, and large where a motion is not seen; the 1 is a seventh unknown."""
    into = np.zeros((12, 7))
    into[:6, :6] = np.eye(6)
    return TraceCriterion((Term(into, np.diag([_SEEN_SHARE] * 6 + [1.0]), np.array([0.0] * 6 + [1.0])),))


def _motion(problem: Problem, weight: _Vector) -> TraceCriterion:
    """Root of tr(W C) with C the covariance of [α; p] in SI units for channels of unit variance."""
    scale = np.array([1.0 / problem.unit] * 3 + [1.0] * 3)
    return TraceCriterion((Term(np.eye(12)[:, :6], weight * np.outer(scale, scale), np.zeros(6)),))


def _length(problem: Problem) -> float:
    return problem.length_unit_m or problem.unit


def _gdop(problem: Problem, conditions: Conditions) -> Criterion:
    del conditions
    return _motion(problem, np.diag([_length(problem) ** 2] * 3 + [1.0] * 3))


def _gdop_joint(problem: Problem, conditions: Conditions) -> Criterion:
    del conditions
    weight = np.diag([(_length(problem) / problem.unit) ** 2] * 3 + [1.0] * 3 + [0.0] * 6)
    return TraceCriterion((Term(np.eye(12), weight, np.array([0.0] * 6 + [_UNSEEN_PRIOR] * 6)),))


def _kappa(problem: Problem, conditions: Conditions) -> Criterion:
    del conditions
    return KappaCriterion(problem.unit / _length(problem))


def _sigma_alpha(problem: Problem, conditions: Conditions) -> Criterion:
    return _motion(problem, conditions.noise**2 * np.diag([1.0] * 3 + [0.0] * 3) / 3.0)


def _sigma_p(problem: Problem, conditions: Conditions) -> Criterion:
    return _motion(problem, conditions.noise**2 * np.diag([0.0] * 3 + [1.0] * 3) / 3.0)


def _rate(problem: Problem, conditions: Conditions) -> Criterion:
    spins = np.eye(3) if conditions.spin_axis == "any" else np.eye(3)["xyz".index(conditions.spin_axis)][None]
    scale = (conditions.noise / (problem.unit * conditions.speed_rad_s)) ** 2
    terms = []
    for spin in spins:
        into = np.zeros((12, 9))
        into[:6, :6] = np.eye(6)
        into[6:, 6:] = omega_products_jacobian(spin)
        terms.append(Term(into, np.diag([0.0] * 6 + [scale / (3.0 * len(spins))] * 3), np.zeros(9)))
    return TraceCriterion(tuple(terms))


def _drift(problem: Problem, conditions: Conditions) -> Criterion:
    return _motion(problem, drift_weight(conditions.time_s, conditions.sources))


def _fault(problem: Problem, conditions: Conditions) -> Criterion:
    channels = problem.n_chips * problem.axes_per_chip
    return FaultCriterion(
        least_fault(channels, conditions.noise, conditions.sample_rate_hz, duration=conditions.fault_time_s)
    )


OBJECTIVES: dict[str, tuple[str, str, Callable[[Problem, Conditions], Criterion]]] = {
    "gdop": ("GDOP", "", _gdop),
    "gdop_joint": ("GDOP*, the angular rate unknown", "", _gdop_joint),
    "kappa": ("condition number κ(J)", "", _kappa),
    "sigma_alpha": ("σ of α, rms of its components", "rad/s²", _sigma_alpha),
    "sigma_p": ("σ of p, rms of its components", "m/s²", _sigma_p),
    "rate": (
        "bound of the rate error at {given.speed_rad_s:.3g} rad/s, rms of its components",
        "rad/s",
        _rate,
    ),
    "drift": (
        "first-order position drift after {given.time_s:g} s at rest, biases of {bias_mg:.3g} mg",
        "m",
        _drift,
    ),
    "fault": ("least fault of the worst channel that is seen within {given.fault_time_s:g} s", "m/s²", _fault),
}
"""Objectives: meaning (a format of the conditions), unit and how each becomes a criterion."""
