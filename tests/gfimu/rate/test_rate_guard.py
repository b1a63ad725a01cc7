"""The filter does not diverge: noise, tones and spins at the start, and the guard that starts it again."""

from __future__ import annotations

import importlib
import os
import sys
from dataclasses import replace

import numpy as np
import pytest
from rate_worlds import Motion, cube, measure, sensor_errors, tumble

from gfimu import AccelerometerArray, LiveRateFilter, Recording, SensorErrors, estimate_rate
from gfimu.array import omega_products, white_noise_std
from gfimu.rate import FilterSettings, filter_rate, joined_estimates, smooth_rate, start_of_still

METHODS = ("filter", "smoother", "live")
ARRAYS = {"cube12": 100.0, "mimu4444": 62.5, "corners8": 100.0, "p3_three_plus_one": 100.0}
CALIBRATED = 0.01  # m/s², of the biases


def solved(method, array, t, readings, errors, settings=None):
    """ω (n, 3), its standard deviation (n, 3), the channel report and the sign."""
    if method == "live":
        live = LiveRateFilter(array, errors, float(np.median(np.diff(t))), settings)
        parts = [live.push(t, readings), live.finish()]
        omega, std = (np.concatenate([getattr(part, name) for part in parts]) for name in ("omega", "std"))
        return omega, std, live.report, live.sign.state
    found = estimate_rate(array, t, readings, errors, method=method, settings=settings)
    return found.omega, found.std, found.channels, found.sign.state


def steady(name, omega, errors, rng, *, seconds=6.0, factor=1.0):
    """Times and readings of a steady rate about the vertical, with biases and noise of the errors."""
    array, rate = AccelerometerArray.load(name), ARRAYS[name]
    t = np.arange(round(seconds * rate)) / rate
    up = rng.standard_normal(3) if not np.any(omega) else omega
    still = array.regression_matrix[:, 3:] @ (9.81 * up / np.linalg.norm(up))
    still = still + array.centripetal_matrix @ omega_products(omega) + errors.bias_std * rng.standard_normal(len(still))
    return t, still + factor * white_noise_std(array, rate) * rng.standard_normal((len(t), len(still)))


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("factor", [0.5, 1.3, 3.0])
@pytest.mark.parametrize("name", ARRAYS)
def test_rest_with_other_noise_than_the_data_sheets(name, factor, method):
    array = AccelerometerArray.load(name)
    errors = SensorErrors.from_parts(array, ARRAYS[name])
    within = []
    for seed in range(3):
        t, readings = steady(name, np.zeros(3), errors, np.random.default_rng([41, seed]), factor=factor)
        omega, std, _, _ = solved(method, array, t, readings, errors)
        within.append((np.abs(omega) < 4 * std).all(axis=1))
    assert np.mean(within) >= 0.99


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize(("hertz", "size"), [(12.5, 0.16), (7.0, 0.16), (12.5, 0.3)])
def test_a_tone_in_one_channel_at_rest(method, hertz, size):
    array = AccelerometerArray.load("mimu4444")
    errors = SensorErrors.from_parts(array, 62.5)
    t, readings = steady("mimu4444", np.zeros(3), errors, np.random.default_rng(5))
    readings[:, 9] += size * np.sin(2 * np.pi * hertz * t + 0.4)
    omega, std, _, _ = solved(method, array, t, readings, errors)
    assert np.mean((np.abs(omega) < 4 * std).all(axis=1)) >= 0.99


@pytest.mark.parametrize("method", METHODS)
def test_a_recorded_rest_with_a_tone(shared_data, method):
    run = Recording.read(shared_data / "public" / "rest_with_tone.csv")
    errors = SensorErrors.from_parts(run.array, run.sample_rate)
    omega, std, _, _ = solved(method, run.array, run.t_s, run.for_array(run.array), errors)
    assert np.all(np.linalg.norm(omega, axis=1) - 4 * np.linalg.norm(std, axis=1) < 1.0)
    assert np.mean((np.abs(omega) < 4 * std).all(axis=1)) >= 0.99


