"""One gate before every command that reads a recording: wrong files are refused with their cause, --force goes on."""

from __future__ import annotations

import warnings
from dataclasses import replace

import numpy as np
import pytest

import gfimu
from gfimu import InputError, RecordingWarning
from gfimu.commands.diagnose import EXPLAINED
from gfimu.recording import doubts_of
from gfimu.recording.doubts.judge import examine

G = 9.80665
CUBE = gfimu.AccelerometerArray.load("cube12")


@pytest.fixture(scope="module")
def sound():
    """A run on the table that begins and ends at rest."""
    return gfimu.simulate("driven_run", seed=5)


def in_g(run):
    return replace(run, readings=run.readings / G)


def one_chip_in_g(run):
    readings = run.readings.copy()
    readings[:, 3:6] /= G
    return replace(run, readings=readings)


def exchanged(run):
    return replace(run, readings=run.readings[:, [2, 1, 0, *range(3, 12)]])


def doubled(run):
    return replace(run, readings=run.readings[:, [0, 0, *range(2, 12)]])


def in_milliseconds(run):
    return replace(run, t_s=1e3 * run.t_s)


WRONG = {
    "all readings are in g": in_g,
    "chip a2 reads in g": one_chip_in_g,
    "a11 and a13 are exchanged": exchanged,
    "a11 and a12 hold the same values": doubled,
    "column t_s is in milliseconds": in_milliseconds,
}


def commands(folder, run):
    """Every command that reads a recording, on a file of it."""
    file = folder / "run.parquet"
    run.write(file)
    reference = folder / "tacho.csv"
    t = np.linspace(0.0, 30.0, 400)
    reference.write_text("t_s,tacho_rad_s\n" + "\n".join(f"{one:.4f},{np.sin(one):.6f}" for one in t))
    lines = ["t_s," + ",".join(f"{name}_m_s2" for name in run.channels)]
    lines += [",".join(repr(float(one)) for one in row) for row in np.column_stack([run.t_s, run.readings])[:500]]
    return {
        "estimate": lambda **more: gfimu.estimate(file, **more),
        "calibrate": lambda **more: gfimu.calibrate("array", file, **more),
        "noise": lambda **more: gfimu.noise(file, **more),
        "view": lambda **more: gfimu.view(file, out=folder / "view.rrd", **more),
        "join": lambda **more: gfimu.join(file, reference, **more),
        "diagnose": lambda **more: gfimu.diagnose(file, "cube12_turntable", **more),
        "live": lambda **more: list(gfimu.live("cube12", 100.0, source=lines, **more)),
    }


@pytest.mark.parametrize("name", ["estimate", "calibrate", "noise", "view", "join", "diagnose", "live"])
@pytest.mark.parametrize("words", WRONG)
def test_a_wrong_file_is_refused_with_its_cause(tmp_path, sound, name, words):
    if name == "diagnose" and "exchanged" in words:
        pytest.skip("a diagnosis finds exchanged channels itself")
    with pytest.raises(InputError, match=words) as caught:
        commands(tmp_path, WRONG[words](sound))[name]()
    assert "--force" in str(caught.value)
    assert "\n" not in str(caught.value)
    assert name in {"diagnose", "live"} or str(caught.value).startswith("run.parquet: ")
    assert not (tmp_path / "view.rrd").exists()


@pytest.mark.parametrize("name", ["estimate", "noise", "live"])
def test_force_goes_on_with_a_warning(tmp_path, sound, name):
    call = commands(tmp_path, in_g(sound))[name]
    with warnings.catch_warnings(record=True) as seen:
        warnings.simplefilter("always")
        found = call(force=True)
    texts = [str(one.message) for one in seen if issubclass(one.category, RecordingWarning)]
    texts += found.metadata["warnings"] if name == "estimate" else []
    assert any("all readings are in g" in text for text in texts)


def test_a_conversion_warns(tmp_path, sound):
    with pytest.warns(RecordingWarning, match="all readings are in g"):
        gfimu.convert(in_g(sound), tmp_path / "run.csv")


def test_the_sound_file_passes_every_gate(sound):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert examine(sound, CUBE, source="run", whose="") == ()
        assert examine(sound) == ()


def test_counts_are_examined_too(sound):
    size = 0.0382
    counts = replace(sound, readings=np.round(sound.readings / size), unit="lsb")
    counts = replace(counts, metadata={**counts.metadata, "lsb_m_s2": size})
    assert examine(counts, CUBE) == ()
    with pytest.raises(InputError, match="a11 and a13 are exchanged"):
        examine(exchanged(counts), CUBE)


def test_another_array_than_the_recording_states_is_a_warning(sound):
    built = gfimu.AccelerometerArray.load("cube12_as_built")
    with pytest.warns(RecordingWarning, match=r"recorded with array 'cube12', but the given 'cube12_as_built' is used"):
        examine(sound, built, force=True)
    with pytest.raises(InputError, match=r"--array cube12;"):
        gfimu.estimate(sound, "cube12_as_built")


def test_poses_turned_over_do_not_hide_a_wrong_unit():
    """A body in the hand is not upright at every rest, whatever its mounting says."""
    poses = gfimu.simulate("calibration_poses", seed=5)
    assert doubts_of(poses, CUBE) == ()
    for words, spoil in WRONG.items():
        found = [one.text for one in doubts_of(spoil(poses), CUBE) if one.refused]
        assert any(words in text for text in found) or words.startswith("column"), words


def test_a_pendulum_is_checked_though_its_axis_is_level():
    swing = gfimu.simulate("pendulum", seed=5)
    array = swing.array
    assert doubts_of(swing, array) == ()
    assert [one.kind for one in doubts_of(in_g(swing), array)] == ["unit"]
    assert [one.kind for one in doubts_of(one_chip_in_g(swing), array)] == ["chip_unit"]


def test_a_diagnosis_refuses_only_what_it_can_not_explain(sound):
    assert {one.kind for one in doubts_of(exchanged(sound), CUBE)} <= EXPLAINED
    with pytest.raises(InputError, match="fitted and held out"):
        gfimu.diagnose(sound, "cube12_turntable", held_out=[sound])


def test_a_file_is_not_fitted_and_held_out_both(tmp_path, gfimu_command, sound):
    sound.write(tmp_path / "run.csv")
    (tmp_path / "other.csv").symlink_to("run.csv")
    result = gfimu_command(
        "diagnose", tmp_path / "run.csv", "--twin", "cube12_turntable", "--held-out", tmp_path / "other.csv",
        "--out", tmp_path / "made",
    )  # fmt: skip
    assert result.code == 2
    assert "is fitted and held out" in result.stderr
    assert not (tmp_path / "made").exists()
