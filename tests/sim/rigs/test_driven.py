"""Driven tables in batches: the same bits as one by one, on any number of threads, and as a plain loop of MuJoCo."""

from dataclasses import replace

import mujoco
import numpy as np
import pytest
from mujoco.batch import Batch, SimulationError

from gfimu import AccelerometerArray, InputError
from sim import DcMotor, Drive, Hold, Ramp, channel_places, drive, drive_all, spin_profile
from sim.world import World

COLUMNS = ("t", "readings", "tacho", "torque")


def varied(count, motor, seed=5):
    """Return runs that differ in command, mounting, tilt and, with a motor, its friction and cogging."""
    rng = np.random.default_rng(seed)
    nominal = World(AccelerometerArray.load("cube12"))
    for _ in range(count):
        world = nominal.changed(
            cube_offset=np.array([0.0, 0.0, 0.06]) + 0.01 * rng.standard_normal(3),
            mount_rotvec=0.1 * rng.standard_normal(3),
            axis_rotvec=np.array([*0.01 * rng.standard_normal(2), 0.0]),
            gravity=9.8 + 0.02 * rng.standard_normal(),
        )
        command = spin_profile([Hold(0.1), Ramp(rng.uniform(-6, 6), 0.3), Hold(1.0)])
        figures = DcMotor(cogging=rng.uniform(0, 0.02), coulomb=rng.uniform(0.01, 0.03)) if motor else None
        yield Drive(world, command, 1.0, motor=figures)


def same(one, other):
    for column in COLUMNS:
        np.testing.assert_array_equal(getattr(one, column), getattr(other, column))
    for column in ("angle", "rate", "acceleration"):
        np.testing.assert_array_equal(getattr(one.state, column), getattr(other.state, column))


@pytest.mark.parametrize("motor", [False, True], ids=["speed controller", "dcmotor"])
def test_a_batch_has_the_bits_of_single_runs_on_any_number_of_threads(motor):
    alone = [drive(run.world, run.command, run.duration, motor=run.motor) for run in varied(7, motor)]
    for threads in (1, 2, 4):
        for one, other in zip(alone, drive_all(varied(7, motor), threads=threads), strict=True):
            same(one, other)
    assert len({run.state.angle[-1] for run in alone}) == 7


@pytest.mark.parametrize("motor", [False, True], ids=["speed controller", "dcmotor"])
def test_a_batch_has_the_bits_of_a_plain_loop(motor):
    for run, found in zip(varied(3, motor), drive_all(varied(3, motor), threads=2), strict=True):
        model, wanted = run.model(), run.command.at(run.times)
        data, controls = mujoco.MjData(model), run.controls(wanted)
        rows = np.empty((len(run.times), model.nsensordata))
        for row, control in enumerate(controls):
            data.ctrl[:] = control
            mujoco.mj_step(model, data)
            rows[row] = data.sensordata
        np.testing.assert_array_equal(found.readings, rows[:, channel_places(model, run.world.array)])
        np.testing.assert_array_equal(found.tacho, rows[:, model.sensor("tachometer").adr[0]])


def test_runs_of_several_kinds_and_lengths_come_back_in_order():
    mixed = [*varied(2, True), *varied(2, False, seed=6), *varied(1, True, seed=7)]
    mixed[4] = replace(mixed[4], duration=0.5)
    mixed[1] = replace(mixed[1], motor=DcMotor(inductance=0.0))  # fewer states: another layout
    shares = []
    for run, found in zip(mixed, drive_all(mixed, threads=2, progress=shares.append), strict=True):
        same(found, drive(run.world, run.command, run.duration, motor=run.motor))
    assert shares == sorted(shares)
    assert shares[-1] == pytest.approx(1.0)


@pytest.mark.parametrize("motor", [False, True], ids=["speed controller", "dcmotor"])
def test_every_nth_state_is_one_of_all(monkeypatch, motor):
    (run,) = varied(1, motor)
    whole = drive(run.world, run.command, run.duration, motor=run.motor)
    monkeypatch.setattr("sim.rigs.driven._CHUNK", 18 * 64)  # the log is put together of several pieces
    (every,) = drive_all([run], every=10)
    np.testing.assert_array_equal(every.t, whole.t[::10])
    np.testing.assert_array_equal(every.readings, whole.readings[::10])
    np.testing.assert_array_equal(every.state.rate, whole.state.rate[::10])


@pytest.mark.filterwarnings("error")
def test_a_run_that_fails_leaves_the_others_alone(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    good, bad, refused = varied(3, True)
    bad = replace(bad, motor=replace(bad.motor, viscous=100.0))  # unstable at this step
    refused = replace(refused, motor=replace(refused.motor, resistance=-1.0))
    first, second, third = drive_all([good, bad, refused], threads=2)
    same(first, drive(good.world, good.command, good.duration, motor=good.motor))
    assert isinstance(second, InputError)
    assert "did not stay finite" in str(second)
    assert isinstance(third, InputError)
    assert "\n" not in str(third)
    assert not list(tmp_path.iterdir())


def test_an_error_of_mujoco_in_one_run_leaves_the_others_alone(monkeypatch):
    whole = drive_all(varied(3, True))
    rollout = Batch.rollout

    def failing(self, *arguments, **options):
        rollout(self, *arguments, **options)
        raise SimulationError(np.array([1]), "stack overflow")

    monkeypatch.setattr(Batch, "rollout", failing)
    first, second, third = drive_all(varied(3, True))
    same(first, whole[0])
    same(third, whole[2])
    assert isinstance(second, InputError)


def test_what_cannot_be_driven_is_one_line():
    (run,) = varied(1, True)
    with pytest.raises(InputError, match="linear axis has no motor"):
        replace(run, world=run.world.changed(slide=np.array([1.0, 0.0, 0.0])))
    with pytest.raises(InputError, match=r"physics step 1e-09 s: 1 s take more than 2e\+07; give a longer step"):
        replace(run, step=1e-9)
    with pytest.raises(InputError, match="threads 0, every 1: give at least 1"):
        drive_all([run], threads=0)
    assert drive_all([]) == []
