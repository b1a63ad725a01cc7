"""A reference of another clock is aligned with the channels; what does not belong together is refused."""

import numpy as np
import pytest

import gfimu
from gfimu.errors import InputError
from gfimu.geometry.array import AccelerometerArray
from gfimu.joining import ReferenceSeries, join_reference, open_reference
from gfimu.joining.signals import functions_of
from gfimu.recording import Recording
from sim.twin import Twin
from sim.worlds.hidden import Measurement, measure

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
    assert all(one == pytest.approx(truth, rel=0.05) for one in join_reference(channels, reference).levers_m["a1"])


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
    readings = functions_of(rate(t), 0.01) @ coefficients + 0.02 * np.random.default_rng(7).standard_normal((len(t), 6))
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
