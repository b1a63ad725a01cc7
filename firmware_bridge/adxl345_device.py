"""The register-level ADXL345 and what belongs to it, under one name (`firmware_bridge.adxl345`)."""

from __future__ import annotations

from firmware_bridge.adxl345.conversion import ConversionSource, format_count
from firmware_bridge.adxl345.device import Adxl345
from firmware_bridge.adxl345.registers import RAW_PER_COUNT, TICKS_PER_SECOND, Adxl345Options, LineFault

__all__ = [
    "RAW_PER_COUNT",
    "TICKS_PER_SECOND",
    "Adxl345",
    "Adxl345Options",
    "ConversionSource",
    "LineFault",
    "format_count",
]
