"""Files in the shape of public formats are read right, or marked; what is wrong in silence must not be."""

import corpus_boards  # noqa: F401 - adds its shapes
import corpus_containers  # noqa: F401
import corpus_laboratory  # noqa: F401
import corpus_phones  # noqa: F401
import corpus_robots  # noqa: F401
import corpus_wearables  # noqa: F401
import pytest
from corpus_judge import judge
from corpus_motion import SEEN, SHAPES

LEAST_RIGHT, MOST_SILENT = 0.90, 0.02  # shares of the shapes
RANK = ("silent", "marked", "right")
LESS = {
    "zephyr_lis2dh": "marked",  # "x 0.010 , y 0.2": a word and a number without a mark between, behind a "#"
}
"""Shapes that are not read right."""
GUESSED = {
    "androsensor": "silent",  # the gravity that a filter estimates is a second chip
    "sensorlog_ios": "silent",
    "ronin_hdf5": "silent",
    "ridi_csv": "silent",
    "witmotion": "silent",  # a magnetometer in uT is a second chip
    "pamap2": "silent",  # magnetometers without names are chips
    "mhealth": "silent",
    "vectornav_ascii": "silent",
    "kitti_oxts": "silent",  # latitude, longitude and altitude, nearly constant, are a chip
    "openlog_artemis": "silent",  # imu_degC is no temperature
    "phyphox_without_gravity": "silent",  # the absolute value is a chip of one axis
    "physics_toolbox_roller_coaster": "silent",  # a magnetometer is a second chip
    "adafruit_mpu6050": "silent",
    "broad_hdf5": "marked",  # a gyro in rad/s is read by a scale that nobody uses
    "broad_matlab": "marked",
    "tum_vi_text": "marked",
    "betaflight": "marked",
    "px4_sensor_combined": "marked",
    "npz_with_rate": "marked",
    "daphnet": "marked",  # mg are read as cm/s²
    "microbit_log": "marked",
    "reprapfirmware": "marked",  # "Rate 1344" states no rate
    "rostopic_csv": "marked",  # a covariance that is always zero is a tachometer
    "json_device_motion": "marked",  # "including gravity" is no acceleration
    "qualisys_markers": "marked",  # positions of markers are chips
    "pasco_rotary": "marked",  # an angular velocity is no reference
}
"""Shapes that the reader reads right, and whose columns, units or rate are guessed wrong: at least so bad as stated."""


@pytest.mark.parametrize("name", SHAPES)
def test_a_shape_is_read_right(name, tmp_path):
    verdict = judge(SHAPES[name].write(tmp_path))
    expected = {**LESS, **GUESSED}.get(name, "right")
    assert RANK.index(verdict.kind) >= RANK.index(expected), verdict.why


def test_nine_of_ten_are_right_and_hardly_one_wrong_in_silence():
    count = len(SHAPES) - len(GUESSED)
    assert len(SHAPES) >= 60
    assert set(LESS) | set(GUESSED) <= set(SHAPES)
    assert 1.0 - len(LESS) / count >= LEAST_RIGHT
    assert sum(kind == "silent" for kind in LESS.values()) / count <= MOST_SILENT


def test_the_page_lists_each_shape_with_its_source(project_root):
    page = (project_root / "docs" / "reference" / "foreign-formats.md").read_text(encoding="utf-8")
    assert set(SHAPES) >= SEEN
    for one in SHAPES.values():
        assert one.source.startswith(("http", "own: "))
        (row,) = [line for line in page.splitlines() if line.startswith(f"| `{one.name}` |")]
        assert one.source.split()[0].removeprefix("own:") in row
        assert row.endswith("| yes |") == (one.name in SEEN)
