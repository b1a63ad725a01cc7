"""Under `gfimu score`: compare array geometries."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from gfimu.commands.former_arguments import former_arguments
from gfimu.results import Panel, PlottedResult, Series
from gfimu.short_repr import joined

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from gfimu.geometry.array import AccelerometerArray
    from gfimu.geometry.scoring import Score
    from gfimu.geometry.turning_axis import TurningAxis
    from gfimu.known_axis.accuracy.bounds import AxisBounds
    from gfimu.known_axis.accuracy.predicted import PredictedRun

__all__ = ["Scores", "score"]

_COLUMNS = (
    "array",
    "channels",
    "condition_number",
    "gdop",
    "gdop_joint",
    "rate_bound_z_rad_s",
    "sigma_rate_filter_rad_s",
)
"""Columns of the notebook's table."""

_FASTEST = 1e6  # rad/s
_AXES = {"x": (1.0, 0.0, 0.0), "y": (0.0, 1.0, 0.0), "z": (0.0, 0.0, 1.0)}


@dataclass(frozen=True)
class Scores(PlottedResult):
    """Scores of arrays side by side, in the order in which the arrays were given; counts and iterates like a list.

    Parameters
    ----------
    scores : tuple of Score or AxisBounds
        One of each array.

    Examples
    --------
    >>> import gfimu
    >>> scores = gfimu.score(["cube12", "corners8"])
    >>> [f"{one.name} {one.gdop:.3f}" for one in scores.rigid]
    ['cube12 1.061', 'corners8 0.750']
    >>> scores.best.name
    'corners8'
    """

    scores: tuple[Score | AxisBounds, ...] = ()

    def __len__(self) -> int:
        return len(self.scores)

    def __iter__(self) -> Iterator[Score | AxisBounds]:
        return iter(self.scores)

    def __getitem__(self, place: int) -> Score | AxisBounds:
        return self.scores[place]

    def __repr__(self) -> str:
        figures = [f"{one.name} {one.gdop:.4g}" for one in self.rigid] + [one.array for one in self.about_axis]
        return joined(self, figures)

    @property
    def rigid(self) -> tuple[Score, ...]:
        """Scores of the arrays that see all six motions."""
        from gfimu.geometry.scoring import Score

        return tuple(one for one in self if isinstance(one, Score))

    @property
    def about_axis(self) -> tuple[AxisBounds, ...]:
        """Bounds of the arrays that were scored about an axis."""
        from gfimu.known_axis.accuracy.bounds import AxisBounds

        return tuple(one for one in self if isinstance(one, AxisBounds))

    @property
    def best(self) -> Score:
        """The score of least GDOP among the arrays that see all six motions.

        Raises
        ------
        InputError
            If none does.
        """
        from gfimu.errors import InputError

        if not self.rigid:
            raise InputError("no array here sees all six motions, so none has a GDOP; see about_axis")
        return min(self.rigid, key=lambda one: one.gdop)

    def to_columns(self) -> dict[str, NDArray[Any]]:
        """Return one row per array, with the columns of its own table; NaN where an array has no such figure."""
        rows = [one.to_columns() for one in self]
        names = list(dict.fromkeys(name for row in rows for name in row))
        return {name: np.concatenate([row.get(name, np.array([np.nan])) for row in rows]) for name in names}

    def _heading(self) -> str:
        return "Scores"

    def _shown(self) -> dict[str, NDArray[Any]]:
        columns = self.to_columns()
        shown = _COLUMNS if self.rigid else tuple(columns)
        return {name: columns[name] for name in shown if name in columns}

    def _notes(self) -> tuple[str, ...]:
        from gfimu.geometry.scoring import ranking_remark

        remark = ranking_remark(self.rigid)
        return (remark,) if remark else ()

    def _panels(self) -> list[Panel]:
        from gfimu.geometry.scoring import score_panels

        if self.rigid:
            return score_panels(self.rigid)
        names = tuple(one.array for one in self.about_axis)
        kinds = (("one sample", "sample_std"), ("filter, settled", "filter_std"))
        series = tuple(
            Series(label, np.array([getattr(one, key) for one in self.about_axis], dtype=float)) for label, key in kinds
        )
        return [Panel("bounds on the rate about the axis", "σ of the rate, rad/s", series, names, scale="zero")]


