"""Channels watched while samples arrive: excluded and used again, with the answer of the whole recording."""

import json

import numpy as np
import pytest
from watched_world import CALIBRATED, CUBE, GRAVITY, RATE_HZ, readings

from gfimu import AccelerometerArray, InputError, LiveRateFilter, SensorErrors
from gfimu.rate import FilterSettings, HealthCode, filter_stream
from gfimu.rate.health import watch_from_rest
from gfimu.rate.health.live.channel_watch import LiveWatch
from gfimu.rate.health.live.watched_filter import WatchedRateFilter

MG = 1e-3 * GRAVITY
ERRORS = SensorErrors.from_parts(CUBE, RATE_HZ)


def watched_filter():
    return WatchedRateFilter(LiveRateFilter(CUBE, ERRORS, 0.01), LiveWatch(CUBE, ERRORS, 0.01))


def streamed(t, y, size=50):
    """Push a recording in pieces: the events, times and rates of all estimates."""
    live = watched_filter()
    events, times, rates = [], [], []
    for first in range(0, len(t), size):
        found = live.push(t[first : first + size], y[first : first + size])
        events += live.take_events()
        times.append(found.t_s)
        rates.append(found.omega)
    return live, events, np.concatenate(times), np.concatenate(rates)


@pytest.mark.parametrize("kind", ["rest", "tumble", "turn"])
def test_a_fault_is_excluded_and_the_channel_used_again(kind):
    t, y, omega = readings(kind, 3, duration=34.0, rest=4.0)
    y[(t >= 14.33) & (t < 20.0), 5] += 40 * MG
    live, events, times, rates = streamed(t, y)
    assert [event.event for event in events] == ["excluded", "measured", "readmitted"]
    excluded, measured, back = events
    assert excluded.fault.channels == (CUBE.channels[5],)
    assert excluded.fault.kind == "step"
    assert excluded.t_s < 15.33
    assert excluded.fault.onset_s == pytest.approx(14.33, abs=0.35)
    for event in (excluded, measured):
        assert event.fault.sizes[0] == pytest.approx(40 * MG, abs=4 * event.fault.sizes_std[0])
    assert 24.0 < back.fault.end_s < 27.0
    assert live.health == [0] * 12
    late = (times > 15.5) & (times < 20.0)
    assert np.abs(rates - omega[: len(times)])[late].max() < 0.15


def test_the_filter_goes_back_to_before_the_fault():
    t, y, _ = readings("turn", 5, duration=16.0, rest=4.0)
    y[t >= 10.0, 0] += 100 * MG
    _, events, times, rates = streamed(t, y, size=1)
    used = y.copy()
    used[t >= events[0].fault.onset_s - 0.25, 0] = np.nan
    expected = LiveRateFilter(CUBE, ERRORS, 0.01).push(t, used).omega
    after = times > events[0].t_s + 0.1
    np.testing.assert_allclose(rates[after], expected[: len(times)][after], atol=1e-6)


def test_one_sample_at_a_time_or_many_find_the_same_as_the_recording():
    t, y, _ = readings("turn", 8, duration=24.0, rest=4.0)
    y[t >= 12.0, 7] -= 30 * MG
    one, many = (streamed(t, y, size)[1] for size in (1, 200))
    (fault,) = watch_from_rest(CUBE, t, y, CALIBRATED).faults
    for events in (one, many):
        event, _ = events
        assert event.fault.channels == fault.channels
        assert event.fault.onset_s == pytest.approx(fault.onset_s, abs=0.15)
        assert event.fault.found_s == pytest.approx(fault.found_s, abs=0.25)


def test_the_watch_goes_on_for_as_long_as_one_likes():
    """Old blocks are forgotten: a fault after three minutes is found as one in the first."""
    t, y, _ = readings("turn", 2, duration=200.0, rest=4.0)
    y[t >= 180.0, 3] += 20 * MG
    live, events, _, _ = streamed(t, y, size=500)
    assert [event.fault.channels for event in events] == 2 * [(CUBE.channels[3],)]
    assert events[0].fault.onset_s == pytest.approx(180.0, abs=0.4)
    monitor = live.watch._monitor
    assert len(monitor.blocks) < 1.2 * monitor.kept_blocks < monitor.total_blocks


