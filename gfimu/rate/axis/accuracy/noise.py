"""What the noise of an array's channels at rest means for a rotation about a known axis."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Annotated

import numpy as np

from gfimu.array.array import AccelerometerArray
from gfimu.array.turning_axis import TurningAxis
from gfimu.base.declared import Table, figure, figures
from gfimu.base.errors import InputError
from gfimu.rate.axis.accuracy.bounds import AxisBounds, axis_bounds, require_visible
from gfimu.sensor_noise import RecordingNoise

__all__ = ["AxisNoise", "NoiseAboutAxis", "axis_noise"]


@dataclass(frozen=True)
class AxisNoise(AxisBounds):
    """Bounds by the white noise of the channels at rest, and what their bias instability adds."""

    instability_std: Annotated[
        float,
        figure(
            "Standard deviation of the rate by the bias instability of the channels, taken as independent constants; "
            "null: one sample can't show the rate.", "rad/s",
            head="σ_Ω by bias instability", form=".3g", key="sigma_rate_by_instability_rad_s",
        ),
    ] = np.inf  # fmt: skip


@dataclass(frozen=True)
class NoiseAboutAxis(RecordingNoise):
    """Noise of a recording at rest, and what it means for a rotation about a known axis."""

    about_axis: Annotated[
        AxisNoise, figure("What the noise means for a rotation about the known axis.", before="unit")
    ] = field(kw_only=True)

    def shown(self) -> Iterator[Table]:
        """Yield the tables that people read."""
        yield from super().shown()
        yield figures(
            "Rotation about the known axis, 1 σ",
            self.about_axis,
            note="—: one sample can't show it. How angle and rate run off with time: gfimu drift --axis.",
        )


def axis_noise(
    noise: RecordingNoise, array: AccelerometerArray, axis: TurningAxis, *, rate_rad_s: float
) -> NoiseAboutAxis:
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
    about = AxisNoise(**vars(white), instability_std=slow.sample_std)
    return NoiseAboutAxis(**vars(noise), about_axis=about)
