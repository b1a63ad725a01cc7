"""Whether what a simulation misses is a motion of the whole array: a test of its residual that needs no fit.

A small motion of the array beside the one that the simulation has, Ω = ω ẑ + δω, changes reading i by

    aᵢᵀ(δa + δα × rᵢ + ω (ẑ × (δω × rᵢ) + δω × (ẑ × rᵢ))),

nine columns, whatever the motion, the frame in which it is simple, and any filter, delay or gain common to all chips.
Combinations of the channels outside these columns show chips that disagree: nothing but a fault of single chips moves
them. Within them, two columns (tangential and centripetal arm) are a spin about the axis of the table, as an error of
the reference, its timing or the drive is; the others are the whole array in a motion that the simulation has not.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation
from scipy.stats import chi2

from gfimu.array.array import AccelerometerArray
from gfimu.base.declared import Declared, figure
from gfimu.diagnosis.criticism.views.dependence import BINS
from gfimu.diagnosis.data.body.stretch import BodyStretch
from gfimu.diagnosis.data.stretch import Stretch
from gfimu.diagnosis.fit.learn import starting_point
from gfimu.diagnosis.policy import Policy
from gfimu.diagnosis.terms.coloured_noise import FLICKER_GRID

__all__ = ["BandPower", "RigidMotion", "motion_columns", "rigid_motion"]

_SECOND_ORDER = 0.01  # numerical: share of a large motion's squares that its second order leaves outside the columns
_FRAME_SPREAD = 0.6  # numerical: standard deviation of the gain of a frame by noise, nats per root of samples


@dataclass(frozen=True)
class BandPower:
    """Power of the residual by frequency, for a picture.

    Parameters
    ----------
    frequency : ndarray, shape (k,)
        Middle of each band, Hz; what is constant is at the left end.
    chips, array, spin : ndarray, shape (k,)
        Mean power in units of the noise, in the combinations that no motion reaches, in those of the whole array, and
        in those of a spin about the axis; NaN where there is no such combination.
    """

    frequency: NDArray[np.float64]
    chips: NDArray[np.float64]
    array: NDArray[np.float64]
    spin: NDArray[np.float64]


@dataclass(frozen=True)
class RigidMotion(Declared):
    """How a residual divides into single chips, the whole array and a spin.

    Sizes are excesses of the squares over those of noise, at all frequencies and at low ones, in standard deviations,
    the error of the noise's level included. ``power`` is the same by frequency.
    """

    place: Annotated[
        str,
        figure(
            "Where the residual is made: chips, array or spin (neither of the others is seen); empty where that can't "
            "be tested."
        ),
    ]
    frame: Annotated[
        str,
        figure(
            "Frame in which a motion of the whole array is simpler, laboratory or body; empty where that can't be said."
        ),
    ]
    combinations: Annotated[int, figure("Combinations of channels that no motion reaches; 0: can't be tested.")]
    chips: Annotated[float, figure("Size of the part of single chips, in standard deviations.", key="chips_std")]
    chips_slow: Annotated[float, figure("Size of its slow part, in standard deviations.", key="chips_slow_std")]
    array: Annotated[
        float,
        figure("Size of the part of the whole array but a spin, in standard deviations.", key="array_std"),
    ]
    array_slow: Annotated[float, figure("Size of its slow part, in standard deviations.", key="array_slow_std")]
    power: BandPower

    @property
    def excesses(self) -> tuple[float, ...]:
        """All excesses, in standard deviations."""
        return self.chips, self.chips_slow, self.array, self.array_slow

    @property
    def sentence(self) -> str:
        """What it says, for people; empty where it says nothing."""
        return {
            "chips": (
                "The chips disagree in a way that no motion of the whole array makes: look at single chips, their "
                "calibration, clocks and wiring."
            ),
            "array": (
                "All chips agree on it as on a motion of the whole array that the simulation has not"
                f"{_FRAMES[self.frame]}."
            ),
            "spin": (
                "Neither a disagreement of the chips nor a motion of the array off its axis is seen beyond noise: look "
                "first at the reference, its timing, and what all chips and their supply have in common."
            ),
        }.get(self.place, "")


_FRAMES = {
    "": ": look at mounting, bearing, table, bench and floor",
    "laboratory": ", simpler in the frame of the laboratory: look at bearing, bench and floor",
    "body": ", simpler in the frame that turns: look at the mounting, the cable and what is fixed to the table",
}


def rigid_motion(stretches: Sequence[Stretch], policy: Policy = Policy()) -> RigidMotion | None:
    """Divide the residual of a simulation, driven by its reference alone, into single chips, whole array and spin.

    Parameters
    ----------
    stretches : sequence of Stretch
        The data. Of a free body nothing can be said: it has a motion that nobody knows.
    policy : Policy
        Threshold ``excess_stds``.
    """
    first = stretches[0]
    if isinstance(first, BodyStretch):
        return None
    alive = np.any([stretch.run.valid.any(axis=0) for stretch in stretches], axis=0)
    point = starting_point(stretches, policy.knots)
    parts = []
    for stretch, drive in zip(stretches, point.drives, strict=True):
        left = np.where(stretch.mask, stretch.measured - stretch.predict([], drive.spin), 0.0)[:, :-1]
        state = stretch.motion(stretch.known, drive.spin).at(stretch.run.t)
        parts.append(_Part.of(stretch, left, np.asarray(state.angle), alive, policy))
    combinations = parts[0].chips.values.shape[1]
    chips = _excess([part.chips for part in parts], combinations)
    array = _excess([part.array for part in parts], combinations)
    place = ""
    if combinations and np.isfinite([*chips, *array]).all():
        squares = [
            sum(share.squares for share in each) for each in zip(*((p.chips, p.array) for p in parts), strict=True)
        ]
        apart = max(chips) > policy.excess_stds and squares[0] > _SECOND_ORDER * squares[1]
        place = "chips" if apart else "array" if max(array) > policy.excess_stds else "spin"
    simpler = sum(part.simpler for part in parts) / float(np.sqrt(sum(part.samples for part in parts)))
    frame = ""
    if place == "array" and abs(simpler) > policy.excess_stds * _FRAME_SPREAD:
        frame = "laboratory" if simpler > 0.0 else "body"
    return RigidMotion(place, frame, combinations, *chips, *array, _by_band(parts))


def motion_columns(array: AccelerometerArray, mounting: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return what the channels read of small motions of an array that turns about z, shape (c, 9).

    Parameters
    ----------
    array : AccelerometerArray
        The array.
    mounting : ndarray, shape (3, 3)
        Rotation matrix from the body to the table.

    Returns
    -------
    ndarray, shape (c, 9)
        Per acceleration (3), per angular acceleration (3), and per rate times the change of it about z, x, y (3).
    """
    axes, places = array.axes @ mounting.T, array.positions @ mounting.T  # (c, 3)
    z = np.array([0.0, 0.0, 1.0])
    columns = [*axes.T]
    columns += [np.sum(axes * np.cross(unit, places), axis=1) for unit in np.eye(3)]
    for unit in np.eye(3)[[2, 0, 1]]:
        change = np.cross(z, np.cross(unit, places)) + np.cross(unit, np.cross(z, places))
        columns.append(np.sum(axes * change, axis=1))
    return np.column_stack(columns)


