"""Board clock against host clock: the true line lies within the stated uncertainty, late bytes do not bend it."""

from __future__ import annotations

import numpy as np
import pytest

from firmware_bridge import ClockFit, HostClock, SampleRate, Samples, Status


def arrivals(seed: int, *, seconds: int = 120, rate_error: float = 40e-6, offset: float = 1000.0):
    rng = np.random.default_rng(seed)
    board = np.arange(0, seconds, 0.02)
    latency = rng.exponential(0.004, len(board)) + 0.001
    latency[rng.random(len(board)) < 0.02] += rng.exponential(0.3)  # the reader was busy
    return board, board * (1 + rate_error) + offset + latency


def test_line_is_found_within_its_uncertainty() -> None:
    inside = 0
    for seed in range(40):
        clock = HostClock()
        for board, host in zip(*arrivals(seed), strict=True):
            clock.add(board, host)
        fit = clock.fit()
        assert fit is not None
        assert abs(fit.rate_error - 40e-6) < 5e-6
        assert abs(fit.to_host(60.0) - (60.0 * (1 + 40e-6) + 1000.0 + 0.001)) < 0.001
        inside += abs(fit.rate_error - 40e-6) < 2 * fit.rate_error_std
    assert inside >= 32  # of 40; 95 % expected, binomial P(< 32) below 1e-3 even at 90 %


def test_outliers_do_not_bend_the_line() -> None:
    clock = HostClock()
    for k, (board, host) in enumerate(zip(*arrivals(1), strict=True)):
        stuck = 1000 <= k < 1500  # ten seconds in which every byte came a second late
        clock.add(board, host + (1.0 if stuck else 0.0))
    fit = clock.fit()
    assert fit is not None
    assert abs(fit.rate_error - 40e-6) < 2e-5


def test_memory_stays_small_and_few_arrivals_give_no_line() -> None:
    clock = HostClock()
    clock.add(0.0, 5.0)
    assert clock.fit() is None
    for k in range(100_000):
        clock.add(k * 1e-3, k * 1e-3 + 5.0)
    assert len(clock._points) <= 102


def walked(seed: int, *, drift: float, walk: float, seconds: int = 600):
    """Board and host times of samples whose board clock drifts and walks, and what arrives when."""
    rng = np.random.default_rng(seed)
    host = np.arange(0.0, seconds, 0.1)
    rate = 40e-6 + drift * host + walk * np.sqrt(0.1) * np.cumsum(rng.normal(size=len(host)))
    board = 12.0 + host - np.concatenate([[0.0], np.cumsum(rate[:-1] * 0.1)])
    latency = 0.0005 + rng.exponential(0.004, len(host))
    latency[rng.random(len(host)) < 0.02] += rng.exponential(0.3)
    return board, host, host + latency


@pytest.mark.parametrize(("drift", "walk"), [(0.0, 0.0), (5e-8, 0.0), (5e-7, 0.0), (0.0, 5e-7)])
def test_a_clock_that_drifts_lies_within_its_uncertainty(drift, walk) -> None:
    inside, changes = [], []
    for seed in range(3):
        board, host, arrived = walked(seed, drift=drift, walk=walk)
        clock = HostClock()
        for one, late in zip(board, arrived, strict=True):
            clock.add(one, late)
        fit = clock.fit()
        error, std = fit.to_host(board) - host, fit.host_std_s(board)
        inside.append(np.mean(np.abs(error) < 3 * std))
        own = np.sqrt(std**2 - fit.latency_std_s**2)  # without the latency, which all times share
        changes.append(np.mean(np.abs(error - np.median(error)) < 3 * own))
        assert np.median(own) < 1e-4
        assert abs(fit.rate_error - (host[-1] - host[0]) / (board[-1] - board[0]) + 1) < 4 * fit.rate_error_std
    assert min(inside) >= 0.98
    assert np.mean(changes) >= 0.98


