"""The noise and the sign of a stream: measured with the samples so far, in the estimates and in their JSON lines."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest
from rate_worlds import measure, sensor_errors, tumble

from gfimu import AccelerometerArray, LiveRateFilter
from gfimu.rate import FilterSettings, filter_stream

RATE = 100.0


def streamed(array: AccelerometerArray, *, stated: float = 1.0, block: int = 25, **settings):
    """Estimates of a tumbling array whose noise is ``stated`` times smaller in the errors that the filter has."""
    motion = tumble(RATE, 8.0, duration=12.0)
    first = 0 if not settings else 600
    t, values = motion.t[first:], measure(array, motion, np.random.default_rng(9), bias=0.0)[first:]
    errors = sensor_errors(array, RATE)
    errors = replace(errors, noise_std=errors.noise_std / stated, bias_std=np.full(array.n_channels, 0.02))
    live = LiveRateFilter(array, errors, 1 / RATE, FilterSettings(**settings) if settings else None)
    parts = [live.push(t[k : k + block], values[k : k + block]) for k in range(0, len(t), block)]
    parts = [part for part in [*parts, live.finish()] if len(part)]
    names = ("t_s", "omega", "std", "scale", "sign_probability")
    return motion.omega[first:], {name: np.concatenate([getattr(part, name) for part in parts]) for name in names}


@pytest.mark.parametrize("name", ["cube12", "corners8"])  # without and with combinations that no motion changes
@pytest.mark.parametrize("stated", [1.0, 3.0])
def test_the_noise_is_measured_as_it_comes(name, stated):
    _, found = streamed(AccelerometerArray.load(name), stated=stated)
    settled = found["t_s"] > 6.0
    assert np.median(found["scale"][settled]) == pytest.approx(stated, rel=0.25)


def test_the_errors_are_as_large_as_stated_when_the_noise_is_not():
    truth, found = streamed(AccelerometerArray.load("corners8"), stated=3.0)
    late = found["t_s"] > 6.0
    error = (found["omega"] - truth)[late] / found["std"][late]
    assert 0.5 < np.median(np.abs(error)) / 0.6745 < 1.5


def test_a_decided_sign_is_the_same_throughout():
    truth, found = streamed(AccelerometerArray.load("corners8"), start_omega=None)
    probability = found["sign_probability"]
    assert np.all((probability >= 0.5 - 1e-9) & (probability <= 1.0))
    decided = (probability > 0.99) & (np.linalg.norm(truth, axis=1) > 1.0)
    assert decided[-200:].mean() > 0.9
    same = np.sign(np.sum(found["omega"] * truth, axis=1))[decided]
    assert max(np.mean(same > 0), np.mean(same < 0)) > 0.995  # of the run as a whole either sign may be true


def test_each_line_of_a_stream_has_both():
    array = AccelerometerArray.load("corners8")
    motion = tumble(RATE, 4.0, duration=5.0)
    values = measure(array, motion, np.random.default_rng(2), bias=0.0)
    head = ",".join(["t_s", *(f"{channel}_m_s2" for channel in array.channels)])
    lines = [head, *(",".join(f"{v:.6f}" for v in [t, *row]) for t, row in zip(motion.t, values, strict=True))]
    found = [json.loads(line) for line in filter_stream(lines, array, sensor_errors(array, RATE), 1 / RATE)]
    assert len(found) == len(motion.t)
    assert all(line["noise_scale"] > 0.0 and 0.0 <= line["omega_sign_probability"] <= 1.0 for line in found)
