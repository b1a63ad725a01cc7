"""The JSON schema of a certificate file, from its dataclasses; published as ``certificate.schema.json`` beside it."""

from __future__ import annotations

import inspect
import json
import re
from pathlib import Path
from typing import Any

import msgspec

from gfimu.calibration.certificate import certificate
from gfimu.calibration.certificate.certificate import Certificate

__all__ = ["SCHEMA_FILE", "certificate_schema"]

SCHEMA_FILE = Path(__file__).with_name("certificate.schema.json")
"""Published schema; docs/scripts/make_files_reference.py writes it, a test compares it with `certificate_schema`."""

_DOCUMENTED = re.compile(r"^(\w[\w, ]*) : .*\n((?: {4}.*\n?)+)", re.MULTILINE)
_ABOUT = (
    "Made by `gfimu certificate`. Null is: of a value, not determined; of std, expanded, coverage_factor, not stated; "
    "of degrees_of_freedom, infinite."
)


def certificate_schema() -> str:
    """Return the text of the schema (JSON Schema, 2020-12) of what `Certificate.save` writes: every key is there."""
    schema = msgspec.json.schema(Certificate)
    parts: dict[str, Any] = schema["$defs"]
    for name, part in parts.items():
        text = inspect.getdoc(getattr(certificate, name)) or ""
        part["description"] = text.partition("\n")[0]
        part["required"] = list(part["properties"])
        part["additionalProperties"] = False
        for keys, meaning in _DOCUMENTED.findall(text):
            for key in keys.split(", "):
                part["properties"][key]["description"] = " ".join(meaning.split())
        for key in part["properties"].values():
            key.pop("default", None)
    whole = {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": "gfimu calibration certificate, format version 1",
        "description": _ABOUT,
        **schema,
    }
    return json.dumps(whole, indent=1, ensure_ascii=False) + "\n"
