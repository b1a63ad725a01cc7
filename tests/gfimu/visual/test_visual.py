"""Rerun recordings: what the file holds is what went in, the viewer's own check passes, nothing is half-written."""

from __future__ import annotations

import subprocess
import sys
from dataclasses import dataclass, replace

import numpy as np
import pyarrow as pa
import pytest
from numpy.testing import assert_allclose
from rerun.chunk import RrdReader
from rerun_layout import Layout
from scipy.spatial.transform import Rotation

import gfimu
from gfimu import AccelerometerArray, Chip, InputError, Recording, TurningAxis, specific_force
from gfimu.rate import HealthCode
from gfimu.recording import open_run
from gfimu.visual import Box, Cylinder, ExpectedDrift, KnownMotion, Line, Mesh, Plot, write_comparison, write_run
from gfimu.visual.picture import picture_of, picture_path
from gfimu.visual.plots import _emptiest_corner, broken_at_gaps
from gfimu.visual.scene import _cylinder_mesh
from gfimu.visual.viewer import open_viewer


@dataclass(frozen=True)
class Motion:
    t_s: np.ndarray
    p: np.ndarray
    alpha: np.ndarray
    omega: np.ndarray
    omega_std: np.ndarray
    quaternion: np.ndarray
    position: np.ndarray | None = None
    health: dict[str, np.ndarray] | None = None


@dataclass(frozen=True)
class Run:
    array: AccelerometerArray
    recording: Recording
    estimate: Motion
    known: KnownMotion
    drift: ExpectedDrift


@pytest.fixture(scope="module")
def run() -> Run:
    array = AccelerometerArray.load("cube12")
    t = np.arange(300) * 0.01
    rate, acceleration = 2.0 * t, np.full_like(t, 2.0)
    angle = t**2
    zero = np.zeros_like(t)
    up = np.array([0.0, 0.0, 1.0])
    p, alpha, omega = 9.80665 * up + zero[:, None], acceleration[:, None] * up, rate[:, None] * up
    readings = specific_force(array, p, alpha, omega)
    attitude = Rotation.from_rotvec(angle[:, None] * up).as_quat(scalar_first=True)
    late = Rotation.from_rotvec((angle - 0.1)[:, None] * up).as_quat(scalar_first=True)
    recording = Recording.from_arrays(
        t, readings, array, reference={"tacho_rad_s": rate, "command_rad_s": rate + 0.1}, metadata={"scenario": "spin"}
    )
    return Run(
        array,
        recording,
        Motion(t, p, alpha, omega + 0.01, np.full((len(t), 3), 0.02), late),
        KnownMotion("truth", t, attitude, np.array([0.0, 0.0, 0.06]), omega, alpha, p, angle),
        ExpectedDrift(t, np.zeros((len(t), 3)), t**2),
    )


def contents(path) -> dict[str, dict[str, np.ndarray]]:
    """Columns of every entity of a rerun recording, by the short name of the component."""
    found: dict[str, dict[str, np.ndarray]] = {}
    for chunk in RrdReader(str(path)).stream().to_chunks():
        batch = chunk.to_record_batch()
        columns = found.setdefault(chunk.entity_path, {})
        for name, column in zip(batch.schema.names, batch.columns, strict=True):
            # Nanoseconds as integers: pyarrow has no scalar of its own for a duration this fine.
            plain = column.cast(pa.int64()) if pa.types.is_temporal(column.type) else column
            columns[name.split(":")[-1]] = np.array(plain.to_pylist(), dtype=object)
    return found