@pytest.mark.parametrize("method", [*METHODS, "ml"])
@pytest.mark.parametrize("speed", [2.0, 8.0])
def test_a_steady_spin_from_the_first_sample_of_a_calibrated_array(speed, method):
    errors = SensorErrors.from_parts(AccelerometerArray.load("cube12"), 100.0, bias_std=CALIBRATED)
    rng = np.random.default_rng(3)
    truth = np.array([0.48, -0.6, 0.64]) * speed
    t, readings = steady("cube12", truth, errors, rng)
    omega, std, _, sign = solved(method, AccelerometerArray.load("cube12"), t, readings, errors)
    side = np.where(omega @ truth < 0, -1.0, 1.0)[:, None]
    assert np.mean((np.abs(side * omega - truth) < 4 * std).all(axis=1)) >= 0.99
    assert sign == "undecided"
    if method != "ml":
        assert np.linalg.norm(omega[-1]) == pytest.approx(speed, rel=0.05)


def test_the_start_is_a_spin_from_the_odds_on():
    """At one bias the evidence of the null space grows with the fourth power of the rate."""
    array = AccelerometerArray.load("cube12")
    errors = SensorErrors.from_parts(array, 100.0, bias_std=CALIBRATED)
    sheet = SensorErrors.from_parts(array, 100.0)
    still = {}
    for speed in np.linspace(0.3, 1.2, 10):
        readings = np.tile(array.centripetal_matrix @ omega_products([0.0, 0.0, speed]), (50, 1))
        still[speed] = start_of_still(array, readings, errors)
        assert start_of_still(array, readings, sheet).kind == "rest"
        assert start_of_still(array, readings, sheet).least_spin > speed
    chances = [found.rest_probability for found in still.values()]
    assert chances == sorted(chances, reverse=True)
    for found in still.values():
        assert (found.kind == "spin") == (found.rest_probability < 0.5)
    assert {found.kind for found in still.values()} == {"rest", "spin"}
    assert start_of_still(array, np.zeros((50, 12)), errors).rest_probability > 0.9


@pytest.mark.parametrize(("size", "factor"), [(1.0, 1.0), (30.0, 50.0)])
def test_biases_that_no_rate_explains_are_larger_than_stated(size, factor):
    array = AccelerometerArray.load("cube12")
    errors = SensorErrors.from_parts(array, 100.0, bias_std=CALIBRATED)
    for seed in range(5):
        readings = np.tile(size * CALIBRATED * np.random.default_rng(seed).standard_normal(12), (50, 1))
        found = start_of_still(array, readings, errors)
        assert found.kind == "rest"
        assert found.bias_factor == 1.0 if factor == 1.0 else found.bias_factor > factor


def late(motion, first):
    return Motion(motion.t[first:] - motion.t[first], *(one[first:] for one in (motion.omega, motion.alpha, motion.p)))


TUMBLE = late(tumble(100.0, 6.0, duration=16.0), 600)
CUBE = cube(0.1)
ERRORS = replace(sensor_errors(CUBE, 100.0), bias_std=np.full(12, CALIBRATED))
KNOWN = FilterSettings(start_omega=TUMBLE.omega[0], start_std=0.01)


def contradicted(kind):
    """Readings of a tumble, settings of the filter, and the samples (first, last) that it may have no rate for."""
    rng = np.random.default_rng(1)
    readings = measure(CUBE, TUMBLE, rng, bias=CALIBRATED, quantise=False)
    if kind == "rest stated":
        return readings, FilterSettings(rest=None), (0, 60)
    if kind == "wrong start":
        return readings, FilterSettings(start_omega=np.array([5.0, 0.0, 0.0]), start_std=0.01), (0, 60)
    if kind == "step":
        readings[400:, 1] += 3.0
        return readings, KNOWN, (400, 1000)
    if kind == "burst":
        readings[400:430] += 30.0 * rng.standard_normal((30, 12))
        return readings, KNOWN, (400, 460)
    if kind == "long burst":
        readings[400:520] += 30.0 * rng.standard_normal((120, 12))
        return readings, KNOWN, (400, 610)
    return readings, KNOWN, (0, 0)


