"""A gyro on a rate table: exact without noise, as uncertain as stated with it, and open about what it can't see."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.spatial.transform import Rotation
from scipy.stats import binom

from gfimu import CalibrationPoses, InputError, Latitude, RateTable, Recording, calibrate
from gfimu.array import EARTH_RATE
from gfimu.calibration.rate_table import Plateaus, body_axis, find_plateaus, rate_table_gyro

M = np.array([[1.02, 0.004, -0.003], [0.002, 0.98, 0.005], [-0.006, 0.001, 1.01]])
BIAS = np.array([0.01, -0.02, 0.005])
TRUTH = np.concatenate([M.ravel(), BIAS])
RATES = np.array([0.0, 1.0, -1.0, 3.0, -3.0, 6.0, -6.0, 0.0])
HOLD = 10.0  # s
LATITUDE = 35.7
NAMES = ("x", "y", "z")


def plateaus(
    name, rng=None, *, noise=1e-4, tacho=5e-5, tilt=0.0, latitude=None, rates=RATES, noise_stated=None
) -> Plateaus:
    """Means of one mounting: the true axis tilted at random, the Earth's rate turning with the table."""
    axis = body_axis(name)
    rng = rng or np.random.default_rng(0)
    across = np.linalg.svd(axis[None])[2][1:]
    true_axis = Rotation.from_rotvec(tilt * rng.standard_normal(2) @ across).apply(axis)
    level, up = (0.0, 0.0) if latitude is None else EARTH_RATE * np.array([np.cos(latitude), np.sin(latitude)])
    turned = rates * HOLD
    middle = np.concatenate([[0.0], np.cumsum(turned[:-1])]) + turned / 2.0
    north = across[0] * np.cos(heading := rng.uniform(0.0, 2.0 * np.pi)) + across[1] * np.sin(heading)
    # Summed over fine steps of the turning, the Earth's horizontal rate as the body has it.
    steps = np.linspace(-0.5, 0.5, 401)
    seen = [
        Rotation.from_rotvec(np.outer(-(angle + turn * steps), axis)).apply(level * north).mean(axis=0)
        for angle, turn in zip(middle, turned, strict=True)
    ] if level else np.zeros((len(rates), 3))  # fmt: skip
    true = (rates + up)[:, None] * true_axis + np.array(seen)
    means = true @ M.T + BIAS + noise * rng.standard_normal((len(rates), 3))
    spread = (noise if noise_stated is None else noise_stated) ** 2 * np.tile(np.eye(3), (len(rates), 1, 1))
    read = rates + tacho * rng.standard_normal(len(rates))
    return Plateaus(axis, read, np.full(len(rates), tacho**2), turned, middle, means, spread)


def test_exact_without_noise():
    exact = [plateaus(name, noise=0.0, tacho=0.0, noise_stated=1e-6) for name in NAMES]
    found = rate_table_gyro(exact)
    assert_allclose(found.values, TRUTH, atol=1e-12)
    assert found.null_space.shape == (12, 0)
    assert (found.unit, found.gauge) == ("rad_s", "poses")


def test_the_vertical_part_of_the_earths_rate_is_taken_off():
    """With one mounting it can't be parted from the bias, but by the latitude."""
    alone = [plateaus("z", noise=0.0, tacho=0.0, latitude=np.radians(LATITUDE), noise_stated=1e-7)]
    given = rate_table_gyro(alone, latitude_deg=LATITUDE)
    assert_allclose(given.models["gyro"].bias, BIAS, atol=1e-6)
    unknown = rate_table_gyro(alone)
    off = unknown.value("gyro_b_z") - BIAS[2]
    assert off == pytest.approx(M[2, 2] * EARTH_RATE * np.sin(np.radians(LATITUDE)), rel=0.02)
    std = unknown.std_of("gyro_b_z") / np.sqrt(unknown.statistics["covariance_factor"])
    assert std == pytest.approx(M[2, 2] * EARTH_RATE / np.sqrt(3.0), rel=0.02)


