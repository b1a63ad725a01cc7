"""State a calibration in the terms of IEEE 1293 and NIST, with expanded uncertainties and their budget.

Examples
--------
gfimu certificate calibration.json --item "cube no. 7" --date 2026-11-27 --out certificate
# With the errors of the stage
gfimu certificate calibration.json --stage plate.toml --out certificate
# The array as an angular sensor
gfimu certificate calibration.json --array cube12 --rest rest.parquet
# Two laboratories
gfimu certificate calibration.json --compare theirs.json
"""

from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from gfimu.base.files.outputs import OutputFolder
from gfimu.calibration.certificate.stage.stage import Stage
from gfimu.commands import given
from gfimu.commands.shell.declare import Option, command
from gfimu.commands.shell.options import ARRAY

if TYPE_CHECKING:
    from gfimu.calibration.certificate.certificate import Certificate, Component, Sheet
    from gfimu.calibration.result import Calibration
    from gfimu.recording.mapped import RecordingLike

__all__ = ["FOLDER", "certificate"]

_SEED = 0
"""Numerical: of the simulated calibrations, so that a certificate comes out the same again."""

FOLDER = OutputFolder(("certificate.json", "certificate.html"), meanings=("certificate", "page"))
"""What a certificate writes."""

_CALIBRATION = Option("Calibration file, from `gfimu calibrate`.", "CAL", argument=True, reads=True)
_OUT = Option("Folder to write: certificate.json, certificate.html.", writes=FOLDER)
_COMPARE = Option("Another calibration or certificate of the same chips: E_n of each quantity.", reads=True)
_STAGE = Option("Errors of stage and gravity, for the budget (.toml); gfimu new stage writes one to edit.", reads=True)
_REST = Option(
    "Recording at rest: noise and bias of that sheet; else the data sheets of the parts.", kind=Path, reads=True
)
_COMPONENTS = Option("Further components of type B for the budget, by name of the term.", shell=False)
_SENSOR = Option("The array as an angular sensor, in place of ``array`` and ``rest``.", shell=False)


@command(doing="stating the calibration")
def certificate(
    calibration: Annotated["Calibration | str | Path", _CALIBRATION],
    *,
    out: Annotated["str | Path | None", _OUT] = None,
    compare: Annotated["Calibration | Certificate | str | Path | None", _COMPARE] = None,
    stage: Annotated["Stage | str | Path | None", _STAGE] = None,
    array: Annotated[given.Array, ARRAY.also(". Adds its sheet as an angular sensor (IEEE 671)")] = None,
    rest: Annotated["RecordingLike | None", _REST] = None,
    item: Annotated[str, Option("What was calibrated: part, serial number.")] = "",
    date: Annotated[str, Option("When it was calibrated.")] = "",
    max_memory: given.Memory = None,
    components: Annotated["Iterable[Component]", _COMPONENTS] = (),
    angular_sensor: Annotated["Sheet | None", _SENSOR] = None,
) -> "Certificate":
    """State a calibration in the terms of IEEE 1293 and NIST, with expanded uncertainties and their budget.

    Returns
    -------
    Certificate
        `gfimu.calibration.certificate.certificate.Certificate`.

    Raises
    ------
    InputError
        If the calibration can't be read, is of a gyro or without covariance, the other is of another unit or other
        chips, or the folder can't be written where it is asked for.

    Examples
    --------
    >>> import gfimu
    >>> gfimu.certificate("cal.json", item="unit 7").to_pandas()  # doctest: +SKIP
    """
    from gfimu.calibration.certificate.angular import angular_sensor_sheet
    from gfimu.calibration.certificate.comparison import compare as compared
    from gfimu.calibration.certificate.page import write_certificate
    from gfimu.commands.opened import as_array, as_calibrated_run, as_calibration, as_source

    fitted = as_calibration(calibration)
    if rest is not None:
        source = as_source(rest, array, max_memory=max_memory)
        geometry = as_calibrated_run(source, array)[1]
        corrected, _ = as_calibrated_run(source, array, fitted)
        angular_sensor = angular_sensor_sheet(fitted, geometry, rest=corrected)
    elif array is not None:
        angular_sensor = angular_sensor_sheet(fitted, as_array(array))
    found = _certified(
        fitted,
        Stage.load(stage) if isinstance(stage, str | Path) else stage,
        components=components,
        source=str(calibration) if isinstance(calibration, str | Path) else "calibration",
        item=item,
        date=date,
        angular_sensor=angular_sensor,
    )
    if compare is not None:
        name = str(compare) if isinstance(compare, str | Path) else "the other"
        found = replace(found, comparison=compared(found, _other(compare, name), other=name))
    if out is not None:
        write_certificate(out, found)
    return found


def _certified(calibration: "Calibration", stage: "Stage | None", **stated: Any) -> "Certificate":
    """Certify a calibration with the components of the stage, and others."""
    import numpy as np

    from gfimu.calibration.certificate.stage.components import stage_components

    return stage_components(calibration, stage, rng=np.random.default_rng(_SEED)).certify(calibration, **stated)


def _other(other: "Calibration | Certificate | str | Path", name: str) -> "Certificate":
    """Return a certificate given as such, as a calibration, or as the file of either."""
    from gfimu.calibration.certificate.certificate import FORMAT, Certificate
    from gfimu.calibration.result import Calibration
    from gfimu.recording.reading import read_json

    if isinstance(other, str | Path):
        data = read_json(other, "neither a calibration nor a certificate; make one with `gfimu calibrate`")
        is_certificate = isinstance(data, dict) and data.get("format") == FORMAT
        other = (Certificate if is_certificate else Calibration).from_dict(data, source=name)
    return other if isinstance(other, Certificate) else _certified(other, None, source=name)
