"""What a recording of the board says of its chips' conversions, against when the emulated chips did convert."""

from __future__ import annotations

from dataclasses import dataclass
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

pytest.importorskip("unicorn", reason="the emulator is in the extra 'firmware'")

from firmware_bridge import RATE_CODE_AUTO, Adxl345Options, Identity, record_virtual
from gfimu import AccelerometerArray
from gfimu.base import STANDARD_GRAVITY
from gfimu.recording import conversion_times
from sim import SensorErrors

LARGEST = 15.9 * STANDARD_GRAVITY
CHIPS = [Adxl345Options(clock_error=error, phase=0.3) for error in (4e-3, -6e-3, 2e-3, -5e-4)]


@dataclass
class Sawtooth:
    """A specific force that rises with time, over and over: a reading says when it was converted.

    The tachometer reads the time itself.
    """

    frequency: float
    seed: int = 1
    lsb: float = STANDARD_GRAVITY / 256.0
    noise_factor: float = 1.0
    bias_walk: float = 0.0

    @property
    def array(self) -> AccelerometerArray:
        return AccelerometerArray.load("cube12")

    @property
    def metadata(self) -> dict[str, Any]:
        return {}

    def force(self, t: NDArray[np.float64]) -> NDArray[np.float64]:
        return np.repeat(LARGEST * (2.0 * ((t * self.frequency) % 1.0) - 1.0)[:, None], 12, axis=1)

    def temperature(self, t: NDArray[np.float64]) -> NDArray[np.float64]:
        return np.full(len(t), 25.0)

    def sensor(self, output_data_rate: float) -> Any:
        return SimpleNamespace(errors=SensorErrors.none(12), noise_std=np.zeros(12))

    def conversion_offsets(self, output_data_rate: float) -> NDArray[np.float64]:
        return np.zeros(1)

    def references(self, t: NDArray[np.float64]) -> dict[str, NDArray[np.float64]]:
        return {"tacho_rad_s": t}


def errors_of(rate: int, code: int) -> NDArray[np.float64]:
    """Return by how much the stated times of the conversions are late (n, 4), s, without means across a tooth."""
    scene = Sawtooth(rate / 10.0)
    recording = record_virtual(scene, 8.0, rate_hz=rate, rate_code=code, chips=CHIPS).recording
    turn = recording.readings[:, ::3] / (2.0 * LARGEST) + 0.5  # of the tooth, (n, 4)
    stated = conversion_times(recording, 4).times - recording.t_s[:, None]
    seconds = recording.reference["tacho_rad_s"][:, None] + stated
    late = ((seconds * scene.frequency - turn + 0.5) % 1.0 - 0.5) / scene.frequency
    return np.where(np.abs(late) < 1.0 / rate, late, np.nan)


@pytest.mark.parametrize("rate", [100, 800])
def test_in_pace_every_conversion_has_its_time(rate: int) -> None:
    late = errors_of(rate, RATE_CODE_AUTO)[20:]
    assert np.isnan(late).mean() < 0.02
    assert np.abs(np.nanmedian(late, axis=0)).max() < 60e-6
    assert np.nanstd(late, axis=0).max() < 0.02 / rate


def test_the_newest_conversion_has_its_mean_age() -> None:
    late = errors_of(100, 12)  # chips at 400 Hz
    assert np.nanmax(np.abs(late)) < 1.25e-3 + 60e-6
    assert np.abs(np.nanmean(late, axis=0)).max() < 0.3e-3  # the phases of the clocks pass through all within minutes


def test_an_identity_says_which_firmware_keeps_pace() -> None:
    def stated(firmware: str, rate_hz: int, code: int) -> dict[str, Any]:
        present = (True,) * 4
        return Identity(firmware, 0, rate_hz, code, 11, 115_200, present, "power-on", True, 5000, 0).conversions

    assert stated("1.2.0", 100, 10) == {
        "output_data_rate_hz": 100.0, "read_spacing_s": 16e-6, "paced_status_bits": [4, 5, 6, 7],
    }  # fmt: skip
    assert "paced_status_bits" in stated("1.2.0", 91, 10)
    assert "paced_status_bits" not in stated("1.2.0", 90, 10)
    assert "paced_status_bits" not in stated("1.2.0", 100, 12)
    assert "paced_status_bits" not in stated("1.1.0", 100, 10)
