"""What the report's plots that zoom hold: residuals over time, and spectra."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gfimu.array.array import AccelerometerArray
from gfimu.diagnosis.criticism.views.residual_spectrum import ResidualSpectrum
from gfimu.diagnosis.criticism.views.residuals import ResidualSize
from gfimu.diagnosis.criticism.views.run_view import RunView
from gfimu.visual.page import Packed, PlotLimits, enveloped
from gfimu.visual.plots import broken_at_gaps

__all__ = ["residual_plot", "spectrum_plot"]

_LIMITS = PlotLimits()


def residual_plot(run: RunView, size: ResidualSize, array: AccelerometerArray, data: Packed) -> dict[str, Any]:
    """Return the plot of every channel's residual over time, before and after.

    A run of up to 900 000 samples, all channels together (12 minutes of 12 channels at 100 Hz), is stored sample by
    sample. Of a longer one each group of samples is stored as its lowest, highest and mean value, so that every peak
    is still there. Values are rounded to an eighth of the noise.

    Parameters
    ----------
    run : RunView
        The run, n samples of c channels.
    size : ResidualSize
        Rms before and after and the noise, by channel.
    array : AccelerometerArray
        Geometry of the channels.
    data : Packed
        Where the columns go.
    """
    count = array.n_channels
    group = _LIMITS.group(run.t.size * count)
    period = float(np.median(np.diff(run.t))) if len(run.t) > 1 else 1.0
    masked = np.where(run.valid, run.measured, np.nan)
    before, after = masked - run.before, masked - run.after
    channels = []
    t, drive = _with_breaks(run.t, run.rate[:, None], group)
    for column, name in enumerate(array.channels):
        noise = float(size.floor[column])
        step = noise / _LIMITS.fineness if np.isfinite(noise) and noise > 0 else _largest(before[:, column]) / 2**12
        pair = np.column_stack([before[:, column], after[:, column]])
        channels.append(
            {
                "name": name,
                "chip": int(array.chip_of_channel[column]),
                "noise": _number(noise),
                "rms": [_number(float(one[column])) for one in (size.before, size.after)],
                **_columns(run.t, pair, group, step, data),
            }
        )
    spacing = period * (1 if group == 1 else group / 2)
    return {
        "kind": "residual",
        "x": {"name": "t", "label": "time, s", "unit": "s", "column": data.add(t, 1e-3 * period, order=2)},
        "unit": "m/s²",
        "grouped": group if group > 1 else 0,
        "smooth": max(round(_LIMITS.smooth_s / spacing), 1),
        "channels": channels,
        "shown": sorted(size.furthest[: _LIMITS.shown_first].tolist()),
        "drive": {
            "label": "speed of the carriage" if run.linear else "rate of rotation",
            "unit": "m/s" if run.linear else "rad/s",
            "column": data.add(drive[:, 0], max(_largest(run.rate) / 2**12, 1e-9), order=1),
        },
    }


def spectrum_plot(spectrum: ResidualSpectrum, data: Packed) -> dict[str, Any]:
    """Return the plot of a spectrum before and after beside that of noise; its decimal logarithms are stored."""
    cycles = spectrum.unit != "Hz"
    lines = {"noise": spectrum.noise, "before": spectrum.before, "after": spectrum.after}
    return {
        "kind": "spectrum",
        "x": {
            "name": "order" if cycles else "f",
            "label": spectrum.unit if cycles else "frequency, Hz",
            "unit": "per revolution" if cycles else "Hz",
            "column": data.add(spectrum.at, float(spectrum.at[-1]) / 2**20, order=2),
            "logarithmic": not cycles,
        },
        "unit": spectrum.quantity.rpartition(", ")[2],
        "label": spectrum.quantity,
        "lines": {name: data.add(_decimal_log(values), 1e-3) for name, values in lines.items()},
    }


def _columns(
    t: NDArray[np.float64], pair: NDArray[np.float64], group: int, step: float, data: Packed
) -> Mapping[str, Any]:
    """Store residuals before and after, (n, 2): the second as its difference to the first, which is smooth."""
    if group == 1:
        _, broken = broken_at_gaps(t, pair)
        return {
            "before": data.add(broken[:, 0], step),
            "change": data.add(broken[:, 1] - broken[:, 0], step, order=1),
        }
    names = ("before", "after")
    found: dict[str, Any] = {}
    for name, values in zip(names, pair.T, strict=True):
        envelope = enveloped(t, values, group)
        found[name] = data.add(envelope.edges, step)
        found[f"mean_{name}"] = data.add(envelope.mean, step, order=1)
    return found


def _with_breaks(
    t: NDArray[np.float64], values: NDArray[np.float64], group: int
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return times and values (n, 1) as they are stored: with a break at every gap, or by groups."""
    if group == 1:
        return broken_at_gaps(t, values)
    envelope = enveloped(t, values[:, 0], group)
    return envelope.t, envelope.mean[:, None]


def _largest(values: NDArray[np.float64]) -> float:
    known = np.abs(values[np.isfinite(values)])
    return float(known.max(initial=0.0))


def _number(value: float) -> float | None:
    return value if np.isfinite(value) else None


def _decimal_log(values: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.log10(np.where(values > 0, values, np.nan))
