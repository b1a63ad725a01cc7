"""Files in the shape of public formats are read right, or marked; what is wrong in silence must not be."""

import corpus_blind  # noqa: F401 - adds its shapes
import corpus_boards  # noqa: F401
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
    "motionsense": "marked",  # the gravity that a filter estimates is a chip where there is no other
    # The blind shapes, as gfimu read them the first time:
    "zephyr_mpu6050": "silent",  # lines "accel a b c m/s/s": a unit behind the numbers hides the label in front
    "sparkfun_lsm9ds1": "marked",  # "A: 0.01, -0.01, 0.98 g", as above
    "circuitpython_lis3dh": "marked",  # "x = 0.006 G, ", as above
    "zephyr_accel_polling": "marked",  # "adxl345@53 [m/s^2]:    (a, b, c)"
    "sparkfun_icm20948": "marked",  # "Acc (mg) [ a, b, c ], Gyr (DPS) [ ... ]"
    "tello_state": "marked",  # a pair with a list, "mpry:0,0,0", among pairs of numbers
    "novatel_rawimu": "marked",  # a line "%RAWIMUSA,...;...*crc" is a comment
    "kinect_azure": "silent",  # gyro_roll, gyro_pitch, gyro_yaw are no axes
    "altos_csv": "silent",  # as above, and accel_along, accel_across, accel_through
    "aim_csv": "silent",  # the units below the names become the names
    "racechrono": "marked",  # names, units, sources: the last row becomes the names
    "up_fall": "marked",  # names repeat per group, the groups stand in the row above
    "gopro_accl": "silent",  # "Accelerometer [m/s2],1,2"
    "opensim_sto": "silent",  # "a,b,c" in cells between tabs; a triple across two sensors
    "eobs_bursts": "silent",  # 120 numbers in a quoted cell are 39 chips
    "umafall": "silent",  # two keys of a row, kind and sensor; the first alone parts the rows
    "kaist_urban": "silent",  # a unit quaternion and a magnetic field of length 0.94 are chips without names
    "oxiod": "silent",  # the gravity of a filter, of constant length, is a chip without names
    "kriswiner_mpu9250": "marked",  # mG of a magnetometer are milligauss
    "x_imu": "marked",  # G of a magnetometer are gauss
    "mavlink_scaled_imu": "silent",  # mrad/s are taken as 16.4 counts per °/s, 6 % off
    "dji_datcon": "marked",  # ticks of 4.5 MHz are taken as µs beside a column of seconds
    "torque_pro": "marked",  # 17-May-2024
    "tobii_glasses": "marked",  # JSON lines of two kinds
    "px4_vehicle_imu": "marked",  # increments of velocity
    "mvn_workbook": "marked",  # the title of the sheet states free acceleration
    "core_motion_iso": "silent",  # °F
}
"""Shapes that are not read right: at least so."""
BLIND = frozenset(name for name, one in SHAPES.items() if one.write.__module__ == "corpus_blind")


@pytest.mark.parametrize("name", SHAPES)
def test_a_shape_is_read_right(name, tmp_path):
    verdict = judge(SHAPES[name].write(tmp_path))
    assert RANK.index(verdict.kind) >= RANK.index(LESS.get(name, "right")), verdict.why


@pytest.mark.parametrize(
    "names",
    [
        pytest.param(frozenset(SHAPES) - BLIND, id="known"),
        pytest.param(BLIND, id="blind", marks=pytest.mark.xfail(strict=True, reason="60 % right, 18 % silent")),
    ],
)
def test_nine_of_ten_are_right_and_hardly_one_wrong_in_silence(names):
    less = [LESS[name] for name in names if name in LESS]
    assert len(names) >= 60
    assert set(LESS) <= set(SHAPES)
    assert 1.0 - len(less) / len(names) >= LEAST_RIGHT
    assert less.count("silent") / len(names) <= MOST_SILENT


def test_the_page_lists_each_shape_with_its_source(project_root):
    page = (project_root / "docs" / "reference" / "foreign-formats.md").read_text(encoding="utf-8")
    assert set(SHAPES) >= SEEN
    for one in SHAPES.values():
        assert one.source.startswith(("http", "own: "))
        (row,) = [line for line in page.splitlines() if line.startswith(f"| `{one.name}` |")]
        assert one.source.split()[0].removeprefix("own:") in row
        assert row.endswith("| yes |") == (one.name in SEEN)
