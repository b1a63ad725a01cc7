"""The change that each effect makes in a fixed reference run: as numbers, and as three small panels.

The reference run is the scenario `speed_sweep` on the twin `cube12_turntable`, without noise, while the board warms
from 25 to 28 °C; of a linear axis, a free body or a pendulum it is the scenario of that rig.
"""

from __future__ import annotations

import io
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import matplotlib as mpl

mpl.use("Agg")

import matplotlib.pyplot as plt
import numpy as np
from numpy.typing import NDArray
from PIL import Image

from gfimu.array.array import AccelerometerArray
from sim.effects import make_effect
from sim.motions.motion import SpinState
from sim.scenarios import Scenario
from sim.twin import Twin
from sim.world import World

__all__ = ["Signature", "draw", "reference_run_of", "signature"]

GREY, COLOURS = "#787878", ("#2b87c4", "#d55e00", "#009e73")
"""Of text, and of three lines: near Okabe and Ito's for the colour-blind; contrast 3 : 1 on white and black."""

WARMING, WARMING_TIME = 3.0, 15.0  # K, s
BINS = 40
COLOURS_KEPT = 160  # of a picture: with fewer the lines take each other's colour
HIDDEN = 0.1
"""Share of its own change by which a channel must differ from another one to be drawn beside it."""
LONGEST_STROKES = 25.0  # s: the run of a linear axis is shorter, that of a table longer
SMALLEST = 1e-9
"""Of a change or a quantity, in its unit: what rounding makes is smaller."""
NATURAL = 0.02
"""Share by which a later quantity must explain the change better than an earlier one to be drawn against."""


