"""Drift of a recording at rest: the prediction against the closed forms and against sums of simulated noise."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

import gfimu
from gfimu import AccelerometerArray, ErrorSources, InputError, Recording, drift_budget, specific_force
from gfimu.budget import NoiseResponse, motion_covariance, rest_drift
from gfimu.sensor_noise import TERMS, synthesise_noise

CUBE = AccelerometerArray.load("cube12")
G = 9.80665
RATE = 50.0
LEAD, TIME = 4.0, 3.0
TIMES = np.linspace(0.0, TIME, 61)[1:]


def squares(covariance, **coefficients):
    """Squared coefficients of the terms as covariance of α and p, shape (5, 6, 6)."""
    return np.array([coefficients.get(symbol, 0.0) ** 2 * covariance for symbol in TERMS])


def off_centre():
    """A cube whose origin is far from its chips: errors of α and p are correlated."""
    places = [np.add(chip.position, [0.1, 0.2, 0.3]) for chip in CUBE.chips]
    return CUBE.with_geometry(places, [chip.axes for chip in CUBE.chips])


@pytest.mark.parametrize(("lead", "array"), [(LEAD, CUBE), (40.0, CUBE), (LEAD, off_centre())])
def test_white_noise_follows_the_laws_of_drift(lead, array):
    """The mean over the lead leaves a constant bias of variance N²/lead; the rest is the budget's."""
    density = 3e-3  # two-sided root, m/s²/√Hz
    response = NoiseResponse.of(TIMES, round(lead * 250.0), 250.0, G)
    _, found, tilt = response.prediction(squares(motion_covariance(array), N=density))
    sources = ErrorSources(bias=density / np.sqrt(lead), noise_density=density * np.sqrt(2.0))
    budget = drift_budget(array, TIME, sources, gravity=G)
    horizontal = (slice(0, 2), slice(0, 2))
    assert_allclose(found[-1][horizontal], budget.covariance[horizontal], rtol=0.02, atol=1e-9)
    assert np.sqrt(tilt[-1, 0]) == pytest.approx(budget.tilt_std, rel=0.01)


@pytest.mark.parametrize("terms", [{"N": 1.0}, {"B": 1.0}, {"K": 1.0}, {"N": 0.5, "B": 1.0, "K": 0.3}])
def test_prediction_is_the_scatter_of_summed_noise(terms):
    """Of α about y, which moves the unit along x, and of p along x; independent of each other."""
    runs, before, after = 600, round(LEAD * RATE), round(TIME * RATE) + 1
    rng = np.random.default_rng(5)
    share = np.zeros((6, 6))
    share[1, 1], share[3, 3] = 0.04, 1.0
    mean, covariance, _ = NoiseResponse.of(TIMES, before, RATE, G).prediction(squares(share, **terms))
    errors = np.empty((runs, 2))
    for run in range(runs):
        alpha, p = (synthesise_noise(before + after, RATE, rng=rng, **terms) for _ in range(2))
        alpha, p = (0.2 * (alpha - alpha[:before].mean()))[before:], (p - p[:before].mean())[before:]
        tilt = np.cumsum(np.cumsum(alpha)) / RATE**2
        errors[run, 0] = np.sum(np.cumsum(G * tilt + p)) / RATE**2
        errors[run, 1] = np.sum(np.cumsum(-0.5 * G * tilt**2)) / RATE**2
    # A variance of Gaussian errors scatters by √(2/runs); two per cent are the sums' coarse steps.
    assert errors[:, 0].var() == pytest.approx(covariance[-1, 0, 0], rel=4 * np.sqrt(2 / runs) + 0.02)
    # The fall is the square of a Gaussian: its mean scatters by √(2/runs) of itself, here at most.
    assert errors[:, 1].mean() == pytest.approx(mean[-1, 2], rel=4 * np.sqrt(2 / runs) + 0.05)
    assert errors[:, 1].var() == pytest.approx(covariance[-1, 2, 2], rel=0.5)


def test_a_ramp_moves_the_unit_by_its_two_integrals():
    share = np.zeros((6, 6))
    share[3, 3] = 1.0
    response = NoiseResponse.of(TIMES, round(LEAD * 1000.0), 1000.0, G)
    _, covariance, _ = response.prediction(squares(share, R=2.0))
    expected = 2.0 * (TIME**3 / 6.0 + 0.5 * LEAD * TIME**2 / 2.0)  # beside its mean over the lead
    assert np.sqrt(covariance[-1, 0, 0]) == pytest.approx(expected, rel=2e-3)


