"""Export of noise figures as Kalibr's ``imu.yaml``, with its names and units."""

from __future__ import annotations

import numpy as np

from gfimu.base.errors import UnitError
from gfimu.sensor_noise.recording_noise import RecordingNoise

__all__ = ["kalibr_yaml"]


def kalibr_yaml(noise: RecordingNoise) -> str:
    """Return the text of Kalibr's ``imu.yaml``.

    ``accelerometer_noise_density`` is N (m/s²/√Hz) and ``accelerometer_random_walk`` is K (m/s³/√Hz, the same as
    m/s²/√s), each the root mean square over the channels; for a random walk that was not found its upper limit is
    used. Gyro figures are there when the recording has a gyro.

    Parameters
    ----------
    noise : RecordingNoise
        Noise in m/s².

    Raises
    ------
    UnitError
        If the noise is in raw counts.
    """
    if noise.unit != "m_s2":
        raise UnitError("Kalibr needs m/s²; read the recording in m/s², or calibrate it, before exporting")
    groups = [("accelerometer", noise.accelerometers, "m/s^2/sqrt(Hz)", "m/s^3/sqrt(Hz)")]
    if noise.gyros:
        groups.append(("gyroscope", noise.gyros, "rad/s/sqrt(Hz)", "rad/s^2/sqrt(Hz)"))
    lines = []
    for kind, models, density_unit, walk_unit in groups:
        density = np.sqrt(np.mean([model["N"].value ** 2 for model in models.values()]))
        found = all(model["K"].found for model in models.values())
        walks = [model["K"].value if model["K"].found else model["K"].high for model in models.values()]
        note = "" if found else ", not found on every axis: 95 % upper limits used there"
        lines.append(f"{kind}_noise_density: {density:.6e}  # {density_unit}")
        lines.append(f"{kind}_random_walk: {np.sqrt(np.mean(np.square(walks))):.6e}  # {walk_unit}{note}")
    if not noise.gyros:
        lines.append("# the recording has no gyro: add gyroscope_noise_density and gyroscope_random_walk")
    lines += ["rostopic: /imu0", f"update_rate: {noise.rate:.6g}  # Hz"]
    return "\n".join(lines) + "\n"
