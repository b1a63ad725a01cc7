"""What one clock dates: a tachometer, an encoder angle or a gyro, or the channels of a logger."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from gfimu.base.errors import InputError
from gfimu.recording.joining.alignment import Alignment, align
from gfimu.recording.joining.basis import Basis, Readings
from gfimu.recording.quantities import GYRO_COLUMNS

__all__ = ["TABLE_COLUMNS", "ReferenceSeries", "align_series"]

TABLE_COLUMNS = ("tacho_rad_s", "command_rad_s", "angle_rad")
"""References of a table's rate or angle, the first that is there being used."""
_FEWEST = 8  # values of a reference


@dataclass(frozen=True)
class ReferenceSeries:
    """References, and channels of another logger, on a clock of their own.

    Parameters
    ----------
    source : str
        Where they come from, for messages.
    t_s : ndarray, shape (m,)
        Times, s, strictly increasing.
    columns : mapping of str to ndarray, shape (m,)
        References by their name in a recording, SI.
    origin_s : float
        Time on the file's clock at which ``t_s`` is zero, s.
    channels : mapping of str to ndarray, shape (m,)
        Accelerations of a logger by channel, m/s².
    """

    source: str
    t_s: NDArray[np.float64]
    columns: Mapping[str, NDArray[np.float64]]
    origin_s: float = 0.0
    channels: Mapping[str, NDArray[np.float64]] = field(default_factory=dict)

    @property
    def period(self) -> float:
        """Median step of the times, s."""
        return float(np.median(np.diff(self.t_s)))

    @property
    def gyro(self) -> NDArray[np.float64] | None:
        """Rates of a whole gyro, (m, 3), rad/s; None without one."""
        names = [name for name in GYRO_COLUMNS if name in self.columns]
        return np.column_stack([self.columns[name] for name in names]) if len(names) == 3 else None

    def basis(self) -> Basis:
        """Return the functions of the reference that the readings of a file on the same body are linear in.

        Raises
        ------
        InputError
            If there is neither a tachometer, an angle, a command, a whole gyro nor a channel.
        """
        name = next((one for one in TABLE_COLUMNS if one in self.columns), None)
        if name is not None:
            t, values = self._known(self.columns[name][:, None])
            is_angle = name == "angle_rad"
            return Basis.of_table(t, np.unwrap(values[:, 0]) if is_angle else values[:, 0], is_angle=is_angle)
        if self.gyro is None and not self.channels:
            raise InputError(
                f"{self.source}: no angular rate among {', '.join(self.columns) or 'its columns'}; "
                "a tachometer, angle, command, gyro of three axes or accelerations are needed"
            )
        known = [*([] if self.gyro is None else [self.gyro]), *(one[:, None] for one in self.channels.values())]
        t, values = self._known(np.column_stack(known))
        channels = dict(zip(self.channels, values[:, values.shape[1] - len(self.channels) :].T, strict=True))
        return Basis.of_body(t, None if self.gyro is None else values[:, :3], channels)

    def _known(self, values: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        rows = np.isfinite(values).all(axis=1)
        if rows.sum() < _FEWEST:
            raise InputError(f"{self.source}: only {int(rows.sum())} values of the reference; record longer")
        return self.t_s[rows], values[rows]


def align_series(first: ReferenceSeries, second: ReferenceSeries, *, most_rate_error: float = 0.02) -> Alignment | None:
    """Find the offset and the rate error between the clocks of a first logger and of a reference or a second logger.

    Returns None where nothing changes. Gyros count where both loggers have one.
    """
    basis, names, columns = second.basis(), [*first.channels], [*first.channels.values()]
    if second.channels and second.gyro is not None and first.gyro is not None:
        names += ["gyro1", "gyro2", "gyro3"]
        columns += [*first.gyro.T]
    names = names if second.channels else []
    readings = Readings.of(first.t_s, np.column_stack(columns), basis.step, names)
    return align(readings, basis, most_rate_error=most_rate_error)