@dataclass(frozen=True)
class _Share:
    """Cosines (n, k) of some combinations in units of white noise, and the variance (n,) of noise there."""

    values: NDArray[np.float64]
    variance: NDArray[np.float64]
    slow: NDArray[np.bool_]

    @property
    def squares(self) -> float:
        """Excess of the squares over those of noise, where it shows most: at all frequencies or below the limit."""
        return max(float(self.excess()[:, 0].max()), 0.0)

    def excess(self) -> NDArray[np.float64]:
        """Return the excess of squares and their number, all (first row) and below the limit (second)."""
        each = np.sum(self.values**2 / self.variance[:, None] - 1.0, axis=1)
        count = self.values.shape[1]
        return np.array([[each.sum(), count * len(each)], [each[self.slow].sum(), count * self.slow.sum()]])


@dataclass(frozen=True)
class _Part:
    """One stretch."""

    frequency: NDArray[np.float64]
    chips: _Share
    array: _Share
    spin: _Share
    simpler: float
    samples: int

    @classmethod
    def of(
        cls,
        stretch: Stretch,
        left: NDArray[np.float64],
        angle: NDArray[np.float64],
        alive: NDArray[np.bool_],
        policy: Policy,
    ) -> _Part:
        """Divide the residual (n, c) of a stretch, the table at ``angle`` (n,), its channels ``alive`` (c,)."""
        period, n = stretch.run.sample_period, len(stretch.run.t)
        white = stretch.model.expected_noise(stretch.run.output_data_rate).white[alive]
        mounting = Rotation.from_rotvec(stretch.run.mounting).as_matrix()
        columns = motion_columns(stretch.model.array, mounting)[alive] / white[:, None]
        frequency = np.arange(n) / (2.0 * n * period)
        cosines = stretch.basis.transform(left[:, alive] / white)  # (n, c)
        spin, array, chips = (cosines @ basis for basis in _bases(columns))
        flicker = stretch.basis.spectrum_of_flicker(n) / np.median(white) ** 2
        variance = _noise(chips, flicker, len(stretch.basis.frequency), policy)
        slow = np.arange(n) < len(stretch.basis.frequency)
        motion = (left[:, alive] / white) @ columns @ np.linalg.pinv(columns.T @ columns)  # (n, 9)
        return cls(
            frequency,
            _Share(chips, variance, slow),
            _Share(array, variance, slow),
            _Share(spin, variance, slow),
            _simpler(motion[:, 0] + 1j * motion[:, 1], angle),
            n,
        )