@former_arguments(duration_s="duration", sample_rate_hz="rate")
def score(
    arrays: AccelerometerArray | str | Path | Sequence[AccelerometerArray | str | Path] | None = None,
    *,
    length_unit_m: float | None = None,
    speed_rad_s: float = math.tau,
    spin_axis: str = "z",
    noise_m_s2: float = 0.0287,
    omega_rad_s: ArrayLike | None = None,
    axis: TurningAxis | str | Sequence[float] | None = None,
    axis_point: Sequence[float] = (0.0, 0.0, 0.0),
    hub: str = "fixed",
    rate: float = 100.0,
    inclination_rad: float | None = None,
    point_std_m: float = 0.0,
    direction_std_rad: float = 0.0,
    lever_std_m: float = 0.0,
    rotation_std_rad: float = 0.0,
    bias_std_m_s2: float = 0.0,
    duration: float = 60.0,
    hub_std_m_s2: float = 0.7,
    jerk_rad2_s5: float = 1.0,
    fault_time_s: float = 1.0,
    per_channel: bool = False,
) -> Scores:
    """Score the geometry of one or several arrays.

    An array that can't see all six motions is scored about its own axis, if its file names one.

    Parameters
    ----------
    arrays : AccelerometerArray, str, Path, or sequence of these, optional
        Arrays, names of shipped arrays, array files (.toml) or MJCF files (.xml); all shipped arrays that see all
        six motions by default.
    length_unit_m : float, optional
        Length that counts as 1 for all of them; without it each array's own unit (half the edge of a cube).
    speed_rad_s : float
        Angular speed at which the rate bound is taken, rad/s.
    spin_axis : {"x", "y", "z"}
        Body axis of that spin.
    noise_m_s2 : float
        Standard deviation of every channel at which the rate bound is taken; the default is an ADXL345 at 100 Hz.
    omega_rad_s : array_like, shape (3,), optional
        Angular rate in place of ``speed_rad_s`` and ``spin_axis``.
    axis : TurningAxis, str or sequence of float, optional
        An axis about which alone the arrays turn: x, y, z, or three numbers, body frame. The bounds of that rotation
        are returned then, for arrays of as few as one chip.
    axis_point : sequence of float
        A point of that axis, body frame, m.
    hub : {"fixed", "free"}
        Whether that axis stands still (a table) or moves with a body (a wheel).
    rate : float
        Sample rate at which the least faults, and the bound of a filter about that axis, hold.
    inclination_rad : float, optional
        Angle between that axis and the vertical, rad; by default a fixed one is upright, a free one level.
    point_std_m, direction_std_rad, lever_std_m, rotation_std_rad, bias_std_m_s2 : float
        How exactly axis, places, orientations and biases of the chips are known
        (`gfimu.geometry.turning_axis.AxisUncertainty`); where all are 0, those of the array file hold.
    duration, hub_std_m_s2, jerk_rad2_s5 : float
        The run for which the estimate's standard deviation is predicted
        (`gfimu.known_axis.accuracy.predicted.PredictedRun`).
    fault_time_s : float
        Time within which a constant fault of a channel is to be found, s: the least that is, is in ``protection`` of
        each `Score` (`gfimu.integrity.protection.FaultProtection`).
    per_channel : bool
        Whether its JSON form lists every channel.

    Raises
    ------
    GeometryError
        If an array can't see all six motions; the message names the motions.
    InputError
        If an array is unknown or an argument is out of range.

    Examples
    --------
    >>> import gfimu
    >>> [f"{one.name} {one.gdop:.3f}" for one in gfimu.score(["cube12", "corners8"]).rigid]
    ['cube12 1.061', 'corners8 0.750']
    """
    from gfimu.commands.known_axis import known_axis, turning_axis
    from gfimu.commands.opened import as_array
    from gfimu.errors import InputError, unknown_name
    from gfimu.geometry.array import AccelerometerArray
    from gfimu.geometry.observability import seeing_arrays
    from gfimu.geometry.scoring import score as score_arrays
    from gfimu.geometry.turning_axis import AxisUncertainty
    from gfimu.integrity.protection import fault_protection

    if not abs(speed_rad_s) <= _FASTEST:
        raise InputError(f"--speed-rad-s {speed_rad_s}: must be a number of at most {_FASTEST:g}")
    if spin_axis not in _AXES:
        raise unknown_name("axis", spin_axis, _AXES)
    if arrays:
        given = [arrays] if isinstance(arrays, AccelerometerArray | str | Path) else list(arrays)
    else:  # boxes of one or two chips see less than a rigid body's motion
        given = list(seeing_arrays())
    turning = turning_axis(axis, axis_point, hub, inclination_rad)
    uncertainty = AxisUncertainty(point_std_m, direction_std_rad, lever_std_m, rotation_std_rad, bias_std_m_s2)
    omega = [speed_rad_s * component for component in _AXES[spin_axis]] if omega_rad_s is None else omega_rad_s
    given_axes = [(array, known_axis(turning, array)) for array in map(as_array, given)]
    seeing = [array for array, about in given_axes if about is None]
    scores: Iterator[Score] = iter(())
    if seeing:
        scores = iter(score_arrays(seeing, length_unit_m=length_unit_m, omega_rad_s=omega, noise_m_s2=noise_m_s2))
    found: list[Score | AxisBounds] = []
    if len(seeing) < len(given_axes):  # the others don't wait for a compiler
        from gfimu.known_axis.accuracy.predicted import PredictedRun

        run = PredictedRun(duration, rate, hub_std_m_s2, jerk_rad2_s5)
    for array, about in given_axes:
        if about is None:
            faults = fault_protection(
                array, noise_m_s2=noise_m_s2, sample_rate_hz=rate, duration_s=fault_time_s,
                per_channel=per_channel,
            )  # fmt: skip
            found.append(replace(next(scores), protection=faults))
            continue
        doubt = about.uncertainty if uncertainty.exact else uncertainty
        tilt = about.inclination if inclination_rad is None else inclination_rad
        stands = replace(about, uncertainty=doubt, inclination=tilt)
        found.append(_about_axis(array, stands, run, speed_rad_s, noise_m_s2))
    if not uncertainty.exact and len(seeing) == len(given_axes):
        raise InputError(f"{next(iter(uncertainty.to_dict()))} is of a known axis; give the axis too (--axis)")
    return Scores(tuple(found))


def _about_axis(
    array: AccelerometerArray, axis: TurningAxis, run: PredictedRun, rate_rad_s: float, noise_std: float
) -> AxisBounds:
    """Return the bounds of a rotation about an axis, with what the estimate reaches in a run."""
    from gfimu.known_axis.accuracy.bounds import axis_bounds
    from gfimu.known_axis.accuracy.predicted import predicted_estimate

    bounds = axis_bounds(array, axis, rate_rad_s=rate_rad_s, noise_std=noise_std, sample_rate_hz=run.sample_rate_hz)
    return replace(bounds, predicted=predicted_estimate(array, axis, run, rate_rad_s=rate_rad_s, noise_std=noise_std))
