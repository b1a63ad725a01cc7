"""The picture of a recording file: read, estimate where the array allows, draw."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

from gfimu.array.array import AccelerometerArray
from gfimu.array.turning_axis import TurningAxis
from gfimu.base.declared import Declared
from gfimu.base.errors import GeometryError, InputError
from gfimu.base.files.input_file import as_path
from gfimu.motion.axis_estimation import estimate_about_axis
from gfimu.motion.estimate import Estimate
from gfimu.motion.estimation import estimate
from gfimu.motion.rest_bias import estimate_from_rest, rest_bias
from gfimu.recording import Recording
from gfimu.recording.carried_array import carried_array, warn_of_other_array
from gfimu.recording.doubts.judge import examine
from gfimu.recording.formats import is_estimate, open_run
from gfimu.recording.mapped import MappedFile
from gfimu.recording.tables.arrow import ArrowStream
from gfimu.visual.run import write_estimate, write_run

__all__ = ["Viewed", "picture_of", "picture_path"]


@dataclass(frozen=True)
class Viewed(Declared):
    """What is shown in the viewer.

    Parameters
    ----------
    picture : Path
        The rerun recording.
    made : bool
        Whether it was made, and not there before.
    opens : bool
        Whether the viewer is to open it.
    """

    picture: Path
    made: bool = True
    opens: bool = True


def picture_path(recording: Path | None) -> Path:
    """Where the picture of a recording goes: beside its file, or in a temporary folder if that can't be written to."""
    if recording is None:
        return Path(tempfile.mkdtemp(prefix="gfimu-")) / "run.view.rrd"
    name = f"{recording.name.split('.')[0]}.view.rrd"
    if os.access(recording.parent, os.W_OK):
        return recording.parent / name
    return Path(tempfile.mkdtemp(prefix="gfimu-")) / name


def picture_of(
    recording: Recording | Estimate | str | Path | MappedFile | ArrowStream,
    out: Path,
    *,
    array: AccelerometerArray | None = None,
    axis: TurningAxis | None = None,
    force: bool = False,
) -> None:
    """Write the rerun recording of a recording, with its estimate where the array sees all six motions.

    A file that `gfimu estimate` wrote is drawn as it is.

    Parameters
    ----------
    recording : Recording, Estimate, path or table
        A recording, or its file in any format that `gfimu.recording.formats.open_run` reads; or an estimate.
    out : Path
        File to write, ``.rrd``.
    array : AccelerometerArray, optional
        The array; the recording's own otherwise.
    axis : TurningAxis, optional
        The axis about which alone it turns; by default that of the recording's rig (a pendulum), or the array's own
        where it can't see all six motions.
    force : bool
        Go on, with a warning, where the checks of the recording would refuse it.

    Raises
    ------
    InputError
        If the recording can't be read, names no array, is refused by its checks, or the picture can't be written.
    """
    name = as_path(recording) if isinstance(recording, str | Path | MappedFile) else Path()
    if name.suffix == ".rrd":
        raise InputError(f"{recording}: already a rerun recording; open it without --out")
    if isinstance(recording, Estimate) or (isinstance(recording, str | Path) and is_estimate(recording)):
        if axis is not None:
            raise InputError(f"{name}: an estimate, which an axis can't change; give its recording with --axis")
        _picture_of_estimate(name, recording if isinstance(recording, Estimate) else Estimate.read(name), out, array)
        return
    run, geometry = _with_array(recording, array)
    examine(run, geometry, source=name.name, force=force)
    carried = run.metadata.get("rig_axis")
    if axis is None and geometry.turning_axis is None and isinstance(carried, Mapping):
        axis = TurningAxis.from_dict(carried, source=f"{name.name}: rig_axis")
    if axis is not None:
        geometry = replace(geometry, turning_axis=axis)
        found, note = _about_axis(run, geometry, axis)
    else:
        found, note = _estimate(run, geometry, force=force)
    write_run(out, run, geometry, estimate=found, notes=note, title=name.stem)


def _with_array(
    recording: Recording | str | Path | MappedFile | ArrowStream, array: AccelerometerArray | None
) -> tuple[Recording, AccelerometerArray]:
    """Return a recording with its array."""
    if not isinstance(recording, Recording):
        return open_run(recording, array)
    geometry = array or recording.array
    if geometry is None:
        raise InputError("the recording does not carry its array; give it as array=")
    return recording, geometry


def _picture_of_estimate(file: Path, found: Estimate, out: Path, array: AccelerometerArray | None) -> None:
    """Write the rerun recording of an estimate, and of the file that it is from, if it is from one."""
    geometry = carried_array(found.metadata, source=file, beside=file.parent) if array is None else array
    if geometry is None:
        raise InputError(f"{file}: the estimate does not name its array; give it with --array")
    if array is not None:
        warn_of_other_array(found.metadata, array, str(file), whose="the given")
    strangers = sorted(set(found.health or {}) - set(geometry.channels))
    if strangers:
        raise InputError(
            f"{file}: an estimate with channel {strangers[0]}, which array {geometry.name!r} does not have"
        )
    method = found.metadata.get("method", "unknown")
    write_estimate(out, found, geometry, notes=f"An estimate by method {method}.", title=file.stem)


def _estimate(run: Recording, array: AccelerometerArray, *, force: bool) -> tuple[Estimate | None, str]:
    """Estimate as far as possible; a note says how, for the picture."""
    try:
        return _six_motions(run, array, force=force)
    except GeometryError as error:
        return (
            _about_axis(run, array, array.turning_axis) if array.turning_axis is not None else (None, _missing(error))
        )


def _six_motions(run: Recording, array: AccelerometerArray, *, force: bool) -> tuple[Estimate, str]:
    """Estimate all six motions, on a table with the biases of the first rest where there is one."""
    if not any(name in run.reference for name in ("tacho_rad_s", "command_rad_s", "angle_rad")):
        return estimate(run, array, force=force), ""
    try:
        found = estimate_from_rest(run, array, force=force)
    except GeometryError:
        raise
    except InputError as error:  # nothing to read biases off: their effect stays in the picture
        return estimate(run, array, force=force), f"Biases are left in: {error}."
    return found, "Biases were read off the first rest, with the table taken as level."


def _about_axis(run: Recording, array: AccelerometerArray, axis: TurningAxis) -> tuple[Estimate | None, str]:
    """Estimate about the array's axis, with the biases of a rest where the body then stood level."""
    note = "Biases are left in: those of a free hub can't be read off a rest."
    if axis.hub == "fixed":
        try:
            found = rest_bias(run, array)
            beyond = found.findings()
            if beyond:
                note = "Biases are left in: at rest the channels do not read those of a body that stands level."
            else:
                run, note = found.remove(run), "Biases were read off the first rest, with the axis taken as upright."
        except InputError as error:
            note = f"Biases are left in: {error}."
    try:
        estimated = estimate_about_axis(run, array, axis)
    except InputError as error:  # a chip on the axis itself, say
        return None, _missing(error)
    warned = "".join(f" Note: {warning}." for warning in estimated.metadata["warnings"])
    return estimated, f"The rotation about the known axis alone is estimated. {note}{warned}"


def _missing(error: InputError) -> str:
    """Return what is missing for an estimate, and where it would go."""
    return (
        f"**No estimate.** {error}. The axis is read from the array file: `[turning_axis]` with "
        "`direction = [0, 0, 1]`. The channels are drawn as they are."
    )
