"""Draw the wiring of the bench page: an mbed LPC1768 and four ADXL345 breakouts on one SPI bus.

Run ``python docs/scripts/make_bench_figure.py [FOLDER]``; the folder is ``docs/figures`` unless given.
"""

from __future__ import annotations

import sys
from dataclasses import dataclass
from pathlib import Path

import matplotlib as mpl

mpl.use("Agg")

import matplotlib.pyplot as plt
from matplotlib.axes import Axes
from matplotlib.patches import Rectangle


@dataclass(frozen=True)
class Net:
    """A net: its colour, the pin of the mbed and the pin of a breakout."""

    colour: str
    board: str
    chip: str


BUS = (
    Net("#c0392b", "p40  VOUT 3.3 V", "VCC"),
    Net("#222222", "p1   GND", "GND"),
    Net("#2471a3", "p7   SCK1  P0.7", "SCL / SCK"),
    Net("#1e8449", "p6   MISO1 P0.8", "SDO"),
    Net("#b9770e", "p5   MOSI1 P0.9", "SDA / SDI"),
)
SELECTS = tuple(
    Net(colour, f"p{26 - chip}  CS{chip + 1}   P2.{chip}", "CS")
    for chip, colour in enumerate(("#7d3c98", "#af7ac5", "#5b2c6f", "#d2b4de"))
)
PITCH, CHIP_GAP = 1.0, 1.6
BOARD_RIGHT, CHIP_LEFT = 6.0, 15.0


def main(folder: Path) -> Path:
    """Draw the figure into a folder; returns its path."""
    figure, axes = plt.subplots(figsize=(9.0, 8.0), dpi=110)
    rows = len(BUS) + 1
    height = 4 * rows * PITCH + 3 * CHIP_GAP
    nets = (*BUS, *SELECTS)
    board_top = height / 2 + len(nets) * PITCH / 2
    block(axes, 0.0, BOARD_RIGHT, board_top + 0.8, board_top - len(nets) * PITCH - 0.1, "mbed LPC1768")
    at = {}
    for row, net in enumerate(nets):
        at[net.board] = board_top - (row + 0.5) * PITCH
        axes.text(BOARD_RIGHT - 0.2, at[net.board], net.board, ha="right", va="center", family="monospace", fontsize=8)
    for chip in range(4):
        top = height - chip * (rows * PITCH + CHIP_GAP)
        block(
            axes,
            CHIP_LEFT,
            CHIP_LEFT + 4.6,
            top + 0.6,
            top - rows * PITCH - 0.1,
            f"ADXL345  {chip + 1}  (a{chip + 1}1…3)",
        )
        for row, net in enumerate((*BUS, SELECTS[chip])):
            y = top - (row + 0.5) * PITCH
            axes.text(CHIP_LEFT + 0.2, y, net.chip, va="center", family="monospace", fontsize=8)
            lane = BOARD_RIGHT + 1.0 + 0.8 * (row if net in BUS else len(BUS) + chip)
            axes.plot(
                [BOARD_RIGHT, lane, lane, CHIP_LEFT], [at[net.board], at[net.board], y, y], color=net.colour, lw=1.6
            )
            if net in BUS:
                axes.plot(lane, y, "o", color=net.colour, ms=3.5)
        axes.text(
            CHIP_LEFT + 4.8, top - PITCH, "100 nF and 10 µF\nfrom VCC to GND,\nat the chip", va="center", fontsize=7.5
        )
    axes.set(xlim=(-0.5, CHIP_LEFT + 8.6), ylim=(-1.0, height + 1.2), aspect="auto")
    axes.axis("off")
    axes.text(0.0, 0.2, "A dot joins wires; wires that cross without one are not joined.", fontsize=8)
    path = folder / "bench_wiring.png"
    figure.savefig(path, bbox_inches="tight")
    plt.close(figure)
    return path


def block(axes: Axes, left: float, right: float, top: float, bottom: float, name: str) -> None:
    """Draw a board with its name at the top."""
    axes.add_patch(Rectangle((left, bottom), right - left, top - bottom, facecolor="#f4f6f7", edgecolor="#566573"))
    axes.text((left + right) / 2, top - 0.4, name, ha="center", va="center", fontsize=8.5, weight="bold")


if __name__ == "__main__":
    print(main(Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).resolve().parents[1] / "figures"))