def verify(path) -> None:
    command = [sys.executable, "-m", "rerun", "rrd", "verify", str(path)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr


def numbers(column: np.ndarray) -> np.ndarray:
    return np.array(column.tolist(), dtype=float).squeeze()


def test_a_run_holds_what_went_in(tmp_path, run):
    path = tmp_path / "run.rrd"
    write_run(path, run.recording, run.array, estimate=run.estimate, known=run.known, drift=run.drift)
    verify(path)
    found = contents(path)
    rate = next(name for name in found if name.endswith("estimate") and "angular_rate" in name)
    assert_allclose(numbers(found[rate]["scalars"]), run.estimate.omega[:, 2])
    band = next(name for name in found if "angular_rate" in name and name.endswith("2σ"))
    edges = numbers(found[band]["scalars"])
    assert_allclose(edges, run.estimate.omega[:, 2:] + 0.04 * np.array([-1.0, 1.0]))
    error = next(name for name in found if name.endswith("estimate_truth"))
    assert_allclose(numbers(found[error]["scalars"]), 0.01, atol=1e-12)
    for channel in run.array.channels:
        entity = next(name for name in found if name.startswith("/plots/raw") and name.endswith(f"_{channel}"))
        assert_allclose(numbers(found[entity]["scalars"]), run.recording.readings[:, run.array.index(channel)])


def test_the_way_of_the_body_is_a_line_and_a_point_that_runs_along_it(tmp_path, run):
    path = tmp_path / "run.rrd"
    t = run.estimate.t_s
    way = np.column_stack([t, t**2, -t])
    write_run(path, run.recording, run.array, estimate=replace(run.estimate, position=way))
    verify(path)
    found = contents(path)
    assert_allclose(numbers(found["/trace/now"]["positions"]), way, rtol=1e-6, atol=1e-6)
    assert_allclose(numbers(found["/trace/estimate"]["strips"]), way, rtol=1e-6, atol=1e-6)
    plotted = next(name for name in found if "position_in_the_world" in name and name.endswith("y"))
    assert_allclose(numbers(found[plotted]["scalars"]), way[:, 1])


def test_each_channel_has_a_lane_of_its_health(tmp_path, run):
    count = len(run.estimate.t_s)
    health = {name: np.zeros(count, dtype=np.int8) for name in run.array.channels}
    health["a21"][10:] = HealthCode.EXCLUDED
    health["a43"][:5] = HealthCode.DOUBTED
    path = tmp_path / "run.rrd"
    write_run(path, run.recording, run.array, estimate=replace(run.estimate, health=health), known=run.known)
    lanes = {name: numbers(columns["scalars"]) for name, columns in contents(path).items()
             if "health" in name and "scalars" in columns}  # fmt: skip
    used, doubt, left_out = (
        next(lanes[name] for name in lanes if name.endswith(end)) for end in ("used", "in_doubt", "a21_not_used")
    )
    expected = np.tile(-np.arange(12.0), (count, 1))
    expected[10:, 3] = np.nan
    expected[:5, 11] = np.nan
    assert_allclose(used, expected)
    assert_allclose(left_out, np.where(np.arange(count) >= 10, -3.0, np.nan))
    assert_allclose(doubt[:5, 11], -11.0)
    assert np.isnan(doubt[5:]).all()


def test_truth_turns_the_rig_and_the_estimate_its_ghost(tmp_path, run):
    path = tmp_path / "run.rrd"
    write_run(path, run.recording, run.array, estimate=run.estimate, known=run.known)
    found = contents(path)
    for body, quaternion in (
        ("cube", run.known.quaternion),
        ("table", run.known.quaternion),
        ("estimate", run.estimate.quaternion),
    ):
        shown = numbers(found[f"/scene/{body}"]["quaternion"])[:, [3, 0, 1, 2]]
        assert_allclose(shown, quaternion, atol=1e-6)


def test_arrows_start_at_the_chips_and_are_as_long_as_the_reading(tmp_path, run):
    path = tmp_path / "run.rrd"
    write_run(path, run.recording, run.array)
    arrows = contents(path)["/scene/cube/sensing_axes_0"]
    assert_allclose(numbers(arrows["origins"]), run.array.positions, atol=1e-7)
    vectors = numbers(arrows["vectors"])  # (n, c, 3)
    one_g = vectors[:, run.array.index("a13")] @ np.array([0.0, 0.0, 1.0])
    assert_allclose(one_g, 0.06, rtol=1e-6)
    lengths = np.einsum("nck,ck->nc", vectors, run.array.axes) * 9.80665 / 0.06
    assert_allclose(lengths, run.recording.readings, atol=1e-5)


def test_without_truth_the_tachometer_turns_the_table(run):
    known = KnownMotion.from_reference(run.recording)
    assert known is not None
    assert_allclose(known.angle, run.known.angle, atol=1e-9)
    assert_allclose(known.quaternion, run.known.quaternion, atol=1e-9)


def test_without_any_reference_nothing_is_known(run):
    bare = Recording.from_arrays(run.recording.t_s, run.recording.readings, run.array)
    assert KnownMotion.from_reference(bare) is None


def test_a_free_body_has_no_table(tmp_path, run):
    path = tmp_path / "free.rrd"
    free = Recording.from_arrays(
        run.recording.t_s,
        run.recording.readings,
        run.array,
        reference={f"gyro_{axis}_rad_s": run.known.omega[:, i] for i, axis in enumerate("xyz")},
    )
    write_run(path, free, run.array, estimate=run.estimate)
    verify(path)
    found = contents(path)
    assert "/scene/table" not in found
    assert "/scene/cube" in found
    error = next(name for name in found if name.endswith("z_estimate_gyro"))
    assert_allclose(numbers(found[error]["scalars"]), 0.01, atol=1e-12)


def test_lost_samples_break_the_line_and_leave_out_the_pose(tmp_path, run):
    t = np.delete(run.recording.t_s, slice(100, 150))
    broken_t, broken = broken_at_gaps(t, np.ones((len(t), 1)))
    assert len(broken_t) == len(t) + 1
    assert np.flatnonzero(np.isnan(broken[:, 0])).tolist() == [100]
    assert np.all(np.diff(broken_t) > 0)
    path = tmp_path / "lost.rrd"
    estimate = Motion(**(vars(run.estimate) | {"quaternion": run.estimate.quaternion.copy()}))
    estimate.quaternion[40:60] = np.nan
    write_run(path, run.recording, run.array, estimate=estimate, known=run.known)
    verify(path)
    assert len(contents(path)["/scene/estimate"]["quaternion"]) == len(run.recording) - 20


def test_a_comparison_holds_residuals_before_and_after(tmp_path, run):
    path = tmp_path / "comparison.rrd"
    before, after = run.recording.readings - 0.2, run.recording.readings - 0.01
    extra = Plot("rate, rad/s", [Line("rate", run.recording.t_s, run.recording.reference["tacho_rad_s"], (1, 2, 3))])
    write_comparison(path, run.recording, run.array, before, after, plots=[extra], notes="# Table tilt")
    verify(path)
    found = contents(path)
    assert_allclose(numbers(found["/plots/residual_a21/00_before"]["scalars"]), 0.2)
    assert_allclose(numbers(found["/plots/residual_a21/01_after"]["scalars"]), 0.01)
    assert_allclose(
        numbers(found["/plots/a21/00_measured"]["scalars"]), run.recording.readings[:, run.array.index("a21")]
    )
    assert "/plots/rate_rad_s/00_rate" in found
    assert "# Table tilt" in str(found["/notes"])


def test_a_prediction_of_another_shape_is_refused(tmp_path, run):
    with pytest.raises(InputError, match=r"prediction 'after' has shape \(300, 3\)"):
        write_comparison(
            tmp_path / "x.rrd", run.recording, run.array, run.recording.readings, run.recording.readings[:, :3]
        )
    assert list(tmp_path.iterdir()) == []


def test_another_ending_is_refused_and_nothing_is_left(tmp_path, run):
    with pytest.raises(InputError, match=r"ends in \.rrd"):
        write_run(tmp_path / "run.html", run.recording, run.array)
    assert list(tmp_path.iterdir()) == []


def test_given_shapes_replace_the_plain_rig(tmp_path, run):
    path = tmp_path / "shapes.rrd"
    triangle = Mesh(np.eye(3), np.array([[0, 1, 2]]), (9, 9, 9))
    shapes = {"base": [], "table": [Cylinder(0.2, 0.01)], "cube": [Box((0.05, 0.05, 0.05)), triangle]}
    write_run(path, run.recording, run.array, shapes=shapes)
    found = contents(path)
    assert numbers(found["/scene/cube/shape_1"]["vertex_positions"]).tolist() == np.eye(3).tolist()
    assert not [name for name in found if name.startswith("/scene/base/")]
    assert len([name for name in found if name.startswith("/scene/table/shape")]) == 1


def test_a_cylinder_is_closed_and_has_its_volume():
    shape = Cylinder(
        0.3, 0.5, centre=(1.0, 2.0, 3.0), quaternion=Rotation.from_euler("y", 0.7).as_quat(scalar_first=True)
    )
    vertices, triangles = _cylinder_mesh(shape)
    corners = vertices[triangles]  # (f, 3, 3)
    volume = np.einsum("fi,fi->", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])) / 6  # divergence theorem
    inscribed = 96 / (2 * np.pi) * np.sin(2 * np.pi / 96)  # 96 sides against the circle
    assert_allclose(volume, np.pi * 0.3**2 * 0.5 * inscribed, rtol=1e-9)
    assert_allclose(np.concatenate([vertices.min(axis=0), vertices.max(axis=0)]).reshape(2, 3).mean(axis=0), [1, 2, 3])


