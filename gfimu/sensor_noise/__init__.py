"""Noise of accelerometers.

In: a recording at rest, or the coefficients of a data sheet.
Out: Allan deviation, N, B and K with their spread (`NoiseModel`), noise per channel, synthetic noise.
"""

from typing import TYPE_CHECKING

from gfimu.base.lazy_names import declared_names

if TYPE_CHECKING:
    from gfimu.sensor_noise.allan import AllanDeviation as AllanDeviation
    from gfimu.sensor_noise.allan import allan_deviation as allan_deviation
    from gfimu.sensor_noise.identification import NoiseModel as NoiseModel
    from gfimu.sensor_noise.identification import identify_noise as identify_noise
    from gfimu.sensor_noise.identification import model_variance as model_variance
    from gfimu.sensor_noise.innovations import add_noise as add_noise
    from gfimu.sensor_noise.innovations import flicker_shape as flicker_shape
    from gfimu.sensor_noise.kalibr import kalibr_yaml as kalibr_yaml
    from gfimu.sensor_noise.recording_noise import RecordingNoise as RecordingNoise
    from gfimu.sensor_noise.recording_noise import recording_noise as recording_noise
    from gfimu.sensor_noise.synthesis import flicker_noise as flicker_noise
    from gfimu.sensor_noise.synthesis import random_walk as random_walk
    from gfimu.sensor_noise.synthesis import synthesise_noise as synthesise_noise
    from gfimu.sensor_noise.synthesis import white_noise as white_noise
else:
    __getattr__, __dir__, __all__ = declared_names(__name__)
