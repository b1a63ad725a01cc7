"""Propose the table profile, or the mounting, that best separates effects.

Examples
--------
gfimu design tacho_scale sensor_position --twin cube12_turntable --max-rate 12 --out next.toml
# The effects of an ambiguous verdict, with the recording at hand
gfimu design --verdict diagnosis/verdict.json --run run.parquet --twin cube12_turntable --out next.toml
"""

import os
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from gfimu.base.errors import InputError
from gfimu.base.files.outputs import OutputFile
from gfimu.commands import given
from gfimu.commands.shell import completion, options
from gfimu.commands.shell.declare import Option, command

if TYPE_CHECKING:
    from collections.abc import Sequence

    from gfimu.diagnosis.design.proposal import Proposal
    from gfimu.model.world_model import Effect

__all__ = ["design"]

_EFFECTS = Option(
    "Effects to distinguish; or use --verdict.", "[EFFECT]...", kind=list[str], argument=True, offers=completion.effects
)
_VERDICT = Option("Take the effects of an ambiguous verdict (verdict.json).", "FILE", reads=True)
_EXPERIMENT = OutputFile("a scenario file", (".toml",))
_RUN = "Recording at hand, to be diagnosed together with the new one; may be repeated."
_OUT = Option("Scenario to write (.toml): the experiment.", "FILE", writes=_EXPERIMENT, what="scenario")


@command(doing="designing")
def design(
    twin: given.Twin,
    effects: Annotated["Sequence[str | Effect]", _EFFECTS] = (),
    *,
    verdict: Annotated["str | Path | None", _VERDICT] = None,
    run: Annotated[given.Runs, Option(_RUN, "RUN", kind=list[Path], reads=True)] = (),
    allow_code: Annotated[bool, options.ALLOW_CODE] = False,
    column_map: given.Map = None,
    max_memory: given.Memory = None,
    max_rate: Annotated[float, Option("Largest rate of the table, rad/s.", "RAD/S")] = 15.0,
    max_acceleration: Annotated[float, Option("Largest angular acceleration of the table, rad/s².", "RAD/S²")] = 20.0,
    duration: Annotated[float, options.DURATION] = 60.0,
    upright: Annotated[bool, Option("Never propose to mount the array differently.")] = False,
    evaluations: Annotated[int, Option("How many profiles to try.", "N", least=1)] = 150,
    seed: Annotated[int, options.SEED] = 0,
    out: Annotated["str | Path | None", _OUT] = None,
    progress: given.Progress = None,
) -> "Proposal":
    """Propose the table profile, or the mounting, that best separates effects.

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

    from gfimu.base.files.atomic_file import write_text
    from gfimu.commands.opened import as_runs, as_source, as_twin
    from gfimu.diagnosis.data.run import prepare_run
    from gfimu.diagnosis.design.ambiguity import open_effects
    from gfimu.diagnosis.design.design import MOUNTINGS, Limits
    from gfimu.diagnosis.design.design import design as propose
    from gfimu.recording.formats import open_recording

    if (verdict is None) == (not effects):
        raise InputError("name effects to distinguish, or give --verdict: one of the two")
    model = as_twin(twin, allow_code=allow_code)
    asked = list(effects) if verdict is None else open_effects(verdict, model)
    at_hand = []
    for number, recording in enumerate(as_runs(run), start=1):
        source = as_source(recording, model.array, column_map, max_memory=max_memory)
        name = str(source) if isinstance(source, str | os.PathLike) else f"run {number}"
        at_hand.append(prepare_run(open_recording(source, array=model.array), model, name=name))
    proposal = propose(
        model,
        asked,
        limits=Limits(max_rate, max_acceleration, duration),
        rng=np.random.default_rng(seed),
        mountings={} if upright else MOUNTINGS,
        recorded=at_hand,
        sample_rate=float(getattr(model, "sample_rate", 100.0)),
        evaluations=evaluations,
        report=progress,
    )
    if out is not None:
        write_text(out, proposal.to_toml())
    return proposal
