"""Compare recordings with a simulation: name the causes of the difference, extend the simulation, measure the gain.

Writes the verdict, the extended twin, a report for people and a rerun recording to a folder. The exit code is 0
whatever the verdict. At the time limit the result is what is known by then; at Ctrl-C and SIGTERM too, with the
exit codes 130 and 143.

Examples
--------
gfimu diagnose run.parquet --twin cube12_turntable --out diagnosis
# What the recording can show, first
gfimu diagnose run.parquet --twin cube12_turntable --check
# A rig known to be unusual
# Two loggers with two clocks
gfimu diagnose accel.csv --map mine.toml --reference tacho.csv --twin rig.toml --out diagnosis
# A unit fresh from the bench
gfimu diagnose run.parquet --twin cube12_turntable --calibration cal.json --out diagnosis
"""

import itertools
import os
import time
import warnings
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from gfimu.base.errors import InputError
from gfimu.base.files.outputs import OutputFolder, check_outputs, same_file
from gfimu.base.optional_packages import missing
from gfimu.commands import given
from gfimu.commands.check import check as look
from gfimu.commands.shell import options
from gfimu.commands.shell.declare import Option, command, command_of

if TYPE_CHECKING:
    from gfimu.diagnosis.report.rig import DrawnRig
    from gfimu.diagnosis.verdict.verdict import Diagnosis
    from gfimu.model.world_model import WorldModel
    from gfimu.recording import Recording
    from gfimu.recording.joining import Joined, ReferenceSeries

__all__ = ["FOLDER", "diagnose", "write_report"]

EXPLAINED = frozenset({"sign", "exchange", "dead", "rest_bias", "clipped", "frozen", "wrong_read", "corrupt"})
"""Findings of a recording's checks that are effects of the library: the diagnosis explains them."""

FOLDER = OutputFolder(("verdict.json", "twin.toml", "report.html", "diagnosis.rrd", "array.toml"))
"""What the folder of a diagnosis holds."""

_TIME_LIMIT_S = 600.0
"""Time that a diagnosis may take by default, s. By choice: most take a minute."""


def _results() -> tuple[type, ...]:
    from gfimu.diagnosis.design.run_check import RunCheck
    from gfimu.diagnosis.verdict.verdict import Diagnosis

    return Diagnosis, RunCheck


@dataclass(frozen=True)
class _Report:
    """What the shell prints: what the recordings show, and the diagnosis."""

    found: "Diagnosis"
    values: Mapping[str, Any]

    def to_dict(self) -> dict[str, Any]:
        """Return the diagnosis as JSON holds it."""
        return self.found.to_dict()

    def shown(self) -> Iterator[Any]:
        """Yield tables and sentences."""
        from gfimu.base.declared import Line
        from gfimu.diagnosis.report.plain_words import headline
        from gfimu.diagnosis.report.tables import diagnosis_tables

        yield from () if self.found.interrupted else self._recordings()
        yield Line(headline(self.found), style="bold")
        yield from diagnosis_tables(self.found)

    def _recordings(self) -> list[str]:
        """Return what the recordings show; nothing where the check refuses them, which the diagnosis reports."""
        from gfimu.commands.shell.output import progress

        with progress("looking at the recordings"), warnings.catch_warnings():
            warnings.simplefilter("ignore")
            try:
                return list(look(**command_of(look).taken(self.values)).in_short())
            except InputError:
                return []

    def exit_code(self) -> int:
        """Return the exit code, and say on standard error what ended the diagnosis early."""
        from gfimu.commands.shell.output import print_text
        from gfimu.commands.shell.stop_signals import INTERRUPTED, TERMINATED
        from gfimu.diagnosis.time_limit import TIME_LIMIT as OUT_OF_TIME

        end = self.found.interrupted
        if end is None:
            return 0
        print_text(f"gfimu: ended by {end.by} ({end.stage}); the result is what was known", stderr=True)
        return {OUT_OF_TIME: 0, "SIGTERM": TERMINATED}.get(end.by, INTERRUPTED)


def _run(
    values: dict[str, Any],
    as_json: bool,
    *,
    check: Annotated[bool, Option("Only look at the recordings, as `gfimu check`: no diagnosis, no --out.")] = False,
) -> None:
    from gfimu.commands.shell.printing import print_report

    if not check and values["out"] is None:
        raise InputError("--out is missing: the folder for the diagnosis; --check needs none")
    declared = command_of(look if check else diagnose)
    print_report(declared, declared.taken(values), as_json=as_json)


