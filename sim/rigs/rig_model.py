"""MuJoCo models of the rig for a world: the turntable, driven or not, or the free cube, with the chips of its array."""

from __future__ import annotations

from dataclasses import dataclass

import mujoco
import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from gfimu.array.array import AccelerometerArray, Chip
from gfimu.base.errors import InputError
from gfimu.base.files.model_files import find_model
from sim.rigs.mujoco_warnings import mujoco_warnings
from sim.world import World

__all__ = [
    "LEAN_JOINT",
    "NOD_JOINT",
    "SPIN_JOINT",
    "across_axis",
    "channel_places",
    "free_spec",
    "nod_axis",
    "turntable_model",
    "turntable_spec",
]

NOD_JOINT = "nod"
LEAN_JOINT = "lean"  # followed by its number
SPIN_JOINT = "spin"
_ORTHONORMAL = 1e-9  # rounding of rotated axes


@mujoco_warnings()
def turntable_model(world: World) -> mujoco.MjModel:
    """Compile the turntable of ``models/mjcf/turntable.xml`` for a world.

    The world decides the chips, the cube's place and attitude on the table, the tilt of the axis and gravity. A
    nodding axis gets a hinge of its own, and stretching arms a slide for each chip; prescribed motion moves both. On a
    linear axis the table slides.
    """
    return turntable_spec(world).compile()


def turntable_spec(world: World, file: str = "turntable") -> mujoco.MjSpec:
    """Return the turntable of a file of ``models/mjcf`` for a world, not yet compiled; see `turntable_model`."""
    spec = mujoco.MjSpec.from_file(str(find_model("mjcf", file, suffix=".xml")))
    axis = spec.body("axis")
    axis.quat = _quaternion(Rotation.from_rotvec(world.axis_rotvec))
    if world.slide is not None:
        carried = spec.joint(SPIN_JOINT)
        carried.type, carried.axis = mujoco.mjtJoint.mjJNT_SLIDE, world.slide
    if world.nod:
        axis.add_joint(name=NOD_JOINT, type=mujoco.mjtJoint.mjJNT_HINGE, axis=nod_axis(world))
    mount = Rotation.from_rotvec(world.mount_rotvec)
    arms = mount.inv().apply(world.cube_offset) + world.array.chip_positions  # from the axis, in cube axes
    cube = spec.body("cube")
    cube.pos, cube.quat = world.cube_offset, _quaternion(mount)
    foot = mount.inv().apply(-world.cube_offset)  # of the cube on the axis, in cube axes
    for index, lean in enumerate(world.leans):
        axis = mount.inv().apply(lean.vector / np.linalg.norm(lean.vector))
        cube.add_joint(name=f"{LEAN_JOINT}{index}", type=mujoco.mjtJoint.mjJNT_HINGE, axis=axis, pos=foot)
    _fit_chips(spec, world.array, across_axis(arms, mount) if world.stretch else None)
    spec.option.gravity = [0.0, 0.0, -world.gravity]
    return spec


def free_spec(world: World) -> mujoco.MjSpec:
    """Return the free cube for a world, not yet compiled."""
    spec = mujoco.MjSpec.from_file(str(find_model("mjcf", "free_cube", suffix=".xml")))
    spec.body("cube").pos = np.zeros(3)
    _fit_chips(spec, world.array, None)
    spec.option.gravity = [0.0, 0.0, -world.gravity]
    return spec


def across_axis(arms: NDArray[np.float64], mount: Rotation) -> NDArray[np.float64]:
    """Return the parts of arms (k, 3), in cube axes, across the axis of the table: there the load is."""
    axis = mount.inv().apply([0.0, 0.0, 1.0])
    return np.asarray(arms - np.outer(arms @ axis, axis))


def nod_axis(world: World) -> NDArray[np.float64]:
    """Return the axis of the hinge that nods."""
    if (direction := world.nod.direction) is None:
        raise InputError("MuJoCo's axis nods about one line; give axis_wobble effects of one direction_rad")
    return np.array([np.cos(direction), np.sin(direction), 0.0])


def channel_places(model: mujoco.MjModel, array: AccelerometerArray) -> NDArray[np.intp]:
    """Return where the sensor data of a rig holds the specific force of each channel of an array, (c,)."""
    places: list[int] = []
    for chip in array.chips:
        if _triaxial(chip):
            first = int(model.sensor(chip.name).adr[0])
            places += range(first, first + 3)
        else:
            places += [int(model.sensor(channel).adr[0]) for channel in chip.channels]
    return np.array(places, dtype=np.intp)


@dataclass(frozen=True)
class _Kept:
    """A sensor of the file that is put after the accelerometers."""

    name: str
    type: mujoco.mjtSensor
    objtype: mujoco.mjtObj
    objname: str


def _fit_chips(spec: mujoco.MjSpec, array: AccelerometerArray, arms: NDArray[np.float64] | None) -> None:
    """Replace the chips drawn in the MJCF by those of the array; with ``arms`` (k, 3) each can slide along its own.

    A chip with three axes at right angles has one accelerometer of three axes, of its name. Any other chip has one
    per channel, whose x axis is the sensing axis.
    """
    cube = spec.body("cube")
    for body in list(cube.bodies):
        spec.delete(body)  # with the sensors at its sites
    later = [_Kept(one.name, one.type, one.objtype, one.objname) for one in spec.sensors]
    for sensor in list(spec.sensors):
        spec.delete(sensor)
    looks = [spec.find_default("board"), spec.find_default("package")]
    for index, chip in enumerate(array.chips):
        body = cube.add_body(name=chip.name, pos=chip.position)
        if arms is not None and np.any(arms[index]):
            axis = arms[index] / np.linalg.norm(arms[index])
            body.add_joint(name=f"stretch_{chip.name}", type=mujoco.mjtJoint.mjJNT_SLIDE, axis=axis)
        for look in looks:
            body.add_geom(look)
        triaxial = _triaxial(chip)
        for number, (channel, sensing) in enumerate(zip(chip.channels, chip.axes, strict=True)):
            frame = Rotation.from_matrix(chip.axes.T) if triaxial and not number else _with_x_along(sensing)
            body.add_site(name=channel, quat=_quaternion(frame))
            if not (triaxial and number):
                spec.add_sensor(
                    name=chip.name if triaxial else channel,
                    type=mujoco.mjtSensor.mjSENS_ACCELEROMETER,
                    objtype=mujoco.mjtObj.mjOBJ_SITE,
                    objname=channel,
                )
    for kept in later:
        spec.add_sensor(name=kept.name, type=kept.type, objtype=kept.objtype, objname=kept.objname)


def _triaxial(chip: Chip) -> bool:
    """Whether the axes of a chip are those of a right-handed frame."""
    axes = np.asarray(chip.axes)
    return len(axes) == 3 and bool(np.allclose(np.cross(axes[0], axes[1]), axes[2], rtol=0, atol=_ORTHONORMAL))


def _with_x_along(axis: NDArray[np.float64]) -> Rotation:
    """Rotation of a site whose x axis is the sensing axis."""
    x = axis / np.linalg.norm(axis)
    helper = np.eye(3)[np.argmin(np.abs(x))]
    y = np.cross(helper, x)
    y /= np.linalg.norm(y)
    return Rotation.from_matrix(np.column_stack([x, y, np.cross(x, y)]))


def _quaternion(rotation: Rotation) -> NDArray[np.float64]:
    return np.asarray(rotation.as_quat(scalar_first=True))
