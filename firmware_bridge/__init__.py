"""The wire: chips at register level, the LPC1768, frames, recording from a port.

In: bytes of a board, real or emulated.
Out: recordings; findings on firmware.
"""

from typing import TYPE_CHECKING

from gfimu.base.lazy_names import declared_names

if TYPE_CHECKING:
    from firmware_bridge.adxl345.conversion import format_count
    from firmware_bridge.adxl345.device import Adxl345
    from firmware_bridge.adxl345.registers import RAW_PER_COUNT, TICKS_PER_SECOND, Adxl345Options, LineFault
    from firmware_bridge.board.board import Board
    from firmware_bridge.board.fast_board import FastBoard
    from firmware_bridge.board.faults import BoardFault, FaultKind
    from firmware_bridge.board.nvic import FIRST_IRQ
    from firmware_bridge.board.rit import RepetitiveTimer
    from firmware_bridge.board.ssp import Ssp
    from firmware_bridge.frames.checksum import crc16, crc16_rows
    from firmware_bridge.frames.commands import (
        FAST_BAUD,
        RATE_CODE_AUTO,
        RATES_HZ,
        ArrayName,
        Command,
        Identity,
        Reply,
        Result,
        encode_command,
        parse_message,
        sample_at,
        set_range,
        set_rate,
    )
    from firmware_bridge.frames.continuity import Continuity
    from firmware_bridge.frames.decoder import (
        FORMATS,
        LPC1768_DTYPE,
        FrameType,
        SampleDecoder,
        Samples,
        Status,
        encode_samples,
        frame_format,
    )
    from firmware_bridge.host.clock import ClockFit, HostClock, SampleRate
    from firmware_bridge.host.finder import find_boards
    from firmware_bridge.host.journal import Journal, JournalError
    from firmware_bridge.host.line_up import change_speed
    from firmware_bridge.host.link import Link
    from firmware_bridge.host.recorder import SampleClock, record
    from firmware_bridge.loop.board_process import BoardProcess
    from firmware_bridge.loop.line_speed import as_received, terminal_baud
    from firmware_bridge.loop.physics import RidePhysics
    from firmware_bridge.loop.virtual_port import PseudoTerminal, TcpPort, open_port, serve
    from firmware_bridge.loop.virtual_run import record_virtual, typical_chips
    from firmware_bridge.lpc1768.build import SOURCES, build, image_path
    from firmware_bridge.lpc1768.elf import ElfImage
    from firmware_bridge.sender.project import write_project
    from firmware_bridge.sources.udp import UdpSource
    from firmware_bridge.strict.board import StrictBoard
else:
    __getattr__, __dir__, __all__ = declared_names(__name__)
