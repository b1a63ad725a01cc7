"""Figures of a diagnosis report, as SVG text; dense lines are pictures inside it, so that files stay small."""

from __future__ import annotations

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray
from scipy.ndimage import uniform_filter1d

from gfimu.array.array import AccelerometerArray
from gfimu.array.turning_axis import TurningAxis
from gfimu.base.results.colours import (
    AFTER_ON_PAPER,
    BEFORE_ON_PAPER,
    INK,
    NOISE_ON_PAPER,
    PALE,
    css,
)
from gfimu.diagnosis.criticism.views.error_form import ErrorForm
from gfimu.diagnosis.criticism.views.residual_spectrum import ResidualSpectrum
from gfimu.diagnosis.criticism.views.residuals import ResidualSize, Whiteness
from gfimu.diagnosis.criticism.views.run_view import RunView
from gfimu.diagnosis.verdict.parts import FunctionTable
from gfimu.visual.page import PlotLimits
from gfimu.visual.page.svg import ON_PAGE, svg_text
from gfimu.visual.rig.figure import Marked, array_figure, channel_style
from gfimu.visual.rig.words import short_name

__all__ = [
    "channels_figure",
    "form_figure",
    "function_figure",
    "marked_figure",
    "measured_figure",
    "rig_figures",
    "spectrum_figure",
    "trace_figure",
    "whiteness_figure",
]

_BEFORE, _AFTER = css(BEFORE_ON_PAPER), css(AFTER_ON_PAPER)
_NOISE, _INK, _PALE = css(NOISE_ON_PAPER), css(INK), css(PALE)
_LIMITS = PlotLimits()
_MANY = 24  # channels, of more of which pictures are coarser so that the page stays small
_MOST_POINTS = 4000
_MOST_FREQUENCIES = 1200
_COARSE_DPI = 55
_QUANTITIES = {
    "rad/s": "rate",
    "rad/s²": "angular acceleration",
    "rad": "angle",
    "s": "time",
    "°C": "temperature",
    "K/s": "warming",
}
_VIEW = (4.4, 2.4)  # inches: letters are legible where a view is as narrow as a telephone


def trace_figure(run: RunView, size: ResidualSize) -> str:
    """Draw the residual of the channel that was worst, before and after."""
    with mpl.rc_context(ON_PAGE):
        figure = Figure(figsize=(11.0, 3.0), layout="constrained")
        axis = figure.subplots()
        worst = size.furthest[0]
        _trace(axis, run, worst, size.floor[worst])
        axis.set_title(f"measured − predicted, channel {size.channels[worst]}", loc="left", fontsize=10.5)
        axis.set_ylabel("m/s²")
        axis.set_xlabel("time, s")
        _legend_above(axis)
        return svg_text(figure)


def measured_figure(run: RunView, size: ResidualSize) -> str:
    """Draw the channels furthest above their noise, measured and predicted, some seconds about the largest error."""
    period = float(np.median(np.diff(run.t))) if len(run.t) > 1 else 1.0
    worst = size.furthest[: _LIMITS.compared]
    errors = np.where(run.valid, run.measured - run.before, 0.0)[:, worst] / size.floor[worst]  # (n, 2)
    width = max(round(_LIMITS.compared_s / period), 1)
    power = uniform_filter1d(np.nan_to_num(errors**2).sum(axis=1), width, mode="constant")
    middle = run.t[int(np.argmax(power))]
    near = np.abs(run.t - middle) <= 0.5 * _LIMITS.compared_s
    with mpl.rc_context(ON_PAGE):
        figure = Figure(figsize=(_VIEW[0], _VIEW[1] * (1 + len(worst)) / 2), layout="constrained")
        axes = figure.subplots(len(worst), 1, sharex=True, squeeze=False)[:, 0]
        for channel, axis in zip(worst, axes, strict=True):
            seen = np.where(run.valid[near, channel], run.measured[near, channel], np.nan)
            axis.plot(run.t[near], seen, ".", color=_INK, markersize=2.0, label="measured", rasterized=True)
            for one, colour, label in ((run.before, _BEFORE, "as given"), (run.after, _AFTER, "extended")):
                axis.plot(run.t[near], one[near, channel], color=colour, linewidth=1.2, label=label)
            axis.set_ylabel(f"{short_name(size.channels[channel])}, m/s²")
        axes[-1].set_xlabel("time, s")
        _legend_above(axes[0])
        return svg_text(figure)