@pytest.mark.parametrize(
    ("case", "latitude"),
    [
        ({"noise": 1e-4}, None),
        ({"noise": 1e-4, "tilt": 2e-3}, None),
        ({"noise": 2e-6, "tacho": 2e-6, "latitude": np.radians(LATITUDE)}, LATITUDE),
        ({"noise": 2e-6, "tacho": 2e-6, "tilt": 1e-4, "latitude": "any"}, None),
    ],
)
def test_errors_are_as_large_as_stated(case, latitude):
    """Normalised errors have unit variance, and 95 % intervals cover 95 %, both within the scatter of 300 runs."""
    runs = 300
    rng = np.random.default_rng(7)
    scores = np.empty((runs, 12))
    for run in range(runs):
        drawn = dict(case)
        if drawn.get("latitude") == "any":
            drawn["latitude"] = np.arcsin(rng.uniform(-1.0, 1.0))  # a direction that may be any
        mountings = [plateaus(name, rng, **drawn) for name in NAMES]
        found = rate_table_gyro(mountings, latitude_deg=latitude, levelling_std_rad=case.get("tilt", 0.0))
        scores[run] = (found.values - TRUTH) / found.std
    # One parameter's scores: variance 1 ± 4 √(2/300). Covers of each: binomial, 12 of them, together at 1 in 1000.
    assert_allclose(np.mean(scores**2, axis=0), 1.0, atol=4 * np.sqrt(2 / runs) + 0.05)
    covered = np.sum(np.abs(scores) < 1.96, axis=0)
    low, high = binom.ppf([0.001 / 24, 1 - 0.001 / 24], runs, 0.95)
    assert np.all((covered >= low) & (covered <= high))


def test_one_mounting_leaves_two_axes_open():
    found = rate_table_gyro([plateaus("y")])
    assert found.null_space.shape == (12, 6)
    assert "rates about x, z is not determined" in found.statements[0]
    model = found.models["gyro"]
    assert_allclose(model.sensitivity[:, 1], M[:, 1], atol=1e-3)
    assert_allclose(model.sensitivity[:, [0, 2]], np.eye(3)[:, [0, 2]], atol=1e-12)
    assert_allclose(model.bias, BIAS, atol=1e-3)
    assert found.std_of("gyro_M_xx") < 1e-12


def test_one_rate_does_not_part_bias_and_scale():
    found = rate_table_gyro([plateaus(name, rates=np.array([3.0])) for name in NAMES])
    assert found.null_space.shape == (12, 3)
    assert "biases and scale factors are not separated" in found.statements[0]


def test_an_inclined_mounting_will_do():
    slanted = replace(plateaus("x"), axis=np.array([0.6, 0.0, 0.8]))
    means = RATES[:, None] * (M @ slanted.axis) + BIAS
    found = rate_table_gyro([replace(slanted, means=means), plateaus("y"), plateaus("z")])
    assert found.null_space.shape == (12, 0)
    assert np.all(np.abs(found.values - TRUTH) < 5.0 * found.std)


def recording(rotvec, rng, *, seconds=10.0, ramp=3.0, noise=2e-3) -> Recording:
    """A gyro alone on a table that holds each rate and goes to the next by a ramp; 100 Hz."""
    knots = np.concatenate([[number * (seconds + ramp), number * (seconds + ramp) + seconds] for number in range(8)])
    t = np.arange(round(knots[-1] * 100.0)) / 100.0
    rate = np.interp(t, knots, np.repeat(RATES, 2))
    axis = Rotation.from_rotvec(rotvec).inv().apply([0.0, 0.0, 1.0])
    gyro = np.outer(rate, axis) @ M.T + BIAS + noise * rng.standard_normal((len(t), 3))
    reference = {f"gyro_{one}_rad_s": values for one, values in zip("xyz", gyro.T, strict=True)}
    reference["tacho_rad_s"] = rate + 1e-3 * rng.standard_normal(len(t))
    metadata = {"mounting_rotvec_rad": list(rotvec)}
    return Recording(t, np.empty((len(t), 0)), (), reference, metadata)


