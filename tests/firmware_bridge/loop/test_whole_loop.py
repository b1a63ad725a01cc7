"""MuJoCo → ADXL345 → firmware → UART → pseudo-terminal → pyserial → decoder → recording → estimate."""

from __future__ import annotations

import sys
import threading

import numpy as np
import pytest

pytest.importorskip("unicorn", reason="the emulator is in the extra 'firmware'")

import gfimu
from firmware_bridge import (
    TICKS_PER_SECOND,
    Adxl345Options,
    BoardProcess,
    RidePhysics,
    SampleDecoder,
    Status,
    format_count,
    open_port,
    record,
    record_virtual,
    sample_at,
    serve,
    set_rate,
    typical_chips,
)
from gfimu import AccelerometerArray, InputError
from gfimu.recording import Recording
from sim import prescribed_readings
from sim.ride import Ride
from sim.scenarios import Scenario
from sim.simulation import simulate

LSB = 0.038245935
CHIPS = tuple(Adxl345Options(clock_error=0.004 * k - 0.006, phase=0.22 * k) for k in range(4))
DATA_FORMAT = 0x0B
READ_S = 600e-6  # the firmware starts its clock this long after reset at most, and reads the chips after the time stamp


class Logged:
    """Physics that remembers what it handed over."""

    def __init__(self, physics: RidePhysics) -> None:
        self.physics = physics
        self.log = [[] for _ in range(4)]

    def __call__(self, sensor, first, period, count, bw_rate):
        block = self.physics(sensor, first, period, count, bw_rate)
        self.log[sensor].append((first, period, bw_rate, block))
        return block


def test_splines_carry_the_physics_to_any_instant() -> None:
    ride = Ride("paper_run")
    t = np.sort(np.random.default_rng(0).uniform(0.0, 25.0, 1500))
    direct = prescribed_readings(ride.world, ride.scenario.motion, t)
    by_blocks = np.concatenate([ride.force(part) for part in np.array_split(t, 12)])
    assert np.abs(by_blocks - direct).max() < 0.01 * LSB


