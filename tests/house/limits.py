"""The stored limits of the figures, ``limits.toml``: a figure may fall below its limit, and the limit then follows."""

from __future__ import annotations

import tomllib
from pathlib import Path

FILE = Path(__file__).with_name("limits.toml")
LIMITS: dict[str, int] = tomllib.loads(FILE.read_text(encoding="utf-8")) if FILE.exists() else {}


def write_limits(figures: dict[str, int]) -> None:
    """Lower each limit to its figure; a figure without a limit gets one."""
    lowered = {name: min(value, LIMITS.get(name, value)) for name, value in figures.items()}
    lines = ["# Limits that only fall. A part that has to raise one says why in its commit."]
    FILE.write_text(
        "\n".join(lines + [f'"{name}" = {value}' for name, value in lowered.items()]) + "\n", encoding="utf-8"
    )
