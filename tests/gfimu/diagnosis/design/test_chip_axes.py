"""How chips are mounted follows from their readings and the reference."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import gfimu
from gfimu.diagnosis import chip_axes, chip_distance
from sim.twin import Twin

ASTRAY = 0.03
"""rad: the scenario turns each chip by about 1° at random, and has gains off by 1 %."""


@pytest.fixture(scope="module")
def run():
    return gfimu.simulate("speed_sweep", seed=3)


def turned(run, rotation):
    """Each chip read by sensing axes that are turned in the body."""
    readings = run.readings.reshape(len(run), -1, 3) @ rotation.as_matrix().T
    return replace(run, readings=readings.reshape(len(run), -1))


@pytest.mark.parametrize(
    ("degrees", "is_square"), [(0.0, True), (90.0, True), (10.0, True), (13.0, False), (40.0, False)]
)
def test_axes_are_those_of_the_chips_and_square_where_nearly_so(run, degrees, is_square):
    rotation = Rotation.from_euler("x", degrees, degrees=True)
    for one in chip_axes(turned(run, rotation), Twin.load("cube12_turntable")):
        wanted = Rotation.from_euler("x", 90.0 * round(degrees / 90.0), degrees=True) if is_square else rotation
        assert one.axes == pytest.approx(wanted.as_matrix(), abs=1e-9 if is_square else ASTRAY)
        assert np.linalg.det(one.axes) == pytest.approx(1.0)
        assert one.off_square_rad == pytest.approx(np.radians(min(degrees % 90, 90 - degrees % 90)), abs=ASTRAY)


def test_the_distance_of_a_single_chip_is_found(run):
    twin = Twin.load("cube12_turntable")
    chip = twin.array.chips[0]
    one = replace(run, readings=run.readings[:, :3], channels=run.channels[:3], metadata={})

    def at(distance):
        alone = replace(chip, position=np.array([distance, 0.0, 0.0]))
        return replace(twin, array=replace(twin.array, chips=(alone,)), cube_offset=np.zeros(3))

    assert chip_distance(one, at) == pytest.approx(np.hypot(*chip.position[:2]), rel=0.03)
