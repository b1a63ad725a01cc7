"""How well a rotation about one known axis can be seen: per sample, and by a filter that runs on.

The Fisher information of one sample, with the specific force of the axis free (a wheel) or known (a table), gives σ_α
and σ_s, the standard deviations of α and of s = Ω². One sample then has |Ω| to σ_s / (2 |Ω|). A filter that integrates
α and is corrected by s settles where a correction takes what a step adds, (T σ_α)²: σ_Ω² = T σ_α σ_s / (2 |Ω|). For two
tri-axial chips ρ apart with white noise σ these are σ / (√2 ρ |Ω|) and (σ / ρ) √(T / |Ω|).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Annotated, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gfimu.array.array import AccelerometerArray
from gfimu.array.turning_axis import TurningAxis
from gfimu.base.declared import Declared, figure
from gfimu.base.errors import GeometryError
from gfimu.base.results import Panel, PlottedResult, Series, text_column
from gfimu.rate.axis.accuracy.predicted_run import PredictedEstimate
from gfimu.rate.axis.channels import AxisChannels

__all__ = ["AxisBounds", "axis_bounds", "require_visible"]


@dataclass(frozen=True)
class AxisBounds(Declared, PlottedResult):
    """Lower bounds on the errors of rate and angle for rotation about one known axis.

    Examples
    --------
    >>> import gfimu
    >>> bounds = gfimu.score("wheel_pair").about_axis[0]
    >>> print(f"{bounds.filter_std:.4f} rad/s at {bounds.rate_rad_s:.2f} rad/s")
    0.0038 rad/s at 6.28 rad/s
    """

    array: Annotated[str, figure("Name of the array.", head="array")]
    axis: Annotated[TurningAxis, figure("The axis.", flat=True)]
    rate_rad_s: Annotated[float, figure("Rate at which the bounds hold.", "rad/s", head="rate")]
    acceleration_std: Annotated[
        float,
        figure(
            "Standard deviation of the angular acceleration by one sample.", "rad/s²",
            head="σ_α", key="sigma_alpha_rad_s2",
        ),
    ]  # fmt: skip
    square_std: Annotated[
        float,
        figure(
            "Standard deviation of Ω² by one sample; null: not observable.", "rad²/s²",
            head="σ of Ω²", key="sigma_rate_squared_rad2_s2",
        ),
    ]  # fmt: skip
    sample_std: Annotated[
        float,
        figure(
            "Standard deviation of the rate by one sample.", "rad/s",
            head="σ_Ω per sample", form=".3g", key="sigma_rate_sample_rad_s",
        ),
    ]  # fmt: skip
    filter_std: Annotated[
        float,
        figure(
            "Standard deviation of the rate of a filter that has settled, biases known.", "rad/s",
            head="σ_Ω of a filter", form=".3g", key="sigma_rate_filter_rad_s",
        ),
    ]  # fmt: skip
    predicted: Annotated[
        PredictedEstimate | None,
        figure("What gfimu estimate reaches in a run, with the mounting estimated.", key="estimate", absent=True),
    ] = None

    @property
    def hub(self) -> Annotated[str, figure("Whether the axis stands still.", head="hub", in_json=False)]:
        """Whether the axis stands still (fixed) or moves with a body (free)."""
        return self.axis.hub

    def to_columns(self) -> dict[str, NDArray[Any]]:
        """Return the bounds as one row, units in the names."""
        return {"array": text_column([self.array])} | self.row()

    def _heading(self) -> str:
        return f"Score of {self.array} about its axis"

    def _shown(self) -> None:
        return None

    def _panels(self) -> list[Panel]:
        values = np.array([self.sample_std, self.filter_std])
        series = Series("", np.where(np.isfinite(values), values, np.nan))
        title = f"bounds on the rate at {self.rate_rad_s:.3g} rad/s"
        return [Panel(title, "σ of the rate, rad/s", (series,), ("one sample", "filter, settled"), scale="zero")]


def axis_bounds(
    array: AccelerometerArray,
    axis: TurningAxis,
    *,
    rate_rad_s: float = 2.0 * np.pi,
    noise_std: ArrayLike = 0.0287,
    sample_rate_hz: float = 100.0,
) -> AxisBounds:
    """Return how well an array sees a rotation about a known axis.

    Parameters
    ----------
    array : AccelerometerArray
        The array.
    axis : TurningAxis
        The axis; a free hub's specific force is marginalised.
    rate_rad_s : float
        Rate, rad/s.
    noise_std : array_like, scalar or shape (c,)
        Standard deviation of one sample of each channel, m/s².
    sample_rate_hz : float
        Rate of the samples.
    """
    channels = AxisChannels.of(array, axis)
    matrix = channels.motion_matrix() if axis.hub == "free" else channels.motion_matrix()[:, :2]
    noise = np.broadcast_to(np.asarray(noise_std, dtype=float), array.n_channels)
    covariance = _covariance(matrix / noise[:, None])
    acceleration, square = np.sqrt(covariance[0]), np.sqrt(covariance[1])
    rate = abs(float(rate_rad_s))
    sample = float(square / (2.0 * rate)) if rate > 0.0 else float("inf")
    filtered = float(np.sqrt(acceleration * square / (2.0 * rate * sample_rate_hz))) if rate > 0.0 else float("inf")
    return AxisBounds(array.name, axis, rate, float(acceleration), float(square), sample, filtered)


def require_visible(array: AccelerometerArray, axis: TurningAxis) -> None:
    """Raise `GeometryError` unless the array sees α and Ω² about the axis.

    One chip on a free hub is let through: gravity, which turns in it, shows the angle.
    """
    found = axis_bounds(array, replace(axis, hub="fixed"))
    if not (np.isfinite(found.acceleration_std) and np.isfinite(found.square_std)):
        raise GeometryError(
            f"array {array.name!r} can't see a rotation about this axis: no chip is off it; correct position_m, or the "
            "axis's point"
        )


def _covariance(matrix: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the variances of the first two columns' coefficients, (2,); infinite where they are not observable."""
    found = np.full(2, np.inf)
    others_of = [[index for index in range(matrix.shape[1]) if index != column] for column in (0, 1)]
    for column, others in enumerate(others_of):
        rest = matrix[:, others]
        basis = np.linalg.svd(rest, full_matrices=False)
        rank = int(np.sum(basis[1] > 1e-9 * max(float(basis[1].max()), 1e-30)))
        used = basis[0][:, :rank]
        own = matrix[:, column] - used @ (used.T @ matrix[:, column])
        information = float(own @ own)
        if information > 1e-12 * max(float(matrix[:, column] @ matrix[:, column]), 1e-30):
            found[column] = 1.0 / information
    return found