def channels_figure(run: RunView, size: ResidualSize, array: AccelerometerArray) -> str:
    """Draw the residual of every channel over time on one scale."""
    count = len(size.channels)
    columns = 3 if count % 3 == 0 else 4
    rows = -(-count // columns)
    with mpl.rc_context(ON_PAGE):
        figure = Figure(figsize=(11.0, 1.35 * rows + 0.4), layout="constrained")
        axes = figure.subplots(rows, columns, sharex=True, sharey=True, squeeze=False)
        for channel, axis in enumerate(axes.flat):
            if channel >= count:
                axis.set_axis_off()
                continue
            _trace(axis, run, channel, size.floor[channel])
            axis.set_title(
                short_name(size.channels[channel]),
                loc="left",
                fontsize=9,
                pad=2,
                color=channel_style(array, channel)[0],
            )
        for axis in axes[:, 0]:
            axis.set_ylabel("m/s²")
        for axis in axes[-1]:
            axis.set_xlabel("time, s")
        return svg_text(figure, _COARSE_DPI if count > _MANY else None)


def marked_figure(
    array: AccelerometerArray,
    axis: TurningAxis | None,
    gravity: NDArray[np.float64] | None,
    gravity_name: str,
    marked: Marked,
) -> str:
    """Draw the array from the side, with the places of what was found."""
    with mpl.rc_context(ON_PAGE):
        drawn = array_figure(
            array, axis=axis, gravity=gravity, gravity_name=gravity_name, views=("side",), marked=marked
        )
        return svg_text(drawn)


def rig_figures(
    array: AccelerometerArray, axis: TurningAxis | None, gravity: NDArray[np.float64] | None, gravity_name: str
) -> tuple[str, str]:
    """Draw the array with its chips, sensing axes, gravity and axis of rotation, from the side and from above."""
    with mpl.rc_context(ON_PAGE):
        side, above = (
            svg_text(array_figure(array, axis=axis, gravity=gravity, gravity_name=gravity_name, views=(view,)))
            for view in ("side", "above")
        )
    return side, above


def form_figure(form: ErrorForm) -> str:
    """Draw the residual of a channel over a quantity, and what the extended simulation makes of it."""
    with mpl.rc_context(ON_PAGE):
        figure = Figure(figsize=_VIEW, layout="constrained")
        axis = figure.subplots()
        axis.axhline(0.0, color=_NOISE, linewidth=0.6)
        axis.errorbar(
            form.at, form.mean, 2.0 * form.std, color=_BEFORE, fmt="o", markersize=3.5, linewidth=0.9,
            label="measured − given simulation, ±2σ",
        )  # fmt: skip
        axis.plot(form.at, form.form, color=_AFTER, linewidth=1.3, label="extended simulation")
        axis.set_xlabel(f"{form.symbol}, {form.unit}")
        axis.set_ylabel(f"{short_name(form.channel)}, m/s²")
        axis.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=2, fontsize=8, handlelength=1.2, borderpad=0)
        return svg_text(figure)


def function_figure(function: FunctionTable, what: str) -> str:
    """Draw an unknown function of an error, such as an offset, with its band of ±2σ."""
    x, f, std = (np.array(column) for column in (function.x, function.f, function.std))
    with mpl.rc_context(ON_PAGE):
        figure = Figure(figsize=_VIEW, layout="constrained")
        axis = figure.subplots()
        axis.axhline(0.0, color=_NOISE, linewidth=0.6)
        axis.fill_between(x, f - 2.0 * std, f + 2.0 * std, color=_PALE, alpha=0.8, linewidth=0)
        axis.plot(x, f, color=_BEFORE, linewidth=1.3)
        axis.set_xlabel(f"{_QUANTITIES.get(function.x_unit, 'of')}, {function.x_unit}")
        axis.set_ylabel(what if function.unit == "1" else f"{what}, {function.unit}")
        return svg_text(figure)