_OUT = Option(
    "Folder to write: verdict.json, twin.toml with its array, report.html, diagnosis.rrd.", "FILE", writes=FOLDER
)
_HELD_OUT = Option("Recording kept for measuring the gain; may be repeated.", "RUN", kind=list[Path], reads=True)
_LIMIT = options.TIME_LIMIT.also(". What is known by then is the result, and described so")
_REFERENCE = Option("Reference of the first run on a clock of its own; aligned as by `gfimu join`.", "FILE", reads=True)
_NAMES = Option("Names of the runs, for people; those of their files by default.", shell=False)


@command(
    results=_results,
    doing="diagnosing",
    report=_Report,
    run=_run,
    files=lambda found, values: _written_files(found, values["out"]),
    exit_code=_Report.exit_code,
)
def diagnose(
    recordings: Annotated[given.Runs, options.RECORDINGS.also("; fitted together")],
    twin: given.Twin,
    *,
    out: Annotated["str | Path | None", _OUT] = None,
    held_out: Annotated[given.Runs, _HELD_OUT] = (),
    calibration: given.CalibrationToApply = None,
    force: Annotated[bool, options.FORCE] = False,
    allow_code: Annotated[bool, options.ALLOW_CODE] = False,
    time_limit: Annotated[float, _LIMIT] = _TIME_LIMIT_S,
    column_map: given.Map = None,
    max_memory: given.Memory = None,
    reference: Annotated["ReferenceSeries | str | Path | None", _REFERENCE] = None,
    reference_map: given.ReferenceMap = None,
    names: Annotated["Sequence[str] | None", _NAMES] = None,
    progress: given.Progress = None,
) -> "Diagnosis":
    """Compare recordings with a simulation: name the causes of the difference, extend the simulation, measure the gain.

    The simulation may be one of your own, as such or as ``rig.py:function`` (`gfimu.model.own_rig.load_model`).

    The folder holds ``array.toml`` too where the twin's array is no shipped one. A file whose package is not installed
    is left out, with a warning before the work begins. A diagnosis that the time limit (infinite: none) or Ctrl-C ends
    says in its ``interrupted`` what was done and what was not; writing the files takes longer.

    Returns
    -------
    Diagnosis
        The verdict with its numbers.

    Raises
    ------
    InputError
        If a recording is too short, lacks the reference that drives the twin, is refused by its checks, or is held
        out and fitted both; the time limit is not positive; or the folder can't be written.

    Examples
    --------
    >>> import gfimu
    >>> run = gfimu.simulate("rest", seed=1)
    >>> found = gfimu.diagnose(run, twin="cube12_turntable")  # doctest: +SKIP
    >>> found.verdict, found.gain.share_of_excess_removed  # doctest: +SKIP
    >>> found.plot()  # doctest: +SKIP
    """
    from gfimu.commands.opened import as_calibrated_run, as_calibration, as_runs, as_source, as_twin, names_of
    from gfimu.diagnosis.time_limit import limited_to
    from gfimu.recording.doubts.judge import examine
    from gfimu.recording.joining import displaced_reference

    if not time_limit > 0.0:
        raise InputError(f"the time limit is {time_limit:g} s; it must be above zero (--time-limit SECONDS)")
    began = time.monotonic()
    if out is not None:
        from gfimu.diagnosis.report.folder import warn_of_omitted

        warn_of_omitted()
    model = as_twin(twin, allow_code=allow_code)
    runs, unseen = (
        [as_source(run, model.array, column_map, max_memory=max_memory) for run in as_runs(group)]
        for group in (recordings, held_out)
    )
    _refuse_fitted(runs, unseen)
    unit = None if calibration is None else as_calibration(calibration)
    read, kept = ([as_calibrated_run(run, model.array, unit)[0] for run in group] for group in (runs, unseen))
    if unit is not None and unit.positions:
        model = model.with_array(unit.calibrated_array(model.array))
    labels = names_of(runs) if names is None else names
    for run, name in zip((*read, *kept), (*labels, *names_of(unseen)), strict=True):
        examine(run, model.array, source=name, force=force, apart_from=EXPLAINED, whose="")
    free = model.drive_source == "gyro"
    clocks = [displaced_reference(run, rates=free) if not free or _by_tacho(run) else None for run in read]
    if reference is not None:
        from gfimu.commands.join import join

        clocks[0] = join(read[0], reference, reference_map=reference_map, max_memory=max_memory)
    with limited_to(time_limit - (time.monotonic() - began)):
        aligned = list(zip(read, clocks, strict=True))
        search = {"held_out": kept, "names": labels, "report": progress, "force": force}
        found, used = _explained(aligned, model, two_files=reference is not None, **search)
    if used.mounting_rotvec.any():
        x, y, z = used.mounting_rotvec.tolist()
        found = replace(found, mounting_rotvec_rad=(x, y, z))
    if out is not None:
        if progress is not None:
            progress(0.99, "write the report")
        write_report(found, out)
    return found


