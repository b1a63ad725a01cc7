"""Noise of accelerometers.

In: a recording at rest, or the coefficients of a data sheet.
Out: Allan deviation, N, B and K with their spread (`NoiseModel`), noise per channel, synthetic noise.
"""

from __future__ import annotations

from gfimu.sensor_noise.allan import AllanDeviation, allan_deviation
from gfimu.sensor_noise.identification import NoiseModel, identify_noise
from gfimu.sensor_noise.kalibr import kalibr_yaml
from gfimu.sensor_noise.recording_noise import RecordingNoise, recording_noise
from gfimu.sensor_noise.synthesis import flicker_noise, random_walk, synthesise_noise, white_noise

__all__ = [
    "AllanDeviation",
    "NoiseModel",
    "RecordingNoise",
    "allan_deviation",
    "flicker_noise",
    "identify_noise",
    "kalibr_yaml",
    "random_walk",
    "recording_noise",
    "synthesise_noise",
    "white_noise",
]
