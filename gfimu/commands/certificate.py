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

import json
from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from gfimu.base.files.outputs import OutputFolder
from gfimu.commands.shell.declare import Option, command
from gfimu.commands.shell.options import ARRAY, MAX_MEMORY

if TYPE_CHECKING:
    from gfimu.array.array import AccelerometerArray
    from gfimu.base.files.memory import MemorySize
    from gfimu.calibration.certificate.certificate import Certificate, Component, Sheet
    from gfimu.calibration.certificate.stage.stage import Stage
    from gfimu.calibration.result import Calibration
    from gfimu.recording.mapped import RecordingLike

__all__ = ["FOLDER", "certificate"]

_SEED = 0
"""Numerical: of the simulated calibrations, so that a certificate comes out the same again."""

FOLDER = OutputFolder(("certificate.json", "certificate.html"), meanings=("certificate", "page"))
"""What a certificate writes."""

_CALIBRATION = Option("Calibration file, from `gfimu calibrate`.", "CAL", kind=Path, argument=True, reads=True)
_COMPARE = Option("Another calibration or certificate of the same chips: E_n of each quantity.", kind=Path, reads=True)
_STAGE = Option(
    "Errors of stage and gravity, for the budget (.toml); gfimu new stage writes one to edit.", kind=Path, reads=True
)
_REST = Option(
    "Recording at rest: noise and bias of that sheet; else the data sheets of the parts.", kind=Path, reads=True
)


@command(doing="stating the calibration")
def certificate(
    calibration: Annotated["Calibration | str | Path", _CALIBRATION],
    *,
    out: Annotated[
        "str | Path | None",
        Option("Folder to write: certificate.json, certificate.html.", kind=Path, writes=FOLDER),
    ] = None,
    compare: Annotated["Calibration | Certificate | str | Path | None", _COMPARE] = None,
    stage: Annotated["Stage | str | Path | None", _STAGE] = None,
    array: Annotated[
        "AccelerometerArray | str | Path | None", ARRAY.also(". Adds its sheet as an angular sensor (IEEE 671)")
    ] = None,
    rest: Annotated["RecordingLike | None", _REST] = None,
    item: Annotated[str, Option("What was calibrated: part, serial number.")] = "",
    date: Annotated[str, Option("When it was calibrated.")] = "",
    max_memory: Annotated["MemorySize | None", MAX_MEMORY] = None,
    components: Annotated[
        "Iterable[Component]",
        Option("Further components of type B for the budget, by name of the term.", shell=False),
    ] = (),
    angular_sensor: Annotated[
        "Sheet | None",
        Option("The array as an angular sensor, in place of ``array`` and ``rest``.", shell=False),
    ] = None,
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
    from gfimu.calibration.certificate.comparison import compare as compared
    from gfimu.calibration.certificate.page import write_certificate
    from gfimu.calibration.certificate.stage.stage import Stage
    from gfimu.commands.opened import as_calibration

    source = str(calibration) if isinstance(calibration, str | Path) else "calibration"
    fitted = as_calibration(calibration)
    found = _certified(
        fitted,
        Stage.load(stage) if isinstance(stage, str | Path) else stage,
        components=components,
        angular_sensor=_sheet(fitted, array, rest, max_memory) or angular_sensor,
        item=item,
        date=date,
        source=source,
    )
    if compare is not None:
        name = str(compare) if isinstance(compare, str | Path) else "the other"
        found = replace(found, comparison=compared(found, _other(compare, name), other=name))
    if out is not None:
        write_certificate(out, found)
    return found


def _sheet(
    calibration: "Calibration",
    array: "AccelerometerArray | str | Path | None",
    rest: "RecordingLike | None",
    max_memory: "MemorySize | None",
) -> "Sheet | None":
    """Return the sheet of the array as an angular sensor; None where neither array nor recording is given."""
    from gfimu.calibration.certificate.angular import angular_sensor_sheet
    from gfimu.commands.opened import as_array, as_calibrated_run, as_run, as_source

    if rest is None:
        return None if array is None else angular_sensor_sheet(calibration, as_array(array))
    source = as_source(rest, array, max_memory=max_memory)
    corrected, _ = as_calibrated_run(source, array, calibration)
    return angular_sensor_sheet(calibration, as_run(source, array)[1], rest=corrected)


def _certified(
    calibration: "Calibration", stage: "Stage | None", *, components: "Iterable[Component]" = (), **stated: Any
) -> "Certificate":
    """Certify a calibration with the components of the stage, and others."""
    import numpy as np

    from gfimu.calibration.certificate.certify import certify
    from gfimu.calibration.certificate.stage.components import stage_components

    simulated = stage_components(calibration, stage, rng=np.random.default_rng(_SEED))
    found = certify(
        calibration,
        components=(*components, *simulated.components),
        explained_misfit=simulated.misfit,
        **stated,
    )
    return replace(found, statements=(*found.statements, *simulated.statements))


def _other(given: "Calibration | Certificate | str | Path", name: str) -> "Certificate":
    """Return a certificate given as such, as a calibration, or as the file of either."""
    from gfimu.base.errors import InputError
    from gfimu.base.files.input_file import LARGEST_TEXT, check_input
    from gfimu.calibration.certificate.certificate import FORMAT, Certificate
    from gfimu.calibration.result import Calibration

    if isinstance(given, Certificate):
        return given
    if isinstance(given, Calibration):
        return _certified(given, None, source=name)
    file = check_input(given, largest=LARGEST_TEXT)
    try:
        data = json.loads(file.read_text(encoding="utf-8"))
    except OSError as error:
        raise InputError(f"{file}: {error.strerror or error}; check the path") from None
    except (ValueError, RecursionError):
        raise InputError(f"{file}: neither a calibration nor a certificate; make one with `gfimu calibrate`") from None
    if isinstance(data, dict) and data.get("format") == FORMAT:
        return Certificate.from_dict(data, source=name)
    return _certified(Calibration.from_dict(data, source=name), None, source=name)
