"""What an extension of the simulation is worth on held-out data."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

__all__ = ["Gain"]


@dataclass(frozen=True)
class Gain:
    """What the extension is worth on validation data.

    Parameters
    ----------
    held_out : str
        Which data, in words: another recording, or blocks of this one; empty where none could be held out.
    rms_before, rms_after : float
        Residual rms on them, m/s².
    share_of_excess_removed : float
        1 − (after² − floor²)/(before² − floor²), channels and reference together in units of their noise, each with
        the drive that suits it best; NaN where there was no excess.
    log_likelihood_per_sample, log_likelihood_std : float
        Gain per sample and its standard error.
    rate_rmse_before, rate_rmse_after : float
        Rate of the array against the reference, rad/s.
    drift_before, drift_after : float
        Position drift of the held-out stretch, m.
    share_std : float
        Standard error of ``share_of_excess_removed`` by the noise; NaN where it was not estimated.
    share_in_any_recording : float
        The same share without terms of absolute time, which another recording has otherwise; NaN where nothing can
        be said.
    of_other_recording : bool
        Whether the held-out data are another recording.
    """

    held_out: str = ""
    rms_before: float = float("nan")
    rms_after: float = float("nan")
    share_of_excess_removed: float = float("nan")
    log_likelihood_per_sample: float = float("nan")
    log_likelihood_std: float = float("nan")
    rate_rmse_before: float = float("nan")
    rate_rmse_after: float = float("nan")
    drift_before: float = float("nan")
    drift_after: float = float("nan")
    share_std: float = float("nan")
    share_in_any_recording: float = float("nan")
    of_other_recording: bool = False

    def to_dict(self) -> dict[str, Any]:
        """Return the JSON form of the contract."""
        return {
            "held_out": self.held_out,
            "held_out_rms_before": self.rms_before,
            "held_out_rms_after": self.rms_after,
            "share_of_excess_removed": self.share_of_excess_removed,
            "share_of_excess_removed_std": self.share_std,
            "share_in_any_recording": self.share_in_any_recording,
            "log_likelihood_per_sample": self.log_likelihood_per_sample,
            "log_likelihood_std": self.log_likelihood_std,
            "rate_rmse_before_rad_s": self.rate_rmse_before,
            "rate_rmse_after_rad_s": self.rate_rmse_after,
            "position_drift_before_m": self.drift_before,
            "position_drift_after_m": self.drift_after,
        }
