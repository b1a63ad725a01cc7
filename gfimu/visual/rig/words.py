"""What the pictures of an array say beside it: which array it is, and what each colour and arrow means."""

from __future__ import annotations

import numpy as np

from gfimu.array.array import AccelerometerArray
from gfimu.visual.motion import KnownMotion
from gfimu.visual.rig.package import Package, is_cube, package_of

__all__ = ["array_words", "comparison_legend", "package_words", "run_legend", "scene_title", "short_name"]

_LONGEST_NAME = 14


def scene_title(array: AccelerometerArray) -> str:
    """Return the title of a 3-D view: the array by name and size."""
    chips, channels = len(array.chips), array.n_channels
    return f"array {array.name}: {_count(chips, 'chip')}, {_count(channels, 'channel')}"


def short_name(name: str) -> str:
    """Return the name of a chip or channel for a drawing: the middle of a long one is left out."""
    if len(name) <= _LONGEST_NAME:
        return name
    return f"{name[: _LONGEST_NAME - 5]}…{name[-4:]}"


def package_words(package: Package) -> str:
    """Return what the package is and its size, mm."""
    x, y, z = 2000.0 * package.half
    match package.kind:
        case "cube":
            return f"cube of {x:.3g} mm"
        case "disc":
            return f"disc of {x:.3g} mm diameter"
        case "rod":
            return f"rod of {x:.3g} mm"
        case "chip":
            return "one chip"
        case "plate":
            return f"plate of {x:.3g} × {y:.3g} mm"
        case _:
            return f"box of {x:.3g} × {y:.3g} × {z:.3g} mm around the chips"


def array_words(array: AccelerometerArray) -> str:
    """Return an array in a sentence or two and its chips as a table, in Markdown."""
    lines = [f"**Array {array.name}.** {_sentence(array.description)}Drawn as a {package_words(package_of(array))}."]
    if (axis := array.turning_axis) is not None:
        direction = ", ".join(f"{part:.3g}" for part in axis.direction)
        hub = "stands still" if axis.hub == "fixed" else "moves with a body"
        tilt = "" if axis.inclination is None else f", {np.rad2deg(axis.inclination):.3g}° from the vertical"
        lines[0] += f" It turns about ({direction}) only, an axis that {hub}{tilt}."
    lines += ["", "| chip | channels | place x, y, z in mm | part |", "|---|---|---|---|"]
    for chip in array.chips:
        x, y, z = 1000.0 * chip.position + 0.0
        lines.append(f"| {chip.name} | {', '.join(chip.channels)} | {x:.4g}, {y:.4g}, {z:.4g} | {chip.part} |")
    return "\n".join(lines)


def run_legend(array: AccelerometerArray, *, estimate: bool, known: KnownMotion | None) -> str:
    """Return the legend of the picture of a run, in Markdown."""
    solid = (
        f"It stands as known ({known.name})" if known is not None else "It stands as estimated" if estimate else ""
    ) or "It stands still, as nothing says how it moved"
    ghost = "; the orange outline and its pointer along x turn with the estimate" if estimate and known else ""
    size = "1 g is a little more than half the cube" if is_cube(array) else "they grow and shrink together"
    colours = ["Grey: truth." if known is not None and known.omega is not None else ""]
    colours += ["Orange: estimate, its ±2σ paler."] if estimate else []
    colours += [
        "Sky blue: tachometer, encoder or gyro about the axis.",
        "Violet: command.",
        "Red, green, blue: x, y, z.",
    ]
    return f"""\
**3-D.** {solid}{ghost}. {_CHIPS} Each thick arrow is as long as its channel reads, in m/s² ({size}). An arrow up at
rest is right: a sensor at rest reads the reaction to gravity.

**Colours.** {" ".join(colour for colour in colours if colour)} {_HUES}

All plots are over the same time, in seconds; those of a run of up to a minute zoom together. Drag to move, scroll to
zoom, double-click to see everything.

{array_words(array)}
"""


def comparison_legend(array: AccelerometerArray, *, extended: bool) -> str:
    """Return the legend of the picture of a diagnosis, in Markdown."""
    after = ", blue after the model was extended" if extended else ""
    return f"""\
**3-D.** Each thick arrow is as long as the residual of its channel, measured minus predicted, in m/s²:
orange before{after}. {_CHIPS}

**Plots.** Grey: measured. Orange: predicted before. {"Blue: predicted after. " if extended else ""}One row per chip,
one column per sensing axis. {_HUES}

{array_words(array)}
"""


_CHIPS = (
    "Chips are named and drawn larger than they are; thin arrows are their sensing axes, point at one for its "
    "channel. The white arrow is gravity, the yellow one the axis of rotation, where there is one."
)
_HUES = "Each chip has one hue in all pictures; its axes 1, 2, 3 are darker, as it is, and lighter."


def _count(number: int, noun: str) -> str:
    return f"{number} {noun}" + ("" if number == 1 else "s")


def _sentence(text: str) -> str:
    text = text.strip()
    return f"{text[0].upper()}{text[1:].rstrip('.')}. " if text else ""
