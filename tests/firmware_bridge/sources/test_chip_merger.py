"""Chips of different pace on one grid: however they are cut into batches, and with the error that is stated."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

from firmware_bridge.sources.chip_merger import ChipMerger, noise_factor, spline_error

RATES = (1000.0, 961.7)


def sampled(rate: float, seconds: float, phase: float = 0.0):
    return (np.arange(int(seconds * rate)) + phase) / rate


def merged(times, readings, cuts, *, leave_out=None):
    """Feed both chips in batches that end at some times; return everything that comes."""
    merger, parts, begin = ChipMerger(("one", "two")), [], -np.inf
    for end in cuts:
        for chip, (t_s, rows) in enumerate(zip(times, readings, strict=True)):
            now = (t_s > begin) & (t_s <= end)
            if leave_out is not None and chip == leave_out[0]:
                now &= (t_s < leave_out[1]) | (t_s > leave_out[2])
            merger.add(chip, t_s[now], rows[now])
        parts.append(merger.take())
        begin = end
    return merger, *(np.concatenate([part[place] for part in parts]) for place in (0, 1))


def test_batches_make_no_difference() -> None:
    rng = np.random.default_rng(1)
    times = [sampled(RATES[0], 3.0), sampled(RATES[1], 3.0, 0.3)]
    readings = [rng.normal(size=(len(t), 3)) for t in times]
    for cuts in (np.arange(0.1, 3.01, 0.1), np.sort(rng.uniform(0.0, 3.0, 40))):
        _, t_s, rows = merged(times, readings, [*cuts, 3.0])
        expected = CubicSpline(times[1], readings[1])(t_s)
        assert len(t_s) >= 2970
        assert np.array_equal(rows[:, :3], readings[0][np.isin(times[0], t_s)])
        inside = slice(60, None)  # the spline's own start differs
        assert np.allclose(rows[inside, 3:], expected[inside], atol=1e-6)


def test_stated_error_of_a_sinusoid_and_of_noise() -> None:
    """Against the rms of what comes out, over phases that the two paces run through."""
    rng = np.random.default_rng(2)
    times = [sampled(RATES[0], 20.0), sampled(RATES[1], 20.0, 0.3)]
    for share in (0.1, 0.2, 0.3):
        waves = [np.repeat(np.sin(2 * np.pi * share * RATES[1] * t)[:, None], 3, axis=1) for t in times]
        _, t_s, rows = merged(times, waves, [5.0, 12.0, 20.0])
        error = rows[100:-100, 3] - np.sin(2 * np.pi * share * RATES[1] * t_s[100:-100])
        assert np.sqrt(2.0) * error.std() == pytest.approx(spline_error(share)[0], rel=0.03)
    noise = [rng.normal(size=(len(t), 3)) for t in times]
    _, _, rows = merged(times, noise, [5.0, 12.0, 20.0])
    # 60,000 values that correlate little: the rms is known to 0.3 %, five of that are allowed
    assert rows[100:-100, 3:].std() == pytest.approx(noise_factor(), rel=0.015)


def test_a_gap_of_a_chip_is_missing_and_the_other_goes_on() -> None:
    times = [sampled(RATES[0], 4.0), sampled(RATES[1], 4.0)]
    readings = [np.ones((len(t), 3)) for t in times]
    _, t_s, rows = merged(times, readings, np.arange(0.1, 4.01, 0.1), leave_out=(1, 1.0, 2.5))
    assert np.isfinite(rows[:, :3]).all()
    gap = (t_s > 1.0) & (t_s < 2.5)
    assert np.isnan(rows[gap, 3:]).all()
    assert np.isfinite(rows[~gap, 3:]).mean() > 0.99
    assert len(t_s) >= 3900


def test_nothing_comes_before_every_chip_has_begun() -> None:
    times = [sampled(RATES[0], 2.0), sampled(RATES[1], 2.0)]
    readings = [np.ones((len(t), 3)) for t in times]
    _, t_s, rows = merged(times, readings, np.arange(0.1, 2.01, 0.1), leave_out=(1, -1.0, 0.95))
    assert t_s[0] == pytest.approx(0.951, abs=1.1e-3)
    assert np.isfinite(rows).all()


def test_rates_and_their_ratio() -> None:
    times = [sampled(RATES[0], 2.0), sampled(RATES[1], 2.0)]
    merger, *_ = merged(times, [np.ones((len(t), 3)) for t in times], [1.0, 2.0], leave_out=(1, 0.5, 0.7))
    assert merger.facts()["chip_rate_ratios"] == pytest.approx({"one": 1.0, "two": 0.9617}, rel=1e-9)
