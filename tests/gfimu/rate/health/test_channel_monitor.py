"""The monitor finds the faulty channel, its onset and kind, and leaves sound and uncalibrated arrays alone."""

import numpy as np
import pytest
from watched_world import CALIBRATED, CUBE, GRAVITY, RATE_HZ, readings

from gfimu import InputError, SensorErrors
from gfimu.rate import HealthCode
from gfimu.rate.health import MonitorPolicy, watch_channels, watch_from_rest
from gfimu.rate.health.recursion.blocks import block_means
from gfimu.rate.health.recursion.monitor_filter import MonitorFilter
from gfimu.rate.health.recursion.signatures import new_slot
from gfimu.rate.health.watch import watch_in_motion

MG = 1e-3 * GRAVITY
NAMES = list(CUBE.channels)


def named(health):
    return {name for fault in health.faults for name in fault.channels}


@pytest.mark.parametrize("kind", ["rest", "tumble", "turn"])
def test_a_sound_array_has_no_fault(kind):
    t, y, _ = readings(kind, 1, duration=300.0)
    health = watch_channels(CUBE, t, y, CALIBRATED)
    assert health.sound
    assert not health.excluded.any()
    assert health.model_factor == 1.0
    assert health.largest_statistic < health.threshold


@pytest.mark.parametrize("channel", [0, 5, 7, 11])
@pytest.mark.parametrize("kind", ["rest", "tumble", "turn"])
def test_a_small_step_is_found_within_a_second(kind, channel):
    t, y, _ = readings(kind, 10 + channel)
    onset = 9.33
    size = (15 if kind == "tumble" else 10) * MG
    y[t >= onset, channel] += size
    health = watch_channels(CUBE, t, y, CALIBRATED)
    (fault,) = health.faults
    assert fault.channels == (NAMES[channel],)
    assert fault.kind == "step"
    assert onset < fault.found_s < onset + 1.0
    assert fault.onset_s == pytest.approx(onset, abs=0.35)
    assert abs(fault.sizes[0] - size) < 4 * fault.sizes_std[0]
    assert health.excluded[t > onset, channel].all()
    assert health.excluded[t < onset - 0.5].sum() == 0


@pytest.mark.parametrize("kind", ["rest", "tumble", "turn"])
def test_the_size_of_a_step_is_as_sure_as_it_says(kind):
    scores = []
    for seed in range(12):
        t, y, _ = readings(kind, 700 + seed, duration=13.0)
        y[t >= 8.0, seed] += 25 * MG
        (fault,) = watch_channels(CUBE, t, y, CALIBRATED).faults
        scores.append((fault.sizes[0] - 25 * MG) / fault.sizes_std[0])
    assert 0.5 < np.sqrt(np.mean(np.square(scores))) < 1.55  # χ²(12) within 0.2 % on either side
    assert np.abs(scores).max() < 4.0


def test_a_gain_is_found_while_the_reading_changes():
    t, y, _ = readings("tumble", 3)
    y[t >= 8.0, 4] *= 1.2
    (fault,) = watch_channels(CUBE, t, y, CALIBRATED).faults
    assert (fault.channels, fault.kind) == ((NAMES[4],), "gain")


@pytest.mark.parametrize("kind", ["rest", "tumble"])
def test_a_fault_that_is_seen_when_it_grows_has_the_onset_at_which_it_began(kind):
    for seed in (0, 3):
        t, y, _ = readings(kind, seed)
        y[t >= 8.0, 4] += (3 if kind == "rest" else 4) * MG  # below the threshold until the next step
        y[t >= 12.0, 4] += 20 * MG
        health = watch_channels(CUBE, t, y, CALIBRATED)
        (fault,) = health.faults
        assert fault.found_s > 12.0
        assert fault.onset_s == pytest.approx(8.0, abs=0.35)
        assert health.excluded[t >= 8.0, 4].all()


@pytest.mark.parametrize(("kind", "motion"), [("drift", "rest"), ("stuck", "tumble"), ("noise", "turn")])
def test_the_kind_of_a_fault_is_named(kind, motion):
    t, y, _ = readings(motion, 4)
    bad = t >= 8.0
    if kind == "drift":
        y[bad, 2] += 5 * MG * (t[bad] - 8.0)
    elif kind == "stuck":
        y[bad, 2] = y[bad, 2][0]
    else:
        y[bad, 2] += np.random.default_rng(0).normal(0.0, 8**0.5 * CALIBRATED.noise_std[2], bad.sum())
    health = watch_channels(CUBE, t, y, CALIBRATED)
    assert named(health) == {NAMES[2]}
    assert health.faults[0].kind == kind


