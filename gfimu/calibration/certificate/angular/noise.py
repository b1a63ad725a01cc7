"""Noise of an array's angular acceleration: from a recording at rest, or by the data sheets."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from gfimu.array.parts.part import white_noise_std
from gfimu.base.errors import InputError
from gfimu.calibration.certificate.angular.response import Response
from gfimu.recording import Recording
from gfimu.recording.rest import detect_rest
from gfimu.sensor_noise import NoiseModel, recording_noise

__all__ = ["AlphaNoise", "noise_at_rest", "noise_by_data_sheet"]

Floats = NDArray[np.float64]

_SHEET_RATE = 100.0  # Hz, for which the parts state their noise


@dataclass(frozen=True)
class AlphaNoise:
    """Noise of the angular acceleration about x, y, z; a pair is value and standard deviation.

    Parameters
    ----------
    density : ndarray, shape (3, 2)
        N of the Allan deviation, rad/s²/√Hz; its integral, the rate, walks by as many rad/s/√s.
    instability : ndarray, shape (3, 2), or None
        Bias instability, rad/s²; None where nothing was recorded.
    falling : tuple of bool
        Whether the curve of an axis still falls at its end, so that ``instability`` is an upper limit.
    bias : ndarray, shape (3, 2), or None
        Mean over the rest, rad/s².
    source : str
        Where it is from.
    rate_hz : float or None
        Sample rate; None where nothing was recorded.
    """

    density: Floats
    instability: Floats | None
    falling: tuple[bool, ...]
    bias: Floats | None
    source: str
    rate_hz: float | None


def noise_by_data_sheet(found: Response) -> AlphaNoise:
    """Return the noise that the parts' data sheets give, white; they state no bias instability."""
    density = white_noise_std(found.array, _SHEET_RATE) / np.sqrt(_SHEET_RATE)
    of_alpha = np.sqrt(found.alpha_rows**2 @ density**2)
    return AlphaNoise(
        np.column_stack([of_alpha, np.full(3, np.nan)]), None, (False,) * 3, None, "data sheets of the parts", None
    )


def noise_at_rest(found: Response, recording: Recording) -> AlphaNoise:
    """Identify the noise of α in the longest rest of a corrected recording.

    Raises
    ------
    InputError
        If there is no rest, it is too short, or a channel has missing samples in it.
    """
    rest = detect_rest(recording)
    if not len(rest):
        raise InputError("no rest found; noise shows only while nothing moves: record at rest")
    longest = int(np.argmax(rest.lengths))
    part = recording.slice(int(rest.start[longest]), int(rest.stop[longest]))
    alpha = part.for_array(found.array) @ found.alpha_rows.T  # (n, 3)
    names = tuple(f"alpha_{axis}" for axis in "xyz")
    turned = replace(part, readings=alpha, channels=names, reference={}, extra={})
    identified = recording_noise(turned, stretch="all", gyros=False)
    models = [identified.models[name] for name in names]
    instability = np.array([_instability(model) for model in models])
    density = np.array([(model["N"].value, model["N"].std) for model in models])
    length = identified.duration_s
    spread = [np.hypot(model["N"].value / np.sqrt(length), model["B"].value) for model in models]
    return AlphaNoise(
        density,
        instability,
        tuple(int(np.argmin(model.allan.deviation)) == len(model.allan.tau) - 1 for model in models),
        np.column_stack([alpha.mean(axis=0), spread]),
        f"Allan deviation of α over {length:.4g} s at rest",
        identified.rate,
    )


def _instability(model: NoiseModel) -> tuple[float, float]:
    """Return the bias instability by the minimum of the curve, and its standard deviation by the averages in it."""
    tau, _ = model.allan.minimum
    averages = model.allan.n / model.allan.rate / tau
    return model.allan.bias_instability, model.allan.bias_instability / np.sqrt(2.0 * max(averages - 1.0, 1.0))
