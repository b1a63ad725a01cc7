"""Rest detection: stretches found, threshold from the data, gaps, missing samples, a spinning table."""

import numpy as np
import pytest

from gfimu import InputError
from gfimu.recording import Recording, detect_rest, motion_statistic

RATE = 100.0


def swing(rng, *, sigma=0.02, scale=1.0):
    """Twelve rests of 5 s with 2 s of motion between them; returns the recording and the true rest mask."""
    parts, still = [], []
    for _ in range(12):
        parts.append(np.tile(rng.normal(0, 5, 3), (500, 1)))
        parts.append(rng.normal(0, 3, 3) * np.sin(np.linspace(0, 8, 200))[:, None] + rng.normal(0, 5, 3))
        still += [True] * 500 + [False] * 200
    readings = scale * (np.concatenate(parts) + rng.normal(0, sigma, (8400, 3)))
    return Recording(np.arange(8400) / RATE, readings, ("a11", "a12", "a13")), np.array(still)


@pytest.mark.parametrize(("sigma", "scale"), [(0.02, 1.0), (0.2, 1.0), (0.02, 400.0), (0.0, 1.0)])
def test_stretches_lie_inside_the_true_rests(sigma, scale):
    recording, still = swing(np.random.default_rng(1), sigma=sigma, scale=scale)
    rest = detect_rest(recording)
    assert len(rest) == 12
    assert rest.chosen_by_data
    for start, stop in zip(rest.start, rest.stop, strict=True):
        assert still[start:stop].all()
        assert stop - start >= 380  # 500 less half a window at each end


def test_threshold_scales_with_the_unit():
    one, _ = swing(np.random.default_rng(2))
    other, _ = swing(np.random.default_rng(2), scale=100.0)
    ratio = detect_rest(other).threshold / detect_rest(one).threshold
    assert ratio == pytest.approx(1e4, rel=0.15)  # a bin of the histogram


def test_a_given_threshold_is_used():
    recording, _ = swing(np.random.default_rng(3))
    rest = detect_rest(recording, threshold=1e-9)
    assert len(rest) == 0
    assert not rest.chosen_by_data
    assert len(detect_rest(recording, threshold=1e9)) == 1


def test_statistic_is_the_norm_of_variances():
    rng = np.random.default_rng(4)
    recording = Recording(np.arange(200) / RATE, rng.normal(7, 1, (200, 3)), ("a11", "a12", "a13"))
    statistic = motion_statistic(recording, 21)
    expected = np.linalg.norm(recording.readings[40:61].var(axis=0, ddof=1))
    assert statistic[50] == pytest.approx(expected, rel=1e-9)
    assert np.isinf(statistic[[0, 9, 190, 199]]).all()
    assert np.isfinite(statistic[[10, 189]]).all()


def test_all_rest_is_one_stretch():
    rng = np.random.default_rng(5)
    recording = Recording(np.arange(3000) / RATE, rng.normal(0, 0.02, (3000, 3)), ("a11", "a12", "a13"))
    rest = detect_rest(recording)
    assert rest.lengths.sum() > 0.9 * len(recording)


def test_gaps_split_and_missing_samples_do_not():
    rng = np.random.default_rng(6)
    time = np.arange(2000) / RATE
    time[1000:] += 3.0
    readings = rng.normal(0, 0.02, (2000, 3))
    readings[300, 1] = np.nan
    rest = detect_rest(Recording(time, readings, ("a11", "a12", "a13")), threshold=1.0)
    assert [tuple(pair) for pair in np.column_stack([rest.start, rest.stop])] == [(50, 950), (1050, 1950)]


def test_a_steady_spin_is_no_rest():
    rng = np.random.default_rng(7)
    rate = np.where((np.arange(3000) > 1000) & (np.arange(3000) < 2000), 6.0, 0.0) + rng.normal(0, 0.02, 3000)
    readings = rng.normal(0, 0.02, (3000, 3))
    recording = Recording(np.arange(3000) / RATE, readings, ("a11", "a12", "a13"), reference={"tacho_rad_s": rate})
    rest = detect_rest(recording, threshold=1.0)
    assert len(rest) == 2
    for start, stop in zip(rest.start, rest.stop, strict=True):
        assert stop <= 1001 or start >= 2000


def test_refusals():
    rng = np.random.default_rng(8)
    short = Recording(np.arange(50) / RATE, rng.normal(size=(50, 3)), ("a11", "a12", "a13"))
    with pytest.raises(InputError, match="record longer or shorten the window"):
        detect_rest(short)
    with pytest.raises(InputError, match="must be positive"):
        detect_rest(short, threshold=-1.0)
