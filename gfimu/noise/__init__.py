"""Noise of accelerometers: Allan deviation, identification of its terms, synthesis, export."""

from __future__ import annotations

from gfimu.noise.allan import AllanDeviation, allan_deviation
from gfimu.noise.identification import NoiseModel, identify_noise
from gfimu.noise.kalibr import kalibr_yaml
from gfimu.noise.recording_noise import RecordingNoise, recording_noise
from gfimu.noise.synthesis import flicker_noise, random_walk, synthesise_noise, white_noise

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