@dataclass(frozen=True)
class Signature:
    """What an effect changes in the reference run.

    Parameters
    ----------
    scenario : str
        The run.
    t : ndarray, shape (n,)
        Times, s.
    names : tuple of str
        What is drawn: three channels with the largest change, or the reference.
    unit : str
        Its unit.
    change : ndarray, shape (n, k)
        With the effect less without.
    rms : dict of str to float
        Root mean square of the change by channel, m/s², and of the ``reference``, in its unit.
    against : str
        Quantity that explains the change of the first channel best.
    values : ndarray, shape (n,)
        That quantity.
    share : float
        Share of the variance that a function of it explains.
    """

    scenario: str
    t: NDArray[np.float64]
    names: tuple[str, ...]
    unit: str
    change: NDArray[np.float64]
    rms: dict[str, float]
    against: str
    values: NDArray[np.float64]
    share: float

    def numbers(self) -> dict[str, Any]:
        """Return what is stored and compared by the tests."""
        line, amplitude = self.strongest_line()
        return {
            "scenario": self.scenario,
            "drawn": list(self.names),
            "unit": self.unit,
            "rms": {name: _short(value) for name, value in self.rms.items()},
            "against": self.against,
            "share": round(self.share, 3),
            "line_hz": _short(line) if amplitude > SMALLEST else None,
            "line": _short(amplitude) if amplitude > SMALLEST else 0.0,
        }

    def spectrum(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return frequencies, Hz, and amplitudes (m, k) of the change under a Hann window, the mean taken out."""
        window = np.hanning(len(self.t))[:, None]
        change = self.change - self.change.mean(axis=0)
        amplitude = 2.0 * np.abs(np.fft.rfft(change * window, axis=0)) / window.sum()
        return np.fft.rfftfreq(len(self.t), self.t[1] - self.t[0])[1:], amplitude[1:]

    def strongest_line(self) -> tuple[float, float]:
        """Return frequency, Hz, and amplitude of the strongest line of the first channel, the slowest two left out."""
        frequency, amplitude = self.spectrum()
        place = int(np.argmax(amplitude[2:, 0])) + 2
        return float(frequency[place]), float(amplitude[place, 0])


def _short(value: float) -> float:
    return float(f"{value:.3g}")


def reference_run_of(name: str) -> str:
    """Return the scenario in which an effect is drawn."""
    special = {"mount_turn": "linear_axis", "angle_zero": "pendulum"}
    return special.get(name, "tumble" if name.startswith("gyro_") else "speed_sweep")


def signature(name: str, parameters: Mapping[str, Any]) -> Signature:
    """Compute what an effect changes in its reference run."""
    run = Scenario.load(reference_run_of(name))
    t = np.arange(round(run.duration * run.sample_rate)) / run.sample_rate
    effect = make_effect(name, parameters, run.array)
    if run.free:
        return _of_gyro(run, t, effect)
    twin = Twin.load({"linear_axis": "linear_axis", "pendulum": "pendulum"}.get(run.name, "cube12_turntable"))
    temperature = 25.0 + WARMING * -np.expm1(-t / WARMING_TIME)
    before, reference = twin.predict(run.motion, t, temperature=temperature)
    after, reference_after = twin.predict(run.motion, t, effects=[effect], temperature=temperature)
    change, reference_change = after - before, reference_after - reference
    spin = run.motion.at(t)
    by_samples = _of_samples(effect, before, t, twin)
    if by_samples is not None:
        change = by_samples
    if np.max(np.abs(change)) < SMALLEST:
        names, drawn = ("reference",), reference_change[:, None]
        unit = "rad" if twin.drive_source == "angle" else "rad/s"
    else:
        order = _unlike(change)
        names, drawn, unit = tuple(twin.array.channels[place] for place in order), change[:, order], "m/s²"
    if name == "dropped_frames":
        unit = "1 = lost"
    rms = {one: float(np.sqrt(np.mean(change[:, k] ** 2))) for k, one in enumerate(twin.array.channels)}
    rms = {one: value for one, value in rms.items() if value > SMALLEST}
    if np.any(np.abs(reference_change) > SMALLEST):
        rms["reference"] = float(np.sqrt(np.mean(reference_change**2)))
    reading = before[:, twin.array.index(names[0])] if names[0] != "reference" else spin.rate
    quantities = _quantities(spin, reading, names[0], t)
    if "order" in effect.parameters:
        quantities = {"table angle, rad": quantities["table angle, rad"]}
    if effect.needs_temperature:
        quantities["temperature, °C"] = temperature
    against, values, share = _natural(drawn[:, 0], quantities)
    return Signature(run.name, t, names, unit, drawn, rms, against, values, share)


def _unlike(change: NDArray[np.float64]) -> list[int]:
    """Return up to three channels with the largest changes that do not hide each other."""
    chosen: list[int] = []
    for place in np.argsort(-np.round(np.sqrt(np.mean(change**2, axis=0)), 12), kind="stable"):
        size = float(np.sqrt(np.mean(change[:, place] ** 2)))
        apart = [float(np.sqrt(np.mean((change[:, place] - change[:, one]) ** 2))) for one in chosen]
        if size > SMALLEST and all(one > HIDDEN * size for one in apart) and len(chosen) < len(COLOURS):
            chosen.append(int(place))
    return chosen


def _of_samples(effect: Any, before: NDArray[np.float64], t: NDArray[np.float64], twin: Twin) -> Any:
    """Return the change by what has no noise-free form: noise, a random walk, faults of the samples; None of others."""
    rng = np.random.default_rng(0)
    white = twin.expected_noise(100.0).white
    if effect.name == "noise":
        extra = np.sqrt(effect.value("factor") ** 2 - 1.0)
        return rng.normal(size=before.shape) * extra * white
    if effect.name == "bias_random_walk":
        step = effect.value("strength_m_s2_rts") * np.sqrt(t[1] - t[0])
        return np.cumsum(rng.normal(size=before.shape) * step, axis=0)
    if effect.place != "data":
        return None
    after = before
    for step in effect.apply(World(twin.array)).data_steps:
        after = step(t, after, rng)
    if effect.name == "dropped_frames":
        return np.isnan(after).astype(float)
    return after - before


def _of_gyro(run: Scenario, t: NDArray[np.float64], effect: Any) -> Signature:
    """Return the change of the gyro's readings: the channels of a free body are the same."""
    world = effect.apply(World(AccelerometerArray.load("cube12")))
    now, then = run.motion.at(t).omega, run.motion.at(np.maximum(t - world.tacho_delay, 0.0)).omega
    change = then @ world.gyro_matrix.T - now
    order = [place for place in np.argsort(-np.std(change, axis=0)) if np.any(change[:, place])]
    names = tuple(f"gyro {'xyz'[place]}" for place in order)
    rms = {f"gyro {axis}": float(np.sqrt(np.mean(change[:, k] ** 2))) for k, axis in enumerate("xyz")}
    first = now[:, order[0]]
    eta = _explained(change[:, order[0]], first)
    return Signature(
        run.name, t, names, "rad/s", change[:, order], rms, f"rate about {names[0][-1]}, rad/s", first, eta
    )


def _quantities(
    spin: SpinState, reading: NDArray[np.float64], name: str, t: NDArray[np.float64]
) -> dict[str, NDArray[np.float64]]:
    """Return what a change may be a function of, the usual first."""
    turns = t[-1] > LONGEST_STROKES
    rate, acceleration = ("rate, rad/s", "rad/s²") if turns else ("speed, m/s", "m/s²")
    return {
        rate: spin.rate,
        "table angle, rad": np.mod(spin.angle, 2 * np.pi),
        f"acceleration, {acceleration}": spin.acceleration,
        f"reading of {name}, m/s²": reading,
        f"rate of change of {name}, m/s³": np.gradient(reading, t),
    }


def _natural(
    change: NDArray[np.float64], quantities: Mapping[str, NDArray[np.float64]]
) -> tuple[str, NDArray[np.float64], float]:
    """Return the quantity whose function explains most of a change, the first ones preferred."""
    best = next(iter(quantities))
    found = _explained(change, quantities[best])
    for label, values in quantities.items():
        share = _explained(change, values)
        if share > found + NATURAL and np.ptp(values) > SMALLEST:
            best, found = label, share
    return best, quantities[best], found


def _explained(change: NDArray[np.float64], values: NDArray[np.float64]) -> float:
    """Return the correlation ratio: the share of the variance between bins of a quantity, equal values together."""
    whole = float(np.sum((change - change.mean()) ** 2))
    if whole <= SMALLEST**2 * len(change):
        return 0.0
    edges = np.unique(np.round(np.quantile(values, np.linspace(0.0, 1.0, BINS + 1)[1:-1]), 9))
    place = np.searchsorted(edges, np.round(values, 9), side="left")
    return (
        1.0
        - sum(float(np.sum((one - one.mean()) ** 2)) for k in np.unique(place) for one in [change[place == k]]) / whole
    )


def draw(found: Signature, path: Path) -> None:
    """Draw a signature: over time, against its natural quantity, and its amplitude spectrum."""
    here = Path(__file__).parent
    style = next(file for folder in (here, here.parent) if (file := folder / "figures.mplstyle").exists())
    colours = {
        "figure.facecolor": "none", "axes.facecolor": "none", "savefig.facecolor": "none", "text.color": GREY,
        "axes.labelcolor": GREY, "axes.edgecolor": GREY, "xtick.color": GREY, "ytick.color": GREY,
        "grid.color": GREY, "axes.titlesize": 8, "font.size": 8,
    }  # fmt: skip
    with plt.style.context([style, colours]):
        figure, (over_time, over_it, over_frequency) = plt.subplots(1, 3, figsize=(7.8, 2.1), layout="constrained")
        frequency, amplitude = found.spectrum()
        floor = max(float(amplitude.max()) * 1e-4, 1e-12)
        for place, (name, colour) in enumerate(zip(found.names, COLOURS, strict=False)):
            change = found.change[:, place]
            over_time.plot(found.t, change, color=colour, lw=0.8, label=name, zorder=3 - place)
            over_it.plot(found.values, change, ".", ms=2.2, mew=0, color=colour, alpha=0.7, zorder=3 - place)
            if amplitude.max() > SMALLEST:
                shown = np.maximum(amplitude[:, place], floor)
                over_frequency.plot(frequency, shown, color=colour, lw=0.8, zorder=3 - place)
        over_time.set(xlabel="time, s", ylabel=f"change, {found.unit}")
        over_it.set(xlabel=found.against)
        over_frequency.set(xlabel="frequency, Hz", ylabel=f"amplitude, {found.unit}", xscale="log", yscale="log")
        if amplitude.max() <= SMALLEST:
            over_frequency.set(xlim=(frequency[0], frequency[-1]), ylim=(1e-6, 1.0))
            over_frequency.text(0.5, 0.5, "constant: no line", transform=over_frequency.transAxes, ha="center")
        for panel in (over_time, over_it):
            if np.ptp(found.change) < 1e-12 + 1e-9 * np.max(np.abs(found.change)):
                panel.margins(y=0.3)
        figure.legend(
            *over_time.get_legend_handles_labels(), loc="outside upper left", ncols=3, fontsize=8, handlelength=1.2
        )
        memory = io.BytesIO()
        figure.savefig(memory, dpi=130)
        plt.close(figure)
    memory.seek(0)
    Image.open(memory).quantize(COLOURS_KEPT, method=Image.Quantize.FASTOCTREE).save(path, optimize=True)
