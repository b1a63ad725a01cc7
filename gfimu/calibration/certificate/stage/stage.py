"""The stage file: what a laboratory states about the errors of its levelled faces or two-axis stage, and of gravity."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import msgspec

from gfimu.base.files.model_files import read_toml
from gfimu.base.files.schema import Table, about, read

__all__ = ["Stage"]

Angle = Annotated[float, msgspec.Meta(ge=0, le=0.05)]
"""rad; beyond 3° a face is no face."""


class Stage(Table, frozen=True):
    """Standard uncertainties of a calibration's stage and reference; of limits ±a, a/√3 (rectangular distribution).

    A key that is left out is zero: nothing is counted for it.
    """

    stage: Annotated[
        str, about("Identification of the stage: maker, model, serial number.", example="two-axis stage no. 2")
    ]
    source: Annotated[str, about("Where the figures are from: certificate or data sheet, with number and date.")] = ""
    pose_tilt_std_rad: Annotated[
        Angle,
        about("Tilt of each pose by itself about each horizontal axis: hand levelling, faces out of square.", "rad"),
    ] = 0.0
    base_tilt_std_rad: Annotated[
        Angle,
        about("Tilt of the base, and so of the outer axis, about each horizontal axis; equal in all poses.", "rad"),
    ] = 0.0
    orthogonality_std_rad: Annotated[
        Angle, about("Angle by which the inner axis misses the right angle to the outer one.", "rad")
    ] = 0.0
    angle_setting_std_rad: Annotated[
        Angle, about("Error of each setting of either axis, new at every setting.", "rad")
    ] = 0.0
    angle_zero_std_rad: Annotated[Angle, about("Error of the zero of either axis, equal in all poses.", "rad")] = 0.0
    angle_step_std_rad: Annotated[
        Angle,
        about("Error of a step of 90° of either axis, in proportion for other steps; equal in all poses.", "rad"),
    ] = 0.0
    mounting_std_rad: Annotated[
        Angle,
        about("Rotation of the unit against the stage about each of its axes; equal in all poses.", "rad"),
    ] = 0.0
    gravity_std_m_s2: Annotated[
        Annotated[float, msgspec.Meta(ge=0, le=0.1)] | None,
        about(
            "Local gravity that the calibration was given.",
            "m/s²",
            default="3e-4, the local anomalies that a formula lacks; 0.015 if standard gravity was used",
        ),
    ] = None
    resolution_m_s2: Annotated[
        Annotated[float, msgspec.Meta(ge=0, le=1)],
        about("Step of the readings where their noise is too small to average it out; 0: it is in the noise.", "m/s²"),
    ] = 0.0
    table_rate_std: Annotated[
        Annotated[float, msgspec.Meta(ge=0, le=0.1)],
        about("Relative error of the rate of the table that gave the positions, a ratio."),
    ] = 0.0
    reliability: Annotated[
        float,
        about("Relative uncertainty of the figures above, a ratio; 0.25 gives them 8 degrees of freedom.", ge=0, lt=1),
    ] = 0.0

    @classmethod
    def load(cls, path: str | Path) -> Stage:
        """Read a stage file.

        Raises
        ------
        InputError
            If there is no such file, or a key is missing, unknown or has a wrong value.
        """
        return read(read_toml(Path(path)), cls, str(path))