@pytest.mark.parametrize("kind", ["rest", "tumble", "turn"])
def test_two_unequal_faults_at_once_are_both_found(kind):
    t, y, _ = readings(kind, 5)
    y[t >= 8.0, 1] += 20 * MG
    y[t >= 8.0, 9] -= 13 * MG
    assert named(watch_channels(CUBE, t, y, CALIBRATED)) == {NAMES[1], NAMES[9]}


@pytest.mark.parametrize("kind", ["rest", "tumble", "turn"])
def test_a_whole_chip_is_found(kind):
    t, y, _ = readings(kind, 6)
    y[np.ix_(t >= 8.0, [3, 4, 5])] += 20 * MG * np.array([1.0, -1.0, 1.0])
    assert named(watch_channels(CUBE, t, y, CALIBRATED)) == {NAMES[3], NAMES[4], NAMES[5]}


def test_a_channel_that_behaves_again_is_used_again():
    t, y, _ = readings("turn", 7, duration=30.0)
    y[(t >= 8.0) & (t < 12.0), 6] += 50 * MG
    health = watch_channels(CUBE, t, y, CALIBRATED)
    (fault,) = health.faults
    assert 16.0 < fault.end_s < 19.0  # 5 s after it behaves
    assert not health.excluded[t >= fault.end_s].any()


def test_an_uncalibrated_array_that_tumbles_excludes_nothing():
    for seed in range(3):
        t, y, _ = readings("tumble", seed, duration=60.0, gains=5e-3, axes=2e-3, places=3e-4)
        health = watch_channels(CUBE, t, y, CALIBRATED)
        assert health.faults == ()
        assert health.model_factor > 2.0
        assert "calibrate" in health.sentences()[-1]


def test_a_channel_that_lacks_readings_is_no_fault():
    t, y, _ = readings("turn", 8)
    y[500:900, 3] = np.nan
    y[1200:1210] = np.nan
    assert watch_channels(CUBE, t, y, CALIBRATED).faults == ()


def test_after_an_exclusion_the_rate_stays_within_its_deviation():
    from gfimu.rate.health import ChannelMonitor
    from gfimu.rate.health.recursion.blocks import block_means

    t, y, omega = readings("tumble", 9)
    y[t >= 8.0, 0] += 50 * MG
    monitor = ChannelMonitor(CUBE, CALIBRATED, 0.01)
    blocks = block_means(t, y, CALIBRATED.limits, monitor.samples)
    monitor.extend(blocks)
    found, std = monitor.omega, monitor.omega_std
    true = omega.reshape(len(blocks), monitor.samples, 3).mean(axis=1)
    late = blocks.t > 8.5
    assert np.mean(np.abs(found - true)[late] < 3 * std[late]) > 0.97
    monitor = ChannelMonitor(CUBE, CALIBRATED, 0.01, policy=MonitorPolicy(false_alarms_per_hour=1e-300))
    monitor.extend(blocks)  # a threshold that nothing reaches


def test_a_rest_at_the_start_shows_the_biases():
    times, y, _ = readings("turn", 2, rest=3.0)
    y += np.random.default_rng(1).normal(0.0, 0.3, 12)
    assert watch_from_rest(CUBE, times, y, CALIBRATED).sound
    y[times >= 12.0, 8] += 15 * MG
    assert named(watch_from_rest(CUBE, times, y, CALIBRATED)) == {NAMES[8]}
    assert watch_from_rest(CUBE, times, y[::-1] + np.sin(9 * times)[:, None], CALIBRATED) is None


@pytest.mark.parametrize("kind", ["tumble", "turn"])
def test_a_run_that_begins_in_motion_is_watched_once_the_rate_has_settled(kind):
    t, y, omega = readings(kind, 11, duration=67.0)
    errors = SensorErrors.from_parts(CUBE, RATE_HZ)
    y = y + np.random.default_rng(3).normal(0.0, errors.bias_std)
    t, y, omega = t[700:] - t[700], y[700:], omega[700:]
    assert watch_in_motion(CUBE, t, y, errors, omega0=omega[0]).sound
    y[t >= 40.0, 10] += 15 * MG
    health = watch_in_motion(CUBE, t, y, errors, omega0=omega[0])
    (fault,) = health.faults
    assert fault.channels == (NAMES[10],)
    assert fault.onset_s == pytest.approx(40.0, abs=0.35)
    assert health.excluded[t > 41.0, 10].all()
    assert health.excluded.shape == y.shape


