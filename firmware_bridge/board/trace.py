"""Traces of register accesses and exceptions: a value change dump for GTKWave, or a rerun timeline."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

from numpy.typing import NDArray

from firmware_bridge.adxl345.registers import TICKS_PER_SECOND
from gfimu.base.declared import Declared, Table, figure, figures
from gfimu.base.files.atomic_file import atomic_path
from gfimu.base.files.rerun_stream import rrd_stream
from gfimu.base.results import TableResult, one_row

__all__ = ["Event", "EventList", "TraceCounts", "write_rrd", "write_trace", "write_vcd"]

_PICOSECONDS = 1_000_000_000_000
_NAMES = {2: "NMI", 3: "HardFault", 11: "SVCall", 14: "PendSV", 15: "SysTick"}
_IRQS = (
    "WDT", "TIMER0", "TIMER1", "TIMER2", "TIMER3", "UART0", "UART1", "UART2", "UART3", "PWM1", "I2C0", "I2C1", "I2C2",
    "SPI", "SSP0", "SSP1", "PLL0", "RTC", "EINT0", "EINT1", "EINT2", "EINT3", "ADC", "BOD", "USB", "CAN", "GPDMA",
    "I2S", "ETHERNET", "RIT", "MCPWM", "QEI", "PLL1", "USBACT", "CANACT",
)  # fmt: skip


@dataclass(frozen=True)
class TraceCounts(Declared, TableResult):
    """A trace of the firmware."""

    events: Annotated[int, figure("Register accesses and interrupts.", head="events")]
    accesses: Annotated[int, figure("Register accesses of the peripherals.", head="register accesses", in_json=False)]
    exceptions: Annotated[int, figure("Exceptions entered.", head="exceptions")]

    def to_columns(self) -> dict[str, NDArray[Any]]:
        """Return one row of the counts."""
        return one_row(vars(self))

    def shown(self) -> Iterator[Table]:
        """Yield the table that people read."""
        yield figures(self._heading(), self)

    def _heading(self) -> str:
        return "Trace of the firmware"


@dataclass(frozen=True)
class Event:
    """One thing that happened.

    Parameters
    ----------
    ticks : int
        When.
    source : str
        Peripheral name, or ``cpu``.
    kind : str
        ``read``, ``write``, ``enter`` or ``leave``.
    place : int
        Register offset, or exception number.
    value : int
        Value read or written.
    """

    ticks: int
    source: str
    kind: str
    place: int
    value: int


class EventList:
    """Collects events in memory (a `firmware_bridge.board.bus.Tracer`)."""

    def __init__(self) -> None:
        self._events: list[Event] = []

    def access(self, ticks: int, peripheral: str, offset: int, value: int, *, write: bool) -> None:
        """Note a register access."""
        self._events.append(Event(ticks, peripheral, "write" if write else "read", offset, value))

    def exception(self, ticks: int, number: int, *, entered: bool) -> None:
        """Note an exception."""
        self._events.append(Event(ticks, "cpu", "enter" if entered else "leave", number, 0))

    def take(self) -> list[Event]:
        """Hand out the events and forget them."""
        events, self._events = self._events, []
        return events


def exception_name(number: int) -> str:
    """Name of an exception of the LPC1768."""
    if number >= 16 and number - 16 < len(_IRQS):
        return _IRQS[number - 16]
    return _NAMES.get(number, f"exception{number}")


def write_trace(path: str | Path, events: Sequence[Event]) -> TraceCounts:
    """Write a value change dump (``.vcd``) or a rerun recording, and return what it holds."""
    file, sources = Path(path), [event.source for event in events]
    (write_vcd if file.suffix == ".vcd" else write_rrd)(file, events)
    accesses = len(events) - sources.count("cpu")
    return TraceCounts(len(events), accesses, sum(event.kind == "enter" for event in events))


def write_vcd(path: str | Path, events: Sequence[Event]) -> None:
    """Write a value change dump (IEEE 1364-2005, 18): one wire per exception, last address and value per peripheral."""
    exceptions = sorted({event.place for event in events if event.source == "cpu"})
    peripherals = sorted({event.source for event in events if event.source != "cpu"})
    codes = _identifiers()
    wires = {number: next(codes) for number in exceptions}
    registers = {name: (next(codes), next(codes), next(codes)) for name in peripherals}
    with atomic_path(path) as temporary, temporary.open("w", encoding="ascii") as file:
        file.write("$timescale 1 ps $end\n$scope module lpc1768 $end\n")
        for number, code in wires.items():
            file.write(f"$var wire 1 {code} irq_{exception_name(number)} $end\n")
        for name, (offset, value, write) in registers.items():
            file.write(f"$scope module {name} $end\n$var wire 16 {offset} offset $end\n")
            file.write(f"$var wire 32 {value} value $end\n$var wire 1 {write} write $end\n$upscope $end\n")
        file.write("$upscope $end\n$enddefinitions $end\n#0\n")
        file.writelines(f"0{code}\n" for code in wires.values())
        last = -1
        for event in sorted(events, key=lambda event: event.ticks):
            if event.ticks != last:
                file.write(f"#{event.ticks * _PICOSECONDS // TICKS_PER_SECOND}\n")
                last = event.ticks
            if event.source == "cpu":
                file.write(f"{int(event.kind == 'enter')}{wires[event.place]}\n")
            else:
                offset, value, write = registers[event.source]
                file.write(
                    f"b{event.place:b} {offset}\nb{event.value:b} {value}\n{int(event.kind == 'write')}{write}\n"
                )


def _identifiers() -> Iterator[str]:
    """Short printable identifiers, without end."""
    symbols = [chr(code) for code in range(33, 127)]
    length = 1
    while True:
        for index in range(len(symbols) ** length):
            name, rest = "", index
            for _ in range(length):
                name += symbols[rest % len(symbols)]
                rest //= len(symbols)
            yield name
        length += 1


def write_rrd(path: str | Path, events: Sequence[Event]) -> None:
    """Write a rerun recording: a state per exception over virtual time, and a log line per register access."""
    import numpy as np
    import rerun as rr

    with rrd_stream(path, "gfimu_firmware_trace") as stream:
        for number in sorted({event.place for event in events if event.source == "cpu"}):
            chosen = [event for event in events if event.source == "cpu" and event.place == number]
            times = np.array([event.ticks for event in chosen]) / TICKS_PER_SECOND
            states = np.array([float(event.kind == "enter") for event in chosen])
            _send(stream, f"exceptions/{exception_name(number)}", times, rr.Scalars.columns(scalars=states))
        for name in sorted({event.source for event in events if event.source != "cpu"}):
            chosen = [event for event in events if event.source == name]
            times = np.array([event.ticks for event in chosen]) / TICKS_PER_SECOND
            lines = [f"{event.kind} +{event.place:#05x} {event.value:#010x}" for event in chosen]
            _send(stream, f"registers/{name}", times, rr.TextLog.columns(text=lines))


def _send(stream: object, entity: str, times: object, columns: object) -> None:
    import rerun as rr

    rr.send_columns(entity, [rr.TimeColumn("board_time", duration=times)], columns, recording=stream)  # type: ignore[arg-type]
