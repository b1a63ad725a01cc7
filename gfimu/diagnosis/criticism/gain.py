"""What an extension of the simulation is worth on held-out data."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from gfimu.base.declared import Declared, figure

__all__ = ["Gain"]

_UNKNOWN = float("nan")


@dataclass(frozen=True)
class Gain(Declared):
    """What the extension is worth on validation data; NaN where a number was not estimated.

    ``of_other_recording`` says whether the held-out data are another recording, and not blocks of this one. The share
    counts channels and reference together in units of their noise, each with the drive that suits it best.
    """

    held_out: Annotated[str, figure("Which data these are, in words; empty where none could be held out.")] = ""
    rms_before: Annotated[float, figure("Prediction error before, rms.", "m/s²", key="held_out_rms_before")] = _UNKNOWN
    rms_after: Annotated[float, figure("Prediction error after, rms.", "m/s²", key="held_out_rms_after")] = _UNKNOWN
    share_of_excess_removed: Annotated[
        float, figure("Share of the error beyond noise that is gone: 1 − (after² − floor²)/(before² − floor²).")
    ] = _UNKNOWN
    log_likelihood_per_sample: Annotated[float, figure("Gain of the log likelihood per sample.", "nats")] = _UNKNOWN
    log_likelihood_std: Annotated[float, figure("Its standard error.", "nats")] = _UNKNOWN
    rate_rmse_before: Annotated[
        float,
        figure("Rate of the array against the reference, before.", "rad/s", key="rate_rmse_before_rad_s"),
    ] = _UNKNOWN
    rate_rmse_after: Annotated[
        float, figure("Rate of the array against the reference, after.", "rad/s", key="rate_rmse_after_rad_s")
    ] = _UNKNOWN
    drift_before: Annotated[float, figure("Position drift before.", "m", key="position_drift_before_m")] = _UNKNOWN
    drift_after: Annotated[float, figure("Position drift after.", "m", key="position_drift_after_m")] = _UNKNOWN
    share_std: Annotated[
        float,
        figure(
            "Standard deviation of that share by the noise.",
            key="share_of_excess_removed_std",
            before="log_likelihood_per_sample",
        ),
    ] = _UNKNOWN
    share_in_any_recording: Annotated[
        float,
        figure(
            "The share without terms of absolute time, which another recording has otherwise.",
            before="log_likelihood_per_sample",
        ),
    ] = _UNKNOWN
    of_other_recording: bool = False
