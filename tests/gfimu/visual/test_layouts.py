"""Every kind of recording opens with a layout of its own: no view empty, all with units, the body in the picture."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from rerun_layout import check_layout

import gfimu
from gfimu import AccelerometerArray, Recording, specific_force

SHORT = {
    "turntable": ("paper_run", []),
    "tumble": ("tumble", []),
    "wheel": ("wheel", []),
    "carriage": ("linear_axis", []),
    "pendulum": ("pendulum", []),
    "long": ("calibration_poses", []),
}
"""Scenarios by the kind of their motion."""


@pytest.fixture(scope="module")
def simulated(tmp_path_factory) -> Callable[[str], tuple[Path, Path]]:
    """Recording of a kind of motion and the picture of its simulation, each made once."""
    made: dict[str, tuple[Path, Path]] = {}

    def of(kind: str) -> tuple[Path, Path]:
        if kind not in made:
            folder = tmp_path_factory.mktemp(kind)
            made[kind] = folder / "run.parquet", folder / "truth.rrd"
            scenario, changes = SHORT[kind]
            gfimu.simulate(scenario, out=made[kind][0], changes=changes, rrd=made[kind][1])
        return made[kind]

    return of


def titles(layout) -> list[str]:
    return sorted(columns["display_name"][0][0] for columns in layout.views("TimeSeries").values())


@pytest.mark.study(only=["turntable"])
@pytest.mark.parametrize(
    ("kind", "expected"),
    [
        ("turntable", "angle about the axis of rotation, rad"),
        ("tumble", "angular acceleration α, rad/s²"),
        ("wheel", "angular rate about the axis of rotation, rad/s"),
        ("carriage", "speed of the carriage, m/s"),
        ("pendulum", "angle about the axis of rotation, rad"),
        ("long", "angular rate ω, rad/s"),
    ],
    ids=list(SHORT),
)
def test_a_simulation_is_drawn_with_its_truth(simulated, kind, expected):
    layout = check_layout(simulated(kind)[1])
    assert expected in titles(layout)
    table = "/scene/table" in layout.data or any(name.startswith("/scene/table/") for name in layout.data)
    assert table == (kind == "turntable")


@pytest.mark.study(only=["wheel"])
@pytest.mark.parametrize("kind", SHORT)
def test_a_recording_is_drawn_with_its_estimate(simulated, tmp_path, kind):
    layout = check_layout(gfimu.view(simulated(kind)[0], out=tmp_path / "view.rrd"))
    found = titles(layout)
    assert any(title.startswith("raw") for title in found)
    assert ("place of the carriage, m" in found) == (kind == "carriage")
    assert any("angular" in title for title in found) == (kind != "carriage")


def test_an_estimate_alone_is_drawn(simulated, tmp_path):
    gfimu.estimate(simulated("tumble")[0], out=tmp_path / "estimate.parquet", rrd=tmp_path / "estimate.rrd")
    check_layout(tmp_path / "estimate.rrd")
    layout = check_layout(gfimu.view(tmp_path / "estimate.parquet", out=tmp_path / "view.rrd"))
    assert "angular rate ω, x, rad/s" in titles(layout)


@pytest.mark.parametrize("name", ["one_chip", "sisfall_belt", "mimu4444"])
@pytest.mark.parametrize("gyro", [False, True])
def test_arrays_of_others_are_drawn(tmp_path, name, gyro):
    """A phone's chip, two chips on a belt, a board of eight; with and without a gyro."""
    array = AccelerometerArray.load(name)
    t = np.arange(300) * 0.01
    omega = np.column_stack([np.sin(t), 0.5 * np.cos(2 * t), np.zeros_like(t)])
    alpha = np.gradient(omega, t, axis=0)
    readings = specific_force(array, np.tile([0.0, 0.0, 9.81], (300, 1)), alpha, omega)
    rates = {f"gyro_{axis}_rad_s": omega[:, place] for place, axis in enumerate("xyz")}
    recording = Recording.from_arrays(t, readings, array, reference=rates if gyro else {})
    recording.write(tmp_path / "run.parquet")
    check_layout(gfimu.view(tmp_path / "run.parquet", array=array, out=tmp_path / "view.rrd"))


def test_a_wheel_without_a_rest_and_without_an_axis_shows_its_channels(simulated, tmp_path):
    """Its array can't see all six motions, and there is no rest to read biases off: neither is an error here."""
    array = AccelerometerArray("pair", AccelerometerArray.load("wheel_pair").chips)
    run = Recording.read(simulated("wheel")[0])
    late = Recording.from_arrays(
        run.t_s[1000:2000], run.for_array(array)[1000:2000], array,
        reference={"tacho_rad_s": run.reference["tacho_rad_s"][1000:2000]},
    )  # fmt: skip
    late.write(tmp_path / "run.parquet")
    layout = check_layout(gfimu.view(tmp_path / "run.parquet", array=array, out=tmp_path / "view.rrd"))
    assert not any(title.startswith("angular acceleration") for title in titles(layout))
