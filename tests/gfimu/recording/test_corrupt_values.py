"""Values that can be no measurement: left out and counted, never clipped, never an end of the reading."""

import warnings
from dataclasses import replace

import numpy as np
import pytest

from gfimu import AccelerometerArray, CorruptValueWarning, InputError, Recording, estimate
from gfimu.array import largest_of_array, largest_of_part
from gfimu.recording import open_run

CUBE = AccelerometerArray.load("cube12")
RAIL = 156.9064  # 16 g
FORMATS = ("csv", "parquet")


def recording(n=400, tacho=True):
    rng = np.random.default_rng(3)
    readings = rng.normal(0, 0.03, (n, 12)) + CUBE.axes @ [0.0, 0.0, 9.81]
    reference = {"tacho_rad_s": rng.normal(0, 0.01, n), "temperature_degC": np.full(n, 21.0)} if tacho else {}
    return Recording.from_arrays(np.arange(n) / 100.0, readings, CUBE, reference=reference)


def damaged(values):
    """A recording with these values in samples 100, 101, … of channel a12 and one in the tachometer."""
    run = recording()
    readings, tacho = run.readings.copy(), run.reference["tacho_rad_s"].copy()
    readings[100 : 100 + len(values), 1] = values
    tacho[200] = values[0]
    return replace(run, readings=readings, reference={**run.reference, "tacho_rad_s": tacho})


@pytest.mark.parametrize(
    ("suffix", "unit", "place", "found"),
    [("csv", "m_s2", "line 104", 6), ("csv", "mg", "line 104", 5), ("parquet", "m_s2", "sample 101", 6)],
)
def test_they_are_left_out_and_counted(tmp_path, suffix, unit, place, found):
    file = tmp_path / f"run.{suffix}"
    damaged([1e19, -1e19, np.inf, -np.inf, 1e300, 2000.0]).write(file)
    if unit == "mg":  # the limit is in m/s², whatever the unit of the file: 2000 mg pass
        file.write_text(file.read_text().replace("a12_m_s2", "a12_mg"))
    with pytest.warns(CorruptValueWarning) as caught:
        read = Recording.read(file)
    counts = f"{found + 1} corrupt values (a12 {found}, tacho_rad_s 1)"
    message = f"{file}: left out {counts}, the first at {place}, column a12_{unit}: 1e+19"
    assert [str(one.message) for one in caught] == [message]
    assert read.corrupt == {"a12": found, "tacho_rad_s": 1}
    assert np.isnan(read.readings[100 : 100 + found, 1]).all()
    assert np.isnan(read.readings).sum() == found
    assert np.isnan(read.reference["tacho_rad_s"]).sum() == 1
    assert len(read) == 400


def test_they_poison_no_result(tmp_path):
    damaged([1e19, np.inf, 1e4]).write(tmp_path / "run.parquet")
    with pytest.warns(CorruptValueWarning):
        found = estimate(*open_run(tmp_path / "run.parquet"), method="filter")
    clean = estimate(recording(), CUBE, method="filter")
    assert np.abs(found.omega - clean.omega).max() < 0.02
    assert np.abs(found.p - clean.p).max() < 0.2


def test_the_count_stays_with_the_recording(tmp_path):
    damaged([1e19]).write(tmp_path / "run.csv")
    with pytest.warns(CorruptValueWarning):
        Recording.read(tmp_path / "run.csv").write(tmp_path / "again.parquet")
    with warnings.catch_warnings():
        warnings.simplefilter("error")  # nothing new is left out
        assert Recording.read(tmp_path / "again.parquet").corrupt == {"a12": 1, "tacho_rad_s": 1}


@pytest.mark.parametrize("suffix", FORMATS)
def test_saturation_and_a_chip_of_the_wrong_range_stay(tmp_path, suffix):
    run = recording()
    run.readings[50:60, 3] = RAIL
    run.readings[60:70, 3] = -RAIL * 1.1
    run.readings[:, 8] *= 8.0
    run.readings[300, 8] = 8 * RAIL
    run.write(tmp_path / f"run.{suffix}")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        read = Recording.read(tmp_path / f"run.{suffix}")
    np.testing.assert_array_equal(read.readings, run.readings)
    assert read.corrupt == {}


def test_most_values_beyond_physics_are_a_wrong_unit(tmp_path):
    run = recording(tacho=False)
    replace(run, readings=1e6 * (run.readings + 9.81)).write(tmp_path / "run.csv")
    with pytest.raises(
        InputError, match=r"column a11_m_s2: .* can't be a reading, as most in this file; check the unit"
    ):
        Recording.read(tmp_path / "run.csv")


def test_the_limit_is_the_parts_range_with_a_margin():
    assert largest_of_part("adxl345") == pytest.approx(10 * RAIL)
    assert largest_of_part(None) == largest_of_part("gone") == 1e4
    shock = "full_range_m_s2 = 49033.25\n"
    assert largest_of_part("shock.toml", {"shock.toml": shock}) == pytest.approx(490332.5)
    assert largest_of_part("shock.toml", {"shock.toml": "full_range_m_s2 = true\n"}) == 1e4
    np.testing.assert_allclose(largest_of_array(CUBE), np.full(12, 10 * RAIL))


def test_a_file_without_an_array_has_the_general_limit(tmp_path):
    lines = [f"{k / 100},{9000 if k == 3 else 1},{11000 if k == 4 else 2}\n" for k in range(20)]
    (tmp_path / "run.csv").write_text("t_s,x1_m_s2,x2_m_s2\n" + "".join(lines))
    with pytest.warns(CorruptValueWarning, match=r"1 corrupt values \(x2 1\)"):
        assert Recording.read(tmp_path / "run.csv").readings[3, 0] == 9000


def test_raw_counts_have_only_the_limit_of_a_count(tmp_path):
    lines = [f"{k / 100},{30000 if k == 3 else 1},{'1e19' if k == 4 else 2}\n" for k in range(20)]
    (tmp_path / "run.csv").write_text("t_s,a11_lsb,a12_lsb\n" + "".join(lines))
    with pytest.warns(CorruptValueWarning):
        read = Recording.read(tmp_path / "run.csv", unit="lsb")
    assert (read.readings[3, 0], read.corrupt) == (30000, {"a12": 1})
