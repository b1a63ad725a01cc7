"""A run that does not exist yet, and what the estimate about a known axis would reach in it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

import numpy as np

from gfimu.base.declared import Declared, figure
from gfimu.base.errors import InputError

__all__ = ["PredictedEstimate", "PredictedRun"]

_MOST_SAMPLES = 400_000  # numerical: more take too long


@dataclass(frozen=True)
class PredictedRun(Declared):
    """A run that does not exist yet.

    The standard deviation of a free hub's acceleration is by default that of a wheel of a car (Wheel Inertial Dataset).
    The spectral density of the change of α is by default that of a smooth motion, by choice.

    Raises
    ------
    InputError
        If a number is not positive, or the run has too many samples.
    """

    duration_s: Annotated[float, figure("Length; a tenth is rest, another tenth the gain of speed.", "s")] = 60.0
    sample_rate_hz: Annotated[float, figure("Sample rate.", "Hz")] = 100.0
    hub_std_m_s2: Annotated[
        float, figure("Of a free hub: standard deviation of its own acceleration, each direction.", "m/s²")
    ] = 0.7
    jerk_rad2_s5: Annotated[float, figure("Spectral density of the change of α.", "rad²/s⁵")] = 1.0

    def __post_init__(self) -> None:
        for name, value in vars(self).items():
            if not 0.0 < value < np.inf:
                raise InputError(f"{name} is {value!r}; give a number above 0")
        if not 20 <= self.duration_s * self.sample_rate_hz <= _MOST_SAMPLES:
            raise InputError(
                f"{self.duration_s:g} s at {self.sample_rate_hz:g} Hz are {self.duration_s * self.sample_rate_hz:.0f} "
                f"samples; give a run of 20 to {_MOST_SAMPLES}"
            )


@dataclass(frozen=True)
class PredictedEstimate(Declared):
    """Standard deviation of the rate that an estimate about a known axis reaches in the steady part of a run."""

    run: Annotated[PredictedRun, figure("The run.", flat=True)]
    inclination_rad: Annotated[
        float,
        figure("Angle between the axis and the vertical at which it holds.", "rad", head="inclination", form=".3g"),
    ]
    noise_std: Annotated[
        float,
        figure(
            "Standard deviation of the rate by the noise alone, of channels and hub.", "rad/s",
            head="σ_Ω by noise", form=".3g", key="sigma_rate_by_noise_rad_s",
        ),
    ]  # fmt: skip
    mounting_std: Annotated[
        float,
        figure("Standard deviation of the rate by the uncertain mounting alone.", "rad/s",
               key="sigma_rate_by_mounting_rad_s"),
    ]  # fmt: skip
    std: Annotated[
        float,
        figure("Standard deviation of the rate.", "rad/s", head="σ_Ω", form=".3g", key="sigma_rate_rad_s"),
    ]
    undetermined: Annotated[
        tuple[str, ...],
        figure(
            "Combinations of uncertain constants that such a run does not determine, in units of their prior standard "
            "deviations.",
            key="undetermined_combinations_in_prior_std",
        ),
    ]
