"""Shapes of the MuJoCo rig for pictures: boxes, cylinders and meshes of each group of bodies."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import mujoco
import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from gfimu.base.results.colours import chip_colour
from gfimu.recording import Recording
from gfimu.visual.rig import is_cube, stand_height
from gfimu.visual.scene import Box, Cylinder, Mesh, Shape
from sim.rigs.rig_model import turntable_model
from sim.scenarios import Scenario
from sim.truth import known_motion
from sim.world import World

__all__ = ["draw_simulated", "rig_drawing"]

_FOOT = "adapter"
_BOARD = 0.004  # half size, m: boards are larger, the packages on them smaller
_MOVING = ("cube", "table")  # a body belongs to the first of these among its ancestors, to the base otherwise


def rig_drawing(world: World) -> Mapping[str, Sequence[Shape]]:
    """Shapes of base, table and cube of the turntable for a world, each in the frame it moves with.

    Returns
    -------
    mapping
        ``base`` in the world frame, ``table`` in the table frame, ``cube`` in the cube frame with its chips, each board
        in the hue of its chip. ``cube`` is missing where the chips are not on that cube, and so is the foot under it.
    """
    model = turntable_model(world)
    chips = {chip.name: chip_colour(index) for index, chip in enumerate(world.array.chips)}
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    shapes: dict[str, list[Shape]] = {"base": [], "table": [], "cube": []}
    for geom in range(model.ngeom):
        group = _group(model, int(model.geom_bodyid[geom]))
        position, rotation = data.geom_xpos[geom], Rotation.from_matrix(data.geom_xmat[geom].reshape(3, 3))
        if group != "base":
            body = model.body(group).id
            frame = Rotation.from_quat(data.xquat[body], scalar_first=True).inv()
            position, rotation = frame.apply(position - data.xpos[body]), frame * rotation
        shape = _shape(model, geom, position, rotation)
        if shape is None or (not is_cube(world.array) and model.geom(geom).name == _FOOT):
            continue
        colour = chips.get(str(model.body(int(model.geom_bodyid[geom])).name))
        if colour is not None and isinstance(shape, Box) and max(shape.half_size) >= _BOARD:
            shape = replace(shape, colour=colour)
        shapes[group].append(shape)
    return {name: drawn for name, drawn in shapes.items() if name != "cube" or is_cube(world.array)}


def draw_simulated(path: str | Path, scenario: Scenario, recording: Recording) -> None:
    """Write what was simulated as a rerun recording.

    It is drawn on its turntable, about a level or inclined axis, on a carriage, or free. About an axis that leans
    0.2 rad or more (a pendulum's, a wheel's) it is moved up so that all of the body's circle is above the ground.
    """
    from gfimu.visual import write_run  # needs rerun, and the shapes alone do not

    array, known, world = scenario.array, known_motion(recording), scenario.world
    axis = None if scenario.free else world.leaning_axis()
    if axis is not None:
        array = replace(array, turning_axis=axis)
        lift = np.array([0.0, 0.0, float(np.linalg.norm(world.cube_offset)) + stand_height(world.array)])
        known = replace(known, position=known.position + lift)
    on_table = not scenario.free and axis is None and world.slide is None
    if recording.unit != "m_s2":
        recording = replace(recording, readings=recording.readings * recording.metadata["lsb_m_s2"], unit="m_s2")
    shapes = rig_drawing(world) if on_table else None
    write_run(path, recording, array, known=known, shapes=shapes, title=scenario.name)


def _group(model: mujoco.MjModel, body: int) -> str:
    while body:
        name = model.body(body).name
        if name in _MOVING:
            return str(name)
        body = int(model.body_parentid[body])
    return "base"


def _shape(model: mujoco.MjModel, geom: int, position: NDArray[np.float64], rotation: Rotation) -> Shape | None:
    """One geom as a shape; kinds a machined rig does not have are left out."""
    place = (position.tolist(), rotation.as_quat(scalar_first=True).tolist(), _colour(model, geom))
    size = model.geom_size[geom]
    match model.geom_type[geom]:
        case mujoco.mjtGeom.mjGEOM_BOX:
            return Box(size.tolist(), *place)
        case mujoco.mjtGeom.mjGEOM_CYLINDER:
            return Cylinder(float(size[0]), 2 * float(size[1]), *place)
        case mujoco.mjtGeom.mjGEOM_MESH:
            mesh = int(model.geom_dataid[geom])
            vertices = model.mesh_vert[model.mesh_vertadr[mesh] :][: model.mesh_vertnum[mesh]]
            triangles = model.mesh_face[model.mesh_faceadr[mesh] :][: model.mesh_facenum[mesh]]
            return Mesh(rotation.apply(vertices) + position, triangles.copy(), place[2])
    return None


def _colour(model: mujoco.MjModel, geom: int) -> tuple[int, int, int, int]:
    material = int(model.geom_matid[geom])
    rgba = model.geom_rgba[geom] if material < 0 else model.mat_rgba[material]
    red, green, blue, opacity = (round(255 * float(part)) for part in rgba)
    return red, green, blue, opacity
