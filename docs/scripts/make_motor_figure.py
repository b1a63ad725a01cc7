"""Draw the figure of the motor-driven table, and print the numbers that the page quotes.

Run ``python docs/scripts/make_motor_figure.py [FOLDER]``; the folder is ``docs/figures`` unless given.
"""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path

import matplotlib as mpl

mpl.use("Agg")

import matplotlib.pyplot as plt
import numpy as np
from numpy.typing import NDArray

from sim.rigs.driven import DrivenRun, drive
from sim.scenarios import Scenario

GREY, ORANGE = "#7f7f7f", "#d95f02"
STEADY = ((14.0, 18.0), (21.0, 25.0))  # s, at 2 and at 5 rad/s
CRAWL = (3.0, 11.0)

plt.style.use(Path(__file__).with_name("figures.mplstyle"))


def main(folder: Path) -> Path:
    """Draw the figure into a folder; returns its path."""
    scenario = Scenario.load("motor_run")
    assert scenario.motor is not None
    run = _driven(scenario)
    smooth = _driven(replace(scenario, motor=replace(scenario.motor, damping=1.0)))
    figure, (crawl, ripple) = plt.subplots(1, 2, figsize=(7, 2.6), layout="constrained", width_ratios=[3, 2])
    shown = (run.t > CRAWL[0]) & (run.t < CRAWL[1])
    crawl.plot(run.t[shown], run.state.rate[shown], color=ORANGE, label="damping 0.1 N·m·s/rad")
    crawl.plot(run.t[shown], smooth.state.rate[shown], color=GREY, label="damping 1 N·m·s/rad")
    crawl.set(xlabel="t, s", ylabel="table rate, rad/s", title="crawling at 0.02 rad/s")
    crawl.legend()
    for span, colour in zip(STEADY, (GREY, ORANGE), strict=True):
        orders, amplitude = order_spectrum(run, *span)
        low = orders < 40
        speed = scenario.motion.at(np.array(span[:1])).rate[0]
        ripple.plot(orders[low], 1e3 * amplitude[low], color=colour, label=f"{speed:g} rad/s")
        peak = np.argmax(np.where(orders > 10, amplitude, 0.0))
        print(f"{speed:g} rad/s: {1e3 * amplitude[peak]:.2f} mrad/s at order {orders[peak]:.1f}")
    ripple.set(xlabel="order of the table's angle", ylabel="ripple, mrad/s", title="cogging", yscale="log")
    ripple.set_ylim(1e-3, 20)
    ripple.legend()
    path = folder / "motor_run.png"
    figure.savefig(path)
    plt.close(figure)
    return path


def order_spectrum(run: DrivenRun, start: float, stop: float) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return orders of the table's angle and the amplitude of the rate at each, rad/s, in a span of time, s."""
    inside = (run.t >= start) & (run.t <= stop)
    angle, rate = run.state.angle[inside], run.state.rate[inside]
    even = np.linspace(angle[0], angle[-1], 4096)
    window = np.hanning(len(even))
    values = np.interp(even, angle, rate)
    amplitude = 2 * np.abs(np.fft.rfft((values - values.mean()) * window)) / window.sum()
    return np.arange(len(amplitude)) * 2 * np.pi / (angle[-1] - angle[0]), amplitude


def _driven(scenario: Scenario) -> DrivenRun:
    return drive(
        scenario.world,
        scenario.motion,  # type: ignore[arg-type]
        STEADY[-1][1],
        step=scenario.physics_step,
        motor=scenario.motor,
    )


if __name__ == "__main__":
    print(main(Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).resolve().parents[1] / "figures"))
