"""The files that a user writes by hand, and the schema of each."""

from __future__ import annotations

import importlib
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from gfimu.base.errors import InputError, check_name

if TYPE_CHECKING:
    import msgspec

__all__ = ["FILE_KINDS", "check_file", "file_schema"]

FILE_KINDS = {
    "array": "gfimu.array.array_file.ArrayFile",
    "part": "gfimu.array.parts.part_file.PartFile",
    "map": "gfimu.recording.importing.column_map.ColumnMap",
    "twin": "sim.twin_file.TwinFile",
    "scenario": "sim.scenario_file.ScenarioFile",
    "frame": "firmware_bridge.frames.format_file.FormatFile",
    "stage": "gfimu.calibration.certificate.stage.stage.Stage",
    "plan": "sim.trials.sweep.plan.PlanFile",
    "brief": "gfimu.array_search.brief.BriefFile",
}
"""Kinds of files by name, and where the struct stands that is the schema of each: one kind must not wait for MuJoCo,
which another one takes and a light installation lacks."""


def file_schema(kind: str) -> type[msgspec.Struct]:
    """Return the struct of a kind of file; raises `InputError` for an unknown kind."""
    check_name("kind", kind, FILE_KINDS)
    module, _, name = FILE_KINDS[kind].rpartition(".")
    found: type[msgspec.Struct] = getattr(importlib.import_module(module), name)
    return found


_MARKS = {
    "array": "chip",
    "part": "noise_lsb_rms_100_hz",
    "plan": "factors",
    "frame": "stream",
    "map": "channels",
    "scenario": "motion",
    "stage": "stage",
    "brief": "volume",
    "twin": "array",
}
"""A key by which each kind of file is known, the first kind that has it."""


def check_file(data: Mapping[str, Any], source: str) -> str:
    """Check the content of a file by the schema of its kind.

    Returns
    -------
    str
        The kind, found by its keys.

    Raises
    ------
    InputError
        If it is of no kind, or a key is missing, unknown or has a wrong value.
    """
    import msgspec

    from gfimu.base.files.schema import Table, read
    from gfimu.recording.importing.column_map import complete

    kind = next((kind for kind, key in _MARKS.items() if key in data), None)
    if kind is None:
        raise InputError(f"{source}: is no {', '.join(_MARKS)} file; gfimu new writes one to start from")
    schema = file_schema(kind)
    if issubclass(schema, Table):
        read(data, schema, source)
        return kind
    try:
        msgspec.convert({"name": "", **complete(data)}, schema)
    except msgspec.ValidationError as error:
        raise InputError(f"{source}: {error}; correct the {kind}") from None
    return kind
