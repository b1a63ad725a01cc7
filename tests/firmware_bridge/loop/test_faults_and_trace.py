"""The fault campaign's table, the self-test, traces, and what happens without the extra."""

from __future__ import annotations

import re
import subprocess
import sys
from importlib.util import find_spec

import numpy as np
import pytest

from firmware_bridge.loop import board_process
from firmware_bridge.loop.fault_campaign import FAULTS, resample_line, run_fault
from firmware_bridge.lpc1768.build import FOLDER
from gfimu import InputError

needs_board = pytest.mark.skipif(find_spec("unicorn") is None, reason="the emulator is in the extra")


@needs_board
@pytest.mark.parametrize("name", FAULTS)
def test_the_host_survives_reports_and_loses_nothing_whole(name: str) -> None:
    outcome = run_fault(name)
    assert outcome.passed, outcome
    expected = {
        "sensor_silent": "sensor_3_missing",
        "spi_stuck_low": "sensor_3_missing",
        "spi_stuck_high": "sensor_3_missing",
        "uart_receive_overrun": "receive_error",
        "uart_framing_errors": "receive_error",
    }
    if name in expected:
        assert expected[name] in outcome.reported
    if name in {"bit_flips", "lost_bytes", "inserted_noise"}:
        assert outcome.counts.lost > 0
        assert outcome.counts.corrupt > 0
    if name == "brown_out_in_frame":
        assert outcome.counts.restarts == 1


def test_resampling_at_the_right_speed_changes_nothing() -> None:
    data = np.random.default_rng(0).integers(0, 256, 500, dtype=np.uint8).tobytes()
    assert resample_line(data, 115_200, 115_200) == data
    assert resample_line(data, 115_200, 117_000) == data  # 1.6 % off: within what a UART bears
    assert resample_line(data, 115_200, 57_600) != data


@needs_board
def test_selftest_passes() -> None:
    from firmware_bridge.loop.selftest import run_selftest

    rows = run_selftest()
    assert len(rows) >= 4
    assert all(row.passed for row in rows), rows
    interrupts = next(row for row in rows if row.check == "interrupts")
    assert int(interrupts.measured.split()[0]) >= 10_000


@needs_board
def test_vcd_is_well_formed_and_shows_the_interrupts(tmp_path) -> None:
    from firmware_bridge.board.trace import write_rrd, write_vcd

    with board_process.BoardProcess(trace=True) as board:
        board.run_for(0.05)
        events = board.take_trace()
        assert board.take_trace() == []
    assert {event.kind for event in events} == {"read", "write", "enter", "leave"}
    write_vcd(tmp_path / "trace.vcd", events)
    text = (tmp_path / "trace.vcd").read_text()
    declared = set(re.findall(r"\$var wire \d+ (\S+) ", text))
    body = text.split("$enddefinitions $end\n")[1]
    used = set(re.findall(r"^(?:b[01]+ |[01])(\S+)$", body, flags=re.MULTILINE))
    assert used <= declared
    times = [int(value) for value in re.findall(r"^#(\d+)$", body, flags=re.MULTILINE)]
    assert times == sorted(times)
    assert 3.9e10 < times[-1] <= 5e10  # picoseconds
    assert "irq_TIMER0" in text
    assert "irq_UART0" in text
    write_rrd(tmp_path / "trace.rrd", events)
    assert (tmp_path / "trace.rrd").read_bytes()[:3] == b"RRF"


@needs_board
def test_the_caller_never_loads_the_emulator() -> None:
    program = (
        "import sys\n"
        "from firmware_bridge.loop.board_process import BoardProcess\n"
        "if __name__ == '__main__':\n"
        "    with BoardProcess() as board:\n"
        "        board.run_for(0.05)\n"
        "        assert board.take_sent()[0]\n"
        "    assert 'unicorn' not in sys.modules\n"
    )
    subprocess.run([sys.executable, "-c", program], check=True, cwd=FOLDER.parents[1])


@needs_board
def test_a_fault_of_the_firmware_crosses_the_process(tmp_path) -> None:
    from firmware_bridge import BoardFault, FaultKind

    image = tmp_path / "lost.bin"
    image.write_bytes((0x10008000).to_bytes(4, "little") + (0x90000001).to_bytes(4, "little"))
    with board_process.BoardProcess(image=image) as board, pytest.raises(BoardFault) as caught:
        board.run_for(0.01)
    assert caught.value.kind is FaultKind.FETCH_UNMAPPED


def test_without_the_extra_the_message_says_what_to_install(monkeypatch) -> None:
    monkeypatch.setitem(sys.modules, "unicorn", None)  # as if it were not installed
    with pytest.raises(InputError, match=r"pip install 'gfimu\[firmware\]'"):
        board_process.BoardProcess()


@needs_board
def test_unknown_image() -> None:
    with pytest.raises(InputError, match="gfimu, selfcheck"):
        board_process.BoardProcess(image="blink")
