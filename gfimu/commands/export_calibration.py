"""Under `gfimu convert` of a calibration: YAML for Kalibr and for the ROS package imu_calib."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from gfimu.base.errors import InputError, check_name

if TYPE_CHECKING:
    from gfimu.array.array import AccelerometerArray
    from gfimu.base.files.memory import MemorySize
    from gfimu.calibration.result import Calibration
    from gfimu.recording import Recording
    from gfimu.recording.importing import ColumnMap
    from gfimu.sensor_noise import RecordingNoise

__all__ = ["TARGETS", "export_calibration"]

TARGETS = ("kalibr", "ros")
"""Formats of a calibration for others."""


def export_calibration(
    calibration: Calibration,
    target: str | Path | None,
    *,
    to: str | None,
    array: AccelerometerArray | None,
    lsb_m_s2: float | None,
    chip: str | None,
    noise: RecordingNoise | Recording | str | Path | None,
    column_map: ColumnMap | str | Path | None = None,
    max_memory: MemorySize | None = None,
) -> None:
    """Write a calibration in a format of others; arguments as `gfimu.convert`.

    Raises
    ------
    InputError
        If the format is not named or unknown, the target is no YAML file, or as
        `gfimu.calibration.exporting.calibrated_chip.calibrated_chips`.
    """
    from gfimu.base.files.atomic_file import write_text
    from gfimu.calibration.exporting import calibration_as_kalibr, calibration_as_ros
    from gfimu.calibration.exporting.calibrated_chip import calibrated_chips
    from gfimu.commands.noise import noise as recorded_noise
    from gfimu.sensor_noise import RecordingNoise

    if to is None:
        raise InputError(f"a calibration is written for one of {', '.join(TARGETS)}; name it with --to")
    check_name("format of a calibration", to, TARGETS)
    if target is not None and Path(target).suffix not in {".yaml", ".yml"}:
        raise InputError(f"{target}: a calibration for {to} ends in .yaml or .yml; name it so")
    found = noise
    if found is not None and not isinstance(found, RecordingNoise):
        found = recorded_noise(found, calibration=calibration, column_map=column_map, max_memory=max_memory)
    chips = calibrated_chips(calibration, array, lsb_m_s2=lsb_m_s2, noise=found, chip=chip)
    write = calibration_as_kalibr if to == "kalibr" else calibration_as_ros
    text = write(chips, notes=_notes(calibration))
    if target is not None:
        write_text(target, text)


def _notes(calibration: Calibration) -> list[str]:
    """Return what a reader of the file should know of the calibration."""
    from gfimu.calibration.error_model import GAUGES
    from gfimu.calibration.parameter_names import kind_of

    made = f"gfimu calibration, method {calibration.method}, g = {calibration.gravity:.9g} m/s^2"
    frame = f"frame of the calibrated values: {GAUGES[calibration.gauge]}"
    bends = "".join(kind for kind in "qc" if any(kind_of(name) == kind for name in calibration.names))
    lost = {"q": "quadratic coefficients q are", "c": "cubic coefficients c are", "qc": "coefficients q and c are"}
    left_out = [f"non-linearity: the {lost[bends]} left out; M and b are those at zero input"] if bends else []
    return [made, frame, *left_out, *calibration.statements, *(f"warning: {text}" for text in calibration.warnings)]
