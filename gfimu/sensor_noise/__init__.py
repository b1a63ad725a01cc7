"""Noise of accelerometers.

In: a recording at rest, or the coefficients of a data sheet.
Out: Allan deviation, N, B and K with their spread (`NoiseModel`), noise per channel, synthetic noise.
"""

from typing import TYPE_CHECKING

from gfimu.base.lazy_names import declared_names
from gfimu.sensor_noise.recording_noise import recording_noise  # at once: later its own module would hide it

if TYPE_CHECKING:
    from gfimu.sensor_noise.allan import AllanDeviation, allan_deviation
    from gfimu.sensor_noise.identification import TERMS, NoiseModel, identify_noise, model_variance
    from gfimu.sensor_noise.innovations import add_noise, flicker_shape
    from gfimu.sensor_noise.kalibr import kalibr_yaml
    from gfimu.sensor_noise.recording_noise import RecordingNoise
    from gfimu.sensor_noise.synthesis import flicker_noise, random_walk, synthesise_noise, white_noise
else:
    __getattr__, __dir__, __all__ = declared_names(__name__)
