"""Nested vectored interrupt controller and system control block of the Cortex-M3 (ARMv7-M ARM B1.5, B3.2–B3.4)."""

from __future__ import annotations

from firmware_bridge.board.bus import Bus
from firmware_bridge.board.peripheral import Peripheral

__all__ = ["FIRST_IRQ", "PENDSV", "SVCALL", "SYSTICK", "UNMASKABLE", "Nvic"]

NMI, HARD_FAULT, SVCALL, PENDSV, SYSTICK, FIRST_IRQ = 2, 3, 11, 14, 15, 16
EXCEPTIONS = 16 + 35
UNMASKABLE = 1 << NMI | 1 << HARD_FAULT
THREAD_PRIORITY = 256
_ALWAYS_ENABLED = (1 << FIRST_IRQ) - 1
_EXISTING = (1 << EXCEPTIONS) - 1
_PRIORITY_BITS = 0xF8  # five bits on the LPC1768
_CPUID = 0x412FC230  # Cortex-M3 r2p0
_RESET_KEY = 0x05FA
_RESET_REQUEST = 1 << 2


class Nvic(Peripheral):
    """Pending, enabled and active exceptions and their priorities; also the registers from 0xE000E000 on."""

    def __init__(self, bus: Bus) -> None:
        super().__init__(bus, "nvic", 0xE000E000)

    def reset(self) -> None:
        """Nothing enabled, pending or active."""
        self.enabled = _ALWAYS_ENABLED
        self.pending = 0
        self.lines = 0
        self.active: list[int] = []
        self.active_mask = 0
        self.priority = [0] * 64
        self.priority[NMI], self.priority[HARD_FAULT] = -2, -1
        self.group_mask = 0xFF
        self.running = THREAD_PRIORITY
        self.vtor = 0
        self._priority_group = 0
        self._stored: dict[int, int] = {0xD14: 0x200}

    # What peripherals and the processor do

    def set_line(self, irq: int, level: bool | int) -> None:
        """Set the level of an interrupt line: a high level makes the interrupt pending unless it is active."""
        bit = 1 << (FIRST_IRQ + irq)
        if level:
            if not self.lines & bit:
                self.lines |= bit
                if not self.active_mask & bit:
                    self.pend(FIRST_IRQ + irq)
        else:
            self.lines &= ~bit

    def pend(self, exception: int) -> None:
        """Make an exception pending."""
        self.pending |= 1 << exception
        self.bus.alarm = -1  # look at the next block

    def _set_running(self) -> None:
        """Note the priority of what runs now, without the mask registers."""
        self.running = self._group(self.active[-1]) if self.active else THREAD_PRIORITY

    def _group(self, exception: int) -> int:
        priority = self.priority[exception]
        return priority & self.group_mask if priority > 0 else priority

    def best(self) -> int:
        """Pending and enabled exception that would preempt what runs now; 0 if none."""
        waiting = self.pending & self.enabled
        if not waiting:
            return 0
        best = (waiting & -waiting).bit_length() - 1
        waiting &= waiting - 1
        while waiting:
            number = (waiting & -waiting).bit_length() - 1
            waiting &= waiting - 1
            if self.priority[number] < self.priority[best]:
                best = number
        priority = self.priority[best]
        return best if (priority & self.group_mask if priority > 0 else priority) < self.running else 0

    def masked(self, exception: int, primask: int, basepri: int, faultmask: int) -> bool:
        """Whether the mask registers hold an exception back."""
        priority = self._group(exception)
        if priority < 0:
            return False
        base = basepri & self.group_mask
        return bool(primask & 1 or faultmask & 1 or (base and priority >= base))

    def enter(self, exception: int) -> None:
        """Pending becomes active."""
        self.pending &= ~(1 << exception)
        self.active.append(exception)
        self.active_mask |= 1 << exception
        self._set_running()

    def leave(self) -> None:
        """End the innermost active exception; a line that is still high makes it pending again."""
        bit = 1 << self.active.pop()
        self.active_mask &= ~bit
        self._set_running()
        if self.lines & bit:
            self.pending |= bit

    @property
    def wakes(self) -> bool:
        """Whether something pending wakes the processor from WFI: it would preempt what runs (UM10360 34.3.5.2.1).

        PRIMASK does not matter; inside a handler, an exception of no higher priority does not wake.
        """
        return bool(self.best())

    # Registers

    def read(self, offset: int, size: int) -> int:
        """Interrupt controller, SysTick and system control registers."""
        if size != 4:
            whole = self.read(offset & ~3, 4)
            return whole >> 8 * (offset & 3) & ((1 << 8 * size) - 1)
        if 0x10 <= offset < 0x20:
            return self.bus.systick.read(offset, size)
        for start, bits in ((0x100, self.enabled), (0x180, self.enabled), (0x200, self.pending), (0x280, self.pending)):
            if start <= offset < start + 8:
                return bits >> (FIRST_IRQ + 8 * (offset - start)) & 0xFFFFFFFF
        if 0x300 <= offset < 0x308:
            return self.active_mask >> (FIRST_IRQ + 8 * (offset - 0x300)) & 0xFFFFFFFF
        if 0x400 <= offset < 0x424:
            return self._priorities(FIRST_IRQ + offset - 0x400)
        if 0xD18 <= offset < 0xD24:
            return self._priorities(4 + offset - 0xD18)
        if offset == 0xD04:
            return self._interrupt_state()
        fixed = {0x004: 1, 0xD00: _CPUID, 0xD08: self.vtor, 0xD0C: 0xFA050000 | self._priority_group << 8}
        return fixed.get(offset, self._stored.get(offset, 0))

    def _priorities(self, first: int) -> int:
        return sum((self.priority[first + k] & 0xFF) << 8 * k for k in range(4))

    def _interrupt_state(self) -> int:
        waiting = self.pending & self.enabled
        best = min(
            (n for n in range(1, EXCEPTIONS) if waiting >> n & 1), key=lambda n: (self.priority[n], n), default=0
        )
        return (
            (self.active[-1] if self.active else 0)
            | (len(self.active) == 1) << 11
            | best << 12
            | bool(waiting >> FIRST_IRQ) << 22
            | (self.pending >> SYSTICK & 1) << 26
            | (self.pending >> PENDSV & 1) << 28
            | (self.pending >> NMI & 1) << 31
        )

    def write(self, offset: int, value: int, size: int) -> None:
        """Interrupt controller, SysTick and system control registers."""
        if 0x400 <= offset < 0x424:
            self._set_priorities(FIRST_IRQ + offset - 0x400, value, size)
        elif 0xD18 <= offset < 0xD24:
            self._set_priorities(4 + offset - 0xD18, value, size)
        elif 0x10 <= offset < 0x20:
            self.bus.systick.write(offset, value, size)
        elif 0x100 <= offset < 0x108:
            self.enabled |= value << (FIRST_IRQ + 8 * (offset - 0x100)) & _EXISTING
        elif 0x180 <= offset < 0x188:
            self.enabled &= ~(value << (FIRST_IRQ + 8 * (offset - 0x180)))
        elif 0x200 <= offset < 0x208:
            self.pending |= value << (FIRST_IRQ + 8 * (offset - 0x200)) & _EXISTING
        elif 0x280 <= offset < 0x288:
            self.pending &= ~(value << (FIRST_IRQ + 8 * (offset - 0x280)))
            self.pending |= self.lines & ~self.active_mask
        elif offset == 0xF00:
            self.pending |= 1 << (FIRST_IRQ + (value & 0x1FF)) & _EXISTING
        elif offset == 0xD04:
            set_bits = (value >> 31 & 1) << NMI | (value >> 28 & 1) << PENDSV | (value >> 26 & 1) << SYSTICK
            clear_bits = (value >> 27 & 1) << PENDSV | (value >> 25 & 1) << SYSTICK
            self.pending = (self.pending | set_bits) & ~clear_bits
        elif offset == 0xD08:
            self.vtor = value & 0x3FFFFF80
        elif offset == 0xD0C:
            self._write_reset_control(value)
        else:
            self._stored[offset & ~3] = value
        self._set_running()  # priorities or groups may be others now
        self.bus.alarm = -1

    def _set_priorities(self, first: int, value: int, size: int) -> None:
        for k in range(size):
            if first + k not in {NMI, HARD_FAULT}:
                self.priority[first + k] = value >> 8 * k & _PRIORITY_BITS

    def _write_reset_control(self, value: int) -> None:
        if value >> 16 != _RESET_KEY:
            return
        self._priority_group = value >> 8 & 7
        self.group_mask = 0xFF & ~((2 << self._priority_group) - 1)
        if value & _RESET_REQUEST:
            self.bus.request_reset(0)
