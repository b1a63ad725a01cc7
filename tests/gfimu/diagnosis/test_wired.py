"""What changes a sensor shows in another column of the file where wires are exchanged."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from gfimu.diagnosis.causes import Cause, Signature, wired
from gfimu.diagnosis.data.prepared_runs import PreparedRuns
from gfimu.diagnosis.signatures import cause_columns, signature_columns
from gfimu.geometry.array import AccelerometerArray
from sim.campaign import Measurement, measure
from sim.effects import EFFECTS, make_effect
from sim.twin import Twin

CUBE = AccelerometerArray.load("cube12")
TWIN = Twin(array=CUBE, array_name="cube12")
SWAP = make_effect("axis_swap", {"channels": ["a22", "a42"]})
ONE, OTHER = CUBE.index("a22"), CUBE.index("a42")


@pytest.fixture(scope="module")
def segment():
    recording = measure(np.random.default_rng(1), TWIN, [], Measurement(duration=6.0))
    ((one,), _) = PreparedRuns.build([recording], TWIN, ["run"]).segments(TWIN)
    one.prepare_weights()
    return one


def test_the_columns_of_an_effect_are_those_of_each_size_alone(segment):
    """Sizes of different channels share one difference, which a swap must not give to the wrong one."""
    family = EFFECTS["warm_up"]
    shape = {"time_constant_s": 3.0}
    signature = Signature(family, shape, np.arange(CUBE.n_channels))
    columns, _ = signature_columns(segment, [signature], (), [SWAP])
    nominal = segment.predict([SWAP])
    for size, sized in ((ONE, family.sizes(CUBE)[ONE]), (OTHER, family.sizes(CUBE)[OTHER]), (0, family.sizes(CUBE)[0])):
        alone = segment.predict([SWAP, family({sized.key: sized.prior_std, **shape})]) - nominal
        assert_allclose(columns[:, size], alone.T, atol=1e-9)
    cause = Cause(family, "all channels", np.eye(12), shape, 0.0, coordinates=np.zeros(12))
    assert_allclose(cause_columns(segment, [cause], [SWAP], shapes=False), columns, atol=1e-9)


def test_several_swaps_follow_each_other():
    reach = np.eye(12, dtype=bool)
    assert wired(None, [SWAP], CUBE) is None
    assert_array_equal(wired(reach, [], CUBE), reach)
    twice = wired(reach, [SWAP, make_effect("axis_swap", {"channels": ["a42", "a11"]})], CUBE)
    readings = np.arange(12)
    for pair in (("a22", "a42"), ("a42", "a11")):
        places = [CUBE.index(name) for name in pair]
        readings[places] = readings[places[::-1]]
    assert [int(np.flatnonzero(row)[0]) for row in twice] == [int(np.flatnonzero(readings == k)[0]) for k in range(12)]
