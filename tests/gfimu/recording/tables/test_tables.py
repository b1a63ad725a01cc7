"""Data objects: recordings and estimates to pandas, polars and pyarrow and back, with the checks of a file."""

import sys
from dataclasses import replace

import numpy as np
import pyarrow as pa
import pytest

from gfimu import (
    AccelerometerArray,
    CorruptValueWarning,
    Estimate,
    GfimuError,
    InputError,
    Recording,
    SensorErrors,
    UnitError,
    estimate,
    estimate_rate,
    open_recording,
)
from gfimu.base import STANDARD_GRAVITY
from gfimu.recording import open_run

CUBE = AccelerometerArray.load("cube12")


@pytest.fixture(scope="module")
def run():
    rng = np.random.default_rng(0)
    readings = rng.normal(0, 0.03, (300, 12)) + CUBE.axes @ [0.0, 0.0, 9.81]
    readings[7, 3] = np.nan
    found = Recording.from_arrays(
        np.arange(300) / 100.0,
        readings,
        CUBE,
        reference={"tacho_rad_s": np.zeros(300)},
        metadata={"mounting_rotvec_rad": np.zeros(3), "scenario": "würfel"},
    )
    return replace(found, extra={"note": np.array(["a", "ü"] * 150, dtype=object), "status": np.arange(300)})


def by_pandas(result):
    return pytest.importorskip("pandas") and result.to_pandas()


def by_polars(result):
    return pytest.importorskip("polars").DataFrame(result)


def by_pyarrow(result):
    return pa.table(result)


def by_batches(result):
    """A stream that can be read only once."""
    table = pa.table(result)
    return pa.RecordBatchReader.from_batches(table.schema, table.to_batches(max_chunksize=70))


TABLES = [by_pandas, by_polars, by_pyarrow, by_batches]


@pytest.mark.parametrize("make", TABLES)
def test_a_recording_there_and_back(run, make):
    back = Recording.read(make(run))
    np.testing.assert_array_equal(back.t_s, run.t_s)
    np.testing.assert_array_equal(back.readings, run.readings)
    assert back.channels == run.channels
    np.testing.assert_array_equal(back.reference["tacho_rad_s"], 0.0)
    assert back.extra["note"].tolist() == run.extra["note"].tolist()
    assert back.extra["status"].tolist() == list(range(300))
    if make is not by_polars:  # polars drops the metadata of a stream
        assert back.metadata == {**run.metadata, "mounting_rotvec_rad": [0.0, 0.0, 0.0]}
        found, array = open_run(make(run))
        np.testing.assert_array_equal(array.positions, CUBE.positions)
        np.testing.assert_array_equal(found.readings, run.readings)
    else:
        with pytest.raises(InputError, match=r"polars DataFrame: the recording does not name its array"):
            open_run(make(run))
        assert open_run(make(run), CUBE)[0].channels == run.channels
    assert open_recording(make(run)).channels == run.channels


@pytest.mark.parametrize("make", TABLES)
def test_an_estimate_there_and_back(run, make):
    found = estimate(run, CUBE, method="filter", position=True)
    back = Estimate.read(make(found))
    for name in ("t_s", "p", "omega", "omega_std", "quaternion", "angle", "position"):
        np.testing.assert_array_equal(getattr(back, name), getattr(found, name))
    if make is not by_polars:
        assert back.metadata["method"] == "filter"


def test_a_rate_estimate_as_a_table(run):
    found = estimate_rate(CUBE, run.t_s, run.readings, SensorErrors.from_parts(CUBE, 100.0), method="filter")
    table = pa.table(found)
    assert table.column_names[:4] == ["t_s", "omega_x_rad_s", "omega_y_rad_s", "omega_z_rad_s"]
    np.testing.assert_array_equal(table["omega_y_std_rad_s"].to_numpy(), found.std[:, 1])
    assert by_pandas(found).attrs["method"] == "filter"


def test_units_are_those_of_the_names():
    table = pa.table({"t_s": [0.0, 0.01], "a11_g": [1.0, 2.0], "a12_lsb": [100, None], "tacho_rpm": [60, 60]})
    read = Recording.read(table)
    np.testing.assert_allclose(read.readings[:, 0], [STANDARD_GRAVITY, 2 * STANDARD_GRAVITY])
    assert read.readings[0, 1] == pytest.approx(0.39 * STANDARD_GRAVITY)
    assert np.isnan(read.readings[1, 1])
    np.testing.assert_allclose(read.reference["tacho_rad_s"], 2 * np.pi)


def test_the_index_of_a_pandas_table_can_be_the_time(run):
    table = by_pandas(run).set_index("t_s")
    np.testing.assert_array_equal(Recording.read(table).t_s, run.t_s)
    part = table.iloc[100:200]
    assert len(Recording.read(part)) == 100
    assert Recording.read(part).array is not None  # attrs stay with a slice


def test_a_file_that_pandas_wrote_keeps_the_metadata(run, tmp_path):
    by_pandas(run).to_parquet(tmp_path / "run.parquet")
    assert open_run(tmp_path / "run.parquet")[1].name == "cube12"
    assert Recording.read(tmp_path / "run.parquet").metadata["scenario"] == "würfel"


def test_corrupt_values_of_a_table_are_left_out():
    table = pa.table({"t_s": np.arange(10) / 10, "a11_m_s2": [1.0] * 9 + [1e19], "a12_m_s2": [1.0] * 10})
    with pytest.warns(CorruptValueWarning, match="pyarrow Table: left out 1 corrupt values .*sample 10, column a11"):
        assert Recording.read(table).corrupt == {"a11": 1}


