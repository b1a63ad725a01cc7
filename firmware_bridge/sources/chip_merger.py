"""Chips with sample clocks of their own on one time base: brought to the sample times of the first, as they come.

Between its samples a chip is interpolated by a cubic spline, as the files of several chips are
(`gfimu.recording.importing.piece`). What that adds is known: the spline's frequency response on a uniform grid (Unser,
IEEE Signal Processing Magazine 16(6):22, 1999).
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

__all__ = ["ChipMerger", "noise_factor", "spline_error"]

_MARGIN = 16  # samples around a place after which a spline's end no longer shows: (2 − √3)^16 = 7e-10
_LONGEST_WAIT_S = 1.0  # for a chip that is behind; then its readings are missing
_MOST_IMAGES = 50
_GAP = 1.5  # sample periods


def _responses(frequency: NDArray[np.float64]) -> NDArray[np.float64]:
    """Gains (m, 2k + 1) of the cubic spline for the images of frequencies (m,), cycles per sample; k is the signal."""
    images = np.asarray(frequency)[:, None] + np.arange(-_MOST_IMAGES, _MOST_IMAGES + 1)
    kernel = np.sinc(images) ** 4
    return np.asarray(kernel / kernel.sum(axis=1, keepdims=True))


def spline_error(frequency: NDArray[np.float64] | float) -> NDArray[np.float64]:
    """Error (m,) of an interpolated sinusoid relative to it, rms over all phases; frequency (m,) in cycles a sample."""
    gains = _responses(np.atleast_1d(np.asarray(frequency, dtype=float)))
    gains[:, _MOST_IMAGES] -= 1.0
    return np.asarray(np.sqrt((gains**2).sum(axis=1)))


def noise_factor() -> float:
    """Rms of white noise after interpolation to times of all phases, relative to before: 0.935."""
    middles = (np.arange(2000) + 0.5) / 2000 - 0.5
    return float(np.sqrt((_responses(middles) ** 2).sum(axis=1).mean()))


def _one_percent() -> float:
    """Highest frequency, cycles a sample, at which the error is 1 %."""
    frequency = np.linspace(0.0, 0.5, 2001)
    return float(frequency[np.searchsorted(spline_error(frequency), 0.01) - 1])


class _Chip:
    """Samples of one chip that may still be needed, and its mean period."""

    def __init__(self) -> None:
        self.t_s: NDArray[np.float64] = np.empty(0)
        self.readings: NDArray[np.float64] = np.empty((0, 3))
        self._steps_s, self._steps = 0.0, 0

    def add(self, t_s: NDArray[np.float64], readings: NDArray[np.float64]) -> None:
        steps = np.diff(t_s, prepend=self.t_s[-1:])
        if len(steps):
            regular = steps[steps < _GAP * np.median(steps)]
            self._steps_s += float(regular.sum())
            self._steps += len(regular)
        self.t_s = np.concatenate([self.t_s, t_s])
        self.readings = np.concatenate([self.readings, readings])

    def at(self, t_s: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the readings (m, 3) at other times (m,); NaN in gaps and outside."""
        from gfimu.recording.importing.piece import at_times  # see `ChipMerger`

        if not len(t_s):
            return np.empty((0, 3))
        return np.column_stack([at_times(t_s, self.t_s, column) for column in self.readings.T])

    def drop_before(self, place: int) -> None:
        self.t_s, self.readings = self.t_s[max(place, 0) :], self.readings[max(place, 0) :]

    @property
    def rate_hz(self) -> float:
        return self._steps / self._steps_s if self._steps else np.nan


class ChipMerger:
    """Brings tri-axial chips, each with sample times of its own on one time base, to the times of the first.

    Parameters
    ----------
    names : tuple of str
        Names of the chips; the first gives the times.
    """

    def __init__(self, names: tuple[str, ...]) -> None:
        self.names = names
        self._chips = [_Chip() for _ in names]
        self._have_begun = False
        if len(names) > 1:  # both take seconds, for which no sample should wait
            import scipy.interpolate  # noqa: F401

            import gfimu.recording.importing.piece  # noqa: F401

    def start_anew(self) -> None:
        """Forget the samples that wait: the stream was broken; the rates stay."""
        for chip in self._chips:
            chip.drop_before(len(chip.t_s))

    def newest_s(self, chip: int) -> float:
        """Time of the newest sample of a chip, s; −∞ before one has come."""
        times = self._chips[chip].t_s
        return float(times[-1]) if len(times) else -np.inf

    def add(self, chip: int, t_s: NDArray[np.float64], readings: NDArray[np.float64]) -> None:
        """Take samples of a chip: times (n,), s, increasing, and readings (n, 3), m/s²."""
        self._chips[chip].add(t_s, readings)

    def take(self, *, rest: bool = False) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return what is complete: times (n,), s, of the first chip and the readings (n, 3 k) of all, m/s².

        A chip that is behind by more than a second is missing (NaN) in the samples that waited for it; with ``rest``,
        at the end of a stream, nothing waits any more.
        """
        first, *others = self._chips
        if not len(first.t_s) or not (self._have_begun or all(len(chip.t_s) for chip in others)):
            return np.empty(0), np.empty((0, 3 * len(self._chips)))
        until = min([float(first.t_s[-1]), *(_settled_s(chip.t_s) for chip in others)])
        until = max(until, float(first.t_s[-1]) - (0.0 if rest else _LONGEST_WAIT_S))
        end = int(np.searchsorted(first.t_s, until, side="right"))
        t_s, mine = first.t_s[:end], first.readings[:end]
        readings = np.column_stack([mine, *(chip.at(t_s) for chip in others)])
        start = 0
        if not self._have_begun:
            start = int(np.searchsorted(t_s, max((float(chip.t_s[0]) for chip in others), default=-np.inf)))
            self._have_begun = start < end
        first.drop_before(end)
        for chip in others if end else ():
            chip.drop_before(int(np.searchsorted(chip.t_s, t_s[-1])) - _MARGIN)
        return t_s[start:], readings[start:]

    def facts(self) -> dict[str, Any]:
        """Rates of the chips, how much they differ, and what the interpolation adds, for the metadata."""
        rates = {name: chip.rate_hz for name, chip in zip(self.names, self._chips, strict=True)}
        stated: dict[str, Any] = {"chip_rates_hz": {name: float(rate) for name, rate in rates.items()}}
        if len(self.names) > 1:
            ratios = {name: float(rate / rates[self.names[0]]) for name, rate in rates.items()}
            stated["chip_rate_ratios"] = ratios
            stated["chip_times_of"] = self.names[0]
            stated["chip_interpolation"] = "cubic spline"
            stated["interpolation_error_1_percent_hz"] = {
                name: _one_percent() * float(rate) for name, rate in rates.items() if name != self.names[0]
            }
            stated["interpolation_noise_factor"] = noise_factor()
        return stated


def _settled_s(times: NDArray[np.float64]) -> float:
    """Time up to which samples that are still to come no longer change the spline, s."""
    return float(times[-1 - _MARGIN]) if len(times) > _MARGIN else -np.inf
