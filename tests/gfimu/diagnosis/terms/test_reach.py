"""Which channels of a recording an unknown changes, behind the wiring too."""

import numpy as np
import pytest

from gfimu import AccelerometerArray
from gfimu.diagnosis import behind_wiring, disjoint
from gfimu.motion import BodyDrive
from sim.effects import BODY_EFFECTS, make_effect
from sim.twin import Twin

TWIN = Twin.from_dict({"array": "cube12", "drive": {"source": "gyro"}, "sensor": {"part": "adxl345"}})
SWAPS = [
    make_effect("axis_swap", {"channels": ["a11", "a12", "a23", "a41"]}),
    make_effect("sign_flip", {"channel": "a12"}),
    make_effect("axis_swap", {"channels": ["a12", "a33"]}),
]


def changed_channels(name: str, wiring) -> np.ndarray:
    """Channels that each size changes in the simulation itself, shape (m, c)."""
    t = np.arange(80) / 100.0
    drive = BodyDrive(t, np.outer(np.sin(9.0 * t), [3.0, 2.0, 1.0]), np.tile([3.0, -4.0, 8.0], (len(t), 1)))
    family = BODY_EFFECTS[name]
    plain = TWIN.predict_body(drive, t, effects=wiring)
    moved = np.eye(len(family.sizes(TWIN.array))) * [size.prior_std for size in family.sizes(TWIN.array)]
    shape = family.shapes(1.0, 100.0)[0]
    each = [family.from_sizes(TWIN.array, values, shape) for values in moved]
    return np.array(
        [np.abs(TWIN.predict_body(drive, t, effects=[*wiring, one]) - plain).max(axis=0) > 0 for one in each]
    )


@pytest.mark.parametrize("name", ["bias", "cross_axis", "sensor_position"])
def test_exchanged_wires_carry_what_changes_a_sensor_to_another_channel(name):
    """The order of the library's wiring faults is that of their predictions, one after another too."""
    reach = behind_wiring(BODY_EFFECTS[name].reach(TWIN.array), SWAPS, TWIN.array)
    assert reach is not None
    found = changed_channels(name, SWAPS)
    assert not (found & ~reach).any()
    assert found.any(axis=1).all()
    assert not np.array_equal(reach, BODY_EFFECTS[name].reach(TWIN.array))


def test_a_fault_that_does_not_state_its_order_leaves_the_reach_unknown():
    class Other:
        place = "data"

    assert behind_wiring(np.eye(12, dtype=bool), [Other()], TWIN.array) is None
    assert behind_wiring(None, SWAPS, TWIN.array) is None


def test_unknowns_of_different_channels_share_a_difference():
    array: AccelerometerArray = TWIN.array
    assert len(disjoint(np.eye(array.n_channels, dtype=bool), array.n_channels)) == 1
    assert disjoint(None, 3) == [[0], [1], [2]]
    assert disjoint(np.array([[1, 1, 0], [0, 1, 1], [0, 0, 1]], dtype=bool), 3) == [[0, 2], [1]]
