"""Under `gfimu schema`: the JSON schema of what each command prints with --json."""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

from gfimu.files.outputs import JSON_SCHEMA, writes

if TYPE_CHECKING:
    from collections.abc import Mapping
    from pathlib import Path

__all__ = ["schema", "schema_names"]

_RESULTS: dict[str, tuple[str, ...]] = {
    "benchmark judge": ("benchmarks.BenchmarkJudged",),
    "benchmark list": ("benchmarks.BenchmarkListed",),
    "benchmark run": ("benchmarks.BenchmarkRun",),
    "benchmark table": ("benchmarks.BenchmarkJudged",),
    "benchmark worlds": ("benchmarks.BenchmarkWorlds",),
    "calibrate": ("calibrations.Calibrated",),
    "campaign": ("campaigns.Campaign",),
    "campaign plot": ("campaigns.CampaignPlot",),
    "campaign status": ("campaigns.CampaignStatus",),
    "campaign table": ("campaigns.CampaignTable",),
    "certificate": (),
    "check": ("diagnoses.Checked",),
    "convert": ("recordings.Converted", "recordings.ConvertedArray", "recordings.ConvertedCalibration"),
    "demo": ("first_steps.Demo",),
    "design": ("diagnoses.Designed",),
    "diagnose": ("diagnoses.Diagnosed", "diagnoses.Checked"),
    "drift": (
        "errors_of_arrays.Drift",
        "errors_of_arrays.RestDrift",
        "errors_of_arrays.EquivalentErrors",
        "errors_of_arrays.AxisDrift",
    ),
    "estimate": ("motions.Estimated",),
    "firmware build": ("firmware.Built",),
    "firmware check": ("firmware.StrictChecked",),
    "firmware faults": ("firmware.Faulted",),
    "firmware run": ("firmware.FirmwareRecorded", "firmware.FirmwareServed"),
    "firmware selftest": ("firmware.SelfTested",),
    "firmware trace": ("firmware.Traced",),
    "impact": ("motions.Impacted",),
    "inspect": ("recordings.Inspected",),
    "join": ("recordings.Joined",),
    "list": ("first_steps.Listed",),
    "live": ("motions.LiveSample", "motions.LiveFault", "motions.LiveEvent"),
    "new": ("first_steps.Begun",),
    "noise": ("calibrations.Noise",),
    "optimize": ("geometries.Optimized", "geometries.Front"),
    "record": ("recordings.Recorded", "recordings.BoardsFound"),
    "schema": ("first_steps.Schema",),
    "score": ("geometries.Scored",),
    "show": ("first_steps.Shown",),
    "simulate": ("recordings.Simulated",),
    "tolerance": ("errors_of_arrays.Tolerated",),
    "view": ("motions.Viewed",),
}
"""Structs of the result of each command, below `gfimu.commands.results`."""

_PARTS = {"score": ("geometries.ArrayScore", "shared.AxisBounds")}
"""Structs that a result names by reference."""

_DIALECT = "https://json-schema.org/draft/2020-12/schema"
_STREAMS = {"live"}
_CERTIFICATE = "certificate"  # whose schema is published with its format


def schema_names() -> tuple[str, ...]:
    """Return the commands whose results have a schema."""
    return tuple(_RESULTS)


@writes(out=JSON_SCHEMA)
def schema(command: str, *, out: str | Path | None = None) -> dict[str, Any]:
    """Return the JSON schema (2020-12) of a command's output with ``--json``, errors included.

    Parameters
    ----------
    command : str
        The command, such as ``estimate`` or ``campaign table``.
    out : str or Path, optional
        File to write, ``.json``.

    Returns
    -------
    dict
        The schema.

    Raises
    ------
    InputError
        If there is no such command.

    Examples
    --------
    >>> import gfimu
    >>> sorted(gfimu.schema("check")["$defs"])[:2]
    ['Checked', 'CheckedEffect']
    """
    import json

    import msgspec

    from gfimu.commands.results.base import Failed, Files
    from gfimu.errors import unknown_name
    from gfimu.files.atomic_file import write_text

    name = " ".join(command.split())
    if name not in _RESULTS:
        raise unknown_name("command", name, _RESULTS)
    kinds = [_struct(one) for one in _RESULTS[name]]
    parts = [_struct(one) for one in _PARTS.get(name, ())]
    references, definitions = msgspec.json.schema_components([*kinds, Failed, *parts], ref_template="#/$defs/{name}")
    found = list(references[: len(kinds) + 1])
    if name == _CERTIFICATE:
        found.insert(0, {"$ref": "#/$defs/Certificate"})
        definitions = _certified(msgspec.json.schema(Files)) | definitions
    what = "Each line that" if name in _STREAMS else "What"
    content: dict[str, Any] = {
        "$schema": _DIALECT,
        "title": f"gfimu {name} --json",
        "description": f"{what} `gfimu {name} --json` prints: a result, or an error. A number that is not finite or "
        "not known is null; keys carry their units.",
        "anyOf": found,
        "$defs": definitions,
    }
    if out is not None:
        write_text(out, json.dumps(content, indent=1, ensure_ascii=False) + "\n")
    return content


def _struct(path: str) -> Any:
    module, _, name = path.rpartition(".")
    return getattr(importlib.import_module(f"gfimu.commands.results.{module}"), name)


def _certified(files: Mapping[str, Any]) -> dict[str, Any]:
    """Return the definitions of a certificate as the command prints it: with the files that were written."""
    import json

    from gfimu.certification.schema import certificate_schema

    definitions: dict[str, Any] = json.loads(certificate_schema())["$defs"]
    definitions["Certificate"]["properties"]["files"] = dict(files)
    definitions["Certificate"]["required"].append("files")
    return definitions
