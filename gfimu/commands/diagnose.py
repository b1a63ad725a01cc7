"""Under `gfimu diagnose`: what the simulation gets wrong against recordings, and why."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from gfimu.errors import InputError
from gfimu.files.outputs import OutputFolder, same_file, writes
from gfimu.optional_packages import missing

if TYPE_CHECKING:
    from gfimu.calibration.result import Calibration
    from gfimu.commands.opened import Source
    from gfimu.diagnosis.report.rig import DrawnRig
    from gfimu.diagnosis.verdict.verdict import Diagnosis
    from gfimu.importing import ColumnMap
    from gfimu.joining import Joined
    from gfimu.recording import Recording
    from gfimu.recording.mapped import RecordingLike
    from gfimu.visual.scene import Shape
    from gfimu.world_model import WorldModel
    from sim.twin import Twin
    from sim.world import World

__all__ = ["FOLDER", "diagnose", "write_report", "written_files"]

EXPLAINED = frozenset({"sign", "exchange", "dead", "rest_bias"})
"""Findings of a recording's checks that are effects of the library: the diagnosis explains them."""

FOLDER = OutputFolder(("verdict.json", "twin.toml", "report.html", "diagnosis.rrd", "array.toml"))
"""What the folder of a diagnosis holds."""


@writes(reads=("recordings", "twin", "held_out", "calibration", "column_map", "reference", "reference_map"), out=FOLDER)
def diagnose(
    recordings: RecordingLike | Sequence[RecordingLike],
    twin: WorldModel | str | Path,
    *,
    out: str | Path | None = None,
    held_out: RecordingLike | Sequence[RecordingLike] = (),
    calibration: Calibration | str | Path | None = None,
    column_map: ColumnMap | str | Path | None = None,
    map_set: Sequence[str] = (),
    reference: str | Path | None = None,
    reference_map: ColumnMap | str | Path | None = None,
    reference_map_set: Sequence[str] = (),
    names: Sequence[str] | None = None,
    report: Callable[[float, str], None] | None = None,
    grammar: bool = False,
    force: bool = False,
) -> Diagnosis:
    """Compare recordings with a simulation: name the causes of the difference, extend the simulation, measure the gain.

    Parameters
    ----------
    recordings : Recording, path, table, (times, readings), or sequence of these
        Runs of one rig, fitted together.
    twin : WorldModel, str or Path
        The simulation to check: a twin, its name or file; or a simulation of one's own, as such or as
        ``rig.py:function`` (`gfimu.own_rig.load_model`).
    out : str or Path, optional
        Folder for ``verdict.json``, ``twin.toml``, ``report.html`` and ``diagnosis.rrd``, and ``array.toml`` where the
        twin's array is no shipped one; made if it isn't there. A file whose package is not installed is left out, with
        a warning before the work begins.
    held_out : as recordings
        Recordings kept for measuring the gain.
    calibration : Calibration, str or Path, optional
        Calibration of the unit, applied first.
    column_map : ColumnMap, str or Path, optional
        What the columns of a foreign file are: a map, its name or TOML file (``--map``); see `gfimu.inspect`.
    map_set : sequence of str
        Keys of that map to set, such as ``"time.unit=ms"`` (``--map-set``); without a map they are all of it.
    reference : str or Path, optional
        Reference of the first run on a clock of its own; it is aligned first, as by `gfimu.join`.
    reference_map : ColumnMap, str or Path, optional
        What the columns of that file are.
    reference_map_set : sequence of str
        Keys of that map to set.
    names : sequence of str, optional
        Names of the runs, for people; those of their files by default.
    report : callable, optional
        Called with the share done, 0 to 1, and a line of text.
    grammar : bool
        Whether further effects of a rig, and places times dependences without a name of their own, are searched at
        once, as a twin file with ``grammar = true`` asks for, and not only where the usual effects give no good answer.
    force : bool
        Go on, with a warning, where the checks of a recording would refuse it.

    Returns
    -------
    Diagnosis
        The verdict with its numbers.

    Raises
    ------
    InputError
        If a recording is too short, lacks the reference that drives the twin, is refused by its checks, or is held
        out and fitted both; or the folder can't be written.

    Examples
    --------
    >>> import gfimu
    >>> run = gfimu.simulate("rest", seed=1)
    >>> found = gfimu.diagnose(run, twin="cube12_turntable")  # doctest: +SKIP
    >>> found.verdict, found.gain.share_of_excess_removed  # doctest: +SKIP
    >>> found.plot()  # doctest: +SKIP
    """
    from gfimu.commands.opened import as_calibration, as_runs, as_source, as_twin
    from gfimu.joining import displaced_reference
    from gfimu.recording.checks import examine

    if out is not None:
        from gfimu.diagnosis.report.folder import warn_of_omitted

        warn_of_omitted()
    given = as_twin(twin)
    runs, unseen = (
        [as_source(run, given.array, column_map, map_set) for run in as_runs(group)] for group in (recordings, held_out)
    )
    _refuse_fitted(runs, unseen)
    model = given.searching(wide=True) if grammar else given
    unit = None if calibration is None else as_calibration(calibration)
    read, kept = ([_opened(run, model, unit) for run in group] for group in (runs, unseen))
    if unit is not None and unit.positions:
        model = model.with_array(unit.calibrated_array(model.array))
    labels = _names(runs) if names is None else names
    for one, name in zip((*read, *kept), (*labels, *_names(unseen)), strict=True):
        examine(one, model.array, source=name, force=force, apart_from=EXPLAINED, whose="")
    free = model.drive_source == "gyro"
    clocks = [displaced_reference(one, rates=free) if not free or _by_tacho(one) else None for one in read]
    if reference is not None:
        from gfimu.commands.join import join

        clocks[0] = join(read[0], reference, reference_map=reference_map, reference_map_set=reference_map_set)
    found, used = _explained(read, clocks, model, reference is not None, kept, labels, report, force)
    if used.mounting_rotvec.any():
        x, y, z = used.mounting_rotvec.tolist()
        found = replace(found, mounting_rotvec_rad=(x, y, z))
    if out is not None:
        if report is not None:
            report(0.99, "write the report")
        write_report(found, out)
    return found


