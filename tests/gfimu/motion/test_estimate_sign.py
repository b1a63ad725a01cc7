"""Measured noise and the sign's probability in the estimate, its file, its summary and its picture."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from gfimu import AccelerometerArray, Estimate, Recording, estimate, specific_force, summarise
from gfimu.array import PartLimits
from gfimu.visual import free_rate_plots

CUBE = AccelerometerArray.load("cube12")


@pytest.fixture(scope="module")
def spun():
    """A second of rest, then turning to and fro about x through zero, with five times the noise from 6 s on."""
    t = np.arange(1200) / 100.0
    moving = np.maximum(t - 2.0, 0.0)
    rate, change = 6 * np.sin(1.5 * moving) * (moving > 0), 9 * np.cos(1.5 * moving) * (moving > 0)
    axis = np.array([1.0, 0.0, 0.0])
    level = np.tile([9.80665, 0.0, 0.0], (len(t), 1))
    readings = specific_force(CUBE, level, np.outer(change, axis), np.outer(rate, axis))
    noise = PartLimits.of(CUBE, 100.0).noise * np.where(t > 6.0, 5.0, 1.0)[:, None]
    readings = readings + noise * np.random.default_rng(0).standard_normal(readings.shape)
    return Recording.from_arrays(t, readings, CUBE)


def test_probability_and_disagreement_are_in_file_and_summary(spun, tmp_path):
    found = estimate(spun, CUBE, method="ml")
    assert found.sign_probability.min() >= 0.49
    assert np.mean(found.sign_probability[spun.t_s > 3] > 0.99) > 0.6
    assert found.sign_undecided.sum() < 0.1 * len(found)
    path = tmp_path / "estimate.parquet"
    found.write(path)
    again = Estimate.read(path)
    np.testing.assert_array_equal(again.sign_probability, found.sign_probability)
    assert "omega_sign_probability" in again.to_columns()
    summary = summarise(found, spun, CUBE)
    assert summary.disagreement["notable"]
    assert summary.disagreement["times"] == pytest.approx(5.0, rel=0.25)
    assert summary.sign_undecided_samples == found.sign_undecided.sum()
    assert "times more than their stated noise" in summary.warnings[0]
    assert len(summary.warnings) == 1 + (summary.sign_undecided_samples > 0)
    late = spun.t_s > 6.5
    ratio = found.omega_products_std[late].mean() / found.omega_products_std[(spun.t_s > 3) & (spun.t_s < 5)].mean()
    assert ratio == pytest.approx(5.0, rel=0.3)


def test_undecided_stretches_are_drawn(spun):
    found = estimate(spun, CUBE, method="ml")
    found = replace(found, sign_probability=np.where(spun.t_s > 9.0, 0.6, 1.0))
    assert found.sign_undecided.any()
    rates = free_rate_plots(spun, found, None)[0]
    marked = [line for line in rates.lines if line.name == "sign undecided"]
    assert len(marked) == 3
    np.testing.assert_array_equal(np.isfinite(marked[0].values), found.sign_undecided)
    certain = estimate(spun, CUBE, method="integrate")
    assert not [
        line for plot in free_rate_plots(spun, certain, None) for line in plot.lines if "undecided" in line.name
    ]
