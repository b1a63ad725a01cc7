"""Draw the figure of the page on designing experiments, and print the numbers that it quotes.

Run ``python docs/scripts/make_design_figure.py [FOLDER]``; the folder is ``docs/figures`` unless given.
"""

from __future__ import annotations

import sys
from pathlib import Path

import matplotlib as mpl

mpl.use("Agg")

import matplotlib.pyplot as plt
import numpy as np

from gfimu.diagnosis.data.run import prepare_run
from gfimu.diagnosis.design.design import Limits, design
from gfimu.diagnosis.design.distinguishability import gained_log_likelihood
from gfimu.diagnosis.design.profile_search import plain_profile
from gfimu.diagnosis.design.proposal import SEPARATED
from sim.effects import make_effect
from sim.trials.worlds.hidden import Measurement, measure
from sim.twin import Twin

LIMITS = Limits(rate=15.0, acceleration=20.0, duration=60.0)
STRETCH = 5e-5  # s²/rad²: the arms are 1.1 % longer at 15 rad/s
RUNS = 20
GREY, ORANGE = "#7f7f7f", "#d95f02"

plt.style.use(Path(__file__).with_name("figures.mplstyle"))


def main(folder: Path) -> Path:
    """Draw the figure into a folder; returns its path."""
    twin = Twin.load("cube12_turntable")
    flex = make_effect("centrifugal_flex", {"stretch_s2_rad2": STRETCH})
    proposal = design(twin, [flex, "quadratic"], limits=LIMITS, rng=np.random.default_rng(0), mountings={})
    motions = {"plain": plain_profile(LIMITS), "designed": proposal.profile}
    predicted = {"plain": proposal.before.nats[0, 1], "designed": proposal.after.nats[0, 1]}
    margins = {}
    for name, motion in motions.items():
        recordings = [
            measure(np.random.default_rng(seed), twin, [flex], Measurement(duration=LIMITS.duration), motion=motion)
            for seed in range(RUNS)
        ]
        gains = [gained_log_likelihood(twin, [flex, "quadratic"], [prepare_run(each, twin)]) for each in recordings]
        margins[name] = np.array([one - other for one, other in gains])
        print(
            f"{name}: predicted {predicted[name]:.1f}, measured {margins[name].mean():.1f} ± {margins[name].std():.1f}"
        )
    print(proposal.text)
    print("\n".join(proposal.profile.in_words()))

    figure, panels = plt.subplots(
        1, 3, figsize=(7, 2.6), layout="constrained", width_ratios=[3, 3, 2], sharey=False, squeeze=True
    )
    t = np.arange(0.0, LIMITS.duration, 0.01)
    for panel, (name, motion), colour in zip(panels, motions.items(), (GREY, ORANGE), strict=False):
        panel.plot(t, motion.at(t).rate, color=colour)
        panel.set(xlabel="t, s", title=f"{name} run", ylim=(-16, 16))
        margin_axis = panels[2]
        place = list(motions).index(name)
        margin_axis.plot(np.full(RUNS, place), margins[name], "o", color=colour, markersize=3, alpha=0.6)
        margin_axis.plot([place - 0.25, place + 0.25], [predicted[name]] * 2, color="black")
    panels[0].set_ylabel("table rate, rad/s")
    panels[2].axhline(SEPARATED, color=GREY, linestyle="--")
    panels[2].set(xticks=[0, 1], xticklabels=list(motions), xlim=(-0.5, 1.5), title="margin, nats")
    path = folder / "design_flex_or_quadratic.png"
    figure.savefig(path)
    plt.close(figure)
    return path


if __name__ == "__main__":
    target = Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).resolve().parents[1] / "figures"
    print(f"wrote {main(target)}")
