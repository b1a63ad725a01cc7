"""Measure one impact: channels zeroed and filtered to a class, time zero, polarity, peaks of p, α and ω.

Examples
--------
gfimu impact drop.csv --array nap.toml --cfc 1000 --direction +x --picture drop.png
# The filtered channels and the motion as files
gfimu impact drop.csv --array nap.toml --cfc 180 --out drop_cfc180.csv --estimate drop_motion.csv
"""

from typing import TYPE_CHECKING, Annotated, Literal

from gfimu.commands import given
from gfimu.commands.shell.declare import Option, command
from gfimu.commands.shell.options import ESTIMATE_OUT, FORCE, RECORDING_OUT

if TYPE_CHECKING:
    from pathlib import Path

    from gfimu.motion.impact.event import Impact

__all__ = ["impact"]

_RECORDING = given.RUN.also(" with the impact, the largest in it: .csv, .parquet; another with --map.")
_DIRECTION = Option("Where the body is accelerated (+x, -x, …): the polarity is checked.")


@command(doing="measuring the impact")
def impact(
    recording: Annotated[given.Run, _RECORDING],
    array: given.Array = None,
    *,
    cfc: Annotated[float, Option("Channel frequency class: 1000 (head), 600, 180, 60, or another.")] = 1000.0,
    standard: Annotated[Literal["sae", "iso"], Option("Of the filter: sae (J211-1) or iso (6487).", "NAME")] = "sae",
    threshold_g: Annotated[float, Option("Change of a channel that counts, g.")] = 5.0,
    direction: Annotated[Literal["+x", "-x", "+y", "-y", "+z", "-z"] | None, _DIRECTION] = None,
    calibration: given.CalibrationToApply = None,
    column_map: given.Map = None,
    max_memory: given.Memory = None,
    out: Annotated["str | Path | None", RECORDING_OUT.also(": channels zeroed and filtered, from time zero")] = None,
    estimate: Annotated["str | Path | None", ESTIMATE_OUT.also(": p, α, ω from time zero")] = None,
    picture: given.Picture = None,
    force: Annotated[bool, FORCE] = False,
) -> "Impact":
    """Measure one impact: channels zeroed and filtered to a frequency class, time zero, polarity, peaks of p, α and ω.

    ``recording`` is a `Recording`, its file, a table, or times (n,), s, with readings (n, c), m/s².

    Raises
    ------
    InputError
        If the recording can't be read, is refused by its checks, has gaps, is sampled too slowly for the class, holds
        no impact or begins within it, or an output can't be written where it is asked for.

    Examples
    --------
    >>> import gfimu
    >>> gfimu.impact("drop.csv", array="cube12").plot()  # doctest: +SKIP
    """
    from gfimu.base.units import STANDARD_GRAVITY
    from gfimu.commands.opened import as_calibrated_run, as_source, name_of
    from gfimu.motion.impact.event import ImpactSettings, measure_impact
    from gfimu.recording.doubts.judge import examine

    settings = ImpactSettings(cfc, standard, threshold_g * STANDARD_GRAVITY, direction=direction or "")
    source = as_source(recording, array, column_map, max_memory=max_memory)
    run, geometry = as_calibrated_run(source, array, calibration)
    examine(run, geometry, source=name_of(recording), force=force)
    measured = measure_impact(run, geometry, settings)
    if out is not None:
        measured.recording.write(out)
    if estimate is not None:
        measured.motion.write(estimate)
    if picture is not None:
        measured.to_picture(picture)
    return measured
