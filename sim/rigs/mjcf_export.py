"""An accelerometer array as a MuJoCo model that anything with MuJoCo can read: on the table, on a motor, or free."""

from __future__ import annotations

from xml.etree import ElementTree as ET

import mujoco
import numpy as np
from numpy.typing import NDArray

from gfimu.array.array import AccelerometerArray
from gfimu.base.errors import InputError, check_name, one_line
from sim.rigs.mujoco_warnings import mujoco_warnings
from sim.rigs.rig_model import channel_places, free_spec, turntable_spec
from sim.world import World

__all__ = ["RIGS", "array_as_mjcf"]

RIGS = ("turntable", "motor_turntable", "free_cube")
"""Models of ``models/mjcf`` that carry an array."""


@mujoco_warnings()
def array_as_mjcf(array: AccelerometerArray, rig: str = "turntable") -> str:
    """Return the MJCF text of a rig that carries an array.

    Each channel has a site, whose x axis is the sensing axis. A chip with three axes at right angles has one
    accelerometer, of its name; any other chip one per channel, of the channel's name, of which x counts. A comment at
    the top says where MuJoCo's ``sensordata`` holds each channel.

    Parameters
    ----------
    array : AccelerometerArray
        The array.
    rig : {"turntable", "motor_turntable", "free_cube"}
        What carries it.

    Raises
    ------
    InputError
        If there is no such rig, or MuJoCo refuses the array, such as two chips of one name.
    """
    check_name("rig", rig, RIGS)
    spec = free_spec(World(array)) if rig == "free_cube" else turntable_spec(World(array), rig)
    spec.modelname = one_line(array.name)
    try:
        places = channel_places(spec.compile(), array)
    except ValueError as error:
        raise InputError(f"array {array.name!r} as MJCF: {' '.join(str(error).split())}") from None
    parser = ET.XMLParser(target=ET.TreeBuilder(insert_comments=True))  # noqa: S314 - text that MuJoCo wrote just now
    root = ET.fromstring(spec.to_xml(), parser)  # noqa: S314
    _write_all_digits(root, spec, array)
    lines = [f"  {channel}: sensordata[{place}]" for channel, place in zip(array.channels, places, strict=True)]
    comment = ["<!-- Specific force along the axis of each channel, m/s2:", *lines, "-->"]
    return "\n".join([*comment, ET.tostring(root, encoding="unicode"), ""])


def _write_all_digits(root: ET.Element, spec: mujoco.MjSpec, array: AccelerometerArray) -> None:
    """Give the places and axes of the chips with every digit: MuJoCo writes six."""
    for chip in array.chips:
        body = root.find(f".//body[@name='{chip.name}']")
        if body is None:  # a name that XPath can't hold; six digits remain
            continue
        body.set("pos", _digits(spec.body(chip.name).pos))
        for site in body.findall("site"):
            site.set("quat", _digits(spec.site(site.get("name")).quat))


def _digits(values: NDArray[np.float64]) -> str:
    return " ".join(repr(value) for value in values.tolist())
