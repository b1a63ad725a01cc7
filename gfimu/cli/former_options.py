"""Former names of options: they work as before, help does not show them, and one line names the present one."""

from __future__ import annotations

__all__ = ["FORMER_OPTIONS"]

FORMER_OPTIONS: dict[str, dict[str, str]] = {
    "drift": {"--time": "--duration", "--rate": "--speed-rad-s"},
    "firmware check": {"--seconds": "--duration"},
    "live": {"--bias-std": "--bias-std-m-s2"},
    "score": {"--duration-s": "--duration", "--sample-rate-hz": "--rate"},
    "tolerance": {
        "--time": "--duration",
        "--rate": "--speed-rad-s",
        "--placement-mm": "--position-mm",
        "--out": "--picture",
    },
}
"""By command: the former name of an option, and its present one."""
