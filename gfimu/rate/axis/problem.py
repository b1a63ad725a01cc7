"""The readings of a run about an axis, and the filter's run over them at given settings."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from gfimu.base.units import STANDARD_GRAVITY
from gfimu.rate.axis.channels import AxisChannels
from gfimu.rate.axis.recursion import FilterRun, Slopes, filter_axis

__all__ = ["AxisProblem", "Settings", "no_slopes"]


@dataclass(frozen=True)
class Settings:
    """Numbers that the filter runs with.

    Parameters
    ----------
    noise_scale : float
        Standard deviation of the channels over that of their data sheets.
    jerk : float
        Spectral density of the change of α, rad²/s⁵.
    hub : float
        Standard deviation of the axis's own specific force, m/s²; 0 where it stands still.
    inclination : float
        Angle between axis and vertical, rad.
    """

    noise_scale: float
    jerk: float
    hub: float
    inclination: float

    @property
    def gravity(self) -> NDArray[np.float64]:
        """Gravity along the axis and across it, shape (2,), m/s²."""
        return STANDARD_GRAVITY * np.array([np.cos(self.inclination), np.sin(self.inclination)])


@dataclass(frozen=True)
class AxisProblem:
    """Readings with what is known of their channels.

    Parameters
    ----------
    t, y : ndarray, shapes (n,) and (n, c)
        Times, s, and readings, m/s²; NaN where one is missing.
    channels : AxisChannels
        What the channels read.
    noise : ndarray, shape (c,)
        Standard deviation of the channels by their data sheets, m/s².
    mirrored : ndarray, shape (k,)
        Samples before which the sign of the rate is changed (`gfimu.rate.axis.mirror`), ascending.
    roughness : ndarray, shape (n,), optional
        How many times rougher than `Settings.jerk` the motion is before each sample (`gfimu.rate.axis.roughness`);
        everywhere as rough by default.
    """

    t: NDArray[np.float64]
    y: NDArray[np.float64]
    channels: AxisChannels
    noise: NDArray[np.float64]
    mirrored: NDArray[np.int64] = field(default_factory=lambda: np.zeros(0, dtype=np.int64))
    roughness: NDArray[np.float64] | None = None

    def likelihood(
        self, settings: Settings, start: NDArray[np.float64], covariance: NDArray[np.float64], samples: int
    ) -> float:
        """Return the log likelihood of the first samples; −∞ where the filter runs off."""
        found = self.run(settings, start, covariance, samples=samples).likelihood
        return float(found) if np.isfinite(found) else -np.inf

    def run(
        self,
        settings: Settings,
        start: NDArray[np.float64],
        covariance: NDArray[np.float64],
        *,
        slopes: Slopes | None = None,
        samples: int | None = None,
    ) -> FilterRun:
        """Return the filter's run over the first samples, or all."""
        return filter_axis(
            self.t[:samples],
            self.y[:samples],
            self.channels.coefficients,
            settings.gravity,
            (settings.noise_scale * self.noise) ** 2,
            settings.hub**2,
            settings.jerk * (np.ones(len(self.t)) if self.roughness is None else self.roughness)[:samples],
            start,
            covariance,
            no_slopes(self.y.shape[1]) if slopes is None else slopes,
            self.mirrored,
            np.zeros((3, 0 if slopes is None else len(slopes.offset))),
        )

    def part(self, rows: slice) -> AxisProblem:
        """Return some of the samples, in which no sign is changed."""
        rough = None if self.roughness is None else self.roughness[rows]
        return AxisProblem(self.t[rows], self.y[rows], self.channels, self.noise, roughness=rough)


def no_slopes(channels: int) -> Slopes:
    """Return the derivatives by no uncertain constant at all."""
    none = np.zeros((0, channels))
    return Slopes(np.zeros((0, channels, 3)), none, none, none, np.zeros((0, 2)))
