"""Pictures of a calibration: magnitudes at rest before and after, by pose, and the correlation of the parameters."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from gfimu.base.results import save_figure
from gfimu.base.results.colours import AFTER_ON_PAPER, BEFORE_ON_PAPER, DIVERGING, INK, chip_colour, css
from gfimu.calibration.check_poses import rest_means
from gfimu.calibration.poses import pose_rests
from gfimu.calibration.result import Calibration
from gfimu.recording import Recording
from gfimu.recording.rest import Rest

if TYPE_CHECKING:
    from matplotlib.axes import Axes


from matplotlib.figure import Figure
from matplotlib.ticker import FixedLocator

__all__ = ["calibration_figure", "calibration_picture", "pose_names"]

_MOST_NAMED = 128  # parameters with a name each; of more, the blocks of the chips are named
_PER_LABEL_IN = 0.125  # room for one name, inches: type of 7 points needs 0.1
_LINEAR = 0.005  # m/s²: below it the scale of magnitudes is linear
_NEAR_AXIS = np.cos(np.deg2rad(10.0))
_UNITS = {"lsb": "count", "lsb²": "count²", "m_s2": "m/s²", "rad_s": "rad/s", "1": "ratio", "m": "m", "s": "s"}
_UNITS |= {unit: unit for unit in ("s²/m", "s⁴/m²")}
_KINDS = {
    "M": "M_ij: sensitivity of axis i to input j",
    "b": "b_i: bias",
    "q": "q_i: quadratic coefficient",
    "c": "c_i: cubic coefficient",
    "r": "r_i: position",
    "d": "d: delay",
}


def calibration_picture(path: str | Path, calibration: Calibration, recording: Recording | None = None) -> None:
    """Write the picture of a calibration, as `calibration_figure` draws it; the extension decides the format."""
    save_figure(path, calibration_figure(calibration, recording))


def calibration_figure(calibration: Calibration, recording: Recording | None = None) -> Figure:
    """Draw a calibration.

    Parameters
    ----------
    calibration : Calibration
        The result.
    recording : Recording, optional
        The recording it was made from, to show magnitudes at rest; readings in the calibration's unit.
    """
    count = len(calibration.names)
    side = max(6.0, _PER_LABEL_IN * min(count, _MOST_NAMED) + 1.5)
    rest = None if recording is None or calibration.unit == "rad_s" else pose_rests(recording)
    across = 0.0 if rest is None else max(6.5, 0.2 * len(rest) + 2.5)
    figure = Figure(figsize=(side + across + 1.0, side + 0.8), layout="constrained")
    figure.suptitle(f"Calibration: {calibration.method}, {len(calibration.chips)} triad(s), {count} parameters")
    if rest is None or recording is None:
        _correlation(figure.subplots(), calibration)
        return figure
    parts = np.asarray(figure.subfigures(1, 2, width_ratios=[across, side + 1.0]))
    _correlation(parts[1].subplots(), calibration)
    _magnitudes(parts[0], calibration, recording, rest)
    return figure


def pose_names(up: NDArray[np.float64]) -> list[str]:
    """Return names of poses by their numbers and which direction of the body was up.

    Parameters
    ----------
    up : ndarray, shape (p, 3)
        Mean specific force of each pose, body frame, any unit: at rest it points up.

    Returns
    -------
    list of str
        ``1: +z up`` for a face, ``7: +x+y up`` for an edge or corner, within 10°; else three numbers, a unit vector.
    """
    named = {
        signs: "".join(f"{'+' if sign > 0 else '−'}{axis}" for sign, axis in zip(signs, "xyz", strict=True) if sign)
        for signs in itertools.product((1, 0, -1), repeat=3)
        if any(signs)
    }
    directions = np.array(list(named)) / np.linalg.norm(list(named), axis=1)[:, None]
    names = []
    for number, vector in enumerate(up, start=1):
        length = float(np.linalg.norm(vector))
        unit = vector / length if length > 0.0 else vector
        nearest = int(np.argmax(directions @ unit)) if np.isfinite(unit).all() else 0
        if np.isfinite(unit).all() and directions[nearest] @ unit > _NEAR_AXIS:
            names.append(f"{number}: {list(named.values())[nearest]} up")
        else:
            names.append(f"{number}: ({', '.join(f'{part:.2f}' for part in unit)}) up".replace("-", "−"))
    return names


def _correlation(axes: Axes, calibration: Calibration) -> None:
    """Draw the correlation matrix with the names of its parameters, and their units below."""
    image = axes.imshow(calibration.correlation, cmap=DIVERGING, vmin=-1, vmax=1, interpolation="nearest")
    axes.figure.colorbar(image, ax=axes, shrink=0.8, label="correlation")
    axes.set_title("correlation of the parameters", fontsize=10)
    names, chips = calibration.names, [name.rpartition("_")[0].rpartition("_")[0] for name in calibration.names]
    starts = [index for index in range(len(names)) if index == 0 or chips[index] != chips[index - 1]]
    several = len(calibration.chips) > 1
    colours = {chip: css(chip_colour(number, on_paper=True)) for number, chip in enumerate(calibration.chips)}
    if len(names) <= _MOST_NAMED:
        shown = [name if several else name.split("_", 1)[1] for name in names]
        axes.set_xticks(range(len(names)), shown, rotation=90, fontsize=7)
        axes.set_yticks(range(len(names)), shown, fontsize=7)
        labels = [*zip(axes.get_xticklabels(), chips, strict=True), *zip(axes.get_yticklabels(), chips, strict=True)]
    else:
        middles = [(first + last - 1) / 2 for first, last in itertools.pairwise([*starts, len(names)])]
        blocks = [chips[first] for first in starts]
        axes.set_xticks(middles, blocks, rotation=90, fontsize=7)
        axes.set_yticks(middles, blocks, fontsize=7)
        labels = [*zip(axes.get_xticklabels(), blocks, strict=True), *zip(axes.get_yticklabels(), blocks, strict=True)]
    axes.tick_params(length=0 if len(names) > 40 else 2)
    for label, chip in labels:
        label.set_color(colours.get(chip, css(INK)) if several else css(INK))
    for start in starts[1:]:
        axes.axhline(start - 0.5, color=css(INK), linewidth=0.5)
        axes.axvline(start - 0.5, color=css(INK), linewidth=0.5)
    order = "" if len(names) <= _MOST_NAMED else f"in each block: {_in_block(names, chips)}\n"
    axes.set_xlabel(f"{order}{_units(calibration)}", fontsize=8)


def _in_block(names: Sequence[str], chips: Sequence[str]) -> str:
    """Return the names of one chip's parameters, in order."""
    return ", ".join(
        name.removeprefix(f"{chips[0]}_") for name, chip in zip(names, chips, strict=True) if chip == chips[0]
    )


