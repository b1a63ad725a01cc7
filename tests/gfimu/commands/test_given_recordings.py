"""Recordings given to commands as tables or arrays: the same result as from the file, the same checks, one line."""

import numpy as np
import pyarrow as pa
import pytest

import gfimu
from gfimu import CorruptValueWarning, InputError, UnitError
from gfimu.commands.opened import as_runs, as_source

CUBE = gfimu.AccelerometerArray.load("cube12")


@pytest.fixture(scope="module")
def run():
    return gfimu.simulate("paper_run", seed=1).slice(0, 1200)


def forms(run):
    """The run in every form that stands for it."""
    return {
        "pandas": run.to_pandas(),
        "polars": run.to_polars(),
        "arrow": run.to_arrow(),
        "stream": pa.RecordBatchReader.from_batches(run.to_arrow().schema, run.to_arrow().to_batches()),
        "arrays": (run.t_s, run.readings),
        "lists": (run.t_s.tolist(), run.readings.tolist()),
    }


@pytest.mark.parametrize("form", ["pandas", "polars", "arrow", "stream", "arrays", "lists"])
def test_an_estimate_from_any_form_is_that_of_the_file(run, form, tmp_path):
    run.write(tmp_path / "run.parquet")
    expected = gfimu.estimate(tmp_path / "run.parquet", "cube12", rest_bias=True)
    if form in {"arrays", "lists"}:  # without the tachometer, which shows where the run rests
        expected = gfimu.estimate(gfimu.Recording.from_arrays(run.t_s, run.readings, CUBE), rest_bias=True)
    found = gfimu.estimate(forms(run)[form], "cube12", rest_bias=True)
    np.testing.assert_array_equal(found.omega, expected.omega)


def test_a_pandas_table_of_a_recording_carries_its_array(run):
    assert gfimu.estimate(run.to_pandas(), rest_bias=True).metadata["array"] == "cube12"


@pytest.mark.parametrize("form", ["pandas", "arrow", "arrays"])
def test_every_command_takes_every_form(run, form, tmp_path):
    given = forms(run)[form]
    named = {"array": "cube12"} if form == "arrays" else {}
    assert gfimu.noise(given, **named).unit == "m_s2"
    assert gfimu.convert(given, tmp_path / "run.csv", **named).channels == run.channels
    assert gfimu.view(given, out=tmp_path / "run.rrd", **named).is_file()
    if form != "arrays":  # no tachometer to drive the twin
        assert gfimu.check(given, "cube12_turntable").effects
    poses = gfimu.simulate("calibration_poses", seed=2)
    calibration = gfimu.calibrate("array", forms(poses)[form], **named)
    assert calibration.channels == poses.channels
    assert gfimu.drift_of_rest(forms(poses.slice(0, 300))[form], duration=0.5, lead=0.5, **named).array == "cube12"


def test_raw_counts_in_a_table_stay_counts_for_a_calibration():
    poses = gfimu.simulate("calibration_poses", seed=2, raw=True)
    assert gfimu.calibrate("array", poses.to_pandas()).unit == gfimu.calibrate("array", poses).unit == "lsb"


def test_a_pair_of_recordings_is_two_runs_and_a_pair_of_arrays_is_one(run):
    assert as_runs((run, run)) == [run, run]
    pair = (run.t_s, run.readings)
    assert as_runs(pair) == [pair]
    assert as_runs([pair, run]) == [pair, run]


def test_a_diagnosis_takes_a_table(run):
    short = gfimu.simulate("paper_run", seed=7, changes=["sensor.errors=false"])
    found = gfimu.diagnose(short.to_pandas(), twin="cube12_turntable")
    assert found.verdict == "nothing_found"
    assert found.to_columns()["value"].shape == (0,)
    assert "nothing found" in found._repr_html_()
    assert found.plot().axes


def test_arrays_need_an_array_that_fits(run):
    with pytest.raises(InputError, match="give it as array="):
        gfimu.estimate((run.t_s, run.readings))
    with pytest.raises(
        InputError, match=r"readings \(1200, 11\); array 'cube12' needs times \(n,\) and readings \(n, 12\)"
    ):
        gfimu.estimate((run.t_s, run.readings[:, :11]), "cube12")
    with pytest.raises(InputError, match="map is for a file or a table"):
        gfimu.estimate((run.t_s, run.readings), "cube12", column_map="phyphox")


def test_a_table_without_its_array_is_one_line(run):
    table = run.to_pandas()
    table.attrs = {}
    with pytest.raises(InputError, match="pandas DataFrame: the recording does not name its array; give it as array="):
        gfimu.estimate(table)


def test_the_checks_of_a_file_hold_for_arrays(run):
    times = run.t_s.copy()
    times[5] = times[4]
    with pytest.raises(InputError, match="NumPy arrays: sample 6: t_s does not increase"):
        gfimu.Recording.from_arrays(times, run.readings, CUBE)
    with pytest.raises(InputError, match="tacho_rad_s has shape"):
        gfimu.Recording.from_arrays(run.t_s, run.readings, CUBE, reference={"tacho_rad_s": np.zeros(3)})
    with pytest.raises(UnitError, match="unknown unit 'furlong'"):
        gfimu.Recording.from_arrays(run.t_s, run.readings, CUBE, unit="furlong")
    bad = run.readings.copy()
    bad[3, 2] = np.inf
    with pytest.warns(CorruptValueWarning, match="left out 1 corrupt values"):
        found = gfimu.Recording.from_arrays(run.t_s, bad, CUBE)
    assert np.isnan(found.readings[3, 2])


def test_arrays_in_g_become_si(run):
    found = gfimu.Recording.from_arrays(run.t_s, run.readings / 9.80665, "cube12", unit="g")
    np.testing.assert_allclose(found.readings, run.readings, rtol=1e-12)


def test_columns_without_units_are_named_once(run):
    table = run.to_pandas().rename(columns=lambda name: name.removesuffix("_m_s2").removesuffix("_rad_s"))
    table[list(CUBE.channels)] /= 9.80665
    found = gfimu.Recording.from_table(table, array="cube12", units="g")
    np.testing.assert_allclose(found.readings, run.readings, rtol=1e-12)
    units = dict.fromkeys(CUBE.channels, "g") | {"tacho": "rad_s"}
    by_column = gfimu.Recording.from_table(table, array="cube12", units=units)
    np.testing.assert_array_equal(by_column.reference["tacho_rad_s"], run.reference["tacho_rad_s"])
    with pytest.raises(InputError, match="column 'speed' is missing"):
        gfimu.Recording.from_table(table, array="cube12", units={"speed": "rpm"})


def test_a_foreign_table_is_read_by_a_map(run):
    table = pa.table({"time": run.t_s, "x": run.readings[:, 0], "y": run.readings[:, 1], "z": run.readings[:, 2]})
    changes = ["time.column=time", "unit=m_s2", "channels.a11=x", "channels.a12=y", "channels.a13=z"]
    found = as_source(table, None, gfimu.load_map(None, changes))
    np.testing.assert_array_equal(found.readings, run.readings[:, :3])