def _explained(
    read: Sequence[Recording],
    clocks: Sequence[Joined | None],
    model: WorldModel,
    two_files: bool,
    kept: Sequence[Recording],
    labels: Sequence[str],
    report: Callable[[float, str], None] | None,
    force: bool,
) -> tuple[Diagnosis, Recording]:
    """Return the diagnosis of recordings whose references are aligned where they had another clock, and the first run.

    The rate error of a clock is left in, so that it is diagnosed beside all else. Where the alignment shows one and the
    diagnosis doesn't name it, or the model is of a free body, which has no such effect, it is taken off.
    """
    from gfimu.diagnosis.diagnose import diagnose as explain
    from gfimu.diagnosis.verdict.sample_notes import with_reference_clock

    def runs(own_rate: bool) -> list[Recording]:
        return [
            run if one is None else (one.by_own_rate if own_rate else one.by_reference_clock)
            for run, one in zip(read, clocks, strict=True)
        ]

    first = next((one for one in clocks if one is not None), None)
    used = runs(model.drive_source != "gyro")
    found = explain(used, model, held_out=kept, names=labels, report=report, force=force)
    if first is None:
        return found, used[0]
    corrected = ["tacho_latency"] if first.is_far and not two_files else []
    if first.has_rate_error and "clock_error" not in {cause.effect for cause in found.causes}:
        corrected.append("clock_error")
        if model.drive_source != "gyro":
            used = runs(False)
            found = explain(used, model, held_out=kept, names=labels, report=report, force=force)
    return with_reference_clock(found, first.clock, corrected, model), used[0]


@writes(folder=FOLDER)
def write_report(diagnosis: Diagnosis, folder: str | Path) -> Path:
    """Write the folder of a diagnosis: verdict, extended twin, ``report.html`` and a rerun recording.

    The rig of an extended `sim.twin.Twin` is drawn by its MuJoCo model where mujoco and rerun-sdk are installed.

    Parameters
    ----------
    diagnosis : Diagnosis
        What `gfimu.diagnose` returned.
    folder : str or Path
        Folder to write; made if it isn't there, in one that is.

    Returns
    -------
    Path
        The report, for a browser; ``verdict.json`` where the packages of the report are not installed.

    Raises
    ------
    InputError
        If the folder can't be written.

    Examples
    --------
    >>> import gfimu
    >>> gfimu.write_report(gfimu.diagnose("run.parquet", "cube12_turntable"), "diagnosis")  # doctest: +SKIP
    """
    from gfimu.diagnosis.report.folder import write_diagnosis

    text, more = _twin_files(diagnosis)
    written = write_diagnosis(folder, diagnosis, twin_toml=text, more=more, rig=drawn_rig(diagnosis))
    return written.get("report", written["verdict"])


