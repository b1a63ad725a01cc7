"""A reference of another clock is aligned with the channels; what does not belong together is refused."""

import numpy as np
import pytest
from scipy.integrate import cumulative_trapezoid

import gfimu
from gfimu import AccelerometerArray, InputError
from gfimu.array import omega_products
from gfimu.recording import Recording, ReferenceSeries, join_reference, open_reference
from sim.trials import Measurement, measure
from sim.twin import Twin

TWIN = Twin(array=AccelerometerArray.load("cube12"), array_name="cube12")
OFFSET, RATE_ERROR, LENGTH = 3.05, 0.0035, 40.0


def two_files(seed, *, of=None, rate=20.0, effects=(), chips=4):
    """Channels, and a tachometer of the same run, or of another one, on a clock of its own."""
    run = measure(np.random.default_rng(seed), TWIN, effects, Measurement(duration=LENGTH))
    turned = run if of is None else measure(np.random.default_rng(of), TWIN, (), Measurement(duration=LENGTH))
    times = np.arange(0.003, LENGTH - 1.0, 1.0 / rate)
    tacho = np.interp(times, turned.t_s, turned.reference["tacho_rad_s"])
    channels = Recording(run.t_s, run.readings[:, : 3 * chips], run.channels[: 3 * chips])
    if chips == 4:
        channels = channels.carrying(TWIN.array)
    return channels, ReferenceSeries("tacho.csv", (times - OFFSET) / (1.0 + RATE_ERROR), {"tacho_rad_s": tacho}), turned


@pytest.mark.parametrize("seed", range(1, 7))
@pytest.mark.parametrize("chips", [1, 4])
def test_offset_and_rate_error_are_found(seed, chips):
    channels, reference, _ = two_files(seed, chips=chips)
    found = join_reference(channels, reference).alignment
    middle = 0.5 * LENGTH
    missed = found.offset + (1.0 + found.rate_error) * (middle - OFFSET) / (1.0 + RATE_ERROR) - middle
    assert abs(missed) < 4.0 * found.offset_std
    assert found.offset_std < 3e-3
    assert found.rate_error == pytest.approx(RATE_ERROR, abs=4.0 * found.rate_error_std)
    assert found.rate_error_std < 5e-4
    truth = np.hypot(0.05, 0.05)
    lever = join_reference(channels, reference).levers_m["a1"]
    assert [lever.by_rate, lever.by_acceleration] == pytest.approx([truth, truth], rel=0.05)


def test_the_reference_keeps_its_own_times():
    """Each of its values stands in one row, at the rate that the table had at that row's time."""
    channels, reference, turned = two_files(2)
    joined = join_reference(channels, reference).recording
    tacho = joined.reference["tacho_rad_s"]
    known = np.isfinite(tacho)
    assert known.sum() == pytest.approx(len(reference.t_s), abs=2)
    truth = turned.reference["tacho_rad_s"]
    scatter = np.std(np.diff(truth)) + 0.02
    assert np.sqrt(np.mean((tacho[known] - truth[known]) ** 2)) < scatter
    assert joined.metadata["reference_rate_error"] == pytest.approx(RATE_ERROR, abs=3e-4)


@pytest.mark.parametrize("seed", range(1, 9))
def test_a_foreign_reference_is_refused(seed):
    channels, reference, _ = two_files(seed, of=seed + 50, chips=1 if seed % 2 else 4)
    with pytest.raises(InputError, match="don't seem to belong together"):
        join_reference(channels, reference)
    assert join_reference(channels, reference, force=True).doubts


def test_a_slow_rate_in_coarse_counts_is_smoothed_through_its_stairs():
    t = np.arange(0.0, 60.0, 0.03)
    rate = 12.0 * np.exp(-t / 40.0)
    counted = np.round(rate, 1)
    basis = ReferenceSeries("tacho.csv", t, {"tacho_rad_s": counted}).basis()
    assert np.std(basis.angle(t, 1) - rate) < 0.3 * np.std(counted - rate)


def test_a_constant_rate_has_no_times():
    channels, reference, _ = two_files(1)
    still = ReferenceSeries("tacho.csv", reference.t_s, {"tacho_rad_s": np.full(len(reference.t_s), 3.0)})
    with pytest.raises(InputError, match="does not change"):
        join_reference(channels, still)


def test_a_gyro_of_a_free_body_is_aligned():
    """The reference of a body that turns about all axes: ω from sines, readings of a chip off its origin."""
    t = np.arange(0.0, 30.0, 0.01)
    phases = np.random.default_rng(4).uniform(0.0, 6.0, (3, 4))
    speeds = np.random.default_rng(5).uniform(1.0, 9.0, (3, 4))

    def rate(at):
        return np.sum(np.sin(speeds * at[:, None, None] + phases), axis=2)

    coefficients = np.random.default_rng(6).standard_normal((9, 6)) * 0.05
    functions = np.column_stack([omega_products(rate(t)), np.gradient(rate(t), 0.01, axis=0)])
    readings = functions @ coefficients + 0.02 * np.random.default_rng(7).standard_normal((len(t), 6))
    names = tuple(f"a{chip}{axis}" for chip in (1, 2) for axis in (1, 2, 3))
    times = np.arange(2.0, 26.0, 0.008)
    gyro = rate(times) + 0.01 * np.random.default_rng(8).standard_normal((len(times), 3))
    columns = {f"gyro_{axis}_rad_s": one for axis, one in zip("xyz", gyro.T, strict=True)}
    reference = ReferenceSeries("gyro.csv", (times + 11.2) / 0.998, columns)
    found = join_reference(Recording(t, readings, names), reference).alignment
    assert found.rate_error == pytest.approx(-0.002, abs=1e-4)
    assert found.offset + 0.998 * (14.0 + 11.2) / 0.998 == pytest.approx(14.0, abs=2e-3)


