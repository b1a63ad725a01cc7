"""Measured data in the benchmark: what makers state is the only truth, held-out error the only measure.

MIMU4444: eight MPU-9150 on one board, turned to poses and shaken by hand (Carlsson, Skog & Jaldén, IEEE Sensors J.
21(6):8451, 2021). The files ``exp_1.bin.gz`` and ``exp_2.bin.gz`` are not part of gfimu; a folder holds them, as such
or in ``mimu4444``. A method sees 70 s of one: the last two poses and half a minute of motion. Its answer is measured on
the same stretch of the other.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from gfimu.base.errors import InputError
from gfimu.motion.body_drive import BodyDrive
from gfimu.recording import Recording
from gfimu.recording.mimu4444 import read_mimu4444
from sim.effects import Effect
from sim.trials.benchmark.answer import CauseAnswer
from sim.trials.benchmark.world import Task
from sim.twin import Twin

__all__ = ["STATED_LIMITS", "beyond_stated", "held_out_recording", "prediction_error", "real_task"]

Floats = NDArray[np.float64]

_FILES = ("exp_1.bin.gz", "exp_2.bin.gz")
_TWIN = "mimu4444_free"
_STRETCH_S = (440.0, 510.0)
_SATURATED = 0.98 * np.deg2rad(2000.0)  # rad/s, of the board's gyros
_AROUND = 3  # samples beside a saturated one that are left out as well
_STEPS = 2  # Gauss–Newton steps for the specific force, which enters nearly linearly

STATED_LIMITS = {
    "bias": 1.471,
    "scale_factor": 0.03,
    "cross_axis": 0.02,
    "misalignment": 0.02,
    "sensor_position": 2e-3,
    "gyro_scale": 0.03,
    "gyro_misalignment": 0.02,
}
"""Largest sizes by effect, SI units: product specification of the MPU-9150 (±150 mg, ±3 %, ±2 %), half its package."""

_MARGIN = 2.0  # times what is stated, from which a size contradicts it


def real_task(world: str, data: str | Path) -> Task:
    """Return the task of a measured world.

    Parameters
    ----------
    world : str
        ``real/test/000`` or ``real/test/001``.
    data : str or Path
        Folder of the measured data.

    Raises
    ------
    InputError
        If a file is not there.
    """
    return Task(world, _stretch(data, _FILES[_number(world)]), Twin.load(_TWIN))


def held_out_recording(world: str, data: str | Path) -> Recording:
    """Return the recording on which an answer for a measured world is measured; arguments as of `real_task`."""
    return _stretch(data, _FILES[1 - _number(world)])


def _number(world: str) -> int:
    return int(world.rpartition("/")[2])


def _stretch(data: str | Path, name: str) -> Recording:
    for file in (Path(data) / "mimu4444" / name, Path(data) / name):
        if file.is_file():
            recording = read_mimu4444(file)
            return recording.slice(*np.searchsorted(recording.t_s, _STRETCH_S).tolist())
    raise InputError(f"{data}: holds no {name} of the MIMU4444 data; name its folder with --data")


def prediction_error(twin: Twin, effects: Sequence[Effect], recording: Recording) -> float:
    """Return the rms error of a free body's channels, m/s², given its gyro, the specific force free at each sample.

    Samples near which a gyro saturates are left out; degrees of freedom that the force takes are corrected for.
    """
    array, t = twin.array, recording.t_s
    gyro = np.column_stack([recording.reference[f"gyro_{axis}_rad_s"] for axis in "xyz"])
    seen = np.isfinite(gyro).all(axis=1)  # a saturated gyro reads nothing
    gyro = np.column_stack([np.interp(t, t[seen], one[seen]) for one in gyro.T])
    measured = recording.for_array(array)
    force = np.tile(np.nanmean(measured, axis=0) @ array.axes / len(array.chips), (len(t), 1))

    def predicted(wanted: Floats) -> Floats:
        return twin.predict_body(BodyDrive(t, gyro, wanted), t, effects=effects)

    for _ in range(_STEPS):
        left = np.nan_to_num(measured - predicted(force))
        gains = np.stack([predicted(force + one) - predicted(force) for one in np.eye(3)], axis=2)  # (n, c, 3)
        force = force + np.linalg.solve(
            np.einsum("nci,ncj->nij", gains, gains), np.einsum("nci,nc->ni", gains, left)[..., None]
        )[..., 0]  # fmt: skip
    left = measured - predicted(force)
    saturated = np.convolve(~seen | (np.abs(gyro).max(axis=1) > _SATURATED), np.ones(2 * _AROUND + 1), "same") > 0
    kept = left[~saturated]
    return float(np.sqrt(np.nanmean(kept**2) * left.shape[1] / (left.shape[1] - 3)))


def beyond_stated(causes: Iterable[CauseAnswer]) -> list[str]:
    """Return the sizes of an answer that contradict what the makers state, as ``effect key``."""
    return [
        f"{cause.effect} {key}"
        for cause in causes
        for key, one in cause.parameters.items()
        if cause.effect in STATED_LIMITS
        and isinstance(one.value, float | int)
        and abs(one.value) > _MARGIN * STATED_LIMITS[cause.effect]
    ]
