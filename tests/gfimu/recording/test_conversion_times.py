"""When chips with clocks of their own converted, from the marks of a board that keeps pace with them."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from gfimu.recording import Recording, conversion_times

BITS = [4, 5, 6, 7]
CHANNELS = tuple(f"a{chip}{axis}" for chip in range(1, 5) for axis in range(1, 4))


class PacedBoard:
    """A board that reads what its chips have converted since the sample before, and waits for the slowest."""

    def __init__(self, errors: list[float], samples: int, rate: float = 100.0, seed: int = 1) -> None:
        periods = (1.0 / rate) / (1.0 + np.array(errors))
        due = np.random.default_rng(seed).uniform(0.1, 0.9, len(errors)) * periods  # next conversion of each chip
        now, rows, status, times = 0.01 + float(due.max()), [], [], []
        for _ in range(samples):
            stamp, waited, mine, flags = now, 0.0, [], 0
            for chip, period in enumerate(periods):
                waited = max(waited, float(due[chip]) - stamp)
                seen = []
                while due[chip] <= stamp + waited:
                    seen.append(float(due[chip]))
                    due[chip] += period
                mine.append(np.mean(seen))
                flags |= (len(seen) > 1) << BITS[chip]
            rows.append(stamp)
            status.append(flags)
            times.append(mine)
            now = stamp + 1.0 / rate + waited
        self.t, self.status, self.times = np.round(rows, 6), np.array(status, dtype=np.uint16), np.array(times)
        self.rate = rate

    def recording(self, kept: slice | NDArray[np.bool_] = slice(4, None), **metadata: object) -> Recording:
        t = self.t[kept]
        stated = {"sample_rate_hz": self.rate, "output_data_rate_hz": self.rate, "paced_status_bits": BITS}
        return Recording(t, np.zeros((len(t), 12)), CHANNELS, {}, {**stated, **metadata}, {"status": self.status[kept]})


@pytest.mark.parametrize("rate", [100.0, 3200.0])
def test_the_times_of_all_chips_are_found_from_the_marks(rate: float):
    board = PacedBoard([-5e-4, -6e-3, 4.2e-3, 2e-3], 3000, rate)
    error = conversion_times(board.recording(), 4).times - board.times[4:]
    age = board.t[4:, None] - board.times[4:]
    assert np.all(np.ptp(age[:, [0, 2, 3]], axis=0) > 0.9 / rate)  # the ages sweep through a period
    assert np.sqrt(np.mean(error**2)) < 0.01 / rate + 1e-6  # of the period; stamps are whole microseconds


def test_a_single_mark_gives_the_times_beside_it():
    board = PacedBoard([0.0, -6e-3, 3e-3, 2.5e-3], 420)
    mark = int(np.flatnonzero(board.status >> BITS[2] & 1)[1])
    rows = slice(mark - 30, mark + 40)
    error = np.abs(conversion_times(board.recording(rows), 4).times - board.times[rows])[:, 2]
    assert error[29:32].max() < 2e-4
    assert error.max() < 0.5 / board.rate  # the chip's rate is not known: the age is between none and a period


def test_lost_interrupts_make_means_of_all_that_came_and_no_marks():
    board = PacedBoard([-5e-4, -6e-3, 4.2e-3, 2e-3], 2000)
    # An interrupt lost: the chips convert on, and the next sample is the mean of what came since.
    lost = np.arange(50, 2000, 97)
    kept = np.ones(2000, dtype=bool)
    kept[lost], kept[:4] = False, False
    board.times[lost + 1] = 0.5 * (board.times[lost] + board.times[lost + 1])
    board.status[lost + 1] |= 0xF0
    usual = kept & (np.roll(board.status, 1) & 0xF0 == 0)
    error = (conversion_times(board.recording(kept), 4).times - board.times[kept])[usual[kept]]
    assert np.median(np.abs(error)) < 1e-4


def test_clocks_that_agree_with_the_board_s_leave_half_a_period():
    t = np.arange(500) / 100.0
    stated = {"sample_rate_hz": 100.0, "output_data_rate_hz": 100.0, "paced_status_bits": BITS}
    still = Recording(t, np.zeros((500, 12)), CHANNELS, {}, stated, {"status": np.zeros(500, dtype=np.uint16)})
    np.testing.assert_allclose(conversion_times(still, 4).times, np.tile(t[:, None] - 5e-3, 4), atol=1e-12)


def test_the_newest_conversion_is_half_an_output_period_old_when_its_chip_is_read():
    t = np.arange(100) / 100.0
    stated = {"output_data_rate_hz": 400.0, "read_spacing_s": 16e-6}
    found = conversion_times(Recording(t, np.zeros((100, 12)), CHANNELS, {}, stated), 4).times
    np.testing.assert_allclose(found, t[:, None] - 1.25e-3 + 16e-6 * np.arange(4), atol=1e-12)


def test_the_period_of_a_chip_with_one_mark_lies_where_every_row_allows_it():
    board = PacedBoard([-1e-3, -7e-4, 3e-3, 2.5e-3], 3000)
    found = conversion_times(board.recording(), 4)
    assert (board.status[4:] >> BITS[1] & 1).sum() == 1
    error, unknown = (found.times - board.times[4:])[:, 1], np.abs(found.unknown[:, :, 1]).sum(axis=0)
    assert np.abs(error).max() < 2.0 * unknown.max()  # a uniform prior ends at 1.7 standard deviations
    assert not found.unknown[:, :, [0, 2, 3]].any()


def test_bits_that_are_no_numbers_mark_nothing():
    t = np.arange(100) / 100.0
    stated = {"output_data_rate_hz": 100.0, "paced_status_bits": ["4", "5", "6", "7"], "sample_rate_hz": "fast"}
    recording = Recording(t, np.zeros((100, 12)), CHANNELS, {}, stated, {"status": np.full(100, np.nan)})
    np.testing.assert_allclose(conversion_times(recording, 4).times, np.tile(t[:, None] - 5e-3, 4), atol=1e-12)


@pytest.mark.parametrize("stated", [{}, {"output_data_rate_hz": 0.0}, {"output_data_rate_hz": "fast"}])
def test_a_recording_that_states_no_rate_has_no_conversion_times(stated: dict[str, object]):
    assert conversion_times(Recording(np.arange(9) / 100.0, np.zeros((9, 12)), CHANNELS, {}, stated), 4) is None
