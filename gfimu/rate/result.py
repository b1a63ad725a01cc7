"""Result of a rate estimator: estimate, covariance, innovation statistics, rest, sign."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from typing import TYPE_CHECKING, Any, Self

import numpy as np
from numpy.typing import NDArray

from gfimu.base.results import Panel, PlottedResult, Series, axis_series
from gfimu.base.short_repr import joined, short_repr
from gfimu.recording.sample_times import timing

if TYPE_CHECKING:
    from gfimu.rate.start import Start

__all__ = [
    "DECIDED", "BodyPath", "ChannelReport", "RateEstimate", "SignDecision", "clear_of_zero", "full_covariance",
    "joined_estimates", "undecided",
]  # fmt: skip

DECIDED = 0.99
"""Probability from which the sign of a rate counts as decided."""

_CLEAR = 4.0 * 13.82  # of ωᵀC⁻¹ω: four times the 99.9 % quantile of χ²(2), as a fit takes two of z's freedoms at rest


@dataclass(frozen=True)
class SignDecision:
    """Which of the two mirrored rates is the true one: ω and −ω give the same centripetal readings.

    Parameters
    ----------
    state : {"known", "decided", "partly", "undecided"}
        ``known``: the start was known, so the sign was never in doubt. ``undecided`` after a start at rest: the
        readings at the start were not those of rest, so what followed may have either sign. ``partly``: decided in
        some samples only, as ``RateEstimate.sign_probability`` shows.
    log_likelihood_ratio : float
        Of the estimate against its mirror image where the decision fell (or at the end, undecided).
    decided_at_s : float
        Time from which on the sign is certain, s; NaN if undecided. With ``partly``, of the first decided sample.
    """

    state: str = "known"
    log_likelihood_ratio: float = np.inf
    decided_at_s: float = np.nan


@dataclass(frozen=True)
class ChannelReport:
    """What was wrong with the channels and what was done about it.

    Parameters
    ----------
    missing, saturated, stuck : mapping of str to int
        Samples in which a channel was left out, per channel with any.
    samples_without_alpha : int
        Samples with too few channels to see α: the rate was carried on with growing uncertainty.
    gaps : int
        Gaps in time that were bridged.
    restarts : int
        How often the readings contradicted the filter for half a second, so that it started again from single samples.
    samples_without_rate : int
        Samples of such half seconds, and those whose readings fit no rate at all: they have none.
    """

    missing: Mapping[str, int] = field(default_factory=dict)
    saturated: Mapping[str, int] = field(default_factory=dict)
    stuck: Mapping[str, int] = field(default_factory=dict)
    samples_without_alpha: int = 0
    gaps: int = 0
    restarts: int = 0
    samples_without_rate: int = 0

    def to_dict(self) -> dict[str, Any]:
        """Return the report as JSON can hold it."""
        return {
            "missing": dict(self.missing),
            "saturated": dict(self.saturated),
            "stuck": dict(self.stuck),
            "samples_without_alpha": self.samples_without_alpha,
            "gaps": self.gaps,
            "restarts": self.restarts,
            "samples_without_rate": self.samples_without_rate,
        }

    def sentences(self) -> list[str]:
        """Return the report in words, one sentence per finding; empty if nothing was wrong."""
        found = []
        for what, counts in (("missing", self.missing), ("saturated", self.saturated), ("stuck", self.stuck)):
            if counts:
                names = ", ".join(f"{name} {count}" for name, count in counts.items())
                found.append(f"{what} channels left out (samples): {names}")
        if self.samples_without_alpha:
            found.append(f"{self.samples_without_alpha} samples with too few channels: rate carried on, less certain")
        if self.gaps:
            found.append(f"{self.gaps} gaps in time bridged, rate less certain after each")
        if self.restarts or self.samples_without_rate:
            found.append(
                f"the readings contradicted the filter for half a second or longer: it started again {self.restarts} "
                f"times, and {self.samples_without_rate} samples have no rate (NaN); likely causes: shocks, a channel "
                "that jumps, a wrong rate at the start; next: --method ml, or `gfimu noise`"
            )
        return found


@dataclass(frozen=True)
class BodyPath:
    """Attitude, velocity, position, angle, α and p of a body along a run, each with its standard deviation.

    Parameters
    ----------
    quaternion : ndarray, shape (n, 4)
        Attitude (w, x, y, z), body to world.
    attitude_std : ndarray, shape (n, 3)
        About the axes of the world, rad: two of tilt, and the heading.
    velocity, velocity_std, position, position_std : ndarray, shape (n, 3)
        Of the origin in the world since the first sample, m/s and m.
    angle, angle_std : ndarray, shape (n,)
        Angle turned about the axis asked for, rad.
    alpha, alpha_std : ndarray, shape (n, 3)
        Angular acceleration, body axes, rad/s², without the biases that the estimate found.
    p, p_std : ndarray, shape (n, 3)
        Specific force of the origin, body axes, m/s², likewise.
    """

    quaternion: NDArray[np.float64]
    attitude_std: NDArray[np.float64]
    velocity: NDArray[np.float64]
    velocity_std: NDArray[np.float64]
    position: NDArray[np.float64]
    position_std: NDArray[np.float64]
    angle: NDArray[np.float64]
    angle_std: NDArray[np.float64]
    alpha: NDArray[np.float64]
    alpha_std: NDArray[np.float64]
    p: NDArray[np.float64]
    p_std: NDArray[np.float64]

    __repr__ = short_repr

    def known_at(self, known: NDArray[np.bool_]) -> Self:
        """Return the path with NaN where a sample is not ``known`` (n,)."""
        columns = {one.name: getattr(self, one.name) for one in fields(self)}
        return type(self)(
            **{name: np.where(known.reshape(-1, *[1] * (v.ndim - 1)), v, np.nan) for name, v in columns.items()}
        )


@dataclass(frozen=True)
class RateEstimate(PlottedResult):
    """Angular rate with its standard deviation, sample by sample.

    Parameters
    ----------
    method : str
        Name of the estimator.
    t_s : ndarray, shape (n,)
        Sample times, s.
    omega : ndarray, shape (n, 3)
        Angular rate in body axes, rad/s; NaN where the method has no estimate.
    covariance : ndarray, shape (n, 3, 3)
        Covariance of ``omega``, (rad/s)².
    nis : ndarray, shape (n,)
        Normalised innovation squared of each sample; with a right model χ² with ``nis_dof`` degrees of freedom.
        For methods without innovations: the normalised residual squared, NaN where there is none.
    stated_nis : ndarray, shape (n,), or None
        The same by the noise as stated, or as measured where the channels agree, before ``scale`` enlarges it.
    start : Start or None
        How the run starts, as inferred.
    path : BodyPath or None
        Attitude, velocity and position, where they were asked for.
    nis_dof : ndarray of int, shape (n,)
        Degrees of freedom of ``nis``; zero where nothing was compared.
    rest : ndarray of bool, shape (n,)
        Samples recognised as rest.
    sign : SignDecision
        Whether the sign of ω is certain. While undecided, ``mirrored`` is the other hypothesis.
    mirrored : RateEstimate or None
        The mirror hypothesis where the sign stayed undecided.
    bias, bias_covariance : ndarray or None
        Final [b_α (rad/s²); b_z (noise units); b_gyro (rad/s)] of the filter and its covariance.
    channels : ChannelReport
        Channels left out, gaps bridged.
    scale : ndarray, shape (n,), or None
        s̃, by which standard deviations were multiplied because the channels disagree more than their stated noise
        (`gfimu.rate.disagreement`); ``covariance`` and ``nis`` have it already. None where it was not measured.
    sign_probability : ndarray, shape (n,), or None
        Probability that ``omega`` and not ``−omega`` is the rate; one half at rest, where the sign means nothing. None
        where the sign was never in doubt.

    Examples
    --------
    >>> import gfimu
    >>> run = gfimu.simulate("paper_run", seed=1)
    >>> cube = run.array
    >>> errors = gfimu.SensorErrors.from_parts(cube, 100.0)
    >>> found = gfimu.estimate_rate(cube, run.t_s, run.readings, errors, method="filter")
    >>> found.omega.shape
    (3000, 3)
    """

    method: str
    t_s: NDArray[np.float64]
    omega: NDArray[np.float64]
    covariance: NDArray[np.float64]
    nis: NDArray[np.float64]
    nis_dof: NDArray[np.int64]
    rest: NDArray[np.bool_]
    sign: SignDecision = field(default_factory=SignDecision)
    mirrored: RateEstimate | None = None
    bias: NDArray[np.float64] | None = None
    bias_covariance: NDArray[np.float64] | None = None
    channels: ChannelReport = field(default_factory=ChannelReport)
    scale: NDArray[np.float64] | None = None
    sign_probability: NDArray[np.float64] | None = None
    stated_nis: NDArray[np.float64] | None = None
    start: Start | None = None
    path: BodyPath | None = None
    unit: str = "rad/s"
    format_version: int = 1

    def __len__(self) -> int:
        return len(self.t_s)

    def __repr__(self) -> str:
        return joined(self, [self.method, timing(self.t_s), f"sign {self.sign.state}"])

    @property
    def std(self) -> NDArray[np.float64]:
        """Standard deviation of each component of ω, shape (n, 3), rad/s."""
        return np.sqrt(np.diagonal(self.covariance, axis1=1, axis2=2))

    def _facts(self) -> list[tuple[str, str]]:
        facts = [("method", self.method), ("samples", timing(self.t_s)), ("sign", self.sign.state)]
        return [*facts, ("mean NIS per degree of freedom", f"{self.mean_nis:.3g}")]

    def _notes(self) -> list[str]:
        return self.channels.sentences()

    def _panels(self) -> list[Panel]:
        panels = [Panel("angular rate", "ω, rad/s", axis_series(self.omega, self.std), self.t_s)]
        with np.errstate(divide="ignore", invalid="ignore"):
            per_freedom = np.where(self.nis_dof > 0, self.nis / self.nis_dof, np.nan)
        if np.isfinite(per_freedom).any():
            title = "normalised innovation squared"
            panels.append(Panel(title, "NIS per degree of freedom", (Series("", per_freedom),), self.t_s))
        return panels

    def to_columns(self) -> dict[str, NDArray[Any]]:
        """Return the columns of a table, by name with unit: time, ω and its standard deviation, statistics, rest."""
        columns: dict[str, NDArray[Any]] = {"t_s": self.t_s}
        columns |= {f"omega_{axis}_rad_s": self.omega[:, index] for index, axis in enumerate("xyz")}
        columns |= {f"omega_{axis}_std_rad_s": self.std[:, place] for place, axis in enumerate("xyz")}
        columns |= {"nis": self.nis, "nis_dof": self.nis_dof, "rest": self.rest}
        further = {"noise_scale": self.scale, "omega_sign_probability": self.sign_probability}
        return columns | {name: values for name, values in further.items() if values is not None}

    def _table_metadata(self) -> dict[str, Any]:
        return {
            "method": self.method,
            "sign": self.sign.state,
            "channels": self.channels.to_dict(),
            "format_version": self.format_version,
        }

    @property
    def sign_undecided(self) -> NDArray[np.bool_]:
        """Samples whose rate has a sign that is not decided (probability of 0.99 or less), shape (n,)."""
        if self.sign_probability is None:
            return np.full(len(self), self.sign.state == "undecided")
        return undecided(self.sign_probability, self.omega, self.std)

    @property
    def mean_nis(self) -> float:
        """Sum of ``nis`` over the sum of its degrees of freedom, 1 for a filter whose model is right."""
        used = (self.nis_dof > 0) & np.isfinite(self.nis) & np.isfinite(self.omega).all(axis=1)
        freedom = int(self.nis_dof[used].sum())
        return float(self.nis[used].sum() / freedom) if freedom else float("nan")


def clear_of_zero(omega: NDArray[np.float64], std: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Whether each rate (n, 3) stands clear of zero, so that it has a sign at all; from ``std`` (n, 3), both rad/s.

    The products of ω have twice the relative error of ω: ω has a sign where it is as many standard deviations from zero
    as makes the products significant at 99.9 %.
    """
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.asarray(np.sum(np.square(omega / std), axis=1) > _CLEAR)


def undecided(
    probability: NDArray[np.float64], omega: NDArray[np.float64], std: NDArray[np.float64]
) -> NDArray[np.bool_]:
    """Whether the sign of each rate (n, 3) is undecided, by its probability (n,) and its ``std`` (n, 3), rad/s.

    A rate that does not stand clear of zero has no sign to decide.
    """
    return clear_of_zero(omega, std) & ~(probability > DECIDED)


def full_covariance(packed: NDArray[np.float64]) -> NDArray[np.float64]:
    """Symmetric matrices (n, 3, 3) from their elements xx, yy, zz, xy, xz, yz, shape (n, 6)."""
    return packed[:, [0, 3, 4, 3, 1, 5, 4, 5, 2]].reshape(-1, 3, 3)


def joined_estimates(parts: Sequence[RateEstimate]) -> RateEstimate:
    """Join estimates of consecutive samples; what is said of the run as a whole is that of the last part."""
    if len(parts) == 1:
        return parts[0]
    columns = ("t_s", "omega", "covariance", "nis", "nis_dof", "rest", "scale", "sign_probability", "stated_nis")
    joined: dict[str, Any] = {name: np.concatenate([getattr(part, name) for part in parts]) for name in columns}
    return replace(parts[-1], **joined)
