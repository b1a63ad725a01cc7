"""Arrays from the sites of MJCF files."""

import numpy as np
import pytest

from gfimu import AccelerometerArray, InputError, RecordingWarning
from gfimu.base import find_model
from sim import array_from_mjcf

TURNED = """<mujoco>
  <worldbody>
    <body name="arm" pos="1 2 3" euler="30 40 50">
      <geom size="0.1"/>
      <body name="tip" pos="0.2 0 0">
        <geom size="0.1"/>
        <site name="s1" pos="0 0.1 0"/>
        <site name="s2" pos="0 0.1 0" xyaxes="0 1 0 -1 0 0"/>
      </body>
      <site name="lone" pos="0 0 0.3" xyaxes="0 0 1 0 1 0"/>
      <site pos="0 0 0.4"/>
    </body>
  </worldbody>
</mujoco>"""


@pytest.fixture
def turned(tmp_path):
    path = tmp_path / "turned.xml"
    path.write_text(TURNED)
    return path


@pytest.mark.parametrize("model", ["turntable", "free_cube"])
def test_the_cube_in_the_models_is_cube12(model):
    array, cube12 = array_from_mjcf(find_model("mjcf", model, suffix=".xml")), AccelerometerArray.load("cube12")
    assert array.channels == cube12.channels
    assert array.length_unit == pytest.approx(0.05)
    np.testing.assert_allclose(array.regression_matrix, cube12.regression_matrix, atol=1e-12)


def test_sites_are_in_the_frame_of_the_body_that_carries_them_all(turned):
    array = array_from_mjcf(turned)
    assert array.channels == ("a11", "s1", "s2")
    np.testing.assert_allclose(array.positions, [[0, 0, 0.3], [0.2, 0.1, 0], [0.2, 0.1, 0]], atol=1e-12)
    np.testing.assert_allclose(array.axes, [[0, 0, 1], [1, 0, 0], [0, 1, 0]], atol=1e-12)


def test_a_body_and_a_pattern_can_be_asked_for(turned):
    array = array_from_mjcf(turned, body="tip", sites="s?")
    assert array.channels == ("s1", "s2")
    np.testing.assert_allclose(array.positions, [[0, 0.1, 0]] * 2, atol=1e-12)


@pytest.mark.parametrize(
    ("text", "options", "message"),
    [
        ("<mujoco/>", {}, "no named site"),
        (TURNED, {"sites": "a*"}, "it has lone, s1, s2"),
        (TURNED, {"body": "leg"}, "unknown body of .* 'leg'; valid: arm, tip, world"),
        ("<mujoco", {}, "not a valid MJCF model"),
        ("\x00\x01", {}, "not a valid MJCF model"),
        (TURNED.replace('name="lone" pos="0 0 0.3"', 'name="s3" pos="0.2 0.1 0"').replace(
            "<site pos=", '<site name="s4" pos="0.2 0.1 0"/><site pos='), {}, "at most three sensing axes"),
    ],
)  # fmt: skip
def test_files_that_hold_no_array(tmp_path, text, options, message):
    path = tmp_path / "model.xml"
    path.write_text(text)
    with pytest.raises(InputError, match=message) as error:
        array_from_mjcf(path, **options)
    assert "\n" not in str(error.value)


def test_a_missing_file_is_named(tmp_path):
    with pytest.raises(InputError, match=r"none\.xml: no such file"):
        array_from_mjcf(tmp_path / "none.xml")


NAN_ELSEWHERE = TURNED.replace("<worldbody>", '<option timestep="nan"/><worldbody>')


def test_what_mujoco_warns_of_is_a_warning_and_no_file(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "model.xml").write_text(NAN_ELSEWHERE)
    with pytest.warns(RecordingWarning, match=r"model\.xml: XML contains a 'NaN'"):
        array_from_mjcf(tmp_path / "model.xml")
    assert [file.name for file in tmp_path.iterdir()] == ["model.xml"]


def test_a_place_that_is_no_number_is_refused(tmp_path):
    path = tmp_path / "model.xml"
    path.write_text(TURNED.replace('name="s1" pos="0 0.1 0"', 'name="s1" pos="nan 0 0"'))
    with pytest.warns(RecordingWarning, match="NaN"), pytest.raises(InputError, match=r"model\.xml: .*finite"):
        array_from_mjcf(path)
