"""What changes a sensor shows in another column of the file where wires are exchanged."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from core_cases import cause_of, dense, small_twin, stretches_of
from numpy.testing import assert_allclose, assert_array_equal

from gfimu.diagnosis import behind_wiring, cause_columns, family_columns, observe, starting_point
from sim.effects import EFFECTS, make_effect

TWIN = small_twin("cube12", rate=100.0)
CUBE = TWIN.array
SWAP = make_effect("axis_swap", {"channels": ["a22", "a42"]})
ONE, OTHER = CUBE.index("a22"), CUBE.index("a42")


@pytest.fixture(scope="module")
def stretch():
    (one,) = stretches_of(TWIN, duration=6.0)
    return replace(one, known=(SWAP,))


def test_the_columns_of_an_effect_are_those_of_each_size_alone(stretch):
    """Sizes of different channels share one difference, which a swap must not give to the wrong one."""
    drive = starting_point([stretch], 0.05).drives[0]
    family = EFFECTS["warm_up"]
    shape = {"time_constant_s": 3.0}
    nominal = stretch.predict([], drive.spin)
    seen = observe(stretch, nominal, stretch.first_levels)
    columns = dense(family_columns(stretch, seen, drive, (), family, shape))
    sizes = family.sizes(CUBE)
    for size in (ONE, OTHER, 0):
        effect = family({sizes[size].key: sizes[size].prior_std, **shape})
        alone = stretch.predict([effect], drive.spin) - nominal
        assert_allclose(columns[:, :, size], alone * stretch.mask, atol=1e-9)
    cause = replace(cause_of("warm_up", CUBE, np.zeros(12), **shape), mixing=np.eye(12), held=True)
    assert_allclose(dense(cause_columns(stretch, seen, drive, (cause,))), columns, atol=1e-9)


def test_several_swaps_follow_each_other():
    reach = np.eye(12, dtype=bool)
    assert behind_wiring(None, [SWAP], CUBE) is None
    assert_array_equal(behind_wiring(reach, [], CUBE), reach)
    twice = behind_wiring(reach, [SWAP, make_effect("axis_swap", {"channels": ["a42", "a11"]})], CUBE)
    readings = np.arange(12)
    for pair in (("a22", "a42"), ("a42", "a11")):
        places = [CUBE.index(name) for name in pair]
        readings[places] = readings[places[::-1]]
    assert [int(np.flatnonzero(row)[0]) for row in twice] == [int(np.flatnonzero(readings == k)[0]) for k in range(12)]