@pytest.mark.parametrize("rate", [200, 3200])
def test_every_conversion_of_every_chip_is_sent_once(rate: int) -> None:
    physics = Logged(RidePhysics(Ride("paper_run", seed=4)))
    code = {200: 0x0B, 3200: 0x0F}[rate]
    with BoardProcess(physics, chips=CHIPS) as board:
        board.run_for(0.02)
        board.receive(sample_at(rate))
        board.run_for(0.1)
        board.take_sent()
        board.run_for(800 / rate)
        samples = SampleDecoder().feed(board.take_sent()[0])
    assert len(samples) > 780
    assert not (samples.status & (Status.STALE | Status.LATE)).any()
    slowest = min(chip.clock_error for chip in CHIPS)
    assert np.diff(samples.ticks).mean() == pytest.approx(1e6 / (rate * (1.0 + slowest)), rel=2e-3)
    merged_in_all = 0
    for sensor in range(4):
        blocks = [entry for entry in physics.log[sensor] if entry[2] & 15 == code]
        at = np.concatenate([first + period * np.arange(len(block)) for first, period, _, block in blocks])
        raw = np.concatenate([block for *_, block in blocks])
        counts = np.array([[format_count(int(v), DATA_FORMAT, code) for v in row] for row in raw]).astype(np.int16)
        merged = (samples.status >> (4 + sensor) & 1).astype(int)
        merged_in_all += merged.sum()
        asked = samples.ticks[0] * (TICKS_PER_SECOND // 1_000_000) + round(READ_S * TICKS_PER_SECOND)
        mine = samples.counts[:, 3 * sensor : 3 * sensor + 3]
        newest_after = np.searchsorted(at, asked, side="right") - 1
        # A sample takes one conversion, or two whose mean it sends; which was the first of all is all that is open.
        matches = 0
        for first in range(newest_after - 5, newest_after + 1):
            newest = first + np.concatenate([[0], np.cumsum(1 + merged[1:])])
            pair = counts[newest].astype(int) + counts[newest - 1]
            expected = np.where(merged[:, None] == 1, (pair + 1) // 2, counts[newest])
            matches += (mine[1:] == expected[1:]).all()
        assert matches == 1
    assert merged_in_all > 5


@pytest.fixture(scope="module")
def looped(tmp_path_factory) -> Recording:
    """A recording through the pseudo-terminal, noise off, chips with clocks of their own."""
    out = tmp_path_factory.mktemp("loop") / "run.parquet"
    ride = Ride(Scenario.load("paper_run", changes=["sensor.noise=false", "sensor.errors=false"]), seed=2)
    port = open_port("pty" if sys.platform != "win32" else "tcp:0")
    done = threading.Event()
    with BoardProcess(RidePhysics(ride), chips=CHIPS) as board:
        board.run_for(0.02)
        board.receive(set_rate(100))
        thread = threading.Thread(target=serve, args=(board, port), kwargs={"stop": done.is_set, "realtime": False})
        thread.start()
        report = record(port.name, out, duration_s=28.0)
        done.set()
        thread.join()
    port.close()
    assert report.stream.lost == report.stream.corrupt == report.stream.restarts == 0
    return Recording.read(out)


def test_equals_the_direct_simulation_within_quantisation_and_the_declared_skew(looped: Recording) -> None:
    scenario = Scenario.load(
        "paper_run", changes=["sensor.noise=false", "sensor.errors=false", "sensor.quantisation=false"]
    )
    direct = simulate(scenario, seed=2)
    rows = looped.t_s < 29.0
    t = looped.t_s[rows]
    chip_period = 0.01 * 1.007  # a sample is at most one period of the slowest chip old
    fine = np.linspace(-chip_period, READ_S, 15)
    truth = np.stack([[np.interp(t + d, direct.t_s, channel) for d in fine] for channel in direct.readings.T])
    low, high = truth.min(axis=1).T - LSB / 2, truth.max(axis=1).T + LSB / 2  # (n, 12)
    # The direct run has its samples every 10 ms only: between them the line may miss a curve by this much.
    curve = 0.25 * np.abs(np.diff(direct.readings, n=2, axis=0)).max()
    outside = np.maximum(low - looped.readings[rows], looped.readings[rows] - high)
    assert outside.max() <= curve + 1e-9
    assert curve < 3 * LSB


def test_estimate_from_the_loop_follows_the_table(looped: Recording) -> None:
    array = AccelerometerArray.load("cube12")
    found = gfimu.estimate(looped, array)
    truth = Ride("paper_run").references(looped.t_s)["command_rad_s"]
    error = found.omega[:, 2] - truth
    assert np.sqrt(np.nanmean(error**2)) < 0.05


def test_record_virtual_has_references_and_metadata() -> None:
    run = record_virtual(Ride("paper_run", seed=3), 2.0, rate_hz=400, range_g=4, full_resolution=False)
    recording = run.recording
    assert run.stream.lost == 0
    slowest = min(chip.clock_error for chip in typical_chips(3))
    assert recording.sample_rate == pytest.approx(400 * (1.0 + slowest), rel=1e-3)
    assert {"tacho_rad_s", "command_rad_s", "angle_rad", "temperature_degC"} <= set(recording.reference)
    assert recording.metadata["scenario"] == "paper_run"
    assert recording.metadata["array_toml"] == AccelerometerArray.load("cube12").to_toml()
    steps = recording.readings[:, 2] / (2 * LSB)  # ±4 g in 10 bits: 7.8 mg per count
    assert np.allclose(steps, np.round(steps), atol=1e-6)
    assert np.median(recording.readings[:, 2]) == pytest.approx(9.8, abs=1.0)


def test_lost_interrupts_are_gaps_in_time() -> None:
    run = record_virtual(Ride("rest"), 3.0, rate_hz=100, lose_every=50)
    assert 4 <= len(run.recording.gaps) <= 6


def test_effects_in_the_data_have_no_place_behind_the_firmware() -> None:
    changes = ['effect=[{name="sign_flip",parameters={channel="a11"}}]']
    with pytest.raises(InputError, match="sign_flip"):
        Ride(Scenario.load("paper_run", changes=changes))


def test_an_array_the_board_does_not_carry() -> None:
    with pytest.raises(InputError, match="four three-axis chips"):
        RidePhysics(Ride(Scenario.load("paper_run", changes=['array="corners8"'])))