def test_a_run_whose_start_is_not_known_is_not_watched_while_its_sign_is_undecided():
    t, y, omega = readings("turn", 11, duration=20.0)
    fastest = int(np.argmax(np.abs(omega[:, 2])))
    noise = CALIBRATED.noise_std * np.random.default_rng(4).standard_normal((1300, 12))
    steady = np.tile(y[fastest], (1300, 1)) + noise
    assert watch_in_motion(CUBE, t[700:], steady, CALIBRATED, omega0=None) is None


@pytest.mark.parametrize("kind", ["rest", "tumble"])
def test_two_equal_faults_that_look_like_two_others_are_both_named(kind):
    """For some pairs of cube12 two equal faults at once are exactly two others: both are named, none is guessed."""
    pair = {"rest": (2, 5), "tumble": (5, 11)}[kind]
    seed, onset = {"rest": (1013, 7.01), "tumble": (1000, 8.17)}[kind]
    t, y, _ = readings(kind, seed)
    y[np.ix_(t >= onset, pair)] += 20 * MG
    health = watch_channels(CUBE, t, y, CALIBRATED)
    (fault,) = health.faults
    assert not fault.isolated
    assert not fault.excluded
    assert {NAMES[i] for i in pair} in [set(names) for names in fault.alternatives]
    assert len(fault.alternatives) == 2
    assert ", or in" in fault.sentence()
    codes = health.codes(t)
    inside = (t > fault.onset_s) & (t < fault.end_s)
    concerned = [NAMES.index(name) for name in fault.channels]
    assert (codes[np.ix_(inside, concerned)] == HealthCode.DOUBTED).all()
    assert not health.excluded.any()


def test_bad_input_is_refused():
    t, y, _ = readings("rest", 1)
    with pytest.raises(InputError, match="one row of 12"):
        watch_channels(CUBE, t, y[:, :5], CALIBRATED)
    with pytest.raises(InputError, match="increase"):
        watch_channels(CUBE, t[::-1], y, CALIBRATED)
    with pytest.raises(InputError, match="block_s"):
        MonitorPolicy(block_s=0.0)


def test_the_onset_that_shows_far_more_than_the_others_is_not_thinned_out():
    """Ages double as a rule; of a fault of 1.5 m/s² the onsets a block beside the right one show hardly anything."""
    state = MonitorFilter(
        CUBE, CALIBRATED, 1.0 / RATE_HZ, omega0=np.zeros(3), omega0_std=1e-3, policy=MonitorPolicy()
    ).state
    ages = [111.0, 47.0, 31.0, 15.0, 7.0, 3.0, 2.0, 1.0]
    state.ages[: len(ages)] = ages
    new_slot(state, 200.0)
    assert state.ages.tolist() == [111.0, 47.0, 31.0, 15.0, 7.0, 3.0, 1.0, 0.5, 0.0]

    state.ages[:] = [*ages, 0.0]
    state.leading[0] = 6
    new_slot(state, 200.0)
    assert state.ages.tolist() == [*ages, 0.5]
    assert state.held[0] == 6

    state.leading[0] = -1  # no longer: it goes before any other
    new_slot(state, 200.0)
    assert 2.0 not in state.ages
    assert state.held[0] == -1
    assert np.count_nonzero(state.ages) == 8


def test_a_trial_whose_evidence_can_not_be_solved_is_lost_and_no_crash(monkeypatch):
    """A filter of too few channels diverges until the information on faults has no inverse."""
    period = 1.0 / RATE_HZ
    follower = MonitorFilter(CUBE, CALIBRATED, period, omega0=np.zeros(3), omega0_std=1e-3, policy=MonitorPolicy())
    t, values, _ = readings("turn", 1, duration=2.0)
    blocks = block_means(t, values, CALIBRATED.limits, follower.samples)
    watched = np.ones(12, dtype=bool)
    arguments = (blocks, slice(0, len(blocks)), watched, np.ones(len(blocks)))
    assert follower.unexplained_without(*arguments, base=0) < 30.0

    def unsolvable(*_):
        raise np.linalg.LinAlgError("not positive definite")

    monkeypatch.setattr("gfimu.rate.health.recursion.monitor_filter.deflate", unsolvable)
    assert follower.unexplained_without(*arguments, base=0) == np.inf