@pytest.mark.parametrize("solve", [filter_rate, smooth_rate])
@pytest.mark.parametrize("kind", ["none", "rest stated", "wrong start", "step", "burst", "long burst"])
def test_readings_that_contradict_the_filter(kind, solve):
    readings, settings, (first, last) = contradicted(kind)
    found = solve(CUBE, TUMBLE.t, readings, ERRORS, settings)
    assert np.isfinite(found.omega).all()
    outside = np.ones(len(found), dtype=bool)
    outside[first:last] = False
    assert np.mean((np.abs(found.omega - TUMBLE.omega) < 4 * found.std).all(axis=1)[outside]) >= 0.98
    if kind == "none":
        assert found.channels.restarts == 0


def test_the_guard_is_the_same_live_and_in_blocks():
    readings, settings, _ = contradicted("long burst")
    whole, single = (LiveRateFilter(CUBE, ERRORS, 0.01, settings) for _ in range(2))
    block = joined_estimates([whole.push(TUMBLE.t, readings), whole.finish()])
    each = [single.push(t, row) for t, row in zip(TUMBLE.t, readings, strict=True)]
    each = joined_estimates([part for part in [*each, single.finish()] if len(part)])
    sound = np.r_[0:400, 650:1000]  # rounding errors grow where no rate explains the readings
    for name in ("omega", "covariance"):
        np.testing.assert_allclose(getattr(each, name)[sound], getattr(block, name)[sound], rtol=1e-6, atol=1e-6)
    assert whole.report == single.report
    assert np.all(np.abs(block.omega - TUMBLE.omega)[650:] < 4 * block.std[650:])


def test_no_restart_in_ten_minutes_of_sound_readings():
    """1200 windows of 300 degrees of freedom, whose misfit never exceeds five standard deviations by chance."""
    t = np.arange(60_000) / 100.0
    rng = np.random.default_rng(2)
    for motion in (Motion(t, *np.zeros((2, len(t), 3)), np.tile([0, 0, 9.81], (len(t), 1))), TUMBLE):
        for bias in (None, CALIBRATED):
            errors = sensor_errors(CUBE, 100.0) if bias is None else ERRORS
            values = measure(CUBE, motion, rng, bias=float(errors.bias_std[0]), quantise=False)
            process = LiveRateFilter(CUBE, errors, 0.01, FilterSettings(start_omega=motion.omega[0]))
            process.push(motion.t, values)
            assert process.report.restarts == 0


def test_an_inner_function_of_another_file_that_changes_is_compiled_anew(tmp_path, monkeypatch):
    monkeypatch.setattr("numba.core.config.CACHE_DIR", str(tmp_path / "kept"))
    monkeypatch.syspath_prepend(str(tmp_path))
    inner, outer = tmp_path / "inner_part.py", tmp_path / "outer_part.py"
    text = "from numba import njit\nfrom gfimu.base.compiled import INNER\n"
    text += "@njit(**INNER)\ndef part(x):\n    return x + {}\n"
    outer.write_text(
        "from gfimu.base.compiled import compiled\nfrom inner_part import part\n"
        "@compiled\ndef whole(x):\n    return 2 * part(x)\n"
    )
    results = []
    for number in (1, 5):
        inner.write_text(text.format(number))
        os.utime(inner, (1e9 + number, 1e9 + number))
        for name in ("inner_part", "outer_part"):
            sys.modules.pop(name, None)
        importlib.invalidate_caches()
        results.append(importlib.import_module("outer_part").whole(1))
    assert results == [4, 12]


def test_what_is_kept_of_a_class_that_moved_is_compiled_anew(tmp_path, monkeypatch):
    monkeypatch.setattr("numba.core.config.CACHE_DIR", str(tmp_path / "kept"))
    monkeypatch.syspath_prepend(str(tmp_path))
    pair = "from typing import NamedTuple\nclass Pair(NamedTuple):\n    a: float\n    b: float\n"
    total = "from gfimu.base.compiled import compiled\n@compiled\ndef total(pair):\n    return pair.a + pair.b\n"
    (tmp_path / "adder.py").write_text(f"{pair}{total}")
    assert importlib.import_module("adder").total(importlib.import_module("adder").Pair(1.0, 2.0)) == 3.0
    (tmp_path / "pairs.py").write_text(pair)
    (tmp_path / "adder.py").write_text(total)
    sys.modules.pop("adder")
    importlib.invalidate_caches()
    assert importlib.import_module("adder").total(importlib.import_module("pairs").Pair(1.0, 2.0)) == 3.0