def test_the_legend_stands_where_the_data_are_not():
    t = np.linspace(0.0, 1.0, 200)
    rising = Line("rising", t, t, (0, 0, 0))
    assert _emptiest_corner([rising]).name in {"LeftTop", "RightBottom"}
    assert _emptiest_corner([Line("flat", t, np.where(t < 0.5, 1.0, 0.0), (0, 0, 0))]).name in {
        "RightTop",
        "LeftBottom",
    }
    assert _emptiest_corner([Line("nothing", t, np.full_like(t, np.nan), (0, 0, 0))]).name == "RightTop"


def test_the_viewer_refuses_what_is_not_a_rerun_recording(tmp_path):
    junk = tmp_path / "junk.rrd"
    junk.write_bytes(b"\x00\x01\x02 junk")
    with pytest.raises(InputError, match="not a rerun recording"):
        open_viewer(junk)
    with pytest.raises(InputError, match="No such file"):
        open_viewer(tmp_path / "missing.rrd")


def test_a_picture_takes_the_rest_biases_off_on_a_table_and_says_so(tmp_path, run):
    array, t = run.array, np.arange(400) * 0.01
    rate = np.where(t > 2.0, t - 2.0, 0.0)
    up = np.array([0.0, 0.0, 1.0])
    ideal = specific_force(array, 9.80665 * up + 0 * t[:, None], np.outer(t > 2.0, up), np.outer(rate, up))
    noise = 0.01 * np.random.default_rng(0).standard_normal(ideal.shape)
    biased = Recording.from_arrays(
        t, ideal + noise + np.linspace(-0.4, 0.5, 12), array, reference={"tacho_rad_s": rate}
    )
    file, out = tmp_path / "run.csv", tmp_path / "run.view.rrd"
    biased.write(file)
    assert picture_path(file) == out
    picture_of(file, out)
    found = contents(out)
    assert "Biases were read off the first rest" in str(found["/notes"])
    error = next(name for name in found if name.endswith("estimate_tacho"))
    assert np.abs(numbers(found[error]["scalars"])).max() < 0.05


