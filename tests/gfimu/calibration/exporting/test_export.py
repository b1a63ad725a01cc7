"""What is written for others reads back as what it was."""

from dataclasses import replace

import numpy as np
import pytest

import gfimu
from gfimu import AccelerometerArray, InputError, load_map
from gfimu.recording import Recording, inspect_file, mapped_recording

ARRAY = AccelerometerArray.load("cube12_as_built")
T = np.arange(0.0, 3.0, 0.01)


@pytest.fixture
def recording():
    rng = np.random.default_rng(1)
    gyro = {f"gyro_{axis}_rad_s": np.sin(T + place) for place, axis in enumerate("xyz")}
    metadata = {"time_origin_s": 1.4e9}
    readings = rng.standard_normal((len(T), 12)) + [0.0, 0.0, 9.8] * 4
    return Recording.from_arrays(T, readings, ARRAY, reference=gyro, metadata=metadata)


def test_mcap_holds_a_topic_per_chip(recording, tmp_path):
    import msgspec

    gfimu.convert(recording, tmp_path / "run.mcap")
    assert len(inspect_file(tmp_path / "run.mcap").tables) == 4
    for number, chip in enumerate(ARRAY.chips):
        chosen = msgspec.structs.replace(load_map("ros_imu"), table=f"/imu/{chip.name}")
        again = mapped_recording(tmp_path / "run.mcap", chosen)
        assert again.readings == pytest.approx(recording.readings[:, 3 * number : 3 * number + 3])
        assert again.t_s == pytest.approx(T, abs=1e-6)
        assert again.metadata["time_origin_s"] == pytest.approx(1.4e9)
        along = np.column_stack([recording.reference[f"gyro_{axis}_rad_s"] for axis in "xyz"]) @ chip.axes.T
        found = np.column_stack([again.reference[f"gyro_{axis}_rad_s"] for axis in "xyz"])
        assert found == pytest.approx(along)


def test_euroc_holds_a_folder_per_chip(recording, tmp_path):
    gfimu.convert(recording, tmp_path / "run.euroc")
    for number in range(4):
        again = mapped_recording(tmp_path / "run.euroc" / f"imu{number}" / "data.csv", "euroc")
        assert again.readings == pytest.approx(recording.readings[:, 3 * number : 3 * number + 3])
    text = (tmp_path / "run.euroc" / "imu2" / "sensor.yaml").read_text()
    numbers = [float(one) for one in text.partition("data: [")[2].partition("]")[0].split(",")]
    pose = np.reshape(numbers, (4, 4))
    assert pose[:3, 3] == pytest.approx(ARRAY.chips[2].position)
    assert pose[:3, :3] == pytest.approx(ARRAY.chips[2].axes.T)
    with pytest.raises(InputError):
        gfimu.convert(recording, tmp_path / "run.euroc")


def test_chips_without_three_axes_are_refused_and_nothing_is_left(recording, tmp_path):
    first = ARRAY.chips[0]
    flat = replace(ARRAY, chips=(replace(first, axes=first.axes[:2]),))
    other = Recording.from_arrays(T, recording.readings[:, :2], flat)
    for name in ("run.mcap", "run.euroc"):
        with pytest.raises(InputError, match="three axes"):
            gfimu.convert(other, tmp_path / name)
    assert list(tmp_path.iterdir()) == []
