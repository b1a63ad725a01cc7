"""Under `gfimu check` and `gfimu diagnose --check`: what recordings can show before they are explained."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from gfimu.files.outputs import writes

if TYPE_CHECKING:
    from gfimu.diagnosis.design.run_check import RunCheck
    from gfimu.importing import ColumnMap
    from gfimu.recording.mapped import RecordingLike
    from gfimu.world_model import WorldModel

__all__ = ["check"]


@writes(reads=("recordings", "twin", "column_map"))
def check(
    recordings: RecordingLike | Sequence[RecordingLike],
    twin: WorldModel | str | Path,
    *,
    column_map: ColumnMap | str | Path | None = None,
    map_set: Sequence[str] = (),
) -> RunCheck:
    """Check recordings before a diagnosis: data quality, effects that their motion separates, what to record next.

    Parameters
    ----------
    recordings : Recording, path, table, (times, readings), or sequence of these
        Runs of one rig.
    twin : WorldModel, str or Path
        The simulation to check: a twin, its name or file, or a simulation of one's own (``rig.py:function``).
    column_map : ColumnMap, str or Path, optional
        What the columns of a foreign file are: a map, its name or TOML file (``--map``).
    map_set : sequence of str
        Keys of that map to set, such as ``"time.unit=ms"`` (``--map-set``); without a map they are all of it.

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

    model = as_twin(twin)
    given = [as_source(one, model.array, column_map, map_set) for one in as_runs(recordings)]
    read = [one if isinstance(one, Recording) else open_recording(one, array=model.array) for one in given]
    names = [
        Path(one).name if isinstance(one, str | os.PathLike) else f"run {number}"
        for number, one in enumerate(given, start=1)
    ]
    return check_runs(read, model, names)
