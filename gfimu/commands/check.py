"""Check recordings before a diagnosis: data quality, effects that their motion separates, what to record next.

Writes nothing.

Examples
--------
gfimu check run.parquet --twin cube12_turntable
# Several recordings of one rig
gfimu check slow.parquet fast.parquet --twin cube12_turntable
"""

from typing import TYPE_CHECKING, Annotated

from gfimu.commands import given
from gfimu.commands.shell.declare import command
from gfimu.commands.shell.options import ALLOW_CODE

if TYPE_CHECKING:
    from gfimu.diagnosis.design.run_check import RunCheck

__all__ = ["check"]


@command(doing="looking at the recordings")
def check(
    recordings: given.Runs,
    twin: given.Twin,
    *,
    allow_code: Annotated[bool, ALLOW_CODE] = False,
    column_map: given.Map = None,
    max_memory: given.Memory = None,
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
    from gfimu.commands.opened import as_runs, as_source, as_twin, names_of
    from gfimu.diagnosis.design.run_check import check_runs
    from gfimu.recording.formats import open_recording

    model = as_twin(twin, allow_code=allow_code)
    sources = [as_source(one, model.array, column_map, max_memory=max_memory) for one in as_runs(recordings)]
    read = [open_recording(source, array=model.array) for source in sources]
    return check_runs(read, model, names_of(sources))
