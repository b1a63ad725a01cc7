"""Under `gfimu impact`: one impact in a recording, as crash and head-impact tests report it."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from gfimu.files.outputs import ESTIMATE, PICTURE, RECORDING, writes

if TYPE_CHECKING:
    from gfimu.calibration.result import Calibration
    from gfimu.crash.event import Impact
    from gfimu.geometry.array import AccelerometerArray
    from gfimu.importing import ColumnMap
    from gfimu.recording.mapped import RecordingLike

__all__ = ["impact"]


@writes(reads=("recording", "array", "calibration", "column_map"), out=RECORDING, estimate=ESTIMATE, picture=PICTURE)
def impact(
    recording: RecordingLike,
    array: AccelerometerArray | str | Path | None = None,
    *,
    cfc: float = 1000.0,
    standard: str = "sae",
    threshold_g: float = 5.0,
    direction: str = "",
    calibration: Calibration | str | Path | None = None,
    column_map: ColumnMap | str | Path | None = None,
    map_set: Sequence[str] = (),
    out: str | Path | None = None,
    estimate: str | Path | None = None,
    picture: str | Path | None = None,
    force: bool = False,
) -> Impact:
    """Measure one impact: channels zeroed and filtered to a frequency class, time zero, polarity, peaks of p, α and ω.

    Parameters
    ----------
    recording : Recording, path, table, or times (n,) with readings (n, c)
        The recording, or its file; the largest impact in it is measured.
    array : AccelerometerArray, str or Path, optional
        The array, its name or file; the recording's own by default.
    cfc : float
        Channel frequency class: 1000 (head), 600, 180, 60, or another.
    standard : {"sae", "iso"}
        SAE J211-1 or ISO 6487.
    threshold_g : float
        Change of a channel that is an impact, g.
    direction : {"+x", "-x", "+y", "-y", "+z", "-z"}, optional
        Where the body is accelerated, body frame, if that is known; the polarity is checked by it.
    calibration : Calibration, str or Path, optional
        Calibration to apply first.
    column_map : ColumnMap, str or Path, optional
        What the columns of a foreign file are: a map, its name or TOML file (``--map``); see `gfimu.inspect`.
    map_set : sequence of str
        Keys of that map to set, such as ``"time.unit=ms"`` (``--map-set``); without a map they are all of it.
    out : str or Path, optional
        Recording to write: the channels, zeroed and filtered, time from time zero.
    estimate : str or Path, optional
        Estimate to write: p, α, ω in the same time.
    picture : str or Path, optional
        Picture to write, ``.png``, ``.svg`` or ``.pdf``.
    force : bool
        Go on, with a warning, where the checks of the recording would refuse it.

    Returns
    -------
    Impact
        `gfimu.crash.event.Impact`.

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
    from gfimu.commands.opened import as_calibrated_run, as_source, name_of
    from gfimu.crash.event import ImpactSettings, measure_impact
    from gfimu.recording.checks import examine
    from gfimu.units import STANDARD_GRAVITY

    settings = ImpactSettings(cfc, standard, threshold_g * STANDARD_GRAVITY, direction=direction)
    run, geometry = as_calibrated_run(as_source(recording, array, column_map, map_set), array, calibration)
    examine(run, geometry, source=name_of(recording), force=force)
    measured = measure_impact(run, geometry, settings)
    if out is not None:
        measured.recording.write(out)
    if estimate is not None:
        measured.motion.write(estimate)
    if picture is not None:
        from gfimu.crash.picture import impact_picture

        impact_picture(picture, measured)
    return measured
