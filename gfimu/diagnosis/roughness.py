"""How rough the drive may be: a Gaussian prior on the third derivative of the rate in every knot interval.

It comes from the smoothed reference first and then from the drive itself, which knows the corners of ramps better.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter1d, uniform_filter1d
from scipy.sparse import csr_array, diags_array

from gfimu.diagnosis.data.run import Run
from gfimu.diagnosis.drive import AngleSpline, smooth_rate

__all__ = ["Roughness"]

_FACTOR = 6.0
_SMOOTHEST = 5.0
_ROUGH_FOR = 0.3  # s over which a drive is about as rough
_PEAK = 0.04  # s that a corner's sharpest part lasts
_PEAK_FACTOR = 2.0  # standard deviations of the prior to what a corner's sharpest part is
_CORNER = 0.1  # s of a drive over which its bend is averaged before knots are set


class Roughness:
    """Prior on the third derivative of the rate of a drive, per knot interval of its spline.

    Parameters
    ----------
    spline : AngleSpline
        The drive's spline with m coefficients.
    factor : float
        Multiplier of the whole prior.
    """

    def __init__(self, spline: AngleSpline, factor: float) -> None:
        self.spline, self.factor = spline, factor
        intervals = len(spline.widths)
        self._learned = np.zeros(intervals)
        self._corners = np.zeros(intervals)

    def on(self, spline: AngleSpline, *, corners: bool) -> Roughness:
        """Return what is learnt on other knots, the floor at corners too where asked."""
        other = Roughness(spline, self.factor)
        centres, known = spline.interval_centres(), self.spline.interval_centres()
        other._learned = np.interp(centres, known, self._learned)
        if corners:
            other._corners = np.interp(centres, known, self._corners)
        return other

    def learn(self, coefficients: NDArray[np.float64]) -> None:
        """Take the roughness from a drive with coefficients (m,)."""
        third = self.spline.roughness_rows() @ coefficients
        self._learned = _FACTOR * np.sqrt(self.spline.moving_average(third**2, _ROUGH_FOR))
        # Corners are no Gaussian noise: however stiff the drive is elsewhere, there it may bend as it does.
        corner = self.spline.widths < 0.75 * self.spline.spacing
        self._corners = np.where(corner, _PEAK_FACTOR * np.sqrt(self.spline.moving_average(third**2, _PEAK)), 0.0)

    def rough(self, coefficients: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return how rough a drive is around each knot interval, shape (m − 4,), rad/s⁴."""
        third = self.spline.roughness_rows() @ coefficients
        return np.asarray(np.sqrt(self.spline.moving_average(third**2, _CORNER)))

    def bend(self, coefficients: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return how sharply a drive bends at the ends of each knot interval, shape (m − 4,), rad/s⁴.

        The third derivative of its rate is constant within an interval: what changes from one to the next tells what
        the spline misses, little of a swift sine and all of a corner.
        """
        change = np.square(np.diff(self.spline.roughness_rows() @ coefficients))  # of a lone peak, twice its square
        ends = 0.5 * (np.append(change, 0.0) + np.insert(change, 0, 0.0))
        return np.asarray(np.sqrt(self.spline.moving_average(ends, _CORNER)))

    def scaled_rows(self, run: Run, *, is_angle: bool, reference_noise: float) -> tuple[csr_array, float]:
        """Return the third derivative in standard deviations of the prior, shape (m − 4, m), and Σ log of these.

        Parameters
        ----------
        run : Run
            The run; its smoothed reference tells where the motion is rough.
        is_angle : bool
            Whether the reference is an angle.
        reference_noise : float
            White noise of the reference, rad/s or rad.
        """
        std = _of_reference(run, self.spline, is_angle=is_angle, reference_noise=reference_noise, factor=self.factor)
        std = np.maximum(np.maximum(std, self.factor * self._learned), self._corners)
        return csr_array(diags_array(1.0 / std) @ self.spline.roughness_rows()), float(np.sum(np.log(std)))


def _of_reference(
    run: Run, spline: AngleSpline, *, is_angle: bool, reference_noise: float, factor: float
) -> NDArray[np.float64]:
    """Return the standard deviation that the smoothed reference suggests per knot interval, shape (m − 4,), rad/s⁴.

    Loose on ramps and stiff on plateaus, so that a ripple at constant speed is a discrepancy and not a motion.
    """
    period = run.sample_period
    rate = smooth_rate(run, is_angle=is_angle)
    third = np.gradient(np.gradient(np.gradient(rate, period), period), period)
    window = max(int(0.3 / period), 3)
    power = np.maximum(uniform_filter1d(third**2, window, mode="nearest"), 0.0)
    # What white noise of the reference alone gives after the same smoothing and differentiation.
    noise = np.random.default_rng(0).standard_normal(4096) * reference_noise
    smooth = gaussian_filter1d(noise, max(0.05 / period, 0.5))
    for _ in range(4 if is_angle else 3):
        smooth = np.gradient(smooth, period)
    power = np.maximum(power - 1.5 * float(np.mean(smooth[50:-50] ** 2)), 0.0)
    at_knots = np.interp(spline.interval_centres(), run.t, power)
    return factor * np.sqrt(_FACTOR**2 * at_knots + _SMOOTHEST**2)
