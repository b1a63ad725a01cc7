"""Check recordings before a diagnosis: data quality, effects that their motion separates, what to record next.

Writes nothing.

Examples
--------
gfimu check run.parquet --twin cube12_turntable
# Several recordings of one rig
gfimu check slow.parquet fast.parquet --twin cube12_turntable
"""

import os
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from gfimu.commands.shell.declare import command
from gfimu.commands.shell.options import ALLOW_CODE, MAP, MAX_MEMORY, RECORDINGS, TWIN

if TYPE_CHECKING:
    from collections.abc import Sequence

    from gfimu.base.files.memory import MemorySize
    from gfimu.diagnosis.design.run_check import RunCheck
    from gfimu.model.world_model import WorldModel
    from gfimu.recording.importing import ColumnMap
    from gfimu.recording.mapped import RecordingLike

__all__ = ["check"]


def _results() -> tuple[type, ...]:
    from gfimu.diagnosis.design.run_check import RunCheck

    return (RunCheck,)


@command(results=_results, doing="looking at the recordings")
def check(
    recordings: Annotated["RecordingLike | Sequence[RecordingLike]", RECORDINGS],
    twin: Annotated["WorldModel | str | Path", TWIN],
    *,
    allow_code: Annotated[bool, ALLOW_CODE] = False,
    column_map: Annotated["ColumnMap | str | Path | None", MAP] = None,
    max_memory: Annotated["MemorySize | None", MAX_MEMORY] = None,
) -> "RunCheck":
    """Check recordings before a diagnosis: data quality, effects that their motion separates, what to record next.

    Raises
    ------
    InputError
        If a recording can't be read, is too short, or lacks the reference that drives the twin.

    Examples
    --------
    >>> import gfimu
    >>> run = gfimu.simulate("paper_run", seed=1)
    >>> seen = gfimu.check(run, "cube12_turntable")
    >>> seen.findings
    ()
    """
    from gfimu.commands.opened import as_runs, as_source, as_twin
    from gfimu.diagnosis.design.run_check import check_runs
    from gfimu.recording import Recording
    from gfimu.recording.formats import open_recording

    model = as_twin(twin, allow_code=allow_code)
    given = [as_source(one, model.array, column_map, max_memory=max_memory) for one in as_runs(recordings)]
    read = [one if isinstance(one, Recording) else open_recording(one, array=model.array) for one in given]
    names = [
        Path(one).name if isinstance(one, str | os.PathLike) else f"run {number}"
        for number, one in enumerate(given, start=1)
    ]
    return check_runs(read, model, names)
