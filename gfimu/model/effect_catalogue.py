"""What was computed of each effect of gfimu and is stored with the models."""

from __future__ import annotations

import json
from collections.abc import Mapping
from functools import cache
from typing import Any

from gfimu.base.files.model_files import models_directory

__all__ = ["EFFECT_CATALOGUE", "effect_catalogue"]

EFFECT_CATALOGUE = "effects/catalogue.json"
"""File of what was computed of each effect, below the folder of the models."""


@cache
def effect_catalogue() -> Mapping[str, Any]:
    """Return what was computed of each effect of gfimu, by name; empty where nothing is stored."""
    file = models_directory() / EFFECT_CATALOGUE
    return json.loads(file.read_text(encoding="utf-8")) if file.exists() else {}
