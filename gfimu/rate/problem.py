"""What a method for the angular rate is given and what it returns."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from gfimu.array.array import AccelerometerArray
from gfimu.array.linear_solution import LinearSolution
from gfimu.base.short_repr import short_repr
from gfimu.rate.disagreement import Disagreement
from gfimu.rate.result import BodyPath, ChannelReport
from gfimu.rate.sensing import SensorErrors

if TYPE_CHECKING:
    from gfimu.rate.path_start import PathStart
    from gfimu.rate.references import Measured

__all__ = ["RateProblem", "RateSolution"]


@dataclass(frozen=True)
class RateProblem:
    """Readings from which the angular rate is to be found.

    Parameters
    ----------
    array : AccelerometerArray
        The array, with c channels.
    t_s : ndarray, shape (n,)
        Sample times, s, strictly increasing.
    readings : ndarray, shape (n, c)
        Specific force along the channels, m/s²; NaN where one is missing.
    errors : SensorErrors
        Errors of the sensors.
    calibrated : bool
        Whether they are those that a calibration leaves.
    linear : LinearSolution
        The part of α and p that is linear in the readings, and what ω adds to it.
    omega0 : ndarray, shape (3,), or None
        Angular rate at the first sample, body axes, rad/s; None if unknown.
    references : sequence of Measured
        What was measured beside the readings.
    temperature : ndarray, shape (n,), optional
        Temperature of the chips, °C.
    path : PathStart, optional
        Where attitude, velocity and position start.
    levelled : bool
        Whether the biases of the first rest were taken off the readings.
    progress : callable, optional
        Called with the share of the work done so far.
    """

    array: AccelerometerArray
    t_s: NDArray[np.float64]
    readings: NDArray[np.float64]
    errors: SensorErrors
    calibrated: bool
    linear: LinearSolution
    omega0: NDArray[np.float64] | None
    references: Sequence[Measured] = ()
    temperature: NDArray[np.float64] | None = None
    path: PathStart | None = None
    levelled: bool = False
    progress: Callable[[float], object] | None = None

    __repr__ = short_repr


@dataclass(frozen=True)
class RateSolution:
    """Angular rate in body axes and its standard deviation, rad/s, each of shape (n, 3); NaN where not found.

    ``rest`` marks the samples recognised as rest, where the method does that. ``noise_scale`` (n,) is how much larger
    than stated the noise was found, and ``sign_probability`` (n,) how sure the sign of each rate is, where that was
    judged. ``path`` holds attitude, velocity, position, α and p, where the method follows them. ``remarks`` are figures
    and sentences about how it was found, by name, for the estimate's metadata.
    """

    omega: NDArray[np.float64]
    omega_std: NDArray[np.float64]
    rest: NDArray[np.bool_] | None = None
    noise_scale: NDArray[np.float64] | None = None
    sign_probability: NDArray[np.float64] | None = None
    path: BodyPath | None = None
    remarks: Mapping[str, Any] = field(default_factory=dict)

    __repr__ = short_repr

    def sentences(self) -> list[str]:
        """Return what is to be said of the rate in words: disagreeing channels, samples of undecided sign."""
        channels = self.remarks.get("channels", {})
        contradicted = {name: channels.get(name, 0) for name in ("restarts", "samples_without_rate")}
        said = ChannelReport(**contradicted).sentences()
        if self.remarks.get("calibration_biases_contradicted"):
            said.append(
                "the first readings contradict the calibration's biases, so their uncertainty is taken as larger; was "
                "this unit calibrated? calibrate it again (gfimu calibrate)"
            )
        found, judged = self.remarks.get("disagreement"), self.remarks.get("consistency")
        if judged is not None and judged["worst_channel"] is not None:  # one channel is the cause of both, and named
            return said
        said += [] if found is None else Disagreement.from_dict(found).sentences()
        count = self.remarks.get("sign_undecided_samples", 0)
        if count and self.sign_probability is not None:
            said.append(
                f"the sign of the rate is undecided in {count} of {len(self.omega)} samples (probability 0.99 or less, "
                "column omega_sign_probability): there the more probable one is given; a start at rest, faster changes "
                "of the rate or a higher sample rate decide it"
            )
        return said
