"""The table's motion over a stretch of a run: a spline, a prior of how rough it is, and where its knots are."""

from __future__ import annotations

from abc import ABC, abstractmethod
from copy import copy
from dataclasses import replace
from typing import Self

import numpy as np
from numpy.typing import NDArray

from gfimu.diagnosis.coloured_noise import NoiseLevels
from gfimu.diagnosis.data.rounding import Steps
from gfimu.diagnosis.data.run import Run
from gfimu.diagnosis.drive import AngleSpline
from gfimu.diagnosis.drive_prior import DrivePrior
from gfimu.diagnosis.knots import KNOT_SPACING, intervals_to_cut
from gfimu.diagnosis.roughness import Roughness
from gfimu.world_model import Spin

__all__ = ["TIME_MARGIN", "SplineDrive"]

TIME_MARGIN = 0.5
"""How far the drive reaches beyond the samples, s: late chips and fast clocks ask for the motion there."""
_START_FACTOR = 2.0  # of the roughness prior, before the data have chosen
_FINEST_ANGLE = 2e-5  # rad
_FINEST_RATE = 1e-4  # rad/s, and of the spread of the rate
_MOST_CUTS_BY_REFERENCE = 3
_BEYOND_CHANCE = 3.0  # times what noise alone, drawn once, bends the drive of the reference by
_REST_FACTOR = 1.3


class SplineDrive(ABC):
    """The drive of one stretch, which its reference and what follows it bend.

    Parameters
    ----------
    run : Run
        The stretch.
    times : ndarray
        All times at which the motion is asked for, s.
    is_angle : bool
        Whether the reference is an angle.
    start_angle, start_angle_std : float
        Table angle at the first sample and its standard deviation, rad.
    """

    rounding: Steps
    levels: NoiseLevels

    def __init__(
        self, run: Run, times: NDArray[np.float64], *, is_angle: bool, start_angle: float, start_angle_std: float
    ) -> None:
        self.run, self.is_angle = run, is_angle
        self.start_angle, self.start_angle_std = start_angle, start_angle_std
        spacing = max(KNOT_SPACING, run.sample_period)
        margin = max(TIME_MARGIN, 2 * spacing)
        spline = AngleSpline.uniform(times.min() - margin, times.max() + margin, spacing)
        self._take(Roughness(spline, _START_FACTOR))
        # Fits are compared under the same knots, so these are chosen once.
        self.knots_chosen = False

    @property
    def coefficients(self) -> NDArray[np.float64]:
        """The drive's spline coefficients, shape (m,)."""
        return self._coefficients

    @coefficients.setter
    def coefficients(self, values: NDArray[np.float64]) -> None:
        self._coefficients = values
        self.spin = self.spline.spin(values)

    def _take(self, roughness: Roughness) -> None:
        """Use a prior of the drive and its spline."""
        self.roughness, self.spline = roughness, roughness.spline

    @property
    def finest(self) -> float:
        """Noise below which a spline can't follow the reference, and which no part keeps to, rad/s or rad."""
        return _FINEST_ANGLE if self.is_angle else _FINEST_RATE * (1.0 + self._reference_spread)

    @property
    def _reference_noise(self) -> float:
        return self.rounding.reference_noise(float(self.levels.white[-1]))

    def _set_prior(self) -> None:
        self.drive_prior = DrivePrior.of_run(
            self.roughness,
            self.run,
            is_angle=self.is_angle,
            reference_noise=self._reference_noise,
            start_angle=(self.start_angle, self.start_angle_std),
        )

    def _start(self) -> None:
        """Take the drive that the reference alone gives, once its noise is known."""
        self._set_prior()
        self.coefficients = self._reference_drive = self._reference_alone(self.run)

    def _reference_alone(self, run: Run) -> NDArray[np.float64]:
        return self.drive_prior.with_reference(run, is_angle=self.is_angle, reference_noise=self._reference_noise)

    def _follow(self, spin: Spin, roughness: Roughness) -> None:
        """Take the drive that comes closest to a motion, on other knots."""
        self._take(roughness)
        self._set_prior()
        self.coefficients = self.following(spin)
        self._reference_drive = self._reference_alone(self.run)

    @property
    def at_rest(self) -> bool:
        """Whether the reference shows no more than its noise."""
        return self._reference_spread < _REST_FACTOR * self._reference_noise

    @property
    def _reference_spread(self) -> float:
        known = self.run.reference_valid
        return float(np.std(self.run.reference[known])) if known.any() else 0.0

    def learn_roughness(self) -> None:
        """Take the roughness from the present drive, which knows the corners of ramps better than the reference."""
        self.roughness.learn(self.coefficients)
        self._set_prior()

    def sharpen(self) -> bool:
        """Cut the knot intervals where the drive bends faster than they follow; tells whether any was cut."""
        return not self.knots_chosen and self._cut(self.roughness.bend(self.coefficients))

    def sharpen_by_reference(self) -> bool:
        """Do the same by the drive of the reference alone, which nothing wrong with the channels bends."""
        if self.knots_chosen:
            return False
        rng = np.random.default_rng(0)
        cuts = 0
        while cuts < _MOST_CUTS_BY_REFERENCE:
            noise = self._reference_noise * rng.standard_normal(len(self.run.t))
            # Of noise what changes from interval to interval stands out more than of a motion.
            by_chance = self.roughness.rough(self._reference_alone(replace(self.run, reference=noise)))
            bend = self.roughness.rough(self._reference_drive)
            self.coefficients = self._reference_drive
            if not self._cut(np.sqrt(np.maximum(bend**2 - (_BEYOND_CHANCE * by_chance) ** 2, 0.0))):
                break
            cuts += 1
        return cuts > 0

    def _cut(self, bend: NDArray[np.float64]) -> bool:
        """Cut the knot intervals that miss something of a drive which bends so sharply around each, rad/s⁴."""
        chosen = intervals_to_cut(
            self.spline.widths,
            bend,
            sample_period=self.run.sample_period,
            acuity=self._acuity(),
            reference_noise=self._reference_noise,
            is_angle=self.is_angle,
        )
        if chosen.any():
            self._follow(self.spin, self.roughness.on(self.spline.halved(chosen), corners=False))
        return bool(chosen.any())

    def uncut(self) -> None:
        """Put the knots of the drive at their usual distance again, at the present drive."""
        spacing = max(KNOT_SPACING, self.run.sample_period)
        spline = AngleSpline.uniform(self.spline.start, self.spline.stop, spacing)
        self._follow(self.spin, self.roughness.on(spline, corners=False))

    def coarser(self, spacing: float) -> Self:
        """Return a copy whose knots are all ``spacing`` s apart, at the present drive."""
        other = copy(self)
        spline = AngleSpline.uniform(self.spline.start, self.spline.stop, spacing)
        other._follow(self.spin, self.roughness.on(spline, corners=False))
        return other

    def following(self, spin: Spin) -> NDArray[np.float64]:
        """Return the coefficients (m,) of the drive that comes closest to a motion."""
        step = min(self.run.sample_period, 0.5 * float(self.spline.widths.min()))
        # Beyond the ends too: late chips ask for the motion there.
        reach = np.arange(self.spline.start, self.spline.stop, step)
        return self.spline.through(reach, spin.at(reach))

    @abstractmethod
    def _acuity(self) -> float:
        """Return how well one sample of all channels tells the angular acceleration, s²/rad."""
