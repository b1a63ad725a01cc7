"""Functions of the motion, the angle and time on every channel and on the reference, causes projected out."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from gfimu.diagnosis.criticism.drive_noise import apart_from_noise, expected_score_of_causes
from gfimu.diagnosis.data.stretch import Stretch
from gfimu.diagnosis.fit.evidence import SCALES, inverse
from gfimu.diagnosis.fit.linear import Point, linearise
from gfimu.diagnosis.fit.posterior import Posterior
from gfimu.diagnosis.terms.cause import effects_of
from gfimu.diagnosis.terms.columns import Columns
from gfimu.diagnosis.terms.drive import Drive
from gfimu.diagnosis.terms.library import cause_columns
from gfimu.model.generic_basis import Motion
from gfimu.model.world_model import BasisUnits, SpinState

__all__ = [
    "FEWEST_CYCLES",
    "LEAST_INFORMATION",
    "REFERENCE",
    "UNIT",
    "basis_units",
    "functions_at",
    "judges_reference",
    "motion_of",
    "series_products",
]

REFERENCE = "the reference"
"""What the tachometer, encoder or command is called beside the channels."""
UNIT = 0.03
"""What a function of order one is worth in the evidence, m/s² (of the reference rad/s or rad): usual white noise.

Numerical: the evidence averages over scales of a hundredth to thirty of it.
"""

FEWEST_CYCLES = 10
"""Numerical: of a tone in a run; slow functions follow what is slower."""
LEAST_INFORMATION = 1e-9
"""Numerical: of a function that is usable at all."""

ValuesOf = Callable[[Stretch, Posterior], NDArray[np.float64]]


def judges_reference(stretches: Sequence[Stretch]) -> bool:
    """Whether the residual of the reference is noise where nothing is wrong: fine steps of a measurement.

    A command is followed as well as the motor can, and errors of coarse steps do not average out.
    """
    return all(one.model.drive_source not in ("command", "gyro") and not one.steps.reference for one in stretches)


def basis_units(stretches: Sequence[Stretch], point: Point) -> BasisUnits:
    """Return the largest rate and acceleration of all drives, and the duration of the longest run."""
    states = [drive.spin.at(stretch.run.t) for stretch, drive in zip(stretches, point.drives, strict=True)]
    return BasisUnits(
        max(1e-6, *(float(np.abs(state.rate).max()) for state in states)),
        max(1e-6, *(float(np.abs(state.acceleration).max()) for state in states)),
        max(1e-9, *(float(stretch.run.t[-1] - stretch.start) for stretch in stretches)),
    )


def motion_of(stretch: Stretch, point: Point, drive: Drive) -> SpinState:
    """Return the table's motion at the samples of a stretch."""
    effects = effects_of(point.causes, stretch.model.array, stretch.index)
    return stretch.motion(effects, drive.spin).at(stretch.run.t)


def functions_at(stretch: Stretch, state: SpinState, units: BasisUnits) -> Motion:
    """Return motion and time since the run began as the functions of the generic basis take them."""
    return Motion.of(state, stretch.run.t - stretch.start, units)


def series_products(
    stretches: Sequence[Stretch], point: Point, values_of: ValuesOf, expected_of: ValuesOf | None = None
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return G and b of k functions on each channel and the reference; drives, slow noise and causes projected out.

    Parameters
    ----------
    stretches : sequence of Stretch
        The data.
    point : Point
        A fit.
    values_of : callable
        From a stretch and its posterior to the functions (n, k), or to those of each series (c + 1, n, k).
    expected_of : callable, optional
        From a stretch and its posterior to the scores (c + 1, k) that the noise of the drive makes
        (`gfimu.diagnosis.criticism.drive_noise`); a share of them is taken off.

    Returns
    -------
    gram : ndarray, shape ((c + 1) k, (c + 1) k)
        G, series by series.
    score : ndarray, shape ((c + 1) k,)
        b.
    """

    def columns(stretch: Stretch, at: Posterior) -> Columns:
        named = cause_columns(stretch, at.observed, at.drive, point.causes)
        return Columns.together([named, _by_series(values_of(stretch, at), at.observed.weight)])

    linear = linearise(stretches, point, columns, responses=False)
    named = sum(cause.unknowns for cause in point.causes)
    gram, score = linear.gram, linear.score
    expected = np.zeros(len(score))
    if expected_of is not None:
        for stretch, at in zip(stretches, linear.posteriors, strict=True):
            expected[named:] += np.ravel(expected_of(stretch, at))
            expected[:named] += expected_score_of_causes(stretch, at, point.causes)
    if not named:
        return gram, apart_from_noise(score, expected, gram)
    # The causes are free: they have the widest prior that a fit gives them.
    covariance = inverse(gram[:named, :named] + np.eye(named) / SCALES[-1] ** 2)
    gain = covariance @ gram[:named, named:]
    score, expected = (one[named:] - gain.T @ one[:named] for one in (score, expected))
    gram = gram[named:, named:] - gram[named:, :named] @ gain
    return gram, apart_from_noise(score, expected, gram)


def _by_series(values: NDArray[np.float64], weight: NDArray[np.float64]) -> Columns:
    """Return functions (n, k) or (c + 1, n, k) as columns of each series, its samples weighted by (n, c + 1)."""
    each = np.broadcast_to(values, (weight.shape[1], *values.shape[-2:]))
    count = values.shape[-1]
    places = tuple(np.arange(series * count, (series + 1) * count) for series in range(len(each)))
    parts = tuple(mine * weight[:, [series]] for series, mine in enumerate(each))
    return Columns(count * len(each), places, parts)
