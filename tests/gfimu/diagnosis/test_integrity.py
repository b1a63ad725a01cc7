"""Wiring faults seen in the samples: exchanged and inverted channels, alone and together."""

from __future__ import annotations

import numpy as np
import pytest

from gfimu.array import AccelerometerArray
from gfimu.diagnosis.diagnose import diagnose
from sim.campaign import Measurement, measure
from sim.effects import make_effect
from sim.twin import Twin

SWAP_Z = ("axis_swap", {"channels": ["a13", "a21"]})


@pytest.mark.parametrize(
    "faults",
    [
        [("sign_flip", {"channel": "a13"})],  # every other z channel reads the same: no exchange need be told
        [("axis_swap", {"channels": ["a11", "a12"]})],
        [SWAP_Z, ("sign_flip", {"channel": "a21"})],
        [("axis_swap", {"channels": ["a11", "a12"]}), ("sign_flip", {"channel": "a12"})],
        [SWAP_Z, ("sign_flip", {"channel": ["a13", "a21"]})],
    ],
    ids=["flip", "swap", "swap and flip", "swap and flip in a chip", "swap and two flips"],
)
def test_exchanged_and_inverted_channels_are_told_together(faults):
    twin = Twin(array=AccelerometerArray.load("cube12"), array_name="cube12")
    effects = [make_effect(name, parameters, twin.array) for name, parameters in faults]
    diagnosis = diagnose([measure(np.random.default_rng(11), twin, effects, Measurement(duration=12.0))], twin)
    assert diagnosis.verdict == "explained"
    told = {cause.effect: cause.parameters for cause in diagnosis.causes}
    assert set(told) == {name for name, _ in faults}
    for name, parameters in faults:
        for key, value in parameters.items():
            assert sorted(np.atleast_1d(told[name][key])) == sorted(np.atleast_1d(value))
