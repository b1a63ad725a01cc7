"""The form of an error: the residual of the channel that shows most of it, over the quantity that orders it best."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gfimu.diagnosis.criticism.views.run_view import RunView
from gfimu.diagnosis.policy import Policy

__all__ = ["ErrorForm", "error_form"]

_BINS = 30  # numerical: of a picture, each with as many samples
_FEWEST = 5  # numerical: samples of a bin
_DIGITS = 2  # numerical: of a share, in which two quantities order a residual alike


@dataclass(frozen=True)
class ErrorForm:
    """The residual of a channel by bins of a quantity, beside what an extended simulation makes of it.

    Parameters
    ----------
    channel : str
        The channel.
    quantity : str
        The quantity, for people: ``"the rate"``.
    symbol, unit : str
        For the axis.
    at : ndarray, shape (b,)
        Mean of the quantity in each bin.
    mean, std : ndarray, shape (b,)
        Mean residual of the simulation as given, and its standard deviation, m/s².
    form : ndarray, shape (b,)
        What the extended simulation predicts more than the given one, m/s².
    share : float
        Share of the square of the residual that the means hold, 0 to 1.
    """

    channel: str
    quantity: str
    symbol: str
    unit: str
    at: NDArray[np.float64]
    mean: NDArray[np.float64]
    std: NDArray[np.float64]
    form: NDArray[np.float64]
    share: float

    @classmethod
    def of(
        cls,
        named: tuple[str, str, str, str],
        values: NDArray[np.float64],
        residual: NDArray[np.float64],
        added: NDArray[np.float64],
    ) -> ErrorForm:
        """Return the form of a residual (n,) by bins of as many samples each of a quantity's values (n,).

        ``named`` holds the channel, and of the quantity its name, symbol and unit.
        """
        bins = np.array_split(np.argsort(values, kind="stable"), _BINS)
        at, mean, form = (np.array([float(np.mean(one[some])) for some in bins]) for one in (values, residual, added))
        counts = np.array([len(some) for some in bins])
        scatter = np.array([float(np.var(residual[some])) for some in bins])
        share = float(np.sum(counts * mean**2 - scatter)) / float(residual @ residual)
        return cls(*named, at, mean, np.sqrt(scatter / counts), form, share)


def error_form(run: RunView, channels: Sequence[str]) -> ErrorForm | None:
    """Return the form of what an extended simulation takes away; None where no quantity orders it.

    Parameters
    ----------
    run : RunView
        The run.
    channels : sequence of str
        Names of the c channels.
    """
    left, after = (np.where(run.valid, run.measured - one, 0.0) for one in (run.before, run.after))
    gone = np.sum(left**2 - after**2, axis=0)
    channel = int(np.argmax(gone))
    valid = run.valid[:, channel]
    if not gone[channel] > 0.0 or valid.sum() < _BINS * _FEWEST:
        return None
    residual, added = left[valid, channel], (run.after - run.before)[valid, channel]
    forms = [
        ErrorForm.of((channels[channel], name, symbol, unit), values[valid], residual, added)
        for name, symbol, unit, values in _quantities(run, channel)
        if np.isfinite(values[valid]).all() and np.ptp(values[valid]) > 0.0
    ]
    best = max(forms, key=lambda one: round(one.share, _DIGITS), default=None)
    return best if best is not None and best.share > Policy.sizeable else None


def _quantities(run: RunView, channel: int) -> Iterator[tuple[str, str, str, NDArray[np.float64]]]:
    """Yield name, symbol, unit and values (n,) of what a residual may go with; time last."""
    if run.linear:
        yield "the speed", "v", "m/s", run.rate
        yield "the acceleration", "a", "m/s²", run.acceleration
        yield "the place of the carriage", "x", "m", run.angle
    else:
        yield "the rate", "ω", "rad/s", run.rate
        yield "the angular acceleration", "α", "rad/s²", run.acceleration
        yield "the angle within a revolution", "θ", "rad", np.mod(run.angle, 2.0 * np.pi)
    if run.temperature is not None:
        yield "the temperature", "T", "°C", run.temperature
    yield "the channel's own reading", "reading", "m/s²", run.before[:, channel]
    yield "time", "t", "s", run.t - run.t[0]