UPRIGHT = {"x": (0.0, -np.pi / 2, 0.0), "y": (np.pi / 2, 0.0, 0.0), "z": (0.0, 0.0, 0.0)}


def test_plateaus_are_found_and_no_ramp_is():
    found = find_plateaus(recording(UPRIGHT["x"], np.random.default_rng(3)))
    assert_allclose(found.rate, RATES, atol=5e-4)
    assert_allclose(found.axis, [1.0, 0.0, 0.0], atol=1e-12)
    assert_allclose(found.turned, RATES * 9.0, atol=1.0 * 6.0)  # half a window of 1 s is left out at each end
    # The mean of 9 s of white noise.
    assert_allclose(np.sqrt(np.einsum("pii->pi", found.covariance)), 2e-3 / 30.0, rtol=0.3)


def test_from_recordings_to_a_corrected_gyro():
    rng = np.random.default_rng(11)
    x, y, z = (recording(UPRIGHT[name], rng) for name in NAMES)
    found = calibrate("gyro", x, rate_table=RateTable([y, z]))
    assert np.all(np.abs(found.values - TRUTH) < 5.0 * found.std)
    assert found.method == "gyro-rate-table"
    corrected = found.apply(y)
    held = np.abs(y.reference["tacho_rad_s"] - 3.0) < 0.01
    means = [corrected.reference[f"gyro_{one}_rad_s"][held].mean() for one in NAMES]
    assert_allclose(means, [0.0, 3.0, 0.0], atol=5e-4)


def test_readings_without_any_noise_do():
    rng = np.random.default_rng(1)
    runs = [recording(UPRIGHT[name], rng, noise=0.0) for name in NAMES]
    for run in runs:
        run.reference["tacho_rad_s"] = np.round(run.reference["tacho_rad_s"], 2)  # as a command is
    found = calibrate("gyro", runs[0], rate_table=RateTable(runs[1:]), poses=CalibrationPoses(levelling_std_rad=1e-3))
    assert_allclose(found.values, TRUTH, atol=2e-3)


def test_axes_given_stand_for_the_mountings():
    rng = np.random.default_rng(12)
    runs = [replace(recording(UPRIGHT[name], rng), metadata={}) for name in NAMES]
    found = calibrate("gyro", runs[0], rate_table=RateTable(runs[1:], NAMES))
    assert np.all(np.abs(found.values - TRUTH) < 5.0 * found.std)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"rate_table": RateTable(axes=("x", "y"))}, "2 axes along the table's for 1 recordings"),
        ({"rate_table": RateTable(axes=("up",))}, "axis 'up' of the gyro"),
        ({"poses": CalibrationPoses(min_rest_s=60.0)}, "no stretch of constant rate of 60 s"),
        ({"gravity": Latitude(95.0)}, "latitude 95° is outside"),
        ({"gravity": 9.8}, "are of accelerometers"),
        ({"poses": CalibrationPoses(levelling_std_rad=float("nan"))}, "--levelling-std is nan rad"),
    ],
)
def test_what_does_not_fit_is_refused(options, words):
    with pytest.raises(InputError, match=words):
        calibrate("gyro", recording(UPRIGHT["z"], np.random.default_rng(1)), **{"rate_table": RateTable(), **options})


@pytest.mark.parametrize(("name", "words"), [("tacho_rad_s", "lacks tacho_rad_s"), ("gyro_y_rad_s", "lacks gyro_y_")])
def test_a_missing_column_is_named(name, words):
    run = recording(UPRIGHT["z"], np.random.default_rng(1))
    run.reference.pop(name)
    with pytest.raises(InputError, match=words):
        calibrate("gyro", run, rate_table=RateTable())


def test_the_table_is_no_part_of_other_methods():
    with pytest.raises(InputError, match="--rate-table, --also and --table-axes are of a gyro"):
        calibrate("multi-position", recording(UPRIGHT["z"], np.random.default_rng(1)), rate_table=RateTable())
