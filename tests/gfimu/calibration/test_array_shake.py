"""Positions and delays of the chips from a shake by hand, without table and gyro."""

from dataclasses import replace

import numpy as np
import pytest
from calibration_cases import GRAVITY, MULTI, chips_in_gauge, poses_of
from scipy.interpolate import CubicSpline

from gfimu import AccelerometerArray, InputError, calibrate_array, read_mimu4444, specific_force
from gfimu.calibration.array_shake import array_shake
from gfimu.calibration.array_static import array_static
from gfimu.calibration.shake_equations import RateSpline
from gfimu.calibration.shake_scale import scale_from_band
from gfimu.calibration.shake_start import Shake, shakes
from gfimu.recording import Recording
from gfimu.recording.rest import Rest

CUBE = AccelerometerArray.load("cube12")
NOISE = 0.03


def swings(rng, fine, highest):
    """Sums of five sines per axis."""
    waves = [
        rng.normal(size=3) * np.sin(2 * np.pi * rng.uniform(0.3, highest) * fine[:, None] + rng.uniform(0, 6, 3))
        for _ in range(5)
    ]
    return np.sum(waves, axis=0)


def shake_readings(rng, array, *, length=4.0, rate=100.0, speed=6.0, rest_s=1.0):
    """Ideal readings of a shake between two rests, with chips off their places and late: the truth with it."""
    t = np.arange(-rest_s, length + rest_s, 1 / rate)
    fine = np.arange(-rest_s - 0.1, length + rest_s + 0.1, 1e-3)
    share = np.clip(np.minimum(fine, length - fine) / 0.5, 0.0, 1.0)
    window = (share**3 * (10 - 15 * share + 6 * share**2))[:, None]
    omega = CubicSpline(fine, speed / 1.6 * swings(rng, fine, 2.5) * window)
    force = CubicSpline(fine, [0.0, 0.0, GRAVITY] + 4.0 * swings(rng, fine, 2.0) * window)
    places = array.chip_positions + rng.normal(0, 5e-4, (len(array.chips), 3))
    delays = rng.normal(0, 1e-3, len(array.chips))
    delays -= delays.mean()
    true = array.with_geometry(places, [chip.axes for chip in array.chips])
    readings = np.empty((len(t), array.n_channels))
    for number, delay in enumerate(delays):
        own = array.chip_of_channel == number
        readings[:, own] = specific_force(true, force(t - delay), omega(t - delay, 1), omega(t - delay))[:, own]
    ends = np.searchsorted(t, [-0.02, length + 0.02])
    rest = Rest(np.array([0, ends[1]]), np.array([ends[0], len(t)]), 1.0, True, 11, "m_s2")
    return t, readings, rest, places, delays, omega(t)


def one_run(seed, array=CUBE, **motion):
    """Return calibration from noisy poses, shake as recorded by those chips and corrected, and the truth."""
    rng = np.random.default_rng(seed)
    models = chips_in_gauge(array, rng)
    static = array_static(poses_of(array, models, MULTI, rng, 1.3e-3), array, gravity=GRAVITY)
    t, ideal, rest, places, delays, omega = shake_readings(rng, array, **motion)
    raw = np.hstack([model.read(ideal[:, 3 * i : 3 * i + 3]) for i, model in enumerate(models)])
    recording = Recording(t, raw + rng.normal(0, NOISE, raw.shape), array.channels)
    return static, recording, rest, places, delays, omega


def normalised(seed, array=CUBE, **options):
    """Errors of centred positions and delays over their standard deviations, and the result."""
    static, recording, rest, places, delays, _ = one_run(seed, array)
    result = array_shake(static.apply(recording), array, static, rest, **options)
    k = len(array.chips)
    centre = np.eye(3 * k) - np.kron(np.ones((k, k)) / k, np.eye(3))
    error = centre @ (result.positions - places).ravel()
    std = np.sqrt(np.diag(centre @ result.covariance[: 3 * k, : 3 * k] @ centre))
    late = (result.delays - delays) / np.sqrt(np.diag(result.covariance)[-k:])
    return np.concatenate([error / std, late]), result, static, std


def test_positions_and_delays_without_a_reference():
    shares = []
    runs = [normalised(0, progress=shares.append), normalised(1)]
    assert len(shares) >= 2
    assert shares == sorted(shares)
    assert 0.0 <= shares[0] <= shares[-1] <= 1.0
    errors = np.array([run[0] for run in runs])
    assert np.sqrt(np.mean(errors**2)) == pytest.approx(1.0, abs=0.45)  # some 13 independent ones in each
    result, std = runs[0][1], runs[0][3]
    assert std.max() < 5e-5
    assert result.residual_rms_m_s2 == pytest.approx(NOISE, rel=0.05)
    assert result.residual_rms_before_m_s2 > 1.5 * NOISE
    assert result.reference == "shake"
    for axis in "xyz":
        assert f"not determined: a common shift of all positions along {axis}" in result.statements
        assert not any(f"acceleration α_{axis}" in text for text in result.statements)  # dω/dt shows those biases
    assert any("a mirrored motion is excluded" in text for text in result.statements)
    assert any(text.startswith("scale of the positions: ±") and "dω/dt" in text for text in result.statements)
    assert any("a delay common to all is not determined" in text for text in result.statements)


@pytest.mark.study
def test_intervals_of_a_shake_cover():
    """300 runs: 95 % intervals of positions and delays cover 92 to 98 %."""
    errors = np.array([normalised(1000 + seed)[0] for seed in range(300)])
    assert np.sqrt(np.mean(errors**2)) == pytest.approx(1.0, abs=0.1)
    assert np.mean(np.abs(errors) < 1.96) == pytest.approx(0.95, abs=0.03)


