"""All foreign effects in the order of the chain, and the chain: from places to readings, from readings to samples."""

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.spatial.transform import Rotation

from sim.trials.benchmark.generators.foreign_chips import EFFECTS as OF_CHIPS
from sim.trials.benchmark.generators.foreign_effect import PLACES, STAGES, Foreign, Motion, Places
from sim.trials.benchmark.generators.foreign_motion import EFFECTS as OF_MOTION
from sim.trials.benchmark.generators.foreign_reading import EFFECTS as OF_READING
from sim.trials.benchmark.generators.independent_effects import G
from sim.trials.benchmark.generators.independent_table import read_positions

__all__ = ["FOREIGN", "PLACES", "STAGES", "Motion", "Places", "acting", "by_positions", "noise_free"]

FOREIGN: dict[str, Foreign] = OF_MOTION | OF_CHIPS | OF_READING


def acting(hidden, stage):
    """The effects of a stage among those hidden (names and parameters), with their parameters."""
    return [(FOREIGN[name].act, one) for name, one in hidden.items() if FOREIGN[name].stage == stage]


def by_positions(run, places):
    """Readings (n, 12) from positions in the lab, differenced twice."""
    to_lab = Rotation.from_rotvec(np.outer(run.angle, [0.0, 0.0, 1.0])).as_matrix().transpose(0, 2, 1)
    positions = places.arms @ to_lab + places.lab[:, None]
    return read_positions(positions, places.axes @ to_lab[:, None], run.step, np.array([0.0, 0.0, -G]))


def noise_free(run, t, hidden, read=by_positions):
    """Stamps (n,), sample times (n, 4), channels (n, 12) and tachometer (n,) at times ``t``, without noise.

    ``read`` turns a motion and places into readings; its difference to places at rest adds to the motion's readings.
    """
    readings, places = run.readings, Places.at_rest()
    for act, one in acting(hidden, "places"):
        places = act(one, run, places)
    if acting(hidden, "places"):
        readings = readings + (read(run, places) - read(run, Places.at_rest()))
    for act, one in acting(hidden, "analogue"):
        readings = act(one, run, readings)
    reference = run.rate
    for act, one in acting(hidden, "reference"):
        reference = act(one, run, reference)
    stamps, times = t, np.repeat(t[:, None], 4, axis=1)
    for act, one in acting(hidden, "times"):
        stamps, times = act(one, run, stamps, times)
    chips = [CubicSpline(run.t, readings[:, 3 * k : 3 * k + 3])(times[:, k]) for k in range(4)]
    channels = np.hstack(chips)
    for act, one in acting(hidden, "sampled"):
        channels = act(one, run, times, channels)
    return stamps, times, channels, np.interp(stamps, run.t, reference)
