"""The rules, one module per part of the chip."""

from __future__ import annotations

from firmware_bridge.strict.rules.chip import ChipWatch
from firmware_bridge.strict.rules.clock import ClockWatch, FeedWatch
from firmware_bridge.strict.rules.interrupts import InterruptWatch
from firmware_bridge.strict.rules.memory import BUS_FAULT, AlignmentWatch, RegisterWatch, StackWatch
from firmware_bridge.strict.rules.pins import GpioWatch, PinWatch, PowerWatch
from firmware_bridge.strict.rules.ssp import SspWatch
from firmware_bridge.strict.rules.uart import UartWatch
from firmware_bridge.strict.rules.waiting import WaitWatch
from firmware_bridge.strict.rules.watchdog import WatchdogWatch

__all__ = ["BUS_FAULT", "WATCHES"]

WATCHES = (
    ClockWatch, FeedWatch, PowerWatch, PinWatch, GpioWatch, UartWatch, SspWatch, ChipWatch, StackWatch,
    AlignmentWatch, RegisterWatch, InterruptWatch, WatchdogWatch, WaitWatch,
)  # fmt: skip
"""Watches of the strict board."""
