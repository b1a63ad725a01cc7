"""A reference with times of its own: tachometer, encoder angle or gyro in a file that holds no channels."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import cumulative_trapezoid
from scipy.interpolate import CubicHermiteSpline, CubicSpline

from gfimu.base.errors import InputError
from gfimu.base.files.input_file import is_there
from gfimu.recording.importing import ColumnMap, load_map
from gfimu.recording.importing.recognise import map_hint
from gfimu.recording.mapped import mapped_reference
from gfimu.recording.quantities import GYRO_COLUMNS, REFERENCE_UNITS
from gfimu.recording.tables.column_file import open_columns

__all__ = ["ReferenceSeries", "open_reference"]


@dataclass(frozen=True)
class ReferenceSeries:
    """References on a clock of their own.

    Parameters
    ----------
    source : str
        Where they come from, for messages.
    t_s : ndarray, shape (m,)
        Times, s, strictly increasing.
    columns : mapping of str to ndarray, shape (m,)
        By their name in a recording, SI.
    origin_s : float
        Time on the file's clock at which ``t_s`` is zero, s.
    """

    source: str
    t_s: NDArray[np.float64]
    columns: Mapping[str, NDArray[np.float64]]
    origin_s: float = 0.0

    @property
    def period(self) -> float:
        """Median step of the times, s."""
        return float(np.median(np.diff(self.t_s)))

    def rate(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return times (k,) and the angular rate at them: (k, 1) about a table's axis, or (k, 3) of a gyro, rad/s.

        Raises
        ------
        InputError
            If there is neither a tachometer, an angle, a command nor a whole gyro.
        """
        for name in ("tacho_rad_s", "command_rad_s"):
            if name in self.columns:
                return self._known(self.columns[name][:, None])
        if "angle_rad" in self.columns:
            t, angle = self._known(self.columns["angle_rad"][:, None])
            return t, CubicSpline(t, np.unwrap(angle[:, 0]))(t, 1)[:, None]
        if all(name in self.columns for name in GYRO_COLUMNS):
            return self._known(np.column_stack([self.columns[name] for name in GYRO_COLUMNS]))
        raise InputError(
            f"{self.source}: no angular rate among {', '.join(self.columns) or 'its columns'}; "
            "a tachometer, angle, command or gyro of three axes is needed"
        )

    def angle(self) -> tuple[CubicHermiteSpline | None, float]:
        """Return the angle of a table by time, rad, and its random walk by the noise of the rates, rad/√s.

        None for a free body. The angle of an encoder has no random walk.
        """
        t, rate = self.rate()
        if rate.shape[1] > 1:
            return None, 0.0
        if not any(name in self.columns for name in ("tacho_rad_s", "command_rad_s")):
            angle = np.unwrap(self._known(self.columns["angle_rad"][:, None])[1][:, 0])
            return CubicHermiteSpline(t, angle, rate[:, 0]), 0.0
        angle = cumulative_trapezoid(rate[:, 0], t, initial=0.0)
        return CubicHermiteSpline(t, angle, rate[:, 0]), self.rate_noise() * float(np.median(np.diff(t))) ** 0.5

    def rate_noise(self) -> float:
        """Return the noise of the angular rate, from sample to sample and by its rounding, rad/s."""
        noise = 0.0
        for rate in self.rate()[1].T:
            steps = np.abs(np.diff(rate))
            rounded = len(np.unique(rate)) < 0.5 * len(rate)
            count = float(np.min(steps[steps > 0.0], initial=np.inf)) if rounded and steps.any() else 0.0
            noise = max(noise, float(np.median(np.abs(np.diff(rate, 2)))) / (0.6745 * 6.0**0.5), count / 12.0**0.5)
        return noise

    def _known(self, values: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        rows = np.isfinite(values).all(axis=1)
        if rows.sum() < 8:
            raise InputError(f"{self.source}: only {int(rows.sum())} values of the reference; record longer")
        return self.t_s[rows], values[rows]


def open_reference(path: str | Path, column_map: ColumnMap | str | Path | None = None) -> ReferenceSeries:
    """Read a file of references: columns as in a recording (``t_s``, ``tacho_rpm`` …), or by a column map.

    Raises
    ------
    InputError
        If the file can't be read, or holds no reference.
    """
    if column_map is not None:
        chosen = load_map(column_map)
        t, columns, origin = mapped_reference(path, chosen)
        return ReferenceSeries(str(path), t, columns, origin)
    try:
        table = open_columns(path)
    except InputError as error:
        hint = map_hint(path) if is_there(path) else ""
        raise InputError(f"{error}" + (f"; {hint} (here --reference-map)" if hint else "")) from None
    factors = {
        f"{name}_{unit}": (f"{name}_{next(iter(units))}", factor)
        for name, units in REFERENCE_UNITS.items()
        for unit, factor in units.items()
    }
    names = [name for name in table.names if name in factors and name != "t_s"]
    if "t_s" not in table.names or not names:
        hint = map_hint(path)
        missing = (
            "column t_s is missing" if "t_s" not in table.names else "no reference; name one tacho_rpm, angle_deg …"
        )
        raise InputError(f"{path}: {missing}" + (f"; {hint} (here --reference-map)" if hint else ""))
    blocks = list(table.blocks(["t_s", *names]))
    if not blocks:
        raise InputError(f"{path}: no samples below the header; record again or give another file")
    t, *values = (np.concatenate(parts) for parts in zip(*blocks, strict=True))
    if not np.isfinite(t).all() or np.any(np.diff(t) <= 0):
        raise InputError(f"{path}: t_s does not increase throughout; sort by time or drop the repeated samples")
    columns = {factors[name][0]: value * factors[name][1] for name, value in zip(names, values, strict=True)}
    origin = table.metadata.get("time_origin_s", 0.0)
    return ReferenceSeries(str(path), t, columns, float(origin) if isinstance(origin, int | float) else 0.0)
