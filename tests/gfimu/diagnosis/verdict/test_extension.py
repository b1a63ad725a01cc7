"""What has no name enters a twin only where the reference alone predicts better with it."""

from __future__ import annotations

import numpy as np
import pytest

from gfimu import AccelerometerArray
from gfimu.diagnosis import LocatedTerm, PreparedRuns, dependences, predicted_by_reference, that_predict
from gfimu.model import LocatedEffect, RigState, Wave, channel_place
from sim.trials import Measurement, measure, random_profile
from sim.twin import Twin

TWIN = Twin(array=AccelerometerArray.load("cube12"), array_name="cube12")
OFFSET = channel_place("channel", "offset", ((4,),), ["a22"])


def described(dependence, size):
    coefficients = size * np.ones(LocatedTerm(OFFSET, dependence).count)
    return TWIN.described(LocatedEffect(OFFSET, dependence, "all", coefficients).parameters)


@pytest.mark.parametrize("hidden", [True, False])
def test_a_function_that_is_there_stays_and_one_that_is_not_goes(hidden):
    rng, t = np.random.default_rng(2), np.arange(0.0, 20.0, 0.01)
    motion = random_profile(rng, 20.0)
    state = RigState(t, motion.at(t), TWIN.predict(motion, t)[0], None, 0.01, TWIN.placed())
    there, absent = described(dependences([state])["omega"], 0.05), described(Wave(123.1, 0.1, fastest=8.0), 0.3)
    world = [there] if hidden else []
    run = measure(rng, TWIN, world, Measurement(duration=20.0), motion=motion)
    prepared = PreparedRuns.build([run], TWIN, ["run"], predicted_by_reference)
    assert that_predict(TWIN, [absent, there], prepared) == world