TWO = [0.0, 1.0]
BAD = {
    "no time": ({"a11_g": TWO}, "column t_s is missing"),
    "wrong unit": ({"t_s": TWO, "a11_ft_s2": TWO}, "'a11_ft_s2': unknown unit 'ft_s2'; valid: a11_m_s2"),
    "time back": ({"t_s": [1.0, 0.0], "a11_g": TWO}, r"sample 2: t_s does not increase \(1 s, then 0 s\)"),
    "no time there": ({"t_s": [0.0, None], "a11_g": TWO}, "sample 2: t_s is missing"),
    "text": ({"t_s": TWO, "a11_g": ["1", "2"]}, r"column a11_g holds (large_)?str(ing)?(_view)?, not numbers"),
    "truth": ({"t_s": TWO, "a11_g": [True, False]}, "column a11_g holds bool, not numbers"),
    "no readings": ({"t_s": TWO, "tacho_rad_s": TWO}, "no column holds a reading"),
    "no rows": ({"t_s": [], "a11_g": []}, "no samples below the header"),
}


@pytest.mark.parametrize(("columns", "message"), BAD.values(), ids=BAD)
@pytest.mark.parametrize("library", ["pandas", "polars", "pyarrow"])
def test_the_errors_are_those_of_a_file(library, columns, message):
    make = pa.table if library == "pyarrow" else pytest.importorskip(library).DataFrame
    kind = f"{library} {'Table' if library == 'pyarrow' else 'DataFrame'}"
    with pytest.raises((InputError, UnitError), match=message) as error:
        Recording.read(make(columns))
    assert str(error.value).startswith(f"{kind}: ")
    assert "\n" not in str(error.value)


def test_errors_that_only_pandas_can_make():
    pandas = pytest.importorskip("pandas")
    mixed = pandas.DataFrame({"t_s": TWO, "a11_g": np.array([1.0, "off"], dtype=object)})
    with pytest.raises(InputError, match="sample 2, column a11_g: 'off' is not a number; leave the cell empty"):
        Recording.read(mixed)
    with pytest.raises(InputError, match="column 1 has no name"):
        Recording.read(pandas.DataFrame({"t_s": TWO, 1: TWO}))
    twice = pandas.DataFrame(np.zeros((2, 3)), columns=["t_s", "a11_g", "a11_g"])
    with pytest.raises(InputError, match="column 'a11_g' appears twice; keep one"):
        Recording.read(twice)
    holes = pandas.DataFrame({"t_s": TWO, "a11_g": pandas.array([1, None], dtype="Int64"), "a12_g": [None, None]})
    read = Recording.read(holes)
    assert np.isnan(read.readings[1, 0])
    assert np.isnan(read.readings[:, 1]).all()


def test_what_is_no_table_is_refused_in_one_line():
    with pytest.raises(InputError, match=r"numpy ndarray: neither a path nor a table; give a \.csv"):
        Recording.read(np.zeros((3, 3)))
    polars = pytest.importorskip("polars")
    with pytest.raises(InputError, match="polars LazyFrame"):
        Recording.read(polars.LazyFrame({"t_s": TWO}))


def test_without_pandas_the_remedy_is_named(run, monkeypatch):
    monkeypatch.setitem(sys.modules, "pandas", None)  # as if it were not installed
    with pytest.raises(GfimuError, match=r"to_pandas needs pandas.*pip install 'gfimu\[tables\]'"):
        run.to_pandas()


def test_an_index_of_times_has_a_remedy_that_works():
    pandas = pytest.importorskip("pandas")
    for start in (pandas.Timestamp("2026-01-01 12:00"), pandas.Timedelta(0)):
        table = pandas.DataFrame({"a11_g": [0.0, 0.0, 1.0]}, index=start + pandas.to_timedelta([0, 10, 20], unit="ms"))
        with pytest.raises(InputError, match=r"t_s is missing; .*; the index holds times: table\[") as error:
            Recording.read(table)
        exec(str(error.value).partition("the index holds times: ")[2], {"table": table})
        assert Recording.read(table).t_s == pytest.approx([0.0, 0.01, 0.02])
    table = pandas.DataFrame({"a11_g": TWO}, index=TWO)
    with pytest.raises(InputError, match=r'the index holds numbers; if they are seconds: table\.index\.name = "t_s"'):
        Recording.read(table)
    table.index.name = "t_s"
    assert Recording.read(table).t_s == pytest.approx(TWO)
    with pytest.raises(InputError, match=r"seconds$"):
        Recording.read(pandas.DataFrame({"a11_g": TWO}))


def test_missing_channels_are_counted_and_bare_names_have_a_remedy():
    cube = AccelerometerArray.load("cube12")
    with pytest.raises(
        InputError, match=r"columns a11_m_s2, a12_m_s2, a13_m_s2 … \(12\) of .* are missing; add them \("
    ):
        Recording.read(pa.table({"t_s": TWO, "b_m_s2": TWO}), array=cube)
    bare = pa.table({"t_s": TWO, **dict.fromkeys(cube.channels, TWO)})
    with pytest.raises(InputError, match=r"are missing; a11 has no unit: gfimu\.Recording\.from_table\("):
        Recording.read(bare, array=cube)


def test_what_is_no_table_is_answered_with_what_can_be_given():
    with pytest.raises(InputError, match=r"^dict: neither a path nor a table; .* or times and readings, \(t, a\)"):
        Recording.read({"t_s": TWO})
