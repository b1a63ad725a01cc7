"""A board with the firmware that rides a scenario: behind a port, or traced."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

from firmware_bridge.board.trace import Event
from firmware_bridge.frames.commands import sample_at, set_range
from firmware_bridge.loop.board_process import BoardProcess
from firmware_bridge.loop.physics import RidePhysics, Scene
from firmware_bridge.loop.virtual_port import ServeReport, open_port, serve
from firmware_bridge.loop.virtual_run import typical_chips
from gfimu.base.files.model_files import list_models

__all__ = ["RiddenBoard"]

_BOOT_S = 0.02


@dataclass(frozen=True)
class RiddenBoard:
    """A board that is not powered yet.

    Parameters
    ----------
    ride : Scene
        What the board experiences (`sim.ride.Ride`).
    image : str or Path
        Firmware.
    fast : bool, optional
        Whether the peripherals run in C; by default where possible.
    """

    ride: Scene
    image: str | Path = "gfimu"
    fast: bool | None = None

    def power(self, *, trace: bool = False) -> BoardProcess:
        """Power the board, whose chips have clocks of their own (`typical_chips`)."""
        name = self.ride.array.name
        stated = name if name in list_models("arrays") else ""  # a host knows no other array by its name
        return BoardProcess(
            RidePhysics(self.ride), image=self.image, chips=typical_chips(self.ride.seed), fast=self.fast, trace=trace,
            array=stated,
        )  # fmt: skip

    def serve(
        self,
        port: str,
        duration_s: float | None,
        *,
        rate_hz: int,
        range_g: int,
        realtime: bool = True,
        on_open: Callable[[str], None] | None = None,
    ) -> ServeReport:
        """Serve the board on a port until the virtual time is up or Ctrl-C.

        Parameters
        ----------
        port : str
            ``pty`` or ``tcp:PORT``.
        duration_s : float, optional
            Virtual time, s; None: without end.
        rate_hz, range_g : int
            What is asked of the firmware.
        realtime : bool
            Whether to keep pace with the clock on the wall.
        on_open : callable, optional
            Called with the name of the port when the board answers there.
        """
        commands = set_range(range_g) + sample_at(rate_hz)
        line = open_port(port)
        try:
            with self.power() as board:
                board.run_for(_BOOT_S)
                board.receive(commands)
                if on_open is not None:
                    on_open(line.name)
                report = serve(board, line, duration_s=duration_s, realtime=realtime)
                return replace(report, warnings=tuple(board.warnings()))
        finally:
            line.close()

    def traced(self, duration_s: float, *, skip_s: float = 0.0, rate_hz: int) -> list[Event]:
        """Return the register accesses and interrupts of some virtual time, from power-on or from ``skip_s`` on."""
        setup = sample_at(rate_hz)
        with self.power(trace=True) as board:
            if skip_s:
                board.run_for(min(skip_s, _BOOT_S))
                board.receive(setup)
                board.run_for(max(0.0, skip_s - _BOOT_S))
                board.take_trace()
            board.run_for(duration_s)
            events: list[Event] = board.take_trace()
        return events