def written_files(diagnosis: Diagnosis, folder: str | Path) -> dict[str, Path]:
    """Return the files that `write_report` writes to a folder, by what they are called."""
    from gfimu.diagnosis.report.folder import files_of

    names = files_of(diagnosis, _twin_files(diagnosis)[1])
    return {meaning: Path(folder) / name for name, meaning in names.items()}


def _twin_files(diagnosis: Diagnosis) -> tuple[str, dict[str, str]]:
    """Return the text of the extended twin's file, and the texts of files that it names, by file name."""
    import tomli_w

    from gfimu.files.model_files import list_models
    from sim.twin import Twin

    twin = diagnosis.twin
    if not isinstance(twin, Twin):
        return twin.to_toml(), {}
    content, more = twin.to_dict(), {}
    if twin.array_name not in list_models("arrays"):
        # An array file of the user's, and a calibrated one, is named relative to the twin file: it moves with it.
        content["array"] = "array.toml"
        more["array.toml"] = twin.array.to_toml()
    return tomli_w.dumps(content), more


def drawn_rig(diagnosis: Diagnosis) -> DrawnRig | None:
    """Return how the array of a diagnosis stood on its rig, for pictures; None for a simulation of one's own."""
    from gfimu.diagnosis.report.rig import DrawnRig
    from sim.twin import Twin

    twin = diagnosis.twin
    if not isinstance(twin, Twin):
        return None
    world = twin.world(mounting=np.array(diagnosis.mounting_rotvec_rad))
    lean = None if world.leaning_axis() is None else world.axis_rotvec
    return DrawnRig(world.mount_rotvec, world.cube_offset, _shapes(twin, world), world.slide, lean)


def _shapes(twin: Twin, world: World) -> Mapping[str, Sequence[Shape]] | None:
    """Return the shapes of the rig; None where it has none of its own, or is not drawn here."""
    on_table = world.slide is None and world.leaning_axis() is None
    if twin.drive_source == "gyro" or not on_table or missing("mujoco", "rerun"):
        return None
    from sim.drawing import rig_drawing

    return rig_drawing(world)


def _refuse_fitted(fitted: Sequence[object], held_out: Sequence[object]) -> None:
    """Refuse a run that is fitted and held out both: the gain would be measured on what was fitted."""
    for one in held_out:
        for other in fitted:
            same = one is other
            if not same and isinstance(one, str | os.PathLike) and isinstance(other, str | os.PathLike):
                same = same_file(Path(one), Path(other))
            if same:
                name = one if isinstance(one, str | os.PathLike) else "a recording"
                raise InputError(f"{name}: is fitted and held out; hold out a recording that is not fitted")


def _by_tacho(recording: Recording) -> bool:
    """Return whether a free body's rate is that of a tachometer along its axle, and not of a gyro on the body."""
    return "tacho_rad_s" in recording.reference and "gyro_x_rad_s" not in recording.reference


def _opened(recording: Source, model: WorldModel, unit: Calibration | None) -> Recording:
    """Return a recording with the channels of the twin's array, calibrated where there is a calibration."""
    from gfimu.calibration.run_file import open_calibrated_run
    from gfimu.recording import Recording
    from gfimu.recording.formats import open_recording

    if isinstance(recording, Recording):
        return recording if unit is None else unit.apply(recording)
    if unit is None:
        return open_recording(recording, array=model.array)
    return open_calibrated_run(recording, unit, model.array)[0]


def _names(runs: Sequence[Source]) -> list[str]:
    """Return names for people: file names where they distinguish the runs."""
    paths = [Path(run) if isinstance(run, str | os.PathLike) else None for run in runs]
    short = [path.name if path is not None else f"run {number}" for number, path in enumerate(paths, start=1)]
    if len(set(short)) == len(short):
        return short
    return [str(path) if path is not None else name for path, name in zip(paths, short, strict=True)]