def test_a_file_of_references_is_read_with_its_units(tmp_path):
    (tmp_path / "tacho.csv").write_text("t_s,tacho_rpm\n0,60\n1,30\n")
    series = open_reference(tmp_path / "tacho.csv")
    assert series.columns["tacho_rad_s"] == pytest.approx([2 * np.pi, np.pi])
    (tmp_path / "bad.csv").write_text("t_s,speed\n0,60\n1,30\n")
    with pytest.raises(InputError, match="no reference"):
        open_reference(tmp_path / "bad.csv")
    (tmp_path / "back.csv").write_text("t_s,tacho_rpm\n1,60\n0,30\n")
    with pytest.raises(InputError, match="does not increase"):
        gfimu.join(two_files(1)[0], tmp_path / "back.csv")


def test_gravity_of_a_leaning_table_dates_its_decay(shared_data):
    """2.0°, offset -2.61 s, clock rate error +0.40 %: of ω² and α alone the rate error is 11 times as unsure."""
    folder = shared_data / "public"
    joined = gfimu.join(
        folder / "tilted_table.csv", folder / "tilted_table_rate.csv", array=folder / "arm.toml"
    ).alignment
    assert joined.rate_error == pytest.approx(0.0040, abs=3.0 * joined.rate_error_std)
    assert joined.rate_error_std < 3e-4
    assert joined.offset == pytest.approx(-2.61, abs=5e-3)


def leaning(clip, *, seed=1, swing=3.0, decay=0.0):
    """One chip 0.1 m off the axis of a table that leans by 3°, and its tachometer: offset 7 s, rate error -0.8 %."""
    rng, t = np.random.default_rng(seed), np.arange(0.0, 40.0, 0.005)
    rate = 7.0 + swing * np.sin(0.4 * t + 0.012 * t**2) - decay * t
    alpha, angle = np.gradient(rate, t), cumulative_trapezoid(rate, t, initial=0.0)
    lean = 9.81 * np.sin(np.radians(3.0))
    readings = np.column_stack(
        [-0.1 * rate**2 + lean * np.cos(angle), 0.1 * alpha - lean * np.sin(angle), np.full(len(t), 9.8)]
    )
    readings = np.round((readings + rng.normal(0.0, 0.05, readings.shape)) / 0.01) * 0.01
    readings[:, 0] = np.maximum(readings[:, 0], clip)
    times = np.arange(2.0, 37.0, 0.05)
    tacho = np.interp(times, t, rate) + rng.normal(0.0, 0.02, len(times))
    reference = ReferenceSeries("tacho.csv", (times - 7.0) / 0.992, {"tacho_rad_s": tacho})
    return Recording(t, readings, ("a11", "a12", "a13")), reference


@pytest.mark.parametrize("clip", [-np.inf, -7.0])
@pytest.mark.parametrize("seed", range(4))
def test_a_leaning_table_and_clipped_samples_are_in_the_model(clip, seed):
    found = join_reference(*leaning(clip, seed=seed)).alignment
    middle = found.offset + (1.0 + found.rate_error) * (19.5 - 7.0) / 0.992 - 19.5
    assert abs(middle) < 3.5 * found.offset_std
    assert found.rate_error == pytest.approx(-0.008, abs=3.5 * found.rate_error_std)
    assert (found.offset_std, found.rate_error_std) < (2e-3, 2e-4)


def test_the_search_ends_at_its_bound_and_says_so():
    channels, reference = leaning(-np.inf)
    with pytest.raises(InputError, match="reaches the bound of its search"):
        join_reference(channels, reference, most_rate_error=0.005)
    forced = join_reference(channels, reference, most_rate_error=0.005, force=True)
    assert abs(forced.alignment.rate_error) <= 0.005


@pytest.mark.parametrize("seed", range(3))
def test_a_spin_up_and_a_long_decay_are_dated_within_their_uncertainty(seed):
    """One chip on a table that leans by 3°; the tachometer has a clock of its own: offset 4 s, rate error 0.3 %."""
    rng, t = np.random.default_rng(seed), np.arange(0.0, 60.0, 0.005)
    rate = np.interp(t, [6.0, 9.0, 60.0], [0.0, 12.0, 3.0])
    alpha, angle = np.gradient(rate, t), cumulative_trapezoid(rate, t, initial=0.0)
    lean = 9.81 * np.sin(np.radians(3.0))
    readings = np.column_stack(
        [-0.1 * rate**2 + lean * np.cos(angle), 0.1 * alpha - lean * np.sin(angle), np.full(len(t), 9.8)]
    )
    times = np.arange(1.0, 58.0, 0.05)
    tacho = 1.003 * np.interp(times, t, rate) + rng.normal(0.0, 0.02, len(times))
    reference = ReferenceSeries("tacho.csv", (times - 4.0) / 1.003, {"tacho_rad_s": tacho})
    noisy = Recording(t, readings + rng.normal(0.0, 0.05, readings.shape), ("a11", "a12", "a13"))
    found = join_reference(noisy, reference).alignment
    middle = found.offset + (1.0 + found.rate_error) * (29.5 - 4.0) / 1.003 - 29.5
    assert abs(middle) < 3.5 * found.offset_std
    assert found.rate_error == pytest.approx(0.003, abs=3.5 * found.rate_error_std)
    assert found.rate_error_std < 1e-3


@pytest.mark.parametrize("motion", [{"swing": 0.01}, {"swing": 0.0, "decay": 0.02}, {"swing": 0.0, "decay": 0.1}])
def test_a_rate_that_hardly_changes_dates_nothing(motion):
    with pytest.raises(InputError, match=r"changes|seem to belong"):
        join_reference(*leaning(-np.inf, **motion))
