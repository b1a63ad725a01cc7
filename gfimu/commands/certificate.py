"""Under `gfimu certificate`: a calibration stated in the terms of the standards, with its uncertainty budget."""

from __future__ import annotations

import json
from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from gfimu.files.outputs import OutputFolder, writes

if TYPE_CHECKING:
    from gfimu.calibration.result import Calibration
    from gfimu.certification.certificate import Certificate, Component, Sheet
    from gfimu.geometry.array import AccelerometerArray
    from gfimu.recording.mapped import RecordingLike
    from gfimu.uncertainty.stage import Stage

__all__ = ["FOLDER", "certificate"]

_SEED = 0
"""Numerical: of the simulated calibrations, so that a certificate comes out the same again."""

FOLDER = OutputFolder(("certificate.json", "certificate.html"))
"""What a certificate writes."""


@writes(reads=("calibration", "compare", "stage", "array", "rest"), out=FOLDER)
def certificate(
    calibration: Calibration | str | Path,
    *,
    out: str | Path | None = None,
    compare: Calibration | Certificate | str | Path | None = None,
    stage: Stage | str | Path | None = None,
    array: AccelerometerArray | str | Path | None = None,
    rest: RecordingLike | None = None,
    item: str = "",
    date: str = "",
    components: Iterable[Component] = (),
    angular_sensor: Sheet | None = None,
) -> Certificate:
    """State a calibration in the terms of IEEE 1293 and NIST, with expanded uncertainties and their budget.

    Parameters
    ----------
    calibration : Calibration, str or Path
        The calibration of accelerometers, or its file.
    out : str or Path, optional
        Folder to write: ``certificate.json``, ``certificate.html``.
    compare : Calibration, Certificate, str or Path, optional
        Another calibration or certificate of the same chips, or its file: E_n of every common quantity.
    stage : Stage, str or Path, optional
        What the laboratory states of the errors of its stage and of gravity, or its file (``gfimu new stage``):
        components of type B, by simulated calibrations.
    array : AccelerometerArray, str or Path, optional
        The array, its name or file: adds the sheet of the whole array as an angular sensor (IEEE 671).
    rest : Recording, str or Path, optional
        Recording at rest: noise, bias and bias instability of that sheet; else the data sheets of the parts. The array
        is the recording's own where none is given.
    item : str
        What was calibrated, such as part and serial number.
    date : str
        When it was calibrated.
    components : iterable of Component
        Further components of type B for the budget, by name of the term.
    angular_sensor : Sheet, optional
        The array as an angular sensor.

    Returns
    -------
    Certificate
        `gfimu.certification.certificate.Certificate`.

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
    from gfimu.certification.comparison import compare as compared
    from gfimu.certification.page import write_certificate
    from gfimu.commands.opened import as_calibration
    from gfimu.uncertainty.stage import Stage

    source = str(calibration) if isinstance(calibration, str | Path) else "calibration"
    fitted = as_calibration(calibration)
    found = _certified(
        fitted,
        Stage.load(stage) if isinstance(stage, str | Path) else stage,
        components=components,
        angular_sensor=_sheet(fitted, array, rest) or angular_sensor,
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
    calibration: Calibration,
    array: AccelerometerArray | str | Path | None,
    rest: RecordingLike | None,
) -> Sheet | None:
    """Return the sheet of the array as an angular sensor; None where neither array nor recording is given."""
    from gfimu.certification.angular import angular_sensor_sheet
    from gfimu.commands.opened import as_array, as_calibrated_run, as_run, as_source

    if rest is None:
        return None if array is None else angular_sensor_sheet(calibration, as_array(array))
    source = as_source(rest, array)
    corrected, _ = as_calibrated_run(source, array, calibration)
    return angular_sensor_sheet(calibration, as_run(source, array)[1], rest=corrected)


def _certified(
    calibration: Calibration, stage: Stage | None, *, components: Iterable[Component] = (), **stated: Any
) -> Certificate:
    """Certify a calibration with the components of the stage, and others."""
    import numpy as np

    from gfimu.certification.certify import certify
    from gfimu.uncertainty.components import stage_components

    simulated = stage_components(calibration, stage, rng=np.random.default_rng(_SEED))
    found = certify(
        calibration,
        components=(*components, *simulated.components),
        explained_misfit=simulated.misfit,
        **stated,
    )
    return replace(found, statements=(*found.statements, *simulated.statements))


def _other(given: Calibration | Certificate | str | Path, name: str) -> Certificate:
    """Return a certificate given as such, as a calibration, or as the file of either."""
    from gfimu.calibration.result import Calibration
    from gfimu.certification.certificate import FORMAT, Certificate
    from gfimu.errors import InputError
    from gfimu.files.input_file import check_input

    if isinstance(given, Certificate):
        return given
    if isinstance(given, Calibration):
        return _certified(given, None, source=name)
    file = check_input(given)
    try:
        data = json.loads(file.read_text(encoding="utf-8"))
    except OSError as error:
        raise InputError(f"{file}: {error.strerror or error}; check the path") from None
    except (ValueError, RecursionError):
        raise InputError(f"{file}: neither a calibration nor a certificate; make one with `gfimu calibrate`") from None
    if isinstance(data, dict) and data.get("format") == FORMAT:
        return Certificate.from_dict(data, source=name)
    return _certified(Calibration.from_dict(data, source=name), None, source=name)
