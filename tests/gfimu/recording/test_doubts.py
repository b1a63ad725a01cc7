"""Doubts of a recording: what is wrong is found with its rows, and nothing is found where nothing is wrong."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_array_equal

import gfimu
from gfimu import Recording, RecordingWarning
from gfimu.recording import doubts_of, steady_clock, without_doubtful

COUNT = 0.0039 * 9.80665
N = 2000


def kinds(recording, array=None):
    return [one.kind for one in doubts_of(recording, array)]


def at_rest(seed=1, tilt=(0.2, -0.3, 0.93), noise=1.0):
    """Two chips at rest, rounded to counts."""
    rng = np.random.default_rng(seed)
    truth = np.tile(np.array(tilt) * 9.80665, 2)
    readings = COUNT * np.round(truth / COUNT + noise * rng.standard_normal((N, 6)))
    return Recording(np.arange(N) / 100.0, readings, ("a11", "a12", "a13", "a21", "a22", "a23"))


def in_motion(seed=1):
    """Turned by hand: gravity goes round at up to 3 rad/s, knocks and all."""
    rng = np.random.default_rng(seed)
    t = np.arange(N) / 100.0
    angle = np.cumsum(3.0 * np.sin(0.7 * t) + 0.3 * rng.standard_normal(N)) / 100.0
    force = 9.80665 * np.column_stack([np.sin(angle), 0.3 * np.cos(angle), 0.954 * np.cos(angle)])
    readings = COUNT * np.round(np.tile(force, 2) / COUNT + rng.standard_normal((N, 6)))
    return Recording(t, readings, ("a11", "a12", "a13", "a21", "a22", "a23"))


def changed(recording, rows, columns, values):
    readings = recording.readings.copy()
    readings[np.ix_(rows, columns)] = values
    return replace(recording, readings=readings)


@pytest.mark.parametrize("made", [at_rest, in_motion])
@pytest.mark.parametrize("seed", range(8))
def test_nothing_is_doubtful_where_nothing_is_wrong(made, seed):
    assert kinds(made(seed)) == []


@pytest.mark.parametrize("factor", [0.0, 2.0, 0.5, -1.0])
@pytest.mark.parametrize("made", [at_rest, in_motion])
def test_misread_registers_are_found_with_their_rows_and_left_out(made, factor):
    run, rows = made(), [171, 304, 900]
    wrong = changed(run, rows, [0, 1, 2], factor * run.readings[rows][:, :3])
    [doubt] = doubts_of(wrong)
    assert (doubt.kind, doubt.severity, doubt.channels) == ("wrong_read", "warning", ("a11", "a12", "a13"))
    assert_array_equal(doubt.rows, rows)
    assert "rows 172, 305, 901" in doubt.text
    cleaned = without_doubtful(wrong, None, [doubt])
    assert_array_equal(np.isnan(cleaned.readings), np.isnan(changed(run, rows, [0, 1, 2], np.nan).readings))


def with_tacho(rate):
    run = at_rest()
    return replace(run, reference={"tacho_rad_s": rate})


def test_lost_pulses_and_impossible_values_of_a_tachometer_are_left_out(tmp_path):
    t = at_rest().t_s
    rate = 5.0 + 3.0 * np.sin(0.7 * t) + 0.02 * np.random.default_rng(2).standard_normal(len(t))
    wrong = rate.copy()
    wrong[[300, 500, 900]] *= [2.0, 0.5, 0.0]
    wrong[700] = 1e30
    found = {one.kind: one for one in doubts_of(with_tacho(wrong))}
    assert found["wrong_read"].rows.tolist() == [300, 500, 900]
    assert found["corrupt"].rows.tolist() == [700]
    kept = without_doubtful(with_tacho(wrong), None, found.values()).reference["tacho_rad_s"]
    assert np.flatnonzero(np.isnan(kept)).tolist() == [300, 500, 700, 900]
    with_tacho(np.where(wrong > 1e3, rate, wrong)).write(tmp_path / "run.parquet")
    assert gfimu.convert(tmp_path / "run.parquet", drop="wrong_read").dropped == {"wrong_read": 3}


@pytest.mark.parametrize("seed", range(8))
def test_a_rate_in_steps_that_stops_and_starts_is_not_doubtful(seed):
    rng, t = np.random.default_rng(seed), at_rest().t_s
    rate = np.round(np.cumsum(rng.standard_normal(len(t))) * 0.05, seed % 3 + 1) * (np.sin(0.5 * t) > 0.0)
    assert "tacho_rad_s" not in {name for one in doubts_of(with_tacho(rate)) for name in one.channels}


def test_a_knock_is_a_note_and_stays():
    run = at_rest()
    knocked = changed(run, [500], [0, 1, 2, 3, 4, 5], run.readings[500] + np.array([7.0, -3.0, 4.0] * 2))
    found = doubts_of(knocked)
    assert [one.kind for one in found] == ["spike", "spike"]
    assert {one.severity for one in found} == {"note"}
    assert without_doubtful(knocked, None, found) is knocked


def test_a_frozen_channel_is_found_at_rest_and_in_motion():
    for run in (at_rest(), in_motion()):
        frozen = changed(run, range(700, 900), [4], run.readings[700, 4])
        [doubt] = doubts_of(frozen)
        assert (doubt.kind, doubt.channels) == ("frozen", ("a22",))
        assert set(range(701, 899)) <= set(doubt.rows.tolist()) <= set(range(695, 905))


def test_equal_readings_of_coarse_steps_are_not_frozen():
    """In the middle of a step a quiet channel repeats itself for long."""
    assert kinds(at_rest(noise=0.2)) == []


def test_channels_without_readings_and_of_one_value_are_dead():
    run = at_rest()
    dead = changed(changed(run, range(N), [1], np.nan), range(N), [5], 3.0)
    found = doubts_of(dead)
    assert {one.kind: one.channels for one in found} == {"dead": ("a23",), "missing": ("a12",)} or [
        one.channels for one in found if one.kind == "dead"
    ] == [("a12",), ("a23",)]
    assert np.isnan(without_doubtful(dead, None, found).readings[:, [1, 5]]).all()


@pytest.mark.parametrize(
    ("per_burst", "rate"), [(4, 100.0), (1, 100.0), (10, 400.0), (2, 26.0)], ids=["four", "late", "ten", "slow"]
)
def test_stamps_of_a_host_show_the_rate_of_the_samples(per_burst, rate):
    rng = np.random.default_rng(3)
    taken = np.arange(3000) / rate
    last = (np.arange(3000) // per_burst + 1) * per_burst - 1  # of the transfer that brings a sample
    late = 0.6 / rate * rng.random(3000)[last.clip(max=2999)] * (1 if per_burst > 1 else 1.6)
    stamps = np.maximum.accumulate(taken[last.clip(max=2999)] + late + 2e-5 * (np.arange(3000) % per_burst))
    clock = steady_clock(stamps)
    assert clock is not None
    assert clock.rate_hz == pytest.approx(rate, rel=2e-3)
    assert clock.per_burst == pytest.approx(per_burst, rel=0.3, abs=1.0)


@pytest.mark.parametrize("seed", range(20))
def test_samples_taken_at_irregular_times_have_no_steady_clock(seed):
    rng = np.random.default_rng(seed)
    assert steady_clock(np.cumsum(rng.exponential(0.01, 3000))) is None


@pytest.mark.parametrize("scatter", [0.0, 0.05])
def test_times_of_the_samples_themselves_stay(scatter):
    rng = np.random.default_rng(5)
    t = np.arange(3000) / 100.0 + scatter / 100.0 * rng.standard_normal(3000)
    assert steady_clock(t) is None
    lost = np.delete(t, slice(1000, 1040))
    assert steady_clock(lost) is None
    assert "gaps" in [one.kind for one in doubts_of(replace_times(lost))]


def replace_times(t):
    run = at_rest()
    rows = np.arange(len(t)) % N
    return Recording(t, run.readings[rows], run.channels)


def test_bursts_are_reported_by_inspect_and_by_every_command(tmp_path):
    run = at_rest()
    burst = np.repeat(run.t_s[3::4] + 0.004, 4) + 1e-4 * (np.arange(N) % 4)
    path = tmp_path / "burst.csv"
    table = np.column_stack([burst, run.readings[:, :3]])
    np.savetxt(path, table, delimiter=",", header="time_s,ax,ay,az", comments="", fmt="%.6f")
    seen = gfimu.inspect(path)
    assert seen.sample_rate_hz == pytest.approx(100.0)
    assert any("in bursts of 4 rows" in line and "(check this)" in line for line in seen.reasons)
    with pytest.warns(RecordingWarning, match=r"come in bursts of 4 rows.* time.rate_hz = 100"):
        gfimu.convert(Recording(burst, run.readings, run.channels))


def test_an_estimate_does_without_misread_samples():
    run = gfimu.simulate("speed_sweep", seed=2)
    readings = run.readings.copy()
    rows = np.arange(200, len(run), 500)
    readings[rows, 3:6] = 0.0
    clean = gfimu.estimate(run, rest_bias=True)
    wrong = gfimu.estimate(replace(run, readings=readings), rest_bias=True)
    assert any("single readings are zero or a multiple" in text for text in wrong.metadata["warnings"])
    assert np.nanmax(np.abs(wrong.omega - clean.omega)) < 3.0 * np.nanmedian(clean.omega_std)


def test_rows_of_misread_samples_are_dropped_on_request(tmp_path):
    run, rows = at_rest(), [171, 304, 900]
    wrong = changed(run, rows, [0, 1, 2], 2.0 * run.readings[rows][:, :3])
    wrong.write(tmp_path / "run.parquet")
    made = gfimu.convert(tmp_path / "run.parquet", drop="wrong_read")
    assert made.dropped == {"wrong_read": 3}
    assert_array_equal(made.t_s, np.delete(run.t_s, rows))