def test_a_file_of_an_estimate_is_shown_with_band_health_and_position(tmp_path, run):
    recording = replace(run.recording, readings=run.recording.readings.copy())
    recording.readings[recording.t_s > 1.0, 0] += 3.0
    estimated = gfimu.estimate(recording, run.array, method="filter", position=True)
    file, out = tmp_path / "estimate.parquet", tmp_path / "estimate.rrd"
    estimated.write(file)
    picture_of(file, out)
    found = contents(out)
    assert not any(name.startswith("/plots/raw") for name in found)
    for axis, letter in enumerate("xyz"):
        rate = next(name for name in found if name.endswith(f"{letter}_rad_s/01_estimate"))
        assert_allclose(numbers(found[rate]["scalars"]), estimated.omega[:, axis])
        edges = numbers(found[rate.replace("01_estimate", "00_2σ")]["scalars"])
        assert_allclose(np.diff(edges, axis=1)[:, 0], 4.0 * estimated.omega_std[:, axis])
    assert any("health" in name for name in found)
    assert "/trace/estimate" in found
    with pytest.raises(InputError, match="give its recording with --axis"):
        picture_of(file, out, axis=TurningAxis(np.array([0.0, 0.0, 1.0]), np.zeros(3)))
    with pytest.raises(InputError, match="an estimate, no recording; gfimu view shows it"):
        open_run(file)


def test_a_picture_without_rest_leaves_the_biases_in_and_says_so(tmp_path, run):
    file, out = tmp_path / "run.parquet", tmp_path / "run.rrd"
    run.recording.write(file)
    picture_of(file, out)
    assert "Biases are left in" in str(contents(out)["/notes"])


def test_a_picture_of_an_array_that_sees_too_little_shows_the_readings_alone(tmp_path, run):
    flat = AccelerometerArray("two", run.array.chips[:1])
    recording = Recording.from_arrays(run.recording.t_s, run.recording.readings[:, :3], flat)
    file, out = tmp_path / "run.parquet", tmp_path / "run.rrd"
    recording.write(file)
    picture_of(file, out, array=flat)
    found = contents(out)
    assert "**No estimate.**" in str(found["/notes"])
    assert "add sensing axes that do" in str(found["/notes"])
    assert "[turning_axis]" in str(found["/notes"])
    assert any(name.startswith("/plots/raw") for name in found)


def arm(axis: TurningAxis | None) -> AccelerometerArray:
    return AccelerometerArray("arm", (Chip("a1", np.array([0.1, 0.0, 0.0]), np.eye(3)),), turning_axis=axis)


def turning(array: AccelerometerArray, reference: str) -> tuple[Recording, np.ndarray]:
    """A rest of 2 s, then a spin up about z, of chips with offsets; and the true rate."""
    t = np.arange(600) * 0.01
    rate = np.clip(t - 2.0, 0.0, 3.0)
    up = np.array([0.0, 0.0, 1.0])
    ideal = specific_force(array, 9.80665 * up + 0 * t[:, None], np.outer(np.gradient(rate, t), up), np.outer(rate, up))
    noise = 0.01 * np.random.default_rng(0).standard_normal(ideal.shape)
    readings = ideal + noise + np.linspace(-0.2, 0.3, array.n_channels)
    return Recording.from_arrays(t, readings, array, reference={reference: rate}), rate


