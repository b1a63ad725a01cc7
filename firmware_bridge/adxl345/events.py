"""Tap, activity, inactivity and free fall of the ADXL345 (data sheet Rev. E, "Tap detection", "Threshold", table 19).

All but inactivity look at the undecimated conversions, 3200 a second by the chip's clock, whatever the output data
rate; so their times are whole numbers of conversions: 625 µs are 2, 1.25 ms are 4, 5 ms are 16. Inactivity, and
activity while the chip sleeps, look at the output data. Thresholds are 62.5 mg per step in every range.
"""

from __future__ import annotations

from collections.abc import Sequence

from firmware_bridge.adxl345.registers import (
    ACT_AC,
    ACT_AXES,
    ACT_INACT_CTL,
    ACT_TAP_STATUS,
    ACTIVITY,
    ASLEEP,
    DOUBLE_TAP,
    DUR,
    FREE_FALL,
    INACT_AC,
    INACT_AXES,
    INACTIVITY,
    INT_ENABLE,
    LATENT,
    LINK,
    POWER_CTL,
    RAW_PER_COUNT,
    SINGLE_TAP,
    SUPPRESS,
    TAP_AXES,
    TAP_AXES_BITS,
    THRESH_ACT,
    THRESH_FF,
    THRESH_INACT,
    THRESH_TAP,
    TIME_FF,
    TIME_INACT,
    WINDOW,
)

__all__ = ["Events"]

_STEP = 16 * RAW_PER_COUNT  # 62.5 mg are 16 counts of 3.9 mg
_PER_DUR, _PER_LATENT, _PER_TIME_FF = 2, 4, 16  # undecimated conversions per step
_IDLE, _FIRST, _LONG, _WAITING, _OPEN, _SECOND = range(6)
Raw = Sequence[int]


