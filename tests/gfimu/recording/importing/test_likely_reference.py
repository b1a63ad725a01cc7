"""A recording that lacks a reference: which column may be it, by its name, and what to do with it."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

import gfimu
from gfimu import InputError
from gfimu.recording import inspect_file
from gfimu.recording.importing.guessing.likely_reference import likely_references, reference_remedy
from gfimu.recording.importing.raw_table import RawTable

RATE = np.linspace(-3.0, 3.0, 50)

FOUND = {
    "rpm": "column rpm may be it: name it tacho_rpm",
    "omega_dps": "column omega_dps may be it: name it tacho_deg_s",
    "omega": "column omega may be it: name it tacho_rad_s, tacho_deg_s or tacho_rpm by its unit",
    "gyro_z": "column gyro_z may be it: name it tacho_rad_s, tacho_deg_s or tacho_rpm by its unit",
    "gyro_z_rad_s": "column gyro_z_rad_s may be it: name it tacho_rad_s, tacho_deg_s or tacho_rpm by its unit",
    "tacho [rev/s]": "column tacho [rev/s] may be it: multiply it by 6.28319 and name it tacho_rad_s",
    "raw_rpm": 'column rpm may be it: add reference.tacho_rad_s={column="rpm", unit="rpm"} to its column map '
    "(--map-set)",
    "raw_omega": 'column omega may be it: add reference.tacho_rad_s={column="omega", unit="rad/s"} to its column map '
    "(--map-set), with the right unit",
    "truth_omega_z_rad_s": None,
    "tacho_t_s": None,
    "ground_speed": None,
    "volts": None,
}


@pytest.mark.parametrize("name", FOUND)
def test_a_rate_by_its_name_may_be_the_tachometer(name):
    assert reference_remedy({name: RATE}, "tacho_rad_s") == (FOUND[name] or "")


def test_text_and_what_never_varies_is_no_reference():
    still = {"rpm": np.full(50, 60.0), "omega": np.full(50, np.nan), "speed": np.array(["fast"] * 50, dtype=object)}
    assert likely_references(still, "tacho_rad_s") == []


def test_the_gyro_along_z_goes_before_others_and_a_tachometer_before_both():
    gyro = {f"gyro_{axis}": RATE for axis in "xyz"}
    assert [one.column for one in likely_references(gyro, "tacho_rad_s")] == ["gyro_z"]
    assert [one.column for one in likely_references(gyro, "gyro_y_rad_s")] == ["gyro_y"]
    assert [one.column for one in likely_references({**gyro, "rpm": RATE}, "tacho_rad_s")] == ["rpm"]


def test_two_columns_are_both_in_the_message():
    remedy = reference_remedy({"encoder_deg": RATE, "theta": RATE}, "angle_rad")
    assert (
        remedy == "column encoder_deg may be it: name it angle_deg, or column theta may be it: name it angle_rad or "
        "angle_deg by its unit"
    )


@pytest.fixture(scope="module")
def table():
    run = gfimu.simulate("paper_run", seed=1)
    run = replace(run, reference={"rpm": run.reference["tacho_rad_s"] * 30.0 / np.pi}, extra={})
    return run.to_pandas()


def test_a_diagnosis_without_its_tachometer_names_the_column(table):
    with pytest.raises(InputError, match=r"column tacho_rad_s is missing, .* column rpm may be it: name it tacho_rpm$"):
        gfimu.check(table, "cube12_turntable")
    named = gfimu.check(table.rename(columns={"rpm": "tacho_rpm"}), "cube12_turntable")
    assert named.runs


def test_a_calibration_without_its_reference_names_the_column(table):
    with pytest.raises(InputError, match=r"no tacho_rad_s column; column rpm may be it: name it tacho_rpm$"):
        gfimu.calibrate("spin", table, array="cube12")
    gyro = table.assign(gyro_y_rad_s=0.0, gyro_z_rad_s=0.0, gyro_x=table["rpm"])
    with pytest.raises(InputError, match=r"lacks gyro_x_rad_s; .*; column gyro_x may be it: name it gyro_x_rad_s or"):
        gfimu.calibrate("gyro-rate-table", gyro)


def test_an_inspection_of_a_recording_shows_the_column(table, tmp_path):
    table.to_csv(tmp_path / "run.csv", index=False)
    found = inspect_file(tmp_path / "run.csv")
    assert {one.name: one.role for one in found.columns}["rpm"] == "tacho? rpm"
    assert "tacho_rad_s is not there; column rpm may be it: name it tacho_rpm" in found.findings
    table.assign(tacho_rad_s=1.0).to_csv(tmp_path / "both.csv", index=False)
    assert inspect_file(tmp_path / "both.csv").findings == ()


def test_the_remedy_for_a_mapped_file_can_be_followed(tmp_path):
    t = np.arange(500) / 100.0
    pd.DataFrame({"t": t, "x": 0.0, "y": 0.0, "z": 9.8, "wheel rpm": t}).to_csv(tmp_path / "log.csv", index=False)
    keys = ["time.column=t", "unit=m/s^2", *(f"channels.a1{place}={axis}" for place, axis in enumerate("xyz", start=1))]
    run = gfimu.convert(tmp_path / "log.csv", column_map=gfimu.load_map(None, keys))
    (likely,) = likely_references(run.extra, "tacho_rad_s")
    key = likely.remedy.split("add ")[1].split(" to its")[0]
    named = gfimu.convert(tmp_path / "log.csv", column_map=gfimu.load_map(None, [*keys, key]))
    assert named.reference["tacho_rad_s"] == pytest.approx(t * np.pi / 30.0)


def test_a_column_is_found_by_its_name_with_underscores_where_no_other_has_that_name():
    table = RawTable("", {"wheel speed": RATE, "b c": RATE, "b_c": RATE})
    assert table.find("wheel_speed") == "wheel speed"
    assert table.find("b_c") == "b_c"