@pytest.mark.parametrize(("reference", "name"), [("tacho_rad_s", "tacho"), ("gyro_z_rad_s", "gyro")])
def test_a_picture_of_one_chip_on_a_known_axis_has_the_estimate_about_it(tmp_path, reference, name):
    array = arm(TurningAxis.of("z"))
    recording, _ = turning(array, reference)
    file, out = tmp_path / "run.parquet", tmp_path / "run.rrd"
    recording.write(file)
    picture_of(file, out, array=array)
    verify(out)
    found = contents(out)
    error = next(entity for entity in found if entity.endswith(f"estimate_{name}"))
    assert np.sqrt(np.mean(numbers(found[error]["scalars"]) ** 2)) < 0.05
    assert "/scene/table" not in found  # an arm on an axis: no turntable is known of
    assert "Biases were read off the first rest" in str(found["/notes"])
    assert "axis of rotation" in str([columns.get("labels") for columns in found.values()])
    ghost, body = (numbers(found[f"/scene/{one}"]["quaternion"]) for one in ("estimate", "array"))
    assert_allclose(np.abs(np.sum(ghost * body, axis=1)), 1.0, atol=0.01)  # both start from one heading


def test_a_chip_on_its_axis_shows_its_channels_and_what_is_missing(tmp_path):
    array = AccelerometerArray("on_axis", (Chip("a1", np.zeros(3), np.eye(3)),), turning_axis=TurningAxis.of("z"))
    recording, _ = turning(array, "tacho_rad_s")
    file, out = tmp_path / "run.parquet", tmp_path / "run.rrd"
    recording.write(file)
    picture_of(file, out, array=array)
    found = contents(out)
    assert "**No estimate.**" in str(found["/notes"])
    assert any(entity.startswith("/plots/raw") for entity in found)


def test_an_inclined_axis_and_a_point_beside_the_origin_are_kept():
    axis = TurningAxis.of("z", point=[0.05, 0.0, 0.0], inclination=0.4)
    recording, _ = turning(arm(axis), "tacho_rad_s")
    known = KnownMotion.from_reference(recording, arm(axis))
    attitude = Rotation.from_quat(known.quaternion, scalar_first=True)
    assert_allclose(attitude.apply(axis.direction)[:, 2], np.cos(0.4), atol=1e-9)
    assert np.ptp(known.position + attitude.apply(axis.point), axis=0).max() < 1e-12
    assert known.angle[-1] == pytest.approx(0.5 * 3.0**2 + 3.0 * 0.99, abs=0.05)


def test_many_chips_are_plotted_in_groups_that_a_legend_can_name(tmp_path):
    chips = tuple(
        Chip(f"c{number:02d}_", 0.01 * np.array([number, number % 3, number % 5]), np.eye(3)) for number in range(32)
    )
    array = AccelerometerArray("many", chips)
    t = np.arange(30) * 0.01
    recording = Recording.from_arrays(t, np.zeros((30, 96)), array)
    write_run(tmp_path / "many.rrd", recording, array)
    found = contents(tmp_path / "many.rrd")
    plots = {name.split("/")[2] for name in found if name.startswith("/plots/raw")}
    assert len(plots) == 12
    assert max(len([name for name in found if name.startswith(f"/plots/{plot}/")]) for plot in plots) == 8
    names = next(
        c["labels"] for n, c in found.items() if n.startswith("/scene/array/") and "c31_" in str(c.get("labels"))
    )
    assert len(names) >= 1


def test_the_picture_of_a_pendulum_has_its_arm_and_no_table(tmp_path):
    """Its axis is in the recording's metadata, not in the array file; a table's recording has none."""
    hung = gfimu.simulate("pendulum", changes=["sensor.errors=false"])
    assert hung.metadata["rig_axis"]["inclination_rad"] == pytest.approx(np.pi / 2)
    np.testing.assert_allclose(hung.metadata["rig_axis"]["point_m"], [0.0, 0.4, 0.0], atol=1e-12)
    assert "rig_axis" not in gfimu.simulate("rest").metadata
    gfimu.view(hung, out=tmp_path / "hung.rrd")
    drawn = Layout.read(tmp_path / "hung.rrd").data
    assert any("/cube" in name for name in drawn)
    assert not any("/table" in name or "/base" in name for name in drawn)
