"""Faults of a firmware or its board that no frame reports are found and named by the diagnosis."""

from __future__ import annotations

from pathlib import Path

import pytest

pytest.importorskip("unicorn", reason="the emulator is in the extra 'firmware'")

from firmware_bridge.adxl345.registers import Adxl345Options
from firmware_bridge.loop.virtual_run import record_virtual
from firmware_bridge.lpc1768.build import build
from gfimu.diagnosis.diagnose import diagnose
from gfimu.diagnosis.verdict.verdict import Diagnosis
from gfimu.recording import Recording
from sim.ride import Ride
from sim.scenarios import Scenario
from sim.twin import Twin

pytestmark = pytest.mark.study

TWIN = """
array = "cube12"
sample_rate_hz = 100.0
[drive]
source = "tacho"
[sensor]
part = "adxl345"
range_g = 16
full_resolution = {full}
"""


SWINGING = """
name = "swinging"
array = "cube12"
sample_rate_hz = 100.0
[motion]
kind = "profile"
segment = [
  { kind = "hold", duration_s = 2.0 },
  { kind = "sine", amplitude_rad_s = 6.0, frequency_hz = 0.8, duration_s = 20.0 },
  { kind = "hold", duration_s = 2.0 },
]
[sensor]
errors = false
[reference]
tacho_noise_std_rad_s = 0.005
"""


def ride() -> Ride:
    return Ride(Scenario.load("paper_run", changes=["sensor.errors=false"]), seed=1)


def diagnosed(recording: Recording, folder: Path, *, full_resolution: bool = True) -> Diagnosis:
    twin = folder / "twin.toml"
    twin.write_text(TWIN.format(full=str(full_resolution).lower()))
    return diagnose([recording], Twin.load(twin))


def test_a_chip_left_in_another_range(tmp_path: Path) -> None:
    chips = [Adxl345Options(phase=0.2 * k, stuck_range=0 if k == 2 else None) for k in range(4)]
    run = record_virtual(ride(), 30.0, rate_hz=100, full_resolution=False, chips=chips)
    found = diagnosed(run.recording, tmp_path, full_resolution=False)
    cause = next(cause for cause in found.causes if cause.effect == "wrong_range")
    assert cause.parameters["chip"] == "a3"
    assert cause.parameters["factor"] == pytest.approx(8.0)


def test_interrupts_dropped_now_and_then(tmp_path: Path) -> None:
    run = record_virtual(ride(), 30.0, rate_hz=100, lose_every=40)
    found = diagnosed(run.recording, tmp_path)
    assert "dropped_frames" in [cause.effect for cause in found.causes]


# 2 ms between two chips leave little time for the line: at 115,200 baud a fifth of the frames would find no room.
SKEWED = {"GFIMU_CHIP_GAP_US": "2000U", "GFIMU_BOOT_BAUD": "460800U"}


@pytest.mark.parametrize("seed", [1, 22])
def test_chips_read_one_after_another(tmp_path: Path, seed: int) -> None:
    pytest.importorskip("ziglang", reason="the C compiler is in the extra 'firmware'")
    image = build("gfimu", tmp_path, defines=SKEWED).elf
    scenario = tmp_path / "swinging.toml"
    scenario.write_text(SWINGING)
    run = record_virtual(Ride(scenario, seed=seed), 24.0, rate_hz=100, rate_code=12, image=image)
    found = diagnosed(run.recording, tmp_path)
    assert [cause.effect for cause in found.causes] == ["channel_skew"]
    assert found.causes[0].parameters["per_chip_s"] == pytest.approx(2.02e-3, abs=1.5e-4)


@pytest.mark.parametrize(("seed", "rate", "code"), [(1, 100, 255), (1, 100, 12), (13, 400, 255)])
def test_nothing_is_found_where_nothing_is_hidden(tmp_path: Path, seed: int, rate: int, code: int) -> None:
    """Chips whose clocks differ by half a percent: the ages of their readings sweep through a period."""
    scenario = tmp_path / "swinging.toml"
    scenario.write_text(SWINGING)
    run = record_virtual(Ride(scenario, seed=seed), 24.0, rate_hz=rate, rate_code=code)
    assert diagnosed(run.recording, tmp_path).verdict == "nothing_found"
