"""Figures of merit of array geometries: condition number, GDOP, errors per axis, what ω² leaves, what ω can be seen.

All figures but the rate bound are pure numbers with lengths in a stated length unit: the condition number and the GDOP
of a regression matrix mean nothing without it (GF-IMU paper, step 6, quotes L/2 = 1).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gfimu.array.array import OMEGA_PRODUCTS, AccelerometerArray
from gfimu.array.dilution import gdop, gdop_lower_bound
from gfimu.array.kinematics import MOTION_NAMES, joint_covariance, null_space, omega_leakage, require_all_motions
from gfimu.base.declared import Declared, figure
from gfimu.base.errors import InputError
from gfimu.base.results import Panel, PlottedResult, Series, text_column
from gfimu.base.short_repr import short_repr
from gfimu.rate.bounds.sample import rate_bound
from gfimu.rate.health.protection import FaultProtection

__all__ = [
    "DEFAULT_NOISE_STD",
    "Score",
    "gdop",
    "gdop_lower_bound",
    "ranking_remark",
    "score",
    "score_panels",
]

DEFAULT_NOISE_STD = 0.0287
"""Channel noise at which rate bounds are quoted, m/s²: ADXL345, x and y axes at 100 Hz (0.75 LSB of 3.9 mg)."""

Floats = NDArray[np.float64]

_NEGLIGIBLE = 1e-6  # coefficient of a product of ω not worth a word


@dataclass(frozen=True)
class Score(Declared, PlottedResult):
    """Figures of merit of one array; those without a unit are pure numbers with lengths in its length unit.

    ``omega_squared_matrix`` (6, 6) holds S Q, the products of ω left in α and p by the linear solution S a, with
    columns in the order `gfimu.array.array.OMEGA_PRODUCTS`.

    Examples
    --------
    >>> import gfimu
    >>> score = gfimu.score("cube12").best
    >>> print(f"κ {score.condition_number:.4f}, GDOP {score.gdop:.4f}")
    κ 1.4142, GDOP 1.0607
    """

    name: Annotated[str, figure("Name of the array.", head="array")]
    description: Annotated[str, figure("What it is.")]
    n_channels: Annotated[int, figure("Channels.", head="axes", key="channels")]
    length_unit_m: Annotated[float, figure("Length that counts as 1 in the figures.", "m", head="length unit")]
    condition_number: Annotated[float, figure("Condition number κ(J).", head="κ(J)", form=".4f")]
    gdop: Annotated[float, figure("√tr((JᵀJ)⁻¹).", head="GDOP", form=".4f")]
    gdop_joint: Annotated[
        float, figure("GDOP with ω unknown and no recursion; null: impossible.", head="GDOP*", form=".4f")
    ]
    sigma_alpha: Annotated[
        Floats,
        figure("Standard deviation of α_x, α_y, α_z, in channel units per length unit.", head="σ_α", form=".4f"),
    ]
    sigma_p: Annotated[Floats, figure("Standard deviation of p_x, p_y, p_z, in channel units.", head="σ_p", form=".4f")]
    omega_squared_leakage: Annotated[
        Floats,
        figure("Largest coefficient of a product of ω in α_x … p_z by the linear solution.", parts=MOTION_NAMES),
    ]
    omega_squared_matrix: Floats
    null_space_rank: Annotated[
        int, figure("Products of ω, of six, that the null space of J sees.", head="ω seen", form="{} of 6")
    ]
    omega_rad_s: Annotated[Floats, figure("Angular rate of the bound, body axes.", "rad/s")]
    noise_m_s2: Annotated[float, figure("Standard deviation of a channel at which the bound holds.", "m/s²")]
    rate_bound_rad_s: Annotated[
        Floats,
        figure("Cramér–Rao bound of one sample on ω; null: not determined.", "rad/s", head="σ_ω", form=".3g"),
    ]
    protection: Annotated[
        FaultProtection | None, figure("Least fault of a channel that is found.", key="least_fault", absent=True)
    ] = None

    __repr__ = short_repr

    def to_columns(self) -> dict[str, NDArray[Any]]:
        """Return the figures as one row, units in the names."""
        return {"array": text_column([self.name])} | self.row()

    def _heading(self) -> str:
        return f"Score of {self.name}"

    def _shown(self) -> None:
        return None

    def _panels(self) -> list[Panel]:
        return score_panels([self])

    @property
    def omega_squared_terms(
        self,
    ) -> Annotated[
        dict[str, str], figure("These products in words, by component that has any.", before="null_space_rank")
    ]:
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

    @property
    def contaminated(self) -> Annotated[str, figure("Components with such terms.", head="ω² left in", in_json=False)]:
        """Components of α and p in which ω² leaves terms, in words."""
        names = [name.replace("alpha", "α") for name in self.omega_squared_terms]
        return "none" if not names else "α and p" if len(names) == len(MOTION_NAMES) else " ".join(names)


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
        return tuple(Series(score.name, finite(values(score)), chip=index) for index, score in enumerate(scores))

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
