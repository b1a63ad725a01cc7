"""What is hidden in a world, a firmware or its board, and no frame reports, is found and named by the diagnosis."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("unicorn", reason="the emulator is in the extra 'firmware'")

from firmware_bridge import Adxl345Options, build, record_virtual
from gfimu import Diagnosis
from gfimu.diagnosis import diagnose
from gfimu.recording import Recording
from sim.ride import Ride
from sim.scenarios import Scenario
from sim.twin import Twin

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
  { kind = "sine", amplitude_rad_s = 6.0, frequency_hz = 0.8, duration_s = {swing_s} },
  { kind = "hold", duration_s = 2.0 },
]
[sensor]
errors = false
[reference]
tacho_noise_std_rad_s = 0.005
"""


SKEWED = {"GFIMU_CHIP_GAP_US": "2000U", "GFIMU_BOOT_BAUD": "460800U"}
"""2 ms between two chips leave little time for the line: at 115,200 baud a fifth of the frames would find no room."""

SKEW_S = 2.02e-3  # the pause and the 16 µs of a read


def swinging(folder: Path, seed: int, *, duration_s: float = 24.0, effect: str = "") -> Ride:
    scenario = folder / "swinging.toml"
    scenario.write_text(SWINGING.replace("{swing_s}", f"{duration_s - 4.0:.1f}") + effect)
    return Ride(scenario, seed=seed)


def skewed(folder: Path) -> Path:
    pytest.importorskip("ziglang", reason="the C compiler is in the extra 'firmware'")
    return build("gfimu", folder, defines=SKEWED).elf


def diagnosed(recording: Recording, folder: Path, *, full_resolution: bool = True) -> Diagnosis:
    twin = folder / "twin.toml"
    twin.write_text(TWIN.format(full=str(full_resolution).lower()))
    return diagnose([recording], Twin.load(twin))


@dataclass(frozen=True)
class Hidden:
    """An effect, where it is hidden, and its true size."""

    effect: str
    size: dict[str, float]
    in_world: bool = False
    in_image: bool = False
    asked: dict[str, Any] = field(default_factory=dict)


HIDDEN = (
    Hidden("table_tilt", {"x_rad": 0.004, "y_rad": -0.002}, in_world=True),
    Hidden("channel_skew", {"per_chip_s": SKEW_S}, in_image=True, asked={"rate_code": 12}),
    Hidden("coarse_resolution", {"step_m_s2": 8 * 0.0039 * 9.80665}, asked={"full_resolution": False}),
)


@pytest.mark.parametrize("hidden", HIDDEN, ids=lambda hidden: hidden.effect)
def test_what_is_hidden_is_named_alone_and_with_its_size(tmp_path: Path, hidden: Hidden) -> None:
    """In the world (mechanical), in the image's timing, and in the format that the chips are set to."""
    values = ", ".join(f"{key} = {value}" for key, value in hidden.size.items())
    effect = f'[[effect]]\nname = "{hidden.effect}"\nparameters = {{ {values} }}\n' if hidden.in_world else ""
    image = skewed(tmp_path) if hidden.in_image else "gfimu"
    run = record_virtual(
        swinging(tmp_path, 1, duration_s=14.0, effect=effect), 14.0, rate_hz=100, image=image, **hidden.asked
    )
    found = diagnosed(run.recording, tmp_path)
    assert found.verdict == "explained"
    (cause,) = found.causes
    assert cause.effect == hidden.effect
    for key, true in hidden.size.items():
        assert cause.parameters[key] == pytest.approx(true, rel=1e-6, abs=3.0 * cause.std.get(key, 0.0))


def test_nothing_is_found_on_a_board_where_nothing_is_hidden(tmp_path: Path) -> None:
    run = record_virtual(swinging(tmp_path, 1, duration_s=14.0), 14.0, rate_hz=100)
    assert diagnosed(run.recording, tmp_path).verdict == "nothing_found"


def paper_run() -> Ride:
    return Ride(Scenario.load("paper_run", changes=["sensor.errors=false"]), seed=1)


@pytest.mark.study
def test_a_chip_left_in_another_range(tmp_path: Path) -> None:
    chips = [Adxl345Options(phase=0.2 * k, stuck_range=0 if k == 2 else None) for k in range(4)]
    run = record_virtual(paper_run(), 30.0, rate_hz=100, full_resolution=False, chips=chips)
    found = diagnosed(run.recording, tmp_path, full_resolution=False)
    cause = next(cause for cause in found.causes if cause.effect == "wrong_range")
    assert cause.parameters["chip"] == "a3"
    assert cause.parameters["factor"] == pytest.approx(8.0)


@pytest.mark.study
def test_interrupts_dropped_now_and_then(tmp_path: Path) -> None:
    run = record_virtual(paper_run(), 30.0, rate_hz=100, lose_every=40)
    found = diagnosed(run.recording, tmp_path)
    assert "dropped_frames" in [cause.effect for cause in found.causes]


@pytest.mark.study
@pytest.mark.parametrize("seed", [1, 22])
def test_chips_read_one_after_another(tmp_path: Path, seed: int) -> None:
    run = record_virtual(swinging(tmp_path, seed), 24.0, rate_hz=100, rate_code=12, image=skewed(tmp_path))
    found = diagnosed(run.recording, tmp_path)
    assert [cause.effect for cause in found.causes] == ["channel_skew"]
    assert found.causes[0].parameters["per_chip_s"] == pytest.approx(SKEW_S, abs=1.5e-4)


@pytest.mark.study
@pytest.mark.parametrize(("seed", "rate", "code"), [(1, 100, 255), (1, 100, 12), (13, 400, 255)])
def test_nothing_is_found_where_nothing_is_hidden(tmp_path: Path, seed: int, rate: int, code: int) -> None:
    """Chips whose clocks differ by half a percent: the ages of their readings sweep through a period."""
    run = record_virtual(swinging(tmp_path, seed), 24.0, rate_hz=rate, rate_code=code)
    assert diagnosed(run.recording, tmp_path).verdict == "nothing_found"
