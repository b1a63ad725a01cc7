"""Metadata of a table as its file or its schema holds them: a JSON text for each key."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any

__all__ = ["schema_metadata", "to_json"]


def schema_metadata(metadata: Mapping[str, Any]) -> dict[bytes, bytes]:
    """Return metadata as the schema of an Arrow table or a Parquet file holds them."""
    return {key.encode(): to_json(value).encode() for key, value in metadata.items()}


def to_json(value: Any) -> str:
    """JSON of a metadata value; NumPy arrays and numbers as lists and numbers."""
    return json.dumps(value, default=lambda item: item.tolist() if hasattr(item, "tolist") else str(item))