def _explained(
    aligned: "Sequence[tuple[Recording, Joined | None]]", model: "WorldModel", *, two_files: bool, **search: Any
) -> "tuple[Diagnosis, Recording]":
    """Return the diagnosis of recordings whose references are aligned where they had another clock, and the first run.

    The rate error of a clock is left in, so that it is diagnosed beside all else. Where the alignment shows one and the
    diagnosis doesn't name it, or the model is of a free body, which has no such effect, it is taken off.
    """
    from gfimu.diagnosis.diagnose import diagnose as diagnosed
    from gfimu.diagnosis.verdict.parts import ReferenceClock
    from gfimu.diagnosis.verdict.sample_notes import with_reference_clock

    def explain(*, own_rate: bool) -> "tuple[Diagnosis, Recording]":
        runs = [
            run if clock is None else (clock.by_own_rate if own_rate else clock.by_reference_clock)
            for run, clock in aligned
        ]
        return diagnosed(runs, model, **search), runs[0]

    first = next((clock for _, clock in aligned if clock is not None), None)
    free = model.drive_source == "gyro"
    found, used = explain(own_rate=not free)
    if first is None or found.interrupted:
        return found, used
    corrected = ["tacho_latency"] if first.is_far and not two_files else []
    if first.has_rate_error and "clock_error" not in {cause.effect for cause in found.causes}:
        corrected.append("clock_error")
        if not free:
            again, run = explain(own_rate=False)
            if again.interrupted:  # what is known is the verdict with the clock's error left in
                return replace(found, interrupted=again.interrupted), used
            found, used = again, run
    return with_reference_clock(found, ReferenceClock(**first.clock), corrected, model), used


def write_report(diagnosis: "Diagnosis", folder: str | Path) -> Path:
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

    check_outputs([("folder", folder, FOLDER)])
    written = write_diagnosis(folder, diagnosis, more=_twin_files(diagnosis), rig=drawn_rig(diagnosis))
    return written.get("report", written["verdict"])


def _written_files(diagnosis: "Diagnosis", folder: str | Path) -> dict[str, Path]:
    """Return the files that `write_report` writes to a folder, by what they are called."""
    from gfimu.diagnosis.report.folder import files_of

    names = files_of(diagnosis, _twin_files(diagnosis))
    return {meaning: Path(folder) / name for name, meaning in names.items()}


def _twin_files(diagnosis: "Diagnosis") -> dict[str, str]:
    """Return the texts of array file and twin file where the array is no shipped one, and moves with the twin."""
    from gfimu.base.files.model_files import list_models
    from sim.twin import Twin

    twin = diagnosis.twin
    if not isinstance(twin, Twin) or twin.array_name in list_models("arrays"):
        return {}
    return {"twin.toml": replace(twin, array_name="array.toml").to_toml(), "array.toml": twin.array.to_toml()}


def drawn_rig(diagnosis: "Diagnosis") -> "DrawnRig | None":
    """Return how the array of a diagnosis stood on its rig, for pictures; None for a simulation of one's own."""
    import numpy as np

    from gfimu.diagnosis.report.rig import DrawnRig
    from sim.twin import Twin

    twin = diagnosis.twin
    if not isinstance(twin, Twin):
        return None
    world = twin.world(mounting=np.array(diagnosis.mounting_rotvec_rad))
    leans, shapes = world.leaning_axis() is not None, None
    if not leans and world.slide is None and twin.drive_source != "gyro" and not missing("mujoco", "rerun"):
        from sim.drawing import rig_drawing

        shapes = rig_drawing(world)
    return DrawnRig(world.mount_rotvec, world.cube_offset, shapes, world.slide, world.axis_rotvec if leans else None)


def _refuse_fitted(fitted: Sequence[object], held_out: Sequence[object]) -> None:
    """Refuse a run that is fitted and held out both: the gain would be measured on what was fitted."""
    for kept, other in itertools.product(held_out, fitted):
        paths = [Path(run) for run in (kept, other) if isinstance(run, str | os.PathLike)]
        if kept is other or (len(paths) == 2 and same_file(*paths)):
            name = kept if paths else "a recording"
            raise InputError(f"{name}: is fitted and held out; hold out a recording that is not fitted")


def _by_tacho(recording: "Recording") -> bool:
    """Return whether a free body's rate is that of a tachometer along its axle, and not of a gyro on the body."""
    return "tacho_rad_s" in recording.reference and "gyro_x_rad_s" not in recording.reference
