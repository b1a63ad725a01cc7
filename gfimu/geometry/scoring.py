"""Figures of merit of array geometries: condition number, GDOP, errors per axis, what ω² leaves, what ω can be seen.

All figures but the rate bound are pure numbers with lengths in a stated length unit: the condition number and the GDOP
of a regression matrix mean nothing without it (GF-IMU paper, step 6, quotes L/2 = 1).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gfimu.bounds.sample import rate_bound
from gfimu.errors import InputError
from gfimu.geometry.array import OMEGA_PRODUCTS, AccelerometerArray
from gfimu.geometry.dilution import gdop, gdop_lower_bound
from gfimu.geometry.kinematics import MOTION_NAMES, joint_covariance, null_space, omega_leakage, require_all_motions
from gfimu.results import Panel, PlottedResult, Series
from gfimu.short_repr import short_repr

__all__ = [
    "DEFAULT_NOISE_STD",
    "Protection",
    "Score",
    "gdop",
    "gdop_lower_bound",
    "ranking_remark",
    "score",
    "score_panels",
]

DEFAULT_NOISE_STD = 0.0287
"""Channel noise at which rate bounds are quoted, m/s²: ADXL345, x and y axes at 100 Hz (0.75 LSB of 3.9 mg)."""

_NEGLIGIBLE = 1e-6  # coefficient of a product of ω not worth a word


class Protection(Protocol):
    """What faults of single channels an array shows (`gfimu.integrity.protection.FaultProtection`)."""

    def to_dict(self) -> dict[str, Any]:
        """Return the figures, with units in the names."""
        ...


@dataclass(frozen=True)
class Score(PlottedResult):
    """Figures of merit of one array.

    Parameters
    ----------
    name, description : str
        The array.
    n_channels : int
        Number of sensing axes c.
    length_unit_m : float
        Length that counts as 1 in every figure below, m.
    condition_number : float
        κ(J) = ‖J‖ ‖J⁻¹‖, ratio of the largest to the least singular value.
    gdop : float
        √tr((JᵀJ)⁻¹).
    gdop_joint : float
        The same for α and p with the products of ω free (`gfimu.geometry.kinematics.joint_form`): the price of not
        needing ω; infinite where that is impossible.
    sigma_alpha, sigma_p : ndarray, shape (3,)
        Standard deviations of the components of S a for channels of unit standard deviation: σ_α in channel units per
        length unit, σ_p in channel units.
    omega_squared_leakage : ndarray, shape (6,)
        Largest coefficient of a product of ω left in α_x, α_y, α_z, p_x, p_y, p_z by the linear solution S a.
    omega_squared_matrix : ndarray, shape (6, 6)
        All of them, S Q; columns in the order `gfimu.geometry.array.OMEGA_PRODUCTS`.
    null_space_rank : int
        How many of the six products of ω the null space of J sees.
    omega_rad_s : ndarray, shape (3,)
        Angular rate at which the bound below holds, body axes.
    noise_m_s2 : float
        Channel standard deviation at which it holds.
    rate_bound_rad_s : ndarray, shape (3,)
        Cramér–Rao bound of one sample on the components of ω; infinite where one sample doesn't determine it.
    protection : Protection, optional
        Least faults of its channels that are found.

    Examples
    --------
    >>> import gfimu
    >>> score = gfimu.score("cube12").best
    >>> print(f"κ {score.condition_number:.4f}, GDOP {score.gdop:.4f}")
    κ 1.4142, GDOP 1.0607
    """

    name: str
    description: str
    n_channels: int
    length_unit_m: float
    condition_number: float
    gdop: float
    gdop_joint: float
    sigma_alpha: NDArray[np.float64]
    sigma_p: NDArray[np.float64]
    omega_squared_leakage: NDArray[np.float64]
    omega_squared_matrix: NDArray[np.float64]
    null_space_rank: int
    omega_rad_s: NDArray[np.float64]
    noise_m_s2: float
    rate_bound_rad_s: NDArray[np.float64]
    protection: Protection | None = None

    __repr__ = short_repr

    def to_columns(self) -> dict[str, NDArray[Any]]:
        """Return the figures as one row, units in the names; without a unit: pure numbers in the length unit."""
        numbers: dict[str, Any] = {
            "channels": self.n_channels,
            "length_unit_m": self.length_unit_m,
            "condition_number": self.condition_number,
            "gdop": self.gdop,
            "gdop_joint": self.gdop_joint,
            "null_space_rank": self.null_space_rank,
        }
        numbers |= {f"sigma_alpha_{axis}": float(one) for axis, one in zip("xyz", self.sigma_alpha, strict=True)}
        numbers |= {f"sigma_p_{axis}": float(one) for axis, one in zip("xyz", self.sigma_p, strict=True)}
        leakage = zip(MOTION_NAMES, self.omega_squared_leakage, strict=True)
        numbers |= {f"omega_squared_leakage_{name}": float(one) for name, one in leakage}
        numbers |= {f"omega_{axis}_rad_s": float(one) for axis, one in zip("xyz", self.omega_rad_s, strict=True)}
        numbers["noise_m_s2"] = self.noise_m_s2
        bounds = zip("xyz", self.rate_bound_rad_s, strict=True)
        numbers |= {f"rate_bound_{axis}_rad_s": float(one) for axis, one in bounds}
        return {"array": np.array([self.name], dtype=object)} | {key: np.array([one]) for key, one in numbers.items()}

    def _heading(self) -> str:
        return f"Score of {self.name}"

    def _facts(self) -> list[tuple[str, str]]:
        def three(values: NDArray[np.float64]) -> str:
            return ", ".join("∞" if np.isinf(one) else f"{one:.4g}" for one in values)

        terms = "; ".join(f"{name}: {text}" for name, text in self.omega_squared_terms.items())
        return [
            ("array", self.description or self.name),
            ("channels", str(self.n_channels)),
            ("length unit", f"{self.length_unit_m:g} m"),
            ("condition number κ", f"{self.condition_number:.4f}"),
            ("GDOP", f"{self.gdop:.4f}"),
            ("GDOP with ω² free", f"{self.gdop_joint:.4f}"),
            ("σ of α per unit of channel noise (x, y, z)", three(self.sigma_alpha)),
            ("σ of p per unit of channel noise (x, y, z)", three(self.sigma_p)),
            ("terms of ω² in α and p", terms or "none"),
            ("products of ω that the null space sees", f"{self.null_space_rank} of 6"),
            (
                f"rate bound of one sample at ω = ({three(self.omega_rad_s)}) rad/s",
                f"({three(self.rate_bound_rad_s)}) rad/s",
            ),
            ("channel noise of that bound", f"{self.noise_m_s2:g} m/s²"),
        ]

    def _shown(self) -> None:
        return None

    def _panels(self) -> list[Panel]:
        return score_panels([self])

    @property
    def omega_squared_terms(self) -> dict[str, str]:
        """Terms left by ω² in words, for each component of α and p that has any; length unit as stated."""
        words = {
            name: " ".join(
                f"{coefficient:+.4g}·{_product_in_words(product)}"
                for coefficient, product in zip(row, OMEGA_PRODUCTS, strict=True)
                if abs(coefficient) > _NEGLIGIBLE
            )
            for name, row in zip(MOTION_NAMES, self.omega_squared_matrix, strict=True)
        }
        return {name: terms for name, terms in words.items() if terms}

    def to_dict(self) -> dict[str, Any]:
        """Return the entry of ``gfimu score --json``."""
        faults = {} if self.protection is None else {"least_fault": self.protection.to_dict()}
        return {
            "name": self.name,
            "description": self.description,
            "channels": self.n_channels,
            "length_unit_m": self.length_unit_m,
            "condition_number": self.condition_number,
            "gdop": self.gdop,
            "gdop_joint": self.gdop_joint,
            "sigma_alpha": self.sigma_alpha,
            "sigma_p": self.sigma_p,
            "omega_squared_leakage": self.omega_squared_leakage,
            "omega_squared_terms": self.omega_squared_terms,
            "null_space_rank": self.null_space_rank,
            "omega_rad_s": self.omega_rad_s,
            "noise_m_s2": self.noise_m_s2,
            "rate_bound_rad_s": self.rate_bound_rad_s,
            **faults,
        }


def score(
    arrays: AccelerometerArray | str | Path | Sequence[AccelerometerArray | str | Path],
    *,
    length_unit_m: float | None = None,
    omega_rad_s: ArrayLike = (0.0, 0.0, 2.0 * math.pi),
    noise_m_s2: float = DEFAULT_NOISE_STD,
) -> list[Score]:
    """Score the geometry of one or several arrays.

    Parameters
    ----------
    arrays : AccelerometerArray, str, Path, or sequence of these
        Arrays, names of shipped arrays, or paths of array files.
    length_unit_m : float, optional
        Length that counts as 1 for all of them; without it each array's own unit (half the edge of a cube).
    omega_rad_s : array_like, shape (3,)
        Angular rate in body axes at which the rate bound is taken; one revolution per second about z by default.
    noise_m_s2 : float
        Standard deviation of every channel at which the rate bound is taken.

    Raises
    ------
    GeometryError
        If an array can't see all six motions; the message names the motions.
    InputError
        If an array is unknown or an argument is out of range.
    """
    if length_unit_m is not None and not (math.isfinite(length_unit_m) and length_unit_m > 0):
        raise InputError(f"length unit {length_unit_m!r}: must be a positive length, m")
    omega = np.asarray(omega_rad_s, dtype=float)
    if omega.shape != (3,) or not np.isfinite(omega).all():
        raise InputError(f"angular rate {omega_rad_s!r}: must be three finite numbers, rad/s")
    given = [arrays] if isinstance(arrays, AccelerometerArray | str | Path) else arrays
    loaded = [item if isinstance(item, AccelerometerArray) else AccelerometerArray.load(item) for item in given]
    return [_score(array, length_unit_m or array.length_unit, omega, noise_m_s2) for array in loaded]


def score_panels(scores: Sequence[Score]) -> list[Panel]:
    """Return the picture of one or several scores side by side: σ per component, what ω² leaves, GDOP, rate bound."""
    components = tuple(f"{quantity}{axis}" for quantity in ("α", "p") for axis in "xyz")
    names = tuple(score.name for score in scores)

    def finite(values: Sequence[float] | NDArray[np.float64]) -> NDArray[np.float64]:
        numbers = np.asarray(values, dtype=float)
        return np.where(np.isfinite(numbers), numbers, np.nan)

    def by_array(values: Callable[[Score], NDArray[np.float64]]) -> tuple[Series, ...]:
        return tuple(Series(score.name, finite(values(score)), chip=place) for place, score in enumerate(scores))

    sigma = by_array(lambda score: np.concatenate([score.sigma_alpha, score.sigma_p]))
    merit = (
        Series("GDOP", finite([score.gdop for score in scores]), chip=0),
        Series("GDOP with ω² free", finite([score.gdop_joint for score in scores]), chip=1),
        Series("κ", finite([score.condition_number for score in scores]), chip=2),
    )
    bound = by_array(lambda score: score.rate_bound_rad_s)
    return [
        Panel(
            "σ of each component",
            "σ per unit of channel noise\n(length unit of the array)",
            sigma,
            components,
            scale="zero",
        ),
        Panel("figures of merit", "pure number", merit, names, scale="zero"),
        Panel("rate bound of one sample", "σ of ω, rad/s", bound, ("ωx", "ωy", "ωz"), scale="zero"),
    ]


def ranking_remark(scores: Sequence[Score]) -> str:
    """Return a sentence where κ and GDOP rank arrays differently, empty where they agree.

    The GF-IMU paper's appendix claims that all its alternatives have larger κ and GDOP than the cube; for κ that is
    false of P1 and P2, whose κ is 1 (`docs/theory/geometry.md`).

    Parameters
    ----------
    scores : sequence of Score
        Scores of the arrays to rank.
    """
    if not scores:
        return ""
    best = min(scores, key=lambda entry: entry.gdop)
    # Equal figures differ in their last digits by rounding.
    lower = [entry.name for entry in scores if entry.condition_number < best.condition_number * (1.0 - _NEGLIGIBLE)]
    if not lower:
        return ""
    have = "have" if len(lower) > 1 else "has"
    return (
        f"κ and GDOP rank these arrays differently: {', '.join(lower)} {have} a lower κ but a larger GDOP than "
        f"{best.name}. κ compares the best-seen motion with the worst-seen one; rank by GDOP, or by GDOP* without ω."
    )


def _score(array: AccelerometerArray, unit: float, omega: NDArray[np.float64], noise: float) -> Score:
    require_all_motions(array)
    scaled = array.regression_matrix / np.array([unit] * 3 + [1.0] * 3)  # (c, 6), lengths in the unit
    singular_values = np.linalg.svd(scaled, compute_uv=False)
    deviations = np.linalg.norm(np.linalg.pinv(scaled), axis=1)  # (6,)
    joint_variance = np.diag(joint_covariance(array))[:6] * np.array([unit**2] * 3 + [1.0] * 3)
    leakage = omega_leakage(array) / np.array([1.0] * 3 + [unit] * 3)[:, None]
    return Score(
        name=array.name,
        description=array.description,
        n_channels=array.n_channels,
        length_unit_m=unit,
        condition_number=float(singular_values[0] / singular_values[-1]),
        gdop=float(np.linalg.norm(deviations)),
        gdop_joint=math.inf if np.isnan(joint_variance).any() else float(np.sqrt(joint_variance.sum())),
        sigma_alpha=deviations[:3],
        sigma_p=deviations[3:],
        omega_squared_leakage=np.abs(leakage).max(axis=1),
        omega_squared_matrix=leakage,
        null_space_rank=null_space(array).rank,
        omega_rad_s=omega,
        noise_m_s2=noise,
        rate_bound_rad_s=rate_bound(array, omega, noise),
    )


def _product_in_words(product: str) -> str:
    first, second = product[0], product[1]
    return f"ω{first}²" if first == second else f"ω{first}ω{second}"