def _units(calibration: Calibration) -> str:
    """Return what the parameters are and their units."""
    units = {name.rpartition("_")[0][-1]: unit for name, unit in zip(calibration.names, calibration.units, strict=True)}
    shown = {kind: " per ".join(_UNITS[part] for part in unit.split(" per ")) for kind, unit in units.items()}
    return "; ".join(f"{words}, {shown[kind]}" for kind, words in _KINDS.items() if kind in shown)


def _magnitudes(figure: Figure, calibration: Calibration, recording: Recording, rest: Rest) -> None:
    """Draw |a| − g of every pose and chip, after calibration and, where the scale is known, before."""
    corrected = calibration.apply(recording)
    shown = [("after: calibrated", corrected, css(AFTER_ON_PAPER))]
    if recording.unit == "m_s2":
        shown.insert(0, ("before: as read", recording, css(BEFORE_ON_PAPER)))
    panels = figure.subplots(len(shown), 1, sharex=True, sharey=True, squeeze=False)[:, 0]
    poses = np.arange(len(rest))
    for panel, (title, readings, colour) in zip(panels, shown, strict=True):
        off = np.linalg.norm(rest_means(readings, calibration, rest), axis=2) - calibration.gravity  # (p, k)
        rms = float(np.sqrt(np.nanmean(off**2)))
        for index, (chip, values) in enumerate(zip(calibration.chips, off.T, strict=True)):
            hue = css(chip_colour(index, on_paper=True))
            panel.plot(poses, values, "o", color=hue, markersize=4.5, label=chip)
        panel.axhspan(-rms, rms, color=colour, alpha=0.15, linewidth=0)
        panel.axhline(0.0, color=css(INK), linewidth=0.5)
        panel.set_yscale("symlog", linthresh=_LINEAR)
        powers = 10.0 ** np.arange(-2, 3)
        panel.yaxis.set_major_locator(FixedLocator([*-powers[::-1], 0.0, *powers]))
        panel.set_ylabel("|a| − g, m/s²")
        panel.set_title(f"{title}: rms {rms:.2g} m/s² (band)", fontsize=10, color=colour, loc="left")
    panels[-1].set_xticks(poses, pose_names(_up(corrected, calibration, rest)), rotation=90, fontsize=7)
    panels[-1].set_xlabel("pose at rest: its number, and which direction of the body was up")
    figure.suptitle("magnitude of the specific force at rest", fontsize=10)
    columns = min(len(calibration.chips), 8)
    figure.legend(*panels[0].get_legend_handles_labels(), loc="outside lower center", ncols=columns, fontsize=8)


def _up(corrected: Recording, calibration: Calibration, rest: Rest) -> NDArray[np.float64]:
    """Return the specific force of each pose in body axes, (p, 3); in the first chip's axes where no array is known."""
    means = rest_means(corrected, calibration, rest)  # (p, k, 3)
    array = corrected.array
    if array is None or not set(calibration.channels) <= set(array.channels):
        return means[:, 0]
    axes = array.axes[[array.index(channel) for channel in calibration.channels]]  # (3k, 3)
    return np.asarray(means.reshape(len(means), -1) @ np.linalg.pinv(axes).T)
