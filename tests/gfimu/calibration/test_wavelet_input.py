"""The wavelet input, level by level and with thresholds: what theory says a denoised mean can and can't be."""

import numpy as np
import pytest
import pywt
from calibration_cases import GRAVITY, MULTI
from recordings import pose_recording

from gfimu import InputError, Recording
from gfimu.calibration import METHODS, CalibrationTask, every_sample, run_calibration
from gfimu.calibration.observations import THRESHOLDS, denoised_samples, observations_from
from gfimu.recording.rest import Rest

SAMPLES = 800  # of a pose: 8 s at 100 Hz
LEVELS = range(1, 7)


def poses(readings):
    """A recording of poses of `SAMPLES` each, and its rests."""
    count = len(readings) // SAMPLES
    start = np.arange(count) * SAMPLES
    recording = Recording(np.arange(len(readings)) / 100.0, readings, ("a11", "a12", "a13"))
    return recording, Rest(start, start + SAMPLES, 1.0, False, 101, "m_s2")


@pytest.fixture(scope="module")
def white():
    return poses(5.0 + np.random.default_rng(1).standard_normal((200 * SAMPLES, 3)))


def weights_of_the_mean(level, wavelet="db4"):
    """Weight of each sample in the mean of the approximation, worked out from unit samples."""
    parts = pywt.wavedec(np.eye(SAMPLES), wavelet, mode="symmetric", level=level, axis=0)
    parts[1:] = [np.zeros_like(one) for one in parts[1:]]
    return pywt.waverec(parts, wavelet, mode="symmetric", axis=0)[:SAMPLES].mean(axis=0)


@pytest.mark.parametrize("level", LEVELS)
def test_no_level_makes_a_mean_better(white, level):
    """The plain mean has least variance of all unbiased linear estimators: 1/n; the edges of a deep level cost some."""
    weights = weights_of_the_mean(level)
    excess = SAMPLES * float(weights @ weights)
    assert weights.sum() == pytest.approx(1.0, abs=1e-12)
    assert excess > 1.0 - 1e-12
    assert excess < 1.003 or level == 6
    smooth, raw = denoised_samples(*white, level=level), every_sample(*white)
    ratio = np.mean((smooth.means - 5.0) ** 2) / np.mean((raw.means - 5.0) ** 2)
    # 600 means each; the two differ by weights of variance excess − 1, of which the ratio scatters by √(4/600).
    assert ratio == pytest.approx(excess, abs=4 * np.sqrt(4 * (excess - 1.0 + 1e-6) / 600))
    # The samples themselves lose the noise of half the band at every level, and the mean of a pose does not show it.
    assert smooth.readings.var() == pytest.approx(2.0**-level, rel=0.35 if level == 6 else 0.06)


@pytest.mark.parametrize("threshold", ["soft", "hard"])
@pytest.mark.parametrize("level", [1, 3, 5])
def test_thresholds_leave_white_noise_as_without_details(white, level, threshold):
    """n details exceed the universal threshold with a probability of about 1/√(π ln n) in all; few do, by little."""
    plain = denoised_samples(*white, level=level)
    found = denoised_samples(*white, level=level, threshold=threshold)
    means = np.sqrt(np.mean((found.means - plain.means) ** 2))
    assert means < 0.05 / np.sqrt(SAMPLES)  # of the scatter of a mean
    same = np.mean(np.abs(found.readings - plain.readings) < 1e-9)
    assert same > 0.9


def test_the_soft_threshold_shrinks_what_the_hard_one_keeps():
    """A knock on one sample: both keep it; the soft one takes the threshold off each detail."""
    rng = np.random.default_rng(3)
    readings = 0.01 * rng.standard_normal((SAMPLES, 3))
    readings[400] += 1.0
    recording, rest = poses(readings)
    peak = {kind: denoised_samples(recording, rest, threshold=kind).readings[400].mean() for kind in THRESHOLDS}
    assert peak["hard"] > 0.95
    assert 0.8 < peak["soft"] < peak["hard"]
    assert peak["none"] < 0.2
    means = [denoised_samples(recording, rest, threshold=kind).means for kind in THRESHOLDS]
    np.testing.assert_allclose(means, readings.mean(axis=0) * np.ones((3, 1, 3)), atol=0.1 * 0.01 / np.sqrt(SAMPLES))


def test_counts_that_mostly_repeat_are_not_thresholded():
    """More than half of the finest details are zero: the median sees no noise, and there is no threshold."""
    rng = np.random.default_rng(4)
    recording, rest = poses(np.round(0.12 * rng.standard_normal((SAMPLES, 3))))
    found = denoised_samples(recording, rest, wavelet="haar", threshold="soft")
    np.testing.assert_allclose(found.readings, recording.readings, atol=1e-9)


def test_denoised_regressors_are_less_biased(triad):
    """Noise of variance v in the readings shrinks the inverse model by v over the spread; each level halves it."""
    sigma = 1.0
    faces = np.concatenate([np.eye(3), -np.eye(3)])
    recording = pose_recording([triad], faces, np.random.default_rng(6), still_s=4.0, sigma=sigma)
    spread = GRAVITY**2 / 3.0
    found = {}
    for level in (0, 1, 2):
        task = CalibrationTask(
            recording,
            gravity=GRAVITY,
            input_kind="wavelet" if level else "raw",
            wavelet={"level": level} if level else {},
        )
        found[level] = run_calibration(METHODS["recursive"], task).models["a1"].sensitivity
    truth = np.linalg.inv(triad.sensitivity)
    excess = [np.trace(found[level] @ truth) / 3.0 for level in found]  # one, and the same noise of the means in all
    for level in (0, 1):
        halved = sigma**2 * (2.0**-level - 2.0 ** -(level + 1)) / spread
        assert excess[level] - excess[level + 1] == pytest.approx(halved, rel=0.1)


@pytest.mark.parametrize("threshold", THRESHOLDS)
@pytest.mark.parametrize("level", [1, 6])
def test_the_standard_deviation_stays_that_of_the_samples(triad, level, threshold):
    recording = pose_recording([triad], MULTI, np.random.default_rng(8), still_s=8.0, sigma=0.01)
    options = {"level": level, "threshold": threshold}
    results = [
        run_calibration(METHODS["multi-position"], CalibrationTask(recording, GRAVITY, input_kind=kind, wavelet=given))
        for kind, given in (("averaged", {}), ("wavelet", options))
    ]
    np.testing.assert_allclose(results[1].std, results[0].std, rtol=0.1)
    np.testing.assert_allclose(results[1].values, results[0].values, atol=1.0 * results[0].std.max())


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"level": 0}, "wavelet level 0: give 1 to 12"),
        ({"threshold": "firm"}, "unknown threshold 'firm'; valid: hard, none, soft"),
        ({"wavelet": "db99"}, "unknown wavelet 'db99'"),
    ],
)
def test_unknown_options_are_named(white, options, words):
    with pytest.raises(InputError, match=words):
        observations_from(*white, "wavelet", **options)


def test_options_of_the_wavelet_are_its_own(white):
    with pytest.raises(InputError, match="add --input wavelet"):
        observations_from(*white, "averaged", level=2)
