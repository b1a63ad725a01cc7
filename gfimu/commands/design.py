"""Under `gfimu design`: the experiment that best separates effects."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from gfimu.errors import InputError
from gfimu.files.outputs import SCENARIO, writes

if TYPE_CHECKING:
    import numpy as np

    from gfimu.diagnosis.data.run import Run
    from gfimu.diagnosis.design.profile_search import Limits
    from gfimu.diagnosis.design.proposal import Proposal
    from gfimu.importing import ColumnMap
    from gfimu.recording.mapped import RecordingLike
    from gfimu.world_model import Effect, WorldModel

__all__ = ["design"]


@writes(reads=("twin", "verdict", "run", "column_map"), out=SCENARIO)
def design(
    twin: WorldModel | str | Path,
    effects: Sequence[str | Effect] = (),
    *,
    verdict: str | Path | None = None,
    run: RecordingLike | Sequence[RecordingLike] = (),
    column_map: ColumnMap | str | Path | None = None,
    map_set: Sequence[str] = (),
    max_rate: float = 15.0,
    max_acceleration: float = 20.0,
    duration: float = 60.0,
    upright: bool = False,
    evaluations: int = 150,
    seed: int = 0,
    out: str | Path | None = None,
    limits: Limits | None = None,
    rng: np.random.Generator | None = None,
    mountings: Mapping[str, tuple[float, float, float]] | None = None,
    recorded: Sequence[Run] = (),
    sample_rate: float | None = None,
    report: Callable[[float, str], None] | None = None,
) -> Proposal:
    """Propose the table profile, or the mounting, that best separates effects.

    Parameters
    ----------
    twin : WorldModel, str or Path
        The simulation: a twin, its name or file, or one of one's own (``rig.py:function``).
    effects : sequence of str or Effect
        Effects to distinguish; or give ``verdict``.
    verdict : str or Path, optional
        Take the effects of an ambiguous verdict (``verdict.json``, or the folder that holds it).
    run : Recording, path, or sequence of these
        Recordings at hand, to be diagnosed together with the new one.
    column_map : ColumnMap, str or Path, optional
        What the columns of these are, where they are foreign files: a map, its name or TOML file (``--map``).
    map_set : sequence of str
        Keys of that map to set, such as ``"time.unit=ms"`` (``--map-set``); without a map they are all of it.
    max_rate, max_acceleration : float
        Largest rate, rad/s, and angular acceleration, rad/s², of the table.
    duration : float
        Length of the recording, s.
    upright : bool
        Never propose to mount the array differently.
    evaluations : int
        How many profiles to try.
    seed : int
        Seed of the search.
    out : str or Path, optional
        Scenario file of the experiment to write, ``.toml``.
    limits : Limits, optional
        In place of ``max_rate``, ``max_acceleration`` and ``duration``.
    rng : numpy.random.Generator, optional
        In place of ``seed``.
    mountings : mapping, optional
        How else the array may be mounted, in place of ``upright``; see `gfimu.diagnosis.design.design.MOUNTINGS`.
    recorded : sequence of Run
        Prepared recordings at hand, beside ``run``.
    sample_rate : float, optional
        Sample rate of the recording, Hz; the twin's by default.
    report : callable, optional
        Called with the share done, 0 to 1, and a line of text.

    Raises
    ------
    InputError
        If effects are missing, unknown or have no size, the twin is not driven by a table, the limits leave no
        motion, or the output can't be written where it is asked for.

    Examples
    --------
    >>> import gfimu
    >>> gfimu.design("cube12_turntable", ["tacho_scale", "scale_factor"]).separates  # doctest: +SKIP
    """
    import numpy as np

    from gfimu.commands.opened import as_runs, as_source, as_twin
    from gfimu.diagnosis.data.run import prepare_run
    from gfimu.diagnosis.design.ambiguity import open_effects
    from gfimu.diagnosis.design.design import MOUNTINGS, Limits
    from gfimu.diagnosis.design.design import design as propose
    from gfimu.files.atomic_file import write_text
    from gfimu.recording import Recording
    from gfimu.recording.formats import open_recording

    if (verdict is None) == (not effects):
        raise InputError("name effects to distinguish, or give --verdict: one of the two")
    model = as_twin(twin)
    asked = list(effects) if verdict is None else open_effects(verdict, model)
    at_hand = [
        prepare_run(
            item if isinstance(item, Recording) else open_recording(item, array=model.array),
            model,
            name=str(item) if isinstance(item, str | os.PathLike) else f"run {number}",
        )
        for number, item in enumerate(
            (as_source(one, model.array, column_map, map_set) for one in as_runs(run)), start=1
        )
    ]
    proposal = propose(
        model,
        asked,
        limits=limits or Limits(max_rate, max_acceleration, duration),
        rng=np.random.default_rng(seed) if rng is None else rng,
        mountings={} if upright else MOUNTINGS if mountings is None else mountings,
        recorded=[*recorded, *at_hand],
        sample_rate=sample_rate or float(getattr(model, "sample_rate", 100.0)),
        evaluations=evaluations,
        report=report,
    )
    if out is not None:
        write_text(out, proposal.to_toml())
    return proposal