def at_rest(seed: int, up=(0.0, 0.0, 1.0), *, seconds: float = 220.0, **terms: float) -> Recording:
    rng = np.random.default_rng(seed)
    n = round(seconds * RATE)
    still = specific_force(CUBE, np.array(up) * G, np.zeros(3), np.zeros(3))
    noise = np.column_stack([synthesise_noise(n, RATE, rng=rng, **terms) for _ in range(12)])
    bias = 0.3 * rng.standard_normal(12)
    return Recording.from_arrays(np.arange(n) / RATE, still + bias + noise, CUBE)


@pytest.mark.parametrize("up", [(0.0, 0.0, 1.0), (0.6, 0.0, 0.8)])
def test_errors_are_as_large_as_predicted_in_any_pose(up):
    found = [rest_drift(at_rest(seed, up, N=2e-3), CUBE, time=TIME, lead=LEAD) for seed in range(4)]
    windows = sum(len(one.start_s) for one in found)
    assert windows == 4 * 31
    # Two normal errors of a window: a mean square of 2 · windows of them scatters by √(1/windows).
    square = np.mean([one.ratio**2 for one in found])
    assert square == pytest.approx(1.0, abs=4 * np.sqrt(1 / windows))
    assert all(one.valid for one in found)
    low, high = found[0].ratio_interval
    assert low < 1.0 < high


def test_errors_beyond_the_prediction_show():
    """Steps of the bias between the lead and its window are no noise that the Allan variance of white noise has."""
    run = at_rest(1, N=2e-3)
    stepped = run.readings + 0.01 * ((run.t_s % (LEAD + TIME + 1.0 / RATE)) > 5.0)[:, None] * np.sign(run.readings[:1])
    found = rest_drift(Recording(run.t_s, run.readings, run.channels), CUBE, time=TIME, lead=LEAD)
    worse = rest_drift(Recording(run.t_s, stepped, run.channels), CUBE, time=TIME, lead=LEAD)
    assert worse.rms_m[:2].max() > 3.0 * found.rms_m[:2].max()


def test_the_inversion_explains_the_first_window():
    found = rest_drift(at_rest(2, N=2e-3), CUBE, time=TIME, lead=LEAD)
    metres = G * np.radians(found.rate_drift_deg_h / 3600.0) * found.time_s**3 / 6.0
    assert metres == pytest.approx(np.hypot(*found.final_m[0, :2]), rel=1e-4)


def test_a_rest_with_missing_samples_gives_no_window():
    run = at_rest(3, N=2e-3, seconds=60.0)
    moved = (run.t_s > 12.0) & (run.t_s < 15.0)
    readings = run.readings + np.where(moved, np.sin(20.0 * run.t_s), 0.0)[:, None]
    readings[300, 4] = np.nan
    found = rest_drift(Recording(run.t_s, readings, run.channels), CUBE, time=TIME, lead=LEAD)
    assert found.start_s.min() > 15.0 + LEAD


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"time": 500.0}, "no complete rest of 510 s .* the longest is 2"),
        ({"time": 0.0}, "--duration is 0 s"),
        ({"lead": -1.0}, "--lead is -1 s"),
        ({"time": float("nan")}, "--duration is nan s"),
        ({"time": 1e308}, "--duration is 1e"),
        ({"gravity": float("inf")}, "gravity is inf"),
    ],
)
def test_what_cannot_be_done_is_refused(options, words):
    with pytest.raises(InputError, match=words):
        rest_drift(at_rest(4, N=2e-3), CUBE, **options)


def test_eight_chips_in_the_hand_drift_as_their_noise_says(shared_data):
    """MIMU4444, some twenty poses; after 1 s the tilt is still small. The first window is just after power-on."""
    file = shared_data / "mimu4444" / "exp_1.bin.gz"
    found = gfimu.drift_of_rest(file, "mimu4444", duration=1.0, lead=5.0)
    low, high = found.ratio_interval
    assert found.valid
    assert len(found.start_s) > 50
    assert low < found.ratio < high
