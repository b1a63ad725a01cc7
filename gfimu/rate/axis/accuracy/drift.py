"""How far rate and angle about a known axis run off by biases and noise: the filter's own derivatives and covariance.

An array that turns steadily about the axis is followed by the filter of `gfimu.rate.axis.recursion` over readings
without error. Its covariance is what white noise does. Its derivatives by a constant of each channel are what a bias
does, and those delayed are what a bias does that walks.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray

from gfimu.array.array import AccelerometerArray
from gfimu.array.turning_axis import TurningAxis
from gfimu.base.declared import Declared, Table, figure, table
from gfimu.base.errors import InputError
from gfimu.base.results import Panel, PlottedResult, Series, text_column
from gfimu.rate.axis.accuracy.bounds import require_visible
from gfimu.rate.axis.accuracy.predicted_readings import gravity_of, readings_of
from gfimu.rate.axis.channels import AxisChannels
from gfimu.rate.axis.recursion import Slopes, filter_axis

__all__ = ["AxisDrift", "AxisDriftTerm", "axis_drift"]

_MOST_SAMPLES = 20000  # numerical: longer runs are sampled more slowly, with the noise of their density
_LEAST_PER_TURN = 60  # numerical
_LEAST_NOISE = 1e-4  # m/s²/√Hz: of a filter that is given none; any will do, as the noise only sets its gains


@dataclass(frozen=True)
class AxisDriftTerm(Declared):
    """One cause of the drift about a known axis."""

    name: Annotated[str, figure("The cause.", head="cause")]
    size: Annotated[str, figure("Its size, with the unit.", head="size")]
    rate_std: Annotated[float, figure("Its share of the rate, 1 σ.", "rad/s", head="rate", form=".3g")]
    angle_std: Annotated[float, figure("Its share of the angle, 1 σ.", "rad", head="angle", form=".3g")]


@dataclass(frozen=True)
class AxisDrift(Declared, PlottedResult):
    """Growth of the errors of rate and angle about a known axis.

    Examples
    --------
    >>> import gfimu
    >>> found = gfimu.axis_drift("wheel_pair", duration=10.0, noise_ug=290.0, speed_rad_s=5.0)
    >>> print(f"rate {found.rate_std_rad_s:.3f} rad/s, angle {found.angle_std_rad:.3f} rad")
    rate 0.003 rad/s, angle 0.002 rad
    """

    array: Annotated[str, figure("Name of the array.")]
    axis: Annotated[TurningAxis, figure("The axis.", key="turning_axis")]
    time_s: Annotated[float, figure("Time since a known start.", "s")]
    rate_rad_s: Annotated[float, figure("Rate about the axis.", "rad/s")]
    terms: Annotated[tuple[AxisDriftTerm, ...], figure("The causes.")]
    remark: Annotated[str, figure("What bounds the drift, or does not.")]

    def to_columns(self) -> dict[str, NDArray[Any]]:
        """Return one row per cause: its size, and the standard deviations of rate and angle at the end."""
        return {
            "cause": text_column(term.name for term in self.terms),
            "size": text_column(one.size for one in self.terms),
            "rate_std_rad_s": np.array([one.rate_std for one in self.terms]),
            "angle_std_rad": np.array([one.angle_std for one in self.terms]),
        }

    def _heading(self) -> str:
        return f"Drift of {self.array} about its axis after {self.time_s:g} s at {self.rate_rad_s:.3g} rad/s"

    def _notes(self) -> tuple[str, ...]:
        return (self.remark,) if self.remark else ()

    def _panels(self) -> list[Panel]:
        columns = self.to_columns()
        names = (*(term.name for term in self.terms), "total")
        return [
            Panel(title, label, (Series("", np.append(columns[key], whole)),), names, scale="zero")
            for title, label, key, whole in (
                ("rate error at the end, by cause", "σ, rad/s", "rate_std_rad_s", self.rate_std_rad_s),
                ("angle error at the end, by cause", "σ, rad", "angle_std_rad", self.angle_std_rad),
            )
        ]

    @property
    def rate_std_rad_s(
        self,
    ) -> Annotated[
        float, figure("Standard deviation of the rate.", "rad/s", head="rate, σ", form=".3g", before="remark")
    ]:
        """Standard deviation of the rate by all causes, rad/s."""
        return float(np.sqrt(sum(term.rate_std**2 for term in self.terms)))

    @property
    def angle_std_rad(
        self,
    ) -> Annotated[
        float, figure("Standard deviation of the angle.", "rad", head="angle, σ", form=".3g", before="remark")
    ]:
        """Standard deviation of the angle by all causes, rad."""
        return float(np.sqrt(sum(term.angle_std**2 for term in self.terms)))

    def shown(self) -> Iterator[Table | str]:
        """Yield the causes, and what bounds the drift."""
        where = f"turning at {self.rate_rad_s:g} rad/s" if self.rate_rad_s else "at rest"
        total = AxisDriftTerm("total", "", self.rate_std_rad_s, self.angle_std_rad)
        title = f"Rotation about the known axis after {self.time_s:g} s, {self.array}, {where} (1 σ)"
        yield table(title, [*self.terms, total], "name size rate_std angle_std", left=2)
        yield f"{self.remark[0].upper()}{self.remark[1:]}."


def axis_drift(
    array: AccelerometerArray,
    axis: TurningAxis,
    time_s: float,
    *,
    bias: float = 0.0,
    noise_density: float = 0.0,
    bias_random_walk: float = 0.0,
    rate_rad_s: float = 0.0,
    hub_density: float = 0.1,
    jerk: float = 1.0,
) -> AxisDrift:
    """Return how far rate and angle about a known axis run off from a known start.

    Parameters
    ----------
    array : AccelerometerArray
        The array.
    axis : TurningAxis
        The axis; without an inclination it is upright.
    time_s : float
        Time since the start, s.
    bias : float
        Standard deviation of the bias of each channel, m/s².
    noise_density : float
        White noise of each channel, one-sided density, m/s²/√Hz.
    bias_random_walk : float
        Random walk of each bias, m/s²/√s.
    rate_rad_s : float
        Steady rate, rad/s; 0 is at rest.
    hub_density : float
        Of a free hub, one-sided density of its own specific force in each direction, m/s²/√Hz.
    jerk : float
        Spectral density of the change of α that the filter allows for, rad²/s⁵.

    Raises
    ------
    GeometryError
        If the array can't see the rotation.
    InputError
        If the time is not positive, or so long that the turns can't be followed.
    """
    require_visible(array, axis)
    if not time_s > 0.0:
        raise InputError(f"time {time_s!r} s: give a time above 0")
    tilt = axis.inclination or 0.0
    count = int(max(2000, min(100.0 * time_s, _MOST_SAMPLES), _LEAST_PER_TURN * time_s * abs(rate_rad_s) / (2 * np.pi)))
    if count > 20 * _MOST_SAMPLES:
        raise InputError(f"{time_s:g} s at {rate_rad_s:g} rad/s are too many turns to follow; give a shorter time")
    t = np.linspace(0.0, time_s, count)
    dt = float(t[1])
    channels = AxisChannels.of(array, axis)
    c = array.n_channels
    y = readings_of(channels, tilt, rate_rad_s * t, np.full(count, rate_rad_s), np.zeros(count))
    none = np.zeros((c, c))
    slopes = Slopes(np.zeros((c, c, 3)), none, none, np.eye(c), np.zeros((c, 2)))
    white = max(noise_density, _LEAST_NOISE) ** 2 / (2.0 * dt)
    hub = hub_density**2 / (2.0 * dt) if axis.hub == "free" else 0.0
    run = filter_axis(
        t, y, channels.coefficients, gravity_of(tilt), np.full(c, white), hub, np.full(count, jerk),
        np.array([0.0, rate_rad_s, 0.0]), np.diag([1e-12, 1e-12, 1e-12]), slopes,
        np.zeros(0, dtype=np.int64), np.zeros((3, c)),
    )  # fmt: skip
    by_bias = run.by_constants[:, :2]  # (n, 2, c): of angle and rate
    end = np.linalg.norm(by_bias[-1], axis=1)
    walked = np.sqrt(dt * np.sum(by_bias**2, axis=(0, 2)))
    terms = []
    if bias > 0.0:
        terms.append(AxisDriftTerm("bias", f"{bias:.3g} m/s²", bias * float(end[1]), bias * float(end[0])))
    if noise_density > 0.0 or axis.hub == "free":
        std = np.sqrt(np.diag(run.covariances[-1]))
        size = f"{noise_density:.3g} m/s²/√Hz" + (f", hub {hub_density:.3g}" if axis.hub == "free" else "")
        terms.append(AxisDriftTerm("white noise", size, float(std[1]), float(std[0])))
    if bias_random_walk > 0.0:
        rate, turned = bias_random_walk * float(walked[1]), bias_random_walk * float(walked[0])
        terms.append(AxisDriftTerm("random walk of the bias", f"{bias_random_walk:.3g} m/s²/√s", rate, turned))
    return AxisDrift(array.name, axis, time_s, rate_rad_s, tuple(terms), _remark(tilt, rate_rad_s))


def _remark(tilt: float, rate: float) -> str:
    """Say what corrects angle and rate."""
    if abs(np.sin(tilt)) > 0.03:
        return "gravity turns in the body as the axis is inclined: it corrects the angle, which does not run off"
    if rate != 0.0:
        return "Ω² corrects the rate; nothing corrects the angle about an upright axis, which runs off with time"
    return (
        "at rest about an upright axis Ω² says nothing: rate and angle are integrals of the angular acceleration "
        "and run off with t and t²"
    )
