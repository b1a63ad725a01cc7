"""Settings of a calibration besides its recording: how its poses are found, prior knowledge, a rate table."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from gfimu.base.errors import InputError

if TYPE_CHECKING:
    from pathlib import Path

    from gfimu.calibration.result import Calibration

__all__ = ["CalibrationPoses", "CalibrationPrior", "RateTable"]


@dataclass(frozen=True)
class CalibrationPoses:
    """How the poses of a recording are found, and what a fit uses of them.

    Parameters
    ----------
    rest_threshold : float, optional
        Threshold of rest, reading unit squared; chosen by the data if not given.
    min_rest_s : float, optional
        Shortest pose, s; the method's default if not given.
    levelling_std_rad : float, optional
        Standard deviation of the tilt of a pose, rad.
    input_kind : {"averaged", "raw", "wavelet"}
        Rows that the fit uses.
    wavelet : mapping
        With the wavelet input: ``level`` of the transform, and ``threshold``, what becomes of its details
        (`gfimu.calibration.observations.denoised_samples`).
    rows : {"auto", "poses", "samples"}
        Whether every row is a pose, or a sample of a series with rests; judged by the data if not given.
    row_noise_m_s2 : float, optional
        Of a table of poses: standard deviation of a reading, m/s²; from the residuals of the fit if not given.

    Examples
    --------
    >>> import gfimu
    >>> poses = gfimu.CalibrationPoses(min_rest_s=2.0)
    >>> gfimu.calibrate("multi-position", "poses.csv", poses=poses)  # doctest: +SKIP
    """

    rest_threshold: float | None = None
    min_rest_s: float | None = None
    levelling_std_rad: float | None = None
    input_kind: str = "averaged"
    wavelet: Mapping[str, Any] = field(default_factory=dict)
    rows: str = "auto"
    row_noise_m_s2: float | None = None


@dataclass(frozen=True)
class CalibrationPrior:
    """What is known before a fit: an earlier calibration, and standard deviations of what may differ since.

    Parameters
    ----------
    update : Calibration, str or Path, optional
        For ``array``: calibration of an earlier run to carry over.
    start : Calibration, str or Path, optional
        For ``spin``: static calibration to start from, or the result of another spin; else the data sheets.
    turn_on_std_m_s2 : float, optional
        With either of them: change of a bias between power-ons, m/s²; 0.03 by default.
    bias_walk_m_s2_rt_s : float, optional
        With ``update``: random walk of a bias between poses, m/s²/√s; 0 by default.
    radius_std_m, stretch_std_s2_rad2 : float, optional
        For ``spin``: standard deviations of each coordinate of a chip, m, and of the arm stretch, s²/rad²
        (`gfimu.calibration.spin.policy`).

    Raises
    ------
    InputError
        If the change of a bias is given without an earlier calibration.

    Examples
    --------
    >>> import gfimu
    >>> prior = gfimu.CalibrationPrior(update="before.json")
    >>> gfimu.calibrate("array", "poses.csv", prior=prior)  # doctest: +SKIP
    """

    update: Calibration | str | Path | None = None
    start: Calibration | str | Path | None = None
    turn_on_std_m_s2: float | None = None
    bias_walk_m_s2_rt_s: float | None = None
    radius_std_m: float | None = None
    stretch_std_s2_rad2: float | None = None

    def __post_init__(self) -> None:
        turned_on = self.turn_on_std_m_s2 is not None and self.start is None
        if self.update is None and (self.bias_walk_m_s2_rt_s is not None or turned_on):
            raise InputError("--turn-on-std and --bias-walk are of --update; give the calibration to carry over")


@dataclass(frozen=True)
class RateTable:
    """Recordings of a gyro on a rate table besides the first one.

    Parameters
    ----------
    also : sequence of Recording
        Recordings of the gyro mounted otherwise; `gfimu.calibrate` takes their files too.
    axes : sequence of str
        Axis of the gyro along the table's, up, of the first recording and each of those: x, -y …; by default those of
        their mountings.
    names : sequence of str
        Names of these recordings, for messages.

    Examples
    --------
    >>> import gfimu
    >>> table = gfimu.RateTable(["y.csv", "z.csv"], ("x", "y", "z"))
    >>> gfimu.calibrate("gyro", "x.csv", rate_table=table)  # doctest: +SKIP
    """

    also: Sequence[Any] = ()
    axes: Sequence[str] = ()
    names: Sequence[str] = ()
