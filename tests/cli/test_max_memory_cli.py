"""Every command that reads recordings, and the simulator, keeps to the memory that it is given."""

from __future__ import annotations

import os

import numpy as np
import pytest
import typer

import gfimu
from gfimu.base import MemoryLimit, with_memory
from gfimu.commands import program
from gfimu.recording import write_columns
from sim.scenarios import Scenario
from sim.simulation import memory_of
from tests.gfimu.calibration.certificate.stage.stage_cases import calibration_of

CALLS = {
    "calibrate": "multi-position run.parquet --array cube12 --out cal.json",
    "certificate": "cal.json --array cube12 --rest run.parquet",
    "check": "run.parquet --twin cube12_turntable",
    "convert": "run.parquet run.csv",
    "design": "bias scale_factor --run run.parquet --twin cube12_turntable",
    "diagnose": "run.parquet --twin cube12_turntable --out diagnosis",
    "drift": "run.parquet",
    "estimate": "run.parquet --out estimate.csv",
    "impact": "run.parquet",
    "inspect": "run.parquet",
    "join": "small.parquet run.parquet --out joined.csv",
    "live": "--from run.parquet",
    "noise": "run.parquet",
    "show": "run.parquet",
    "simulate": "rest --out run.csv --set duration_s=400",
    "start": "run.parquet --array cube12 --rig table --out begun",
    "view": "run.parquet --out run.rrd",
}
NEEDS = 8 * 13 * 40_000  # bytes of the recording


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("memory")
    array = gfimu.AccelerometerArray.load("cube12")
    for name, rows in {"run": 40_000, "small": 100}.items():
        columns = {"t_s": np.arange(rows) / 100.0} | {f"{one}_m_s2": np.ones(rows) for one in array.channels}
        write_columns(folder / f"{name}.parquet", columns, {"array": "cube12", "array_toml": array.to_toml()})
    calibration_of("six-position").save(folder / "cal.json")
    return folder


def test_the_calls_are_those_of_all_commands_with_the_option():
    commands = typer.main.get_command(program()).commands
    having = {name for name, one in commands.items() if any("--max-memory" in param.opts for param in one.params)}
    assert having == set(CALLS)


@pytest.mark.parametrize("command", CALLS)
def test_a_command_keeps_to_the_memory_that_it_is_given(gfimu_command, folder, monkeypatch, command):
    monkeypatch.chdir(folder)
    result = gfimu_command(command, *CALLS[command].split(), "--max-memory", "4MB")
    assert result.code == 2
    assert "the limit is 4 MB; --max-memory" in result.stderr
    assert result.stderr.count("\n") == 1


def test_the_limit_of_a_command_from_both_sides(gfimu_command, folder, monkeypatch):
    monkeypatch.chdir(folder)
    assert gfimu_command("convert", "run.parquet", "out.csv", "--max-memory", str(NEEDS - 1)).code == 2
    assert gfimu_command("convert", "run.parquet", "out.csv", "--max-memory", str(NEEDS)).code == 0
    assert "no size" in gfimu_command("convert", "run.parquet", "out.csv", "--max-memory", "much").stderr


def test_the_shipped_scenarios_are_simulated_in_little_memory():
    for name in gfimu.catalogue("scenarios"):
        MemoryLimit.of_work(with_memory(name, "500MB")).needs(memory_of(Scenario.load(name)))


def test_a_run_may_take_half_of_the_machine(gfimu_command, folder, monkeypatch):
    monkeypatch.chdir(folder)
    pages = {"SC_PAGE_SIZE": 4096, "SC_PHYS_PAGES": 1_000_000}
    monkeypatch.setattr(os, "sysconf", pages.__getitem__)
    long = ["simulate", "paper_run", "--set", "duration_s=20000", "--set", "sample_rate_hz=1000", "--out", "run.csv"]
    result = gfimu_command(*long)
    assert result.code == 2
    assert "needs about 24 GB, the limit is 2 GB; --max-memory 25GB is enough" in result.stderr
