"""The rig's shapes for pictures: taken from the compiled model, each in the frame it moves with."""

from __future__ import annotations

import numpy as np
from numpy.testing import assert_allclose
from scipy.spatial.transform import Rotation

from gfimu import AccelerometerArray
from gfimu.base import chip_colour
from gfimu.visual import Box, Cylinder
from sim.drawing import rig_drawing
from sim.world import World


def corners(box: Box) -> np.ndarray:
    signs = np.array(np.meshgrid([-1, 1], [-1, 1], [-1, 1])).reshape(3, -1).T
    turned = Rotation.from_quat(np.asarray(box.quaternion), scalar_first=True).apply(signs * np.asarray(box.half_size))
    return turned + np.asarray(box.centre)


def test_the_cube_is_drawn_in_its_own_frame_wherever_it_is_mounted():
    array = AccelerometerArray.load("cube12")
    tilted = World(array, cube_offset=np.array([0.02, -0.01, 0.08]), mount_rotvec=np.array([0.3, -0.2, 0.1]))
    for world in (World(array), tilted):
        boxes = [shape for shape in rig_drawing(world)["cube"] if isinstance(shape, Box)]
        walls = [box for box in boxes if max(box.half_size) > 0.04]
        reach = np.concatenate([corners(box) for box in walls])
        assert_allclose(reach.max(axis=0), 0.05, atol=1e-9)
        assert_allclose(reach.min(axis=0), -0.05, atol=1e-9)
        for position in array.chip_positions:
            assert min(np.linalg.norm(np.asarray(box.centre) - position) for box in boxes) < 1e-9


def test_each_board_has_the_hue_of_its_chip():
    array = AccelerometerArray.load("cube12")
    boxes = [shape for shape in rig_drawing(World(array))["cube"] if isinstance(shape, Box)]
    for number, position in enumerate(array.chip_positions):
        hues = [box.colour[:3] for box in boxes if np.linalg.norm(np.asarray(box.centre) - position) < 0.003]
        assert chip_colour(number) in hues


def test_another_array_stands_on_the_table_without_the_cube():
    shapes = rig_drawing(World(AccelerometerArray.load("mimu4444")))
    assert "cube" not in shapes
    assert not [shape for shape in shapes["table"] if isinstance(shape, Box) and max(shape.half_size) > 0.03 + 1e-9]
    assert any(isinstance(shape, Cylinder) for shape in shapes["table"])


def test_the_disc_lies_in_the_table_frame_below_the_cube():
    shapes = rig_drawing(World(AccelerometerArray.load("cube12")))
    disc = max((shape for shape in shapes["table"] if isinstance(shape, Cylinder)), key=lambda shape: shape.radius)
    assert_allclose(disc.centre[2] + disc.length / 2, 0.0, atol=1e-12)
    assert shapes["base"]
