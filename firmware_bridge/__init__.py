"""The wire: chips at register level, the LPC1768, frames, recording from a port.

In: bytes of a board, real or emulated.
Out: recordings; findings on firmware.
"""

from typing import TYPE_CHECKING

from gfimu.base.lazy_names import declared_names

if TYPE_CHECKING:
    from firmware_bridge.adxl345.conversion import format_count as format_count
    from firmware_bridge.adxl345.device import Adxl345 as Adxl345
    from firmware_bridge.adxl345.registers import RAW_PER_COUNT as RAW_PER_COUNT
    from firmware_bridge.adxl345.registers import TICKS_PER_SECOND as TICKS_PER_SECOND
    from firmware_bridge.adxl345.registers import Adxl345Options as Adxl345Options
    from firmware_bridge.board.board import Board as Board
    from firmware_bridge.board.fast_board import FastBoard as FastBoard
    from firmware_bridge.board.rit import RepetitiveTimer as RepetitiveTimer
    from firmware_bridge.frames.continuity import Continuity as Continuity
    from firmware_bridge.frames.decoder import FORMATS as FORMATS
    from firmware_bridge.frames.decoder import SampleDecoder as SampleDecoder
    from firmware_bridge.frames.decoder import encode_samples as encode_samples
    from firmware_bridge.host.journal import Journal as Journal
    from firmware_bridge.host.recorder import record as record
    from firmware_bridge.loop.board_process import BoardProcess as BoardProcess
    from firmware_bridge.loop.line_speed import as_received as as_received
    from firmware_bridge.loop.line_speed import terminal_baud as terminal_baud
    from firmware_bridge.loop.virtual_port import TcpPort as TcpPort
    from firmware_bridge.loop.virtual_port import open_port as open_port
    from firmware_bridge.loop.virtual_port import serve as serve
    from firmware_bridge.loop.virtual_run import record_virtual as record_virtual
    from firmware_bridge.lpc1768.build import build as build
    from firmware_bridge.lpc1768.build import image_path as image_path
    from firmware_bridge.sender.project import write_project as write_project
else:
    __getattr__, __dir__, __all__ = declared_names(__name__)
