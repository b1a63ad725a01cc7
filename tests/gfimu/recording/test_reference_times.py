"""A reference at times of its own: no error of half a sample, in a file, on the rows and in a diagnosis."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from gfimu import AccelerometerArray
from gfimu.diagnosis import Policy, make_stretches, prepare_run, starting_point
from gfimu.recording import Recording, ReferenceSeries, join_reference, reference_on_rows, reference_series
from sim.twin import Twin

TWIN = Twin(array=AccelerometerArray.load("cube12"), array_name="cube12")
T = np.arange(0.0, 20.0, 0.01)


def rate_of(t, frequency=1.5):
    return 4.0 + 3.0 * np.sin(2 * np.pi * frequency * t)


def rare(hertz, frequency=1.5, late=0.0037):
    """A recording at 100 Hz whose tachometer reads between its samples, less often."""
    read_at = np.arange(late, T[-1], 1.0 / hertz)
    rows = np.rint(read_at / 0.01).astype(int)
    tacho, times = np.full(len(T), np.nan), np.full(len(T), np.nan)
    tacho[rows], times[rows] = rate_of(read_at, frequency), read_at
    readings = 0.01 * np.random.default_rng(1).standard_normal((len(T), 12))
    return Recording.from_arrays(T, readings, TWIN.array, reference={"tacho_rad_s": tacho, "tacho_t_s": times})


@pytest.mark.parametrize(("hertz", "most"), [(10.0, 0.03), (100 / 3, 3e-3)])
def test_the_rows_have_the_reference_of_their_times(hertz, most):
    recording = rare(hertz)
    found = reference_on_rows(recording).reference
    assert set(found) == {"tacho_rad_s"}
    known = np.isfinite(found["tacho_rad_s"])
    assert known.mean() > 0.98
    error = found["tacho_rad_s"] - rate_of(T)
    assert np.sqrt(np.nanmean(error**2)) < most
    beside = np.isfinite(recording.reference["tacho_rad_s"])
    taken = np.sqrt(np.mean((recording.reference["tacho_rad_s"] - rate_of(T))[beside] ** 2))  # as if read at the row
    assert np.sqrt(np.mean(error[beside] ** 2)) < 0.05 * taken


def test_a_gap_stays_and_a_full_column_is_left_alone():
    recording = rare(10.0)
    for column in recording.reference.values():
        column[(T > 8.0) & (T < 11.0)] = np.nan
    found = reference_on_rows(recording).reference["tacho_rad_s"]
    assert np.isnan(found[(T > 8.3) & (T < 10.7)]).all()
    assert np.isfinite(found[(T > 1.0) & (T < 7.8)]).all()
    full = Recording.from_arrays(T, np.zeros((len(T), 12)), TWIN.array, reference={"tacho_rad_s": rate_of(T)})
    assert reference_on_rows(full) is full


@pytest.mark.parametrize("extension", ["csv", "parquet"])
def test_the_times_are_kept_in_a_file(tmp_path, extension):
    rare(10.0).write(tmp_path / f"run.{extension}")
    t, values = reference_series(Recording.read(tmp_path / f"run.{extension}"), "tacho_rad_s")
    np.testing.assert_allclose(t, np.arange(0.0037, T[-1], 0.1), atol=1e-9)
    np.testing.assert_allclose(values, rate_of(t), atol=1e-9)


@pytest.mark.parametrize("hertz", [10.0, 100 / 3])
def test_a_diagnosis_takes_the_reference_at_its_own_times(hertz):
    recording = rare(hertz, frequency=1.0)
    run = prepare_run(recording, TWIN)
    assert run.reference_valid.sum() == pytest.approx(20 * hertz, abs=2)
    assert np.abs(run.late).max() <= 0.5 * run.sample_period + 1e-9
    inside = (T > 1.0) & (T < 19.0)

    def rate_error(one):
        stretches = make_stretches(TWIN, [one], [[]])
        [drive] = starting_point(stretches, Policy().knots).drives
        error = drive.spin.at(T).rate - rate_of(T, 1.0)
        return stretches, drive, np.sqrt(np.mean(error[inside] ** 2))

    stretches, drive, error = rate_error(run)
    assert error < 0.3 * rate_error(replace(run, late=None))[2]  # as if each value were of its row
    # What is predicted belongs to the times at which it was read.
    predicted = stretches[0].predict((), drive.spin)[:, -1]
    seen = run.reference_valid & inside
    assert np.abs(predicted - drive.spin.at(run.t + run.late).rate)[seen].max() < 1e-4


def test_a_joined_reference_has_its_own_values_and_times():
    read_at = np.arange(1.0031, 18.0, 0.1)
    series = ReferenceSeries("tacho.csv", read_at, {"tacho_rad_s": rate_of(read_at, 0.3)})
    rate = rate_of(T, 0.3)
    readings = np.column_stack([0.05 * rate**2, 0.05 * np.gradient(rate, T), np.zeros(len(T))])
    readings += 0.01 * np.random.default_rng(2).standard_normal(readings.shape)
    joined = join_reference(Recording(T, readings, ("a11", "a12", "a13")), series, force=True)
    t, values = reference_series(joined.recording, "tacho_rad_s")
    np.testing.assert_array_equal(values, series.columns["tacho_rad_s"])
    np.testing.assert_allclose(t, read_at, atol=4.0 * joined.alignment.offset_std + 1e-4)
