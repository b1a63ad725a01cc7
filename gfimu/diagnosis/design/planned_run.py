"""A recording that does not exist yet, as diagnosis would see it; and recordings at hand, beside it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from gfimu.base.units import STANDARD_GRAVITY
from gfimu.diagnosis.data.cosine_basis import NoiseLevels
from gfimu.diagnosis.data.run import Run
from gfimu.diagnosis.data.stretch import Stretch, make_stretches
from gfimu.diagnosis.fit.learn import starting_point
from gfimu.diagnosis.fit.linear import Point
from gfimu.diagnosis.policy import Policy
from gfimu.diagnosis.terms.drive import Drive
from gfimu.model.world_model import Spin, WorldModel

__all__ = ["PlannedRun", "planned", "recorded_stretches"]

_WARMING, _WARMING_TIME = 3.0, 15.0  # K, s: a board after power-on


@dataclass(frozen=True)
class PlannedRun:
    """A recording that does not exist yet.

    Parameters
    ----------
    spin : Spin
        Motion of the table.
    duration : float
        Length, s.
    sample_rate : float
        Samples per second, Hz.
    mounting : ndarray, shape (3,)
        Rotation vector by which the array is turned from upright, rad.
    reference_noise : float
        White noise of the reference at 100 Hz, rad/s (rad for an encoder).
    bias_instability : float
        Rms of the 1/f noise of each channel, m/s².
    """

    spin: Spin
    duration: float
    sample_rate: float = 100.0
    mounting: NDArray[np.float64] = field(default_factory=lambda: np.zeros(3))
    reference_noise: float = 0.02
    bias_instability: float = 0.15e-3 * STANDARD_GRAVITY

    def stretch(self, model: WorldModel, index: int) -> Stretch:
        """Return the run as diagnosis would see it, without noise in it."""
        t = np.arange(round(self.duration * self.sample_rate)) / self.sample_rate
        temperature = 25.0 + _WARMING * -np.expm1(-t / _WARMING_TIME)
        channels, reference = model.predict(self.spin, t, temperature=temperature, mounting=self.mounting)
        everywhere = np.ones(channels.shape, dtype=bool)
        run = Run(
            t, channels, everywhere, reference, everywhere[:, 0], temperature, self.mounting, 0, 1 / self.sample_rate
        )
        return Stretch(model, run, index, 0.0, start_angle=float(self.spin.at(t[:1]).angle[0]))

    def drive(self, stretch: Stretch, spacing: float) -> Drive:
        """Return the motion as the drive of its stretch, which is known, with the roughness that it has."""
        times, std = stretch.times(), np.inf if stretch.is_angle else stretch.start_angle_std
        knots = max(spacing, stretch.run.sample_period)
        still = Drive.still(times, float(stretch.run.t[0]), knots, stretch.start_angle, std)
        known = replace(still, coefficients=still.spline.through(self.spin))
        return known.relearned(np.zeros((known.spline.size, known.spline.size)))

    def levels(self, model: WorldModel, noise_rate: float | None = None) -> NoiseLevels:
        """Return the noise of its readings.

        Parameters
        ----------
        model : WorldModel
            The simulation.
        noise_rate : float, optional
            Sample rate of the real recording, Hz: a coarser time step than that keeps the noise's power density.
        """
        real_rate = self.sample_rate if noise_rate is None else noise_rate
        white = np.append(model.expected_noise(real_rate).white, self.reference_noise * np.sqrt(real_rate / 100.0))
        flicker = np.append(np.full(len(white) - 1, self.bias_instability), 0.0)
        return NoiseLevels(white * np.sqrt(self.sample_rate / real_rate), flicker)


def planned(
    model: WorldModel, runs: Sequence[PlannedRun], *, first: int = 0, noise_rate: float | None = None
) -> tuple[tuple[Stretch, ...], Point]:
    """Return planned runs as stretches, and the point at which these are linearised.

    Parameters
    ----------
    model : WorldModel
        The simulation.
    runs : sequence of PlannedRun
        The runs.
    first : int
        Number of the first one.
    noise_rate : float, optional
        As `PlannedRun.levels` takes it.
    """
    stretches = tuple(run.stretch(model, first + index) for index, run in enumerate(runs))
    spacing = Policy().knots
    drives = tuple(run.drive(stretch, spacing) for run, stretch in zip(runs, stretches, strict=True))
    return stretches, Point((), drives, tuple(run.levels(model, noise_rate) for run in runs))


def recorded_stretches(model: WorldModel, runs: Sequence[Run]) -> tuple[tuple[Stretch, ...], Point]:
    """Return recordings as stretches, and the point at which these are linearised: nothing but their references."""
    stretches = make_stretches(model, runs, [()] * len(runs))
    return stretches, starting_point(stretches, Policy().knots)
