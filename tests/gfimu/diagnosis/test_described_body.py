"""What has no name is found and described on a free body, and its twin loads back and leaves nothing to find."""

from __future__ import annotations

import numpy as np
import pytest
from test_free_body import tumble, twin

from gfimu.diagnosis import diagnose, write_diagnosis
from sim.twin import Twin

TWIN = twin("cube12")
CHIP = 2


def truth(recording, name="omega", unit="rad_s"):
    return np.column_stack([recording.extra[f"truth_{name}_{axis}_{unit}"] for axis in "xyz"])


def offset_by_speed(recording):
    """One channel reads more the faster the body turns."""
    recording.readings[:, 4] += 0.12 * (np.linalg.norm(truth(recording), axis=1) / 8.0) ** 2


def gain_in_time(recording):
    """The gain of a chip drifts by a percent."""
    mine = TWIN.array.chip_of_channel == CHIP
    recording.readings[:, mine] *= 1.0 + 0.01 * (recording.t_s / recording.t_s[-1])[:, None]


def gyro_by_force(recording):
    """The gyro reads some of the specific force, axis by axis another."""
    force = recording.readings @ np.linalg.pinv(TWIN.array.axes).T
    for axis, name in enumerate("xyz"):
        recording.reference[f"gyro_{name}_rad_s"][:] += 0.012 * force[:, (axis + 1) % 3]


@pytest.mark.parametrize(
    ("change", "place", "series", "dependence"),
    [
        (offset_by_speed, "channel", ("a22",), "omega^2"),
        (gain_in_time, "chip", ("a3",), "t"),
        (gyro_by_force, "reference", ("x", "y", "z"), "force change"),
    ],
)
def test_an_error_of_a_body_has_its_place_and_dependence(tmp_path, change, place, series, dependence):
    recording = tumble(seed=1, array="cube12", duration=12.0, rate=8.0)
    change(recording)
    found = diagnose([recording], TWIN)
    assert found.verdict == "unknown"
    (cause,) = found.causes
    assert (cause.unlisted.place, cause.unlisted.series) == (place, series)
    assert 1.0 - found.gain.share_of_excess_removed < 4.0 * found.gain.share_std
    assert found.residual.rms_after < 1.08 * found.residual.noise_floor
    if dependence == "t":  # a function of absolute time predicts no other recording
        assert not found.twin.effects
        assert found.gain.share_in_any_recording < 0.1
        return
    assert [effect.parameters["dependence"] for effect in found.twin.effects] == [dependence]
    write_diagnosis(tmp_path, found)
    again = diagnose([recording], Twin.load(tmp_path / "twin.toml"))
    assert again.verdict == "nothing_found", again.sentences