def spectrum_figure(spectrum: ResidualSpectrum) -> str:
    """Draw a spectrum before and after against noise."""
    with mpl.rc_context(ON_PAGE):
        figure = Figure(figsize=_VIEW, layout="constrained")
        axis = figure.subplots()
        group = max(1, len(spectrum.at) // _MOST_FREQUENCIES)
        starts = np.arange(0, len(spectrum.at), group)
        axis.plot(spectrum.at[starts], spectrum.noise[starts], color=_NOISE, linestyle="--", label="noise")
        for values, colour, label in ((spectrum.before, _BEFORE, "before"), (spectrum.after, _AFTER, "after")):
            peaks = np.maximum.reduceat(values, starts)  # a line must not vanish between the points drawn
            axis.plot(spectrum.at[starts], peaks, color=colour, linewidth=0.9, label=label)
        axis.set_yscale("log")
        if spectrum.unit == "Hz":
            axis.set_xscale("log")
        else:
            axis.set_xlim(0, float(spectrum.at[-1]))
        axis.set_xlabel("frequency, Hz" if spectrum.unit == "Hz" else spectrum.unit)
        axis.set_ylabel(spectrum.quantity)
        _legend_above(axis)
        return svg_text(figure)


def whiteness_figure(whiteness: Whiteness) -> str:
    """Draw the cumulative periodogram of every channel: noise gives the diagonal."""
    with mpl.rc_context(ON_PAGE):
        figure = Figure(figsize=_VIEW, layout="constrained")
        pair = figure.subplots(1, 2, sharey=True)
        frequency = whiteness.frequency
        step = max(1, len(frequency) // 400)
        band = 1.95 / np.sqrt(len(frequency))  # of the Kolmogorov distribution, 1 in 1000
        for axis, curves, colour, title in (
            (pair[0], whiteness.cumulative_before, _BEFORE, "before"),
            (pair[1], whiteness.cumulative_after, _AFTER, "after"),
        ):
            ends, line = frequency[[0, -1]], np.array([0.0, 1.0])
            axis.fill_between(ends, line - band, line + band, color=_PALE, alpha=0.6, linewidth=0)
            axis.plot(frequency[::step], curves[::step], color=colour, linewidth=0.8, rasterized=True)
            axis.set_title(title, loc="left", fontsize=9.5, pad=3)
            axis.set_xlabel("frequency, Hz")
            axis.set_ylim(0, 1)
        pair[0].set_ylabel("share of the power below")
        return svg_text(figure)


def _trace(axis: Axes, run: RunView, channel: int, floor: float) -> None:
    """Residual of one channel over time: samples pale, their moving mean strong, noise as a band of ±2σ."""
    period = float(np.median(np.diff(run.t))) if len(run.t) > 1 else 1.0
    for prediction, colour, label, order in ((run.before, _BEFORE, "before", 1.2), (run.after, _AFTER, "after", 1.3)):
        residual = np.where(run.valid[:, channel], run.measured[:, channel] - prediction[:, channel], np.nan)
        t, shown = _thinned(run.t, residual)
        axis.plot(t, shown, color=colour, linewidth=0.5, alpha=0.3, rasterized=True, zorder=order)
        mean = _moving_mean(residual, max(round(_LIMITS.smooth_s / period), 1))
        t, shown = _thinned(run.t, mean)
        axis.plot(t, shown, color=colour, linewidth=1.1, label=label, rasterized=True, zorder=order + 0.2)
    # Below the frame of the axes (2.5) and side by side in depth: all samples become one picture.
    axis.axhspan(-2 * floor, 2 * floor, color=_PALE, alpha=0.55, linewidth=0, label="noise, ±2σ", zorder=1)
    axis.margins(x=0.01)


def _moving_mean(values: NDArray[np.float64], width: int) -> NDArray[np.float64]:
    """Mean over a window of the valid samples in it, NaN where there are none."""
    valid = np.isfinite(values)
    total = uniform_filter1d(np.where(valid, values, 0.0), width, mode="constant")
    share = uniform_filter1d(valid.astype(float), width, mode="constant")
    return np.where(share > 0.5 / width, total / np.maximum(share, 1e-12), np.nan)


def _thinned(t: NDArray[np.float64], values: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Lowest and highest value of each group of samples, so that a long run keeps its outline."""
    group = -(-2 * len(t) // _MOST_POINTS)
    if group < 3:
        return t, values
    whole = len(t) // group * group
    blocks = values[:whole].reshape(-1, group)
    blocks = np.where(np.isfinite(blocks), blocks, np.nan)
    ends = np.column_stack([np.fmin.reduce(blocks, axis=1), np.fmax.reduce(blocks, axis=1)]).ravel()
    return np.repeat(t[:whole:group], 2), ends


def _legend_above(axis: Axes) -> None:
    legend = axis.legend(
        loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=3, fontsize=8.5, handlelength=1.2, borderpad=0
    )
    for line in legend.get_lines():
        line.set_linewidth(2.0)
