"""A table in memory is inspected as its file is, and its map reads it."""

import numpy as np
import pandas as pd
import pyarrow as pa
import pytest

import gfimu
from gfimu import InputError

T = np.arange(400) / 100.0
LOG = pd.DataFrame({"millis": 1000.0 * T, "ax": 0.01 * np.sin(T), "ay": 0.02 * np.cos(T), "az": 1.0 + 0.001 * T})


TABLES = {
    "pandas": lambda: LOG,
    "polars": lambda: pytest.importorskip("polars").DataFrame(LOG.to_dict("list")),
    "pyarrow": lambda: pa.Table.from_pandas(LOG),
}


@pytest.mark.parametrize("kind", TABLES)
def test_a_table_is_inspected_as_its_file(kind, tmp_path):
    LOG.to_csv(tmp_path / "log.csv", index=False)
    seen, of_file = gfimu.inspect(TABLES[kind]()), gfimu.inspect(tmp_path / "log.csv")
    assert seen.source.startswith(kind)
    assert [(one.name, one.role) for one in seen.columns] == [(one.name, one.role) for one in of_file.columns]
    assert seen.sample_rate_hz == pytest.approx(100.0)
    assert seen.chips == 1


def test_the_map_of_a_table_reads_it_and_its_file(tmp_path):
    found = gfimu.inspect(LOG, out=tmp_path / "map.toml")
    assert found.column_map.format == ""
    LOG.to_csv(tmp_path / "log.csv", index=False)
    for source in (LOG, tmp_path / "log.csv"):
        run = gfimu.convert(source, column_map=tmp_path / "map.toml")
        assert run.readings[:, 2] == pytest.approx(LOG["az"].to_numpy() * 9.80665)


def test_a_recording_is_inspected():
    run = gfimu.simulate("rest", seed=1)
    seen = gfimu.inspect(run)
    assert seen.is_own
    assert seen.rows == len(run)


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ((T, np.zeros((400, 3))), "NumPy arrays: they have no columns to look at; gfimu.Recording.from_arrays"),
        (3, "int: neither a path nor a table"),
        (None, "NoneType: neither a path nor a table"),
        (pd.DataFrame([[1.0, 2.0]], columns=["a", "a"]), "column"),
    ],
)
def test_what_is_neither_file_nor_table_is_refused_in_one_line(given, words):
    with pytest.raises(InputError, match=words) as caught:
        gfimu.inspect(given)
    assert "\n" not in str(caught.value)