def _bases(columns: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Return orthonormal bases of a spin, of other motions and of what no motion reaches, from columns (c, 9)."""
    spin, _ = np.linalg.qr(columns[:, [5, 6]])  # tangential and centripetal arm
    rest = columns - spin @ (spin.T @ columns)
    left, _, _ = np.linalg.svd(rest, full_matrices=False)
    array = left[:, : np.linalg.matrix_rank(rest)]
    whole = np.hstack([spin, array])
    basis, _ = np.linalg.qr(np.hstack([whole, np.eye(len(columns))]))
    return spin, array, basis[:, whole.shape[1] :]


def _noise(chips: NDArray[np.float64], flicker: NDArray[np.float64], slow: int, policy: Policy) -> NDArray[np.float64]:
    """Return the variance (n,) of noise, learnt from what no motion reaches: white noise, and bounded slow noise."""
    levels = FLICKER_GRID[policy.largest_flicker >= FLICKER_GRID]
    if not chips.shape[1]:
        return np.ones(len(flicker)) + flicker * policy.usual_flicker**2
    white = np.median(chips[slow:] ** 2) / chi2.median(1)
    squares, count = np.sum(chips[:slow] ** 2, axis=1), chips.shape[1]

    def misfit(level: float) -> float:
        variance = white + flicker[:slow] * level**2
        # What is larger than noise ever is must not pass for slow noise.
        return float(np.sum(count * np.log(variance) + np.minimum(squares / variance, count * policy.noise_stds**2)))

    return np.asarray(white + flicker * min(levels, key=misfit) ** 2)


def _simpler(motion: NDArray[np.complex128], angle: NDArray[np.float64]) -> float:
    """Return by how much the spectrum of a horizontal motion (n,) is simpler in the laboratory than in the body, nats.

    Noise has the same spectrum in each frame; a motion has its power at few frequencies in the frame that it is of.
    """
    return _peaked(motion * np.exp(1j * angle)) - _peaked(motion)


def _peaked(motion: NDArray[np.complex128]) -> float:
    power = np.abs(np.fft.fft(motion)) ** 2 / len(motion)
    width = 5  # numerical: frequencies that are smoothed over
    wide = np.concatenate([power[-(width // 2) :], power, power[: width // 2]])
    smooth = np.convolve(wide, np.ones(width) / width, "valid")
    return -float(np.sum(np.log(np.maximum(smooth, 1e-300))))


def _excess(shares: Sequence[_Share], combinations: int) -> tuple[float, float]:
    """Return the excess of all stretches in standard deviations, at all frequencies and below the limit.

    Of N squares the sum errs by √(2N), and by N times the relative error of the variance that they are compared with,
    which is learnt from the combinations that no motion reaches.
    """
    total = np.sum([share.excess() for share in shares], axis=0)
    samples = sum(len(share.values) for share in shares)
    median = chi2.median(1)
    level = (2.0 * median * chi2.pdf(median, 1)) ** -2 / max(samples * combinations, 1.0)  # of a median
    whole, slow = total[:, 0] / np.sqrt(np.maximum(2.0 * total[:, 1] + total[:, 1] ** 2 * level, 1.0))
    return float(whole), float(slow)


def _by_band(parts: Sequence[_Part]) -> BandPower:
    """Return the mean power by bands of frequency that grow with it, the first of what is constant."""
    part = max(parts, key=lambda one: one.samples)
    count = len(part.frequency)
    edges = np.unique(np.concatenate([[0, 1], np.geomspace(2, count, BINS).astype(int)]))
    starts = edges[:-1]
    frequency = part.frequency[-1] / count * np.sqrt(np.maximum(starts, 0.5) * edges[1:])

    def power(share: _Share) -> NDArray[np.float64]:
        if not share.values.shape[1]:
            return np.full(len(starts), np.nan)
        each = np.mean(share.values**2, axis=1) / share.variance
        return np.add.reduceat(each[: edges[-1]], starts) / np.diff(edges)

    return BandPower(frequency, power(part.chips), power(part.array), power(part.spin))
