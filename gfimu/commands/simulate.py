"""Under `gfimu simulate`: a recording from a scenario."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from gfimu.files.outputs import RECORDING, RERUN, writes

if TYPE_CHECKING:
    from gfimu.recording import Recording
    from sim.scenarios import Scenario

__all__ = ["simulate"]


@writes(reads=("scenario",), out=RECORDING, rrd=RERUN)
def simulate(
    scenario: Scenario | str | Path,
    *,
    out: str | Path | None = None,
    seed: int = 0,
    changes: Sequence[str] = (),
    raw: bool = False,
    rrd: str | Path | None = None,
    progress: Callable[[float], None] | None = None,
) -> Recording:
    """Simulate a scenario on the MuJoCo turntable and return what the board would have recorded.

    Parameters
    ----------
    scenario : Scenario, str or Path
        The scenario, its name, or a scenario or twin file (.toml).
    out : str or Path, optional
        Recording to write, ``.csv`` or ``.parquet``.
    seed : int
        Seed of all random numbers.
    changes : sequence of str
        Changes to keys of the scenario file, such as ``"sensor.range_g=8"`` (``--set``).
    raw : bool
        Keep the readings as counts of the converter.
    rrd : str or Path, optional
        Rerun recording to write.
    progress : callable, optional
        Called with the share done, 0 to 1.

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
    from gfimu.errors import InputError
    from sim.scenarios import Scenario
    from sim.simulation import simulate as run_scenario

    if seed < 0:
        raise InputError(f"seed {seed}: must be zero or positive")
    if isinstance(scenario, Scenario):
        if changes:
            raise InputError("changes apply to a scenario file; change the Scenario object with dataclasses.replace")
        run = scenario
    else:
        run = Scenario.load(scenario, changes=changes)
    recording = run_scenario(run, seed=seed, out=out, raw=raw, progress=progress)
    if rrd is not None:
        _draw(rrd, run, recording)
    return recording


def _draw(rrd: str | Path, run: Scenario, recording: Recording) -> None:
    """Draw what was simulated: on its turntable, about a level or inclined axis, on a carriage, or free."""
    from dataclasses import replace

    from gfimu.visual import write_run
    from sim.drawing import array_on_axis, rig_drawing
    from sim.truth import known_motion

    array, known = run.array, known_motion(recording)
    hung = None if run.free else array_on_axis(run.world)
    if hung is not None:
        array, lift = hung
        known = replace(known, position=known.position + lift)
    on_table = not run.free and hung is None and run.world.slide is None
    shapes = rig_drawing(run.world) if on_table else None
    write_run(rrd, _in_si(recording), array, known=known, shapes=shapes, title=run.name)


def _in_si(recording: Recording) -> Recording:
    """Return the readings in m/s²."""
    from dataclasses import replace

    if recording.unit == "m_s2":
        return recording
    return replace(recording, readings=recording.readings * recording.metadata["lsb_m_s2"], unit="m_s2")