class Events:
    """The sensing logic; it reads the registers it is given and writes the sources into ACT_TAP_STATUS.

    Parameters
    ----------
    registers : bytearray
        Registers of the chip.
    second : int
        Ticks per second of the chip's clock.
    """

    def __init__(self, registers: bytearray, second: int) -> None:
        self._registers = registers
        self._second = second
        self.restart()

    def restart(self) -> None:
        """Begin anew, as at the start of measuring."""
        self.activity_on = self.inactivity_on = self.tap_on = self.free_fall_on = False
        self.awaits_inactivity = True
        self._activity_reference: Raw | None = None
        self._inactivity_reference: Raw | None = None
        self._quiet_since: int | None = None
        self._falling = 0
        self._tap = _IDLE
        self._tap_count = 0
        self._tap_axes = 0

    def configure(self) -> None:
        """Find out from the registers which functions work."""
        registers = self._registers
        enabled, control, linked = registers[INT_ENABLE], registers[ACT_INACT_CTL], registers[POWER_CTL] & LINK
        activity = bool(control & ACT_AXES and (enabled & ACTIVITY or linked))
        inactivity = bool(control & INACT_AXES and (enabled & INACTIVITY or linked))
        if activity and not self.activity_on:
            self._activity_reference = None
        if inactivity and not self.inactivity_on:
            self._inactivity_reference = self._quiet_since = None
        self.activity_on, self.inactivity_on = activity, inactivity
        self.tap_on = bool(
            enabled & (SINGLE_TAP | DOUBLE_TAP) and registers[DUR] and registers[TAP_AXES] & TAP_AXES_BITS
        )
        if not self.tap_on:
            self._tap = _IDLE
        self.free_fall_on = bool(enabled & FREE_FALL)
        if not self.free_fall_on:
            self._falling = 0

    @property
    def linked(self) -> bool:
        """Whether activity and inactivity wait for each other."""
        return bool(self._registers[POWER_CTL] & LINK) and self.activity_on and self.inactivity_on

    def undecimated(self, sample: Raw) -> int:
        """Look at one undecimated conversion; return the bits of INT_SOURCE that it sets off."""
        found = 0
        if self.tap_on:
            found |= self._look_for_taps(sample)
        if self.free_fall_on:
            found |= self._look_for_free_fall(sample)
        return found | self.activity(sample)

    def activity(self, sample: Raw) -> int:
        """Look for activity in one conversion; return ACTIVITY or 0."""
        if not self.activity_on or (self.linked and self.awaits_inactivity):
            return 0
        registers = self._registers
        if registers[ACT_INACT_CTL] & ACT_AC and self._activity_reference is None:
            self._activity_reference = sample
        axes = _axes_beyond(
            sample,
            self._activity_reference if registers[ACT_INACT_CTL] & ACT_AC else None,
            registers[THRESH_ACT] * _STEP,
            registers[ACT_INACT_CTL] >> 4,
        )
        if not axes:
            return 0
        registers[ACT_TAP_STATUS] = registers[ACT_TAP_STATUS] & (ASLEEP | TAP_AXES_BITS) | axes << 4
        self._activity_reference = sample
        self.awaits_inactivity = True
        self._inactivity_reference = self._quiet_since = None
        return ACTIVITY

    def inactivity(self, sample: Raw, now: int) -> int:
        """Look for inactivity in one conversion of the output data; return INACTIVITY or 0."""
        if not self.inactivity_on or (self.linked and not self.awaits_inactivity):
            return 0
        registers = self._registers
        coupled = registers[ACT_INACT_CTL] & INACT_AC
        if coupled and self._inactivity_reference is None:
            self._inactivity_reference = sample
        limit = registers[THRESH_INACT] * _STEP - 1  # quiet means below the threshold
        reference = self._inactivity_reference if coupled else None
        if _axes_beyond(sample, reference, limit, registers[ACT_INACT_CTL] & INACT_AXES):
            self._inactivity_reference, self._quiet_since = sample, None
            return 0
        if self._quiet_since is None:
            self._quiet_since = now
        if now - self._quiet_since < registers[TIME_INACT] * self._second:
            return 0
        self._quiet_since = now
        self.awaits_inactivity = False
        self._activity_reference = None
        return INACTIVITY

    def _look_for_free_fall(self, sample: Raw) -> int:
        limit = self._registers[THRESH_FF] * _STEP
        if max(sample) >= limit or min(sample) <= -limit:
            self._falling = 0
            return 0
        self._falling += 1
        return FREE_FALL if self._falling == max(1, _PER_TIME_FF * self._registers[TIME_FF]) else 0

    def _look_for_taps(self, sample: Raw) -> int:
        registers = self._registers
        axes = _axes_beyond(sample, None, registers[THRESH_TAP] * _STEP, registers[TAP_AXES] & TAP_AXES_BITS)
        longest = _PER_DUR * registers[DUR]
        state = self._tap
        self._tap_count += 1
        if state == _IDLE:
            if axes:
                self._begin(_FIRST, 1)
                self._tap_axes = axes
        elif state == _FIRST:
            if not axes:
                if registers[INT_ENABLE] & DOUBLE_TAP and registers[LATENT] and registers[WINDOW]:
                    self._begin(_WAITING)
                else:
                    return self._end(SINGLE_TAP)
            elif self._tap_count > longest:
                self._tap = _LONG
        elif state == _LONG:
            if not axes:
                self._tap = _IDLE
        elif state == _WAITING:
            if axes and registers[TAP_AXES] & SUPPRESS:
                return self._end(SINGLE_TAP, _LONG)
            if self._tap_count >= _PER_LATENT * registers[LATENT]:
                self._begin(_OPEN)
        elif state == _OPEN:
            return self._look_for_second_tap(axes)
        elif not axes:
            return self._end(SINGLE_TAP | DOUBLE_TAP)
        elif self._tap_count > longest:
            return self._end(SINGLE_TAP, _LONG)
        return 0

    def _look_for_second_tap(self, axes: int) -> int:
        if axes and self._tap_count == 1:
            return self._end(SINGLE_TAP, _LONG)  # above the threshold at the start of the window
        if axes:
            self._begin(_SECOND, 1)
        elif self._tap_count >= _PER_LATENT * self._registers[WINDOW]:
            return self._end(SINGLE_TAP)
        return 0

    def _begin(self, state: int, count: int = 0) -> None:
        self._tap, self._tap_count = state, count

    def _end(self, events: int, state: int = _IDLE) -> int:
        """Decide a tap: note the axes of the first one."""
        registers = self._registers
        self._tap = state
        registers[ACT_TAP_STATUS] = registers[ACT_TAP_STATUS] & ~TAP_AXES_BITS | self._tap_axes
        return events


def _axes_beyond(sample: Raw, reference: Raw | None, limit: int, axes: int) -> int:
    """Those of the participating axes (4 x, 2 y, 1 z) whose distance from the reference is larger than the limit."""
    found = 0
    for axis in range(3):
        bit = 4 >> axis
        if axes & bit:
            distance = sample[axis] - (reference[axis] if reference is not None else 0)
            if distance > limit or distance < -limit:
                found |= bit
    return found
