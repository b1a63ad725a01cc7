"""What is known of a drive before the channels are looked at: how rough it may be, where the table stood at first."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import solveh_banded
from scipy.sparse import csr_array, diags_array

from gfimu.diagnosis.data.run import Run
from gfimu.diagnosis.drive import AngleSpline
from gfimu.diagnosis.drive_root import banded
from gfimu.diagnosis.roughness import Roughness

__all__ = ["DrivePrior"]


@dataclass(frozen=True)
class DrivePrior:
    """Gaussian prior of the m coefficients d of a drive.

    Parameters
    ----------
    spline : AngleSpline
        The drive's spline.
    rough : csr_array, shape (m − 4, m)
        Third derivative of the rate in standard deviations.
    log_roughness : float
        Σ log of these standard deviations.
    begin : csr_array, shape (1, m)
        Angle at the first sample in standard deviations; no rows where the reference is an angle.
    begin_at : ndarray, shape (1,)
        What it is known to be, in the same units.
    """

    spline: AngleSpline
    rough: csr_array
    log_roughness: float
    begin: csr_array
    begin_at: NDArray[np.float64]

    @classmethod
    def of_run(
        cls, roughness: Roughness, run: Run, *, is_angle: bool, reference_noise: float, start_angle: tuple[float, float]
    ) -> DrivePrior:
        """Return the prior of a stretch.

        Parameters
        ----------
        roughness : Roughness
            How rough the drive may be.
        run : Run
            The stretch.
        is_angle : bool
            Whether the reference is an angle.
        reference_noise : float
            White noise of the reference, rad/s or rad.
        start_angle : tuple of float
            Table angle at the first sample and its standard deviation, rad.
        """
        spline = roughness.spline
        rough, log_roughness = roughness.scaled_rows(run, is_angle=is_angle, reference_noise=reference_noise)
        first = run.t[: 0 if is_angle else 1]
        angle, std = start_angle
        return cls(
            spline, rough, log_roughness, csr_array(spline.matrices(first)[0] / std), np.full(len(first), angle / std)
        )

    @cached_property
    def precision(self) -> csr_array:
        """R, shape (m, m)."""
        return csr_array(self.rough.T @ self.rough + self.begin.T @ self.begin)

    def energy(self, coefficients: NDArray[np.float64]) -> tuple[float, NDArray[np.float64]]:
        """Return dᵀRd and −Rd (m,), about where the table stood."""
        # Differences first: the quadratic form of the coefficients would lose ten digits.
        rough, off = self.rough @ coefficients, self.begin @ coefficients - self.begin_at
        return float(rough @ rough + off @ off), -(self.rough.T @ rough) - self.begin.T @ off

    def with_reference(self, run: Run, *, is_angle: bool, reference_noise: float) -> NDArray[np.float64]:
        """Return the coefficients (m,) that the reference alone gives."""
        angle, rate, _ = self.spline.matrices(run.t)
        weight = diags_array(run.reference_valid / reference_noise**2)
        observe = angle if is_angle else rate
        lhs = banded(csr_array(observe.T @ weight @ observe + self.precision))
        lhs[0] *= 1 + 1e-14
        rhs = observe.T @ (weight @ run.reference) + self.begin.T @ self.begin_at
        return np.asarray(solveh_banded(lhs, rhs, lower=True))
