"""Readings in another unit: the remedy names the argument by which their unit was stated."""

import numpy as np
import pytest

import gfimu
from gfimu import InputError
from gfimu.base import STANDARD_GRAVITY
from gfimu.recording import doubts_of


@pytest.fixture(scope="module")
def run():
    return gfimu.simulate("paper_run", seed=1)


def refusal(recording, **options) -> str:
    with pytest.raises(InputError) as caught:
        gfimu.estimate(recording, **options)
    return str(caught.value)


@pytest.mark.parametrize(("unit", "size"), [("g", STANDARD_GRAVITY), ("mg", STANDARD_GRAVITY / 1000.0)])
def test_arrays_are_given_their_unit_as_an_argument(run, unit, size):
    numbers = run.readings / size
    text = refusal((run.t_s, numbers), array="cube12")
    assert f"all readings are in {unit}, not in m/s²: gravity reads " in text
    assert f'; give unit="{unit}" to gfimu.Recording.from_arrays;' in text
    assert "name the column" not in text
    assert "--map" not in text
    mended = gfimu.Recording.from_arrays(run.t_s, numbers, "cube12", unit=unit)
    assert mended.readings == pytest.approx(run.readings)


def test_one_chip_of_arrays_in_another_unit_is_to_be_scaled(run):
    numbers = run.readings / np.where(np.arange(12) // 3 == 1, STANDARD_GRAVITY, 1.0)
    assert "chip a2 reads in g, the others in m/s²; multiply its columns by 9.80665" in refusal(
        (run.t_s, numbers), array="cube12"
    )


def test_a_single_chip_of_arrays_too(run):
    array = gfimu.AccelerometerArray.load("one_adxl345")
    recording = gfimu.Recording.from_arrays(run.t_s, run.readings[:, :3] / STANDARD_GRAVITY, array)
    (finding,) = doubts_of(recording, array)
    assert finding.text.endswith('it looks like it is in g: give unit="g" to gfimu.Recording.from_arrays')


def test_a_table_is_given_the_units_or_the_names_of_its_columns(run):
    names = {f"{name}_m_s2": name for name in run.channels}
    table = run.to_pandas()
    table[list(names)] /= STANDARD_GRAVITY
    assert "; name the columns a11_g …;" in refusal(table, array="cube12")
    bare = gfimu.Recording.from_table(table.rename(columns=names), array="cube12", units="m_s2")
    assert '; give units="g" to gfimu.Recording.from_table;' in refusal(bare)


def test_a_mapped_file_is_given_its_unit_in_the_map(run, tmp_path):
    table = run.to_pandas()[["t_s", *(f"{name}_m_s2" for name in run.channels)]]
    table.columns = ["time", *(f"acc{name[1:]}" for name in run.channels)]
    table.loc[:, table.columns[1:]] /= STANDARD_GRAVITY
    table.to_csv(tmp_path / "log.csv", index=False)
    keys = ["time.column=time", *(f"channels.{name}=acc{name[1:]}" for name in run.channels)]
    text = refusal(tmp_path / "log.csv", array="cube12", column_map=gfimu.load_map(None, ["unit=m/s^2", *keys]))
    assert '; set unit = "g" in the column map;' in text
    mended = gfimu.estimate(tmp_path / "log.csv", array="cube12", column_map=gfimu.load_map(None, ["unit=g", *keys]))
    assert np.isfinite(mended.omega).all()


def test_the_names_of_the_columns_state_the_unit_of_a_file(run, tmp_path):
    table = run.to_pandas()
    table[[f"{name}_m_s2" for name in run.channels]] /= STANDARD_GRAVITY
    table.to_csv(tmp_path / "run.csv", index=False)
    assert "; name the columns a11_g …;" in refusal(tmp_path / "run.csv", array="cube12")
