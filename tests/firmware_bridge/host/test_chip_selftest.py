"""The self-test of real chips: limits of the data sheet, chips that are missing or moved, the command on a port."""

from __future__ import annotations

import threading

import numpy as np
import pytest

from firmware_bridge import open_port, serve
from firmware_bridge.host.chip_selftest import check_chips, judge
from gfimu import InputError

CHANNELS = tuple(f"a{chip}{axis}" for chip in (1, 2) for axis in (1, 2, 3))


def readings(shift) -> tuple[np.ndarray, np.ndarray]:
    noise = np.random.default_rng(0).normal(0.0, 0.004, (2, 100, 6))
    return noise[0], noise[1] + np.asarray(shift)


def test_the_limits_are_those_of_the_supply() -> None:
    off, on = readings([0.3, -0.3, 0.4, 3.0, -3.0, 4.5])  # at 2.5 V: passed, passed, passed, failed, failed, failed
    assert [axis.verdict for axis in judge(off, on, CHANNELS, at_3v3=False)] == 3 * ["passed"] + 3 * ["failed"]
    assert [axis.verdict for axis in judge(off, on, CHANNELS)] == 3 * ["failed"] + 3 * ["passed"]
    first = judge(off, on, CHANNELS)[0]
    assert first.shift_g == pytest.approx(0.3, abs=0.002)
    assert (first.least_g, first.greatest_g) == pytest.approx((0.2 * 1.77, 2.1 * 1.77))


def test_a_chip_without_readings_and_a_unit_that_moves() -> None:
    off, on = readings([1.0, -1.0, 1.5, 1.0, -1.0, 1.5])
    off[:, 2] = np.nan
    on[:, 4] += np.linspace(0.0, 0.5, 100)
    assert [axis.verdict for axis in judge(off, on, CHANNELS)] == [
        "passed", "passed", "missing", "passed", "moved", "passed",
    ]  # fmt: skip


def test_over_a_port_with_a_chip_that_is_silent() -> None:
    pytest.importorskip("unicorn", reason="the emulator is in the extra 'firmware'")
    from firmware_bridge import BoardProcess, LineFault
    from firmware_bridge.adxl345.registers import DATA_FORMAT, SELF_TEST

    port, done = open_port("tcp:0"), threading.Event()
    with BoardProcess() as board:
        board.set_line_fault(1, LineFault.SILENT)
        board.run_for(0.05)
        thread = threading.Thread(target=serve, args=(board, port), kwargs={"stop": done.is_set, "realtime": False})
        thread.start()
        try:
            verdicts = [axis.verdict for axis in check_chips(port.name)]
            data_format = board.read_chip(0, DATA_FORMAT)
        finally:
            done.set()
            thread.join()
            port.close()
    assert verdicts == 3 * ["passed"] + 3 * ["missing"] + 6 * ["passed"]
    assert not data_format & SELF_TEST  # switched off again


def test_a_format_without_commands_is_refused() -> None:
    with pytest.raises(InputError, match="no command for the self-test"):
        check_chips("socket://127.0.0.1:1", form="mimu4444")