def test_answers_bound_the_shortest_latency() -> None:
    board, host, arrived = walked(5, drift=0.0, walk=0.0)
    clock = HostClock()
    for one, late in zip(board, arrived + 0.006, strict=True):  # 6.5 ms at least
        clock.add(one, late)
    for k in range(100, len(board), 100):
        clock.exchange(float(board[k]), float(host[k]) - 0.002)  # the way to the board took 2 ms
    fit = clock.fit()
    assert fit.latency_std_s == pytest.approx(0.0085 / np.sqrt(12.0), rel=0.05)
    assert np.all(np.abs(fit.to_host(board) - host) < 3 * fit.host_std_s(board))


def test_a_restart_keeps_the_rate_and_not_the_offset() -> None:
    board, _, arrived = walked(6, drift=0.0, walk=0.0)
    clock = HostClock()
    for one, late in zip(board, arrived, strict=True):
        clock.add(one, late)
    before = clock.fit()
    clock.restart()
    for k in range(20):  # two seconds: too few for a line of their own
        clock.add(0.1 * k, 700.0 + 0.1 * k + 0.0005)
    fit = clock.fit()
    assert fit.to_host(1.0) == pytest.approx(701.0, abs=3 * fit.host_std_s(1.0))
    assert abs(fit.rate_error - before.rate_error) < 20e-6
    assert fit.host_std_s(30.0) < fit.host_std_s(1.0) + 30 * 20e-6


def test_the_uncertainty_grows_in_a_gap() -> None:
    board, _, arrived = walked(7, drift=0.0, walk=1e-6)
    clock = HostClock()
    for one, late in zip(board, arrived, strict=True):
        if not 200.0 < one < 400.0:
            clock.add(one, late)
    fit = clock.fit()
    own = [np.sqrt(fit.host_std_s(at) ** 2 - fit.latency_std_s**2) for at in (100.0, 300.0)]
    assert own[1] > 5 * own[0]


def samples_at(ticks, *, status=None, lost=None, segment=None) -> Samples:
    n = len(ticks)
    none = np.zeros(n, dtype=np.int64)
    return Samples(
        np.asarray(ticks, dtype=np.int64),
        np.arange(n, dtype=np.uint16),
        np.zeros((n, 12), dtype=np.int16),
        np.asarray(none if status is None else status, dtype=np.uint16),
        none if lost is None else np.asarray(lost),
        none if segment is None else np.asarray(segment),
        np.full(n, np.nan),
    )


def test_the_sample_rate_counts_lost_samples_and_leaves_starts_out() -> None:
    rate = SampleRate(1e6)
    rate.add(samples_at([100, 1350, 2600]))
    rate.add(samples_at([7600, 8850], lost=[3, 0]))
    rate.add(samples_at([], lost=[]))
    rate.add(samples_at([9_000_000, 9_001_250], status=[Status.FIRST, 0]))
    rate.add(samples_at([50, 1300], segment=[1, 1]))
    stated = rate.metadata()
    assert stated["time_stamp_rate_hz"] == pytest.approx(800.0, abs=1e-9)
    assert stated["time_stamp_clock"] == "board"
    assert stated["time_stamp_tick_hz"] == 1e6
    assert "not corrected" in stated["time_stamp_rate_from"]
    assert "host_clock_rate_hz" not in stated


def test_the_rate_by_the_hosts_clock_is_stated_with_its_uncertainty() -> None:
    rate = SampleRate(1e6)
    rate.add(samples_at(range(0, 100_000, 1250)))
    stated = rate.metadata(ClockFit(0.0, 1e-4, 50e-6, 2e-6, 0.0, 1e-4, 20))
    assert stated["host_clock_rate_hz"] == pytest.approx(800.0 / 1.00005)
    assert stated["host_clock_rate_std_hz"] == pytest.approx(800.0 * 2e-6)
    assert "20 arrivals" in stated["host_clock_rate_from"]


def test_without_two_samples_no_rate_is_stated() -> None:
    rate = SampleRate(1e6)
    rate.add(samples_at([100]))
    assert "time_stamp_rate_hz" not in rate.metadata()
