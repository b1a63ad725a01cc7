"""Simulate a scenario on the MuJoCo turntable and write what the board would have recorded.

Examples
--------
gfimu simulate paper_run --out run.parquet --seed 1
# Keys of the scenario changed
gfimu simulate paper_run --out run.csv --set sensor.range_g=8 --set duration_s=5
# With a picture for the rerun viewer
gfimu simulate tumble --out tumble.parquet --rrd tumble.rrd
"""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from gfimu.base.errors import InputError
from gfimu.commands import given
from gfimu.commands.shell.declare import Option, command
from gfimu.commands.shell.options import MAX_MEMORY, RECORDING_OUT, RRD, SCENARIO, SEED, SHARE

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from gfimu.recording import Recording
    from sim.scenarios import Scenario
    from sim.simulation import Simulated

__all__ = ["simulate"]

_CHANGES = Option("Change a key of the scenario file; may be repeated.", "KEY=VALUE", name="--set", kind=list[str])


def _recording(simulated: "Simulated") -> "Recording":
    return simulated.recording


@command(gives=_recording, doing=lambda values: f"simulating {values['scenario']}")
def simulate(
    scenario: Annotated["Scenario | str | Path", SCENARIO.also(" or a twin file", argument=True)],
    *,
    out: Annotated["str | Path | None", RECORDING_OUT.also(needed=True)] = None,
    seed: Annotated[int, SEED] = 0,
    changes: Annotated["Sequence[str]", _CHANGES] = (),
    raw: Annotated[bool, Option("Keep the readings as counts of the converter.")] = False,
    max_memory: Annotated[given.Memory, MAX_MEMORY.also("; of the run, half of the machine's")] = None,
    rrd: Annotated["str | Path | None", RRD] = None,
    progress: Annotated["Callable[[float], None] | None", SHARE] = None,
) -> "Simulated":
    """Simulate a scenario on the MuJoCo turntable and return what the board would have recorded.

    Returns
    -------
    Recording
        As `sim.simulation.simulate`: readings, references and the truth.

    Raises
    ------
    InputError
        If the scenario or a change is wrong, or an output can't be written where it is asked for.

    Examples
    --------
    >>> import gfimu
    >>> run = gfimu.simulate("paper_run", seed=1)
    >>> run.readings.shape
    (3000, 12)
    """
    from gfimu.base.files.memory import MemoryLimit, with_memory
    from sim.scenarios import Scenario
    from sim.simulation import memory_of, summarise
    from sim.simulation import simulate as run_scenario

    if isinstance(scenario, Scenario):
        if changes:
            raise InputError("changes apply to a scenario file; change the Scenario object with dataclasses.replace")
        run = scenario
    else:
        run = Scenario.load(scenario, changes=changes)
        MemoryLimit.of_work(with_memory(scenario, max_memory)).needs(memory_of(run))
    recording = run_scenario(run, seed=seed, out=out, raw=raw, progress=progress)
    if rrd is not None:
        from sim.drawing import draw_simulated

        draw_simulated(rrd, run, recording)
    return summarise(run, recording)
