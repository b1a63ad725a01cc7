"""What the noise of an array's channels at rest means for a rotation about a known axis."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from gfimu.errors import InputError
from gfimu.geometry.array import AccelerometerArray
from gfimu.geometry.turning_axis import TurningAxis
from gfimu.known_axis.accuracy.bounds import AxisBounds, axis_bounds, require_visible
from gfimu.sensor_noise import RecordingNoise

__all__ = ["AxisNoise", "axis_noise"]


@dataclass(frozen=True)
class AxisNoise:
    """What the noise of the channels means for a rotation about a known axis.

    Parameters
    ----------
    bounds : AxisBounds
        Standard deviations by the white noise, at one rate.
    instability_rate_std : float
        Standard deviation of the rate by the bias instability of the channels, taken as independent constants, rad/s;
        infinite where one sample can't show the rate.
    """

    bounds: AxisBounds
    instability_rate_std: float

    def to_dict(self) -> dict[str, Any]:
        """Return the figures as JSON holds them."""
        return {**self.bounds.to_dict(), "sigma_rate_by_instability_rad_s": self.instability_rate_std}


def axis_noise(noise: RecordingNoise, array: AccelerometerArray, axis: TurningAxis, *, rate_rad_s: float) -> AxisNoise:
    """Return what the noise of the channels means for a rotation about a known axis.

    Parameters
    ----------
    noise : RecordingNoise
        Noise of the channels, in m/s².
    array : AccelerometerArray
        The array.
    axis : TurningAxis
        The axis.
    rate_rad_s : float
        Rate at which the figures hold, rad/s.

    Raises
    ------
    InputError
        If the noise is in counts.
    GeometryError
        If the array can't see the rotation.
    """
    if noise.unit != "m_s2":
        raise InputError("the readings are counts: a rate needs them in m/s²; give a calibration, or an array's part")
    require_visible(array, axis)
    white, slow = (
        axis_bounds(array, axis, rate_rad_s=rate_rad_s, noise_std=std, sample_rate_hz=noise.rate)
        for std in (noise.sample_std(array.channels), noise.instability(array.channels))
    )
    return AxisNoise(white, slow.sample_std)