def test_the_signs_of_the_start_are_those_of_the_motion():
    static, recording, rest, _, _, omega = one_run(5)
    (found,) = shakes(static.apply(recording), CUBE, rest, np.full(12, NOISE))
    true = omega[np.searchsorted(recording.t_s, found.t_s)]
    fast = np.linalg.norm(true, axis=1) > 2.0
    assert np.mean(np.sum(found.omega * true, axis=1)[fast] > 0) > 0.97


def test_splines_hold_their_rate_and_its_derivative():
    t = np.linspace(0.0, 3.0, 301)
    rate = np.column_stack([np.sin(4 * t), np.cos(3 * t), t])
    pieces = [Shake(t + 10.0 * i, np.zeros((301, 12)), np.zeros(301, dtype=bool), rate) for i in range(2)]
    spline = RateSpline.of(pieces, 0.016)
    omega, slope = spline.at_samples(spline.fit(np.concatenate([rate, rate])))
    inner = np.r_[10:290, 311:590]
    np.testing.assert_allclose(omega[inner], np.concatenate([rate, rate])[inner], atol=2e-3)
    exact = np.column_stack([4 * np.cos(4 * t), -3 * np.sin(3 * t), np.ones_like(t)])
    np.testing.assert_allclose(slope[inner], np.concatenate([exact, exact])[inner], atol=5e-2)


def test_the_scale_from_the_band_ignores_fast_vibration():
    rng = np.random.default_rng(8)
    t = np.arange(0.0, 40.0, 0.016)
    slope = np.column_stack([np.cos(2 * np.pi * f * t) for f in (3.0, 4.1, 5.3)])
    fast = 3.0 * np.sin(2 * np.pi * 19.0 * t)[:, None]
    scale, std = scale_from_band([(t, 1.02 * slope + rng.normal(0, 0.3, slope.shape), slope + fast)])
    assert scale == pytest.approx(1.02**2, abs=4 * std)
    assert std < 0.03


def test_the_method_takes_a_shake_as_its_motion():
    rng = np.random.default_rng(9)
    static, recording, _, places, delays, _ = one_run(9, rest_s=3.0)
    still = np.repeat(poses_of(CUBE, [static.models[chip.name] for chip in CUBE.chips], MULTI, rng, 1e-9).means, 300, 0)
    still[::300] += rng.normal(0, 3.0, still[::300].shape)  # a knock between the poses
    poses = Recording(np.arange(len(still)) / 100.0, still + rng.normal(0, NOISE, still.shape), CUBE.channels)
    result = calibrate_array(poses, CUBE, gravity=GRAVITY, motion=recording, min_rest_s=1.0)
    fitted = np.array([result.positions[chip.name] for chip in CUBE.chips])
    np.testing.assert_allclose(fitted - fitted.mean(0), places - places.mean(0), atol=2e-4)
    np.testing.assert_allclose([result.value(f"{chip.name}_d") for chip in CUBE.chips], delays, atol=1e-4)
    assert dict(zip(result.names, result.units, strict=True))["a1_d"] == "s"
    assert result.statistics["motion_reference"] == "shake"
    alone = calibrate_array(poses, CUBE, gravity=GRAVITY, min_rest_s=1.0)
    assert not alone.positions
    assert "--motion" in alone.statements[-1]


def test_what_is_no_shake_is_refused():
    static, recording, rest, *_ = one_run(10)
    corrected = static.apply(recording)
    with pytest.raises(InputError, match="needs a rest before it"):
        array_shake(corrected, CUBE, static, replace(rest, start=rest.start[:0], stop=rest.stop[:0]))
    still = replace(corrected, readings=np.repeat(corrected.readings[:80], 8, axis=0)[: len(corrected)])
    with pytest.raises(InputError, match="turns faster than 2 rad/s"):
        array_shake(still, CUBE, static, rest)


def test_a_motion_too_slow_for_positions_is_refused():
    static, recording, rest, *_ = one_run(11, speed=6.0)
    corrected = static.apply(recording)
    slow = np.random.default_rng(1).normal(0, 0.4, corrected.readings.shape) * (~_still(recording, rest))[:, None]
    with pytest.raises(InputError, match=r"scale of the positions (to \d|not at all)|turns faster than") as caught:
        array_shake(replace(corrected, readings=corrected.readings[:1] + slow), CUBE, static, rest)
    assert "e+" not in str(caught.value)


def _still(recording, rest):
    still = np.zeros(len(recording), dtype=bool)
    for start, stop in zip(rest.start, rest.stop, strict=True):
        still[start:stop] = True
    return still


@pytest.mark.study
def test_mimu4444_without_its_gyros(shared_data):
    """Positions within 0.5 mm of those with gyros, and consistent within the standard deviations."""
    board = AccelerometerArray.load("mimu4444")
    for number in (1, 2):
        recording = read_mimu4444(shared_data / "mimu4444" / f"exp_{number}.bin.gz")
        with_gyros = calibrate_array(recording, board, gravity=9.81)
        alone = calibrate_array(replace(recording, reference={}), board, gravity=9.81, fit_positions=True)
        first, second = (np.array([one.positions[chip.name] for chip in board.chips]) for one in (with_gyros, alone))
        apart = (second - second.mean(axis=0)) - (first - first.mean(axis=0))
        assert np.abs(apart).max() < 0.5e-3
        assert any("between 2 and 8 Hz" in text for text in alone.statements)