@pytest.mark.parametrize("seed", range(3))
def test_an_uncalibrated_array_that_tumbles_excludes_nothing(seed):
    t, y, _ = readings("tumble", seed, duration=60.0, rest=4.0, gains=5e-3, axes=2e-3, places=3e-4)
    live, events, _, _ = streamed(t, y)
    assert events == []
    assert live.watch._agreement.factor > 2.0


def test_a_stream_that_begins_in_motion_is_watched_once_the_rate_has_settled():
    t, y, omega = readings("tumble", 1, duration=40.0)
    t, y, omega = t[700:] - t[700], y[700:] + np.random.default_rng(0).normal(0.0, 0.3, 12), omega[700:]
    y[t >= 22.0, 4] += 30 * MG
    live = WatchedRateFilter(
        LiveRateFilter(CUBE, ERRORS, 0.01, FilterSettings(start_omega=omega[0])), LiveWatch(CUBE, ERRORS, 0.01)
    )
    events = []
    for first in range(0, len(t), 50):
        live.push(t[first : first + 50], y[first : first + 50])
        events += live.take_events()
    assert [event.event for event in events] == ["unwatched", "watched", "excluded", "measured"]
    assert events[1].t_s < 12.0
    assert events[2].fault.channels == (CUBE.channels[4],)
    assert live.health[4] == HealthCode.EXCLUDED


def test_a_start_whose_sign_is_undecided_is_not_watched():
    t, y, _ = readings("tumble", 1, duration=10.0)
    y = np.tile(y[500], (1000, 1)) + ERRORS.noise_std * np.random.default_rng(4).standard_normal((1000, 12))
    y[:60] += np.linspace(1.0, 0.0, 60)[:, None] * np.sin(np.arange(60.0))[:, None]  # no rest
    live, events, times, _ = streamed(t, y)
    assert [event.event for event in events] == ["unwatched"]
    assert "rest" in events[0].text
    assert live.health is None
    assert len(times) == len(t) - 2


def test_a_line_that_is_refused_is_not_filtered_again():
    t, y, _ = readings("rest", 4, duration=12.0, rest=4.0)
    y[t >= 8.0, 6] += 50 * MG
    live = watched_filter()
    for k in range(len(t)):
        if k in (300, 830):
            with pytest.raises(InputError, match="increase"):
                live.push(t[k - 1], y[k])
        live.push(t[k], y[k])
    assert live.health == [0, 0, 0, 0, 0, 0, HealthCode.EXCLUDED, 0, 0, 0, 0, 0]


def test_an_array_with_few_channels_is_not_watched():
    array = AccelerometerArray.load("nap_3_2_2_2")
    watch = LiveWatch(array, SensorErrors.from_parts(array, RATE_HZ), 0.01)
    assert not watch.possible
    assert watch.push(0.0, np.zeros(9)) == []


def test_lines_of_a_stream_carry_health_and_events():
    t, y, _ = readings("rest", 6, duration=14.0, rest=4.0)
    y[t >= 9.0, 2] += 50 * MG
    y[500, 4] = np.nan
    text = ["t_s," + ",".join(f"{name}_m_s2" for name in CUBE.channels)]
    text += [",".join(map(repr, (float(time), *row.tolist()))) for time, row in zip(t, y, strict=True)]
    lines = [json.loads(line) for line in filter_stream(text, CUBE, ERRORS, 0.01, watched=watched_filter())]
    first, event = [line for line in lines if "event" in line]
    assert (first["event"], event["event"]) == ("excluded", "measured")
    (fault,) = event["faults"]
    assert (fault["channel"], fault["kind"], fault["unit"], fault["excluded"]) == ("a13", "step", "m/s2", True)
    assert fault["size"] == pytest.approx(50 * MG, abs=4 * fault["std"])
    assert fault["onset_s"] == pytest.approx(9.0, abs=0.35)
    estimates = [line for line in lines if "omega_rad_s" in line]
    assert len(estimates) == len(t)
    assert "health" not in estimates[100]
    assert estimates[800]["health"] == [0] * 12
    assert estimates[-1]["health"] == [0, 0, HealthCode.EXCLUDED, *[0] * 9]
    assert [line["fault"] for line in estimates if "fault" in line] == [{"missing": {"a22": 1}}]
