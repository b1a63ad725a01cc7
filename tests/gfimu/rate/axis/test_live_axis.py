"""The rate about a known axis while samples arrive: error and standard deviation, either sign, and the command."""

import json

import numpy as np
import pytest
from turning import array_of, turned

import gfimu
from gfimu import InputError, TurningAxis
from gfimu.array import AxisUncertainty
from gfimu.rate import LiveAxisFilter

ONE = array_of((0.1, 0.0, 0.02))
TWO = array_of((0.02, 0.0, 0.0), (0.17, 0.0, 0.0))
CASES = {
    "one chip, upright table": (ONE, "fixed", {}, 0.05),
    "one chip, inclined table": (ONE, "fixed", {"tilt": 0.5}, 0.05),
    "two chips, wheel": (TWO, "free", {"tilt": 1.57, "hub": 0.7}, 0.05),
    "two chips, wheel, start unknown": (TWO, "free", {"tilt": 1.5, "hub": 0.7, "rest": False}, 0.05),
    "one chip, wheel, start unknown": (ONE, "free", {"tilt": 1.57, "hub": 0.7, "rest": False}, 0.4),
}


def followed(array, axis, recording, **options):
    live = LiveAxisFilter(array, axis, 100.0, **options)
    return [found for t, row in zip(recording.t_s, recording.readings, strict=True) for found in live.push(t, row)]


@pytest.mark.parametrize(("array", "hub", "world", "most"), CASES.values(), ids=CASES)
def test_the_rate_is_followed(array, hub, world, most):
    recording, rate, _ = turned(array, (0, 0, 1), np.random.default_rng(1), **world)
    found = followed(array, TurningAxis.of("z", hub=hub), recording, at_rest=world.get("rest", True))
    assert [one.t_s for one in found] == recording.t_s.tolist()
    missed = (np.array([one.rate for one in found]) - rate)[1000:]
    assert np.sqrt(np.mean(missed**2)) < most
    assert np.mean(np.abs(missed) < 3.0 * np.array([one.rate_std for one in found])[1000:]) > 0.97


def test_an_uncertain_lever_is_in_the_standard_deviation():
    recording, _, _ = turned(ONE, (0, 0, 1), np.random.default_rng(1), duration=20.0)
    exact, rough = (
        followed(ONE, TurningAxis.of("z", uncertainty=AxisUncertainty(lever_std_m=lever)), recording)
        for lever in (0.0, 0.005)
    )
    assert np.median([one.rate_std for one in rough]) > 2.0 * np.median([one.rate_std for one in exact])


def test_a_stream_of_one_chip_by_its_own_axis():
    recording, rate, _ = turned(ONE, (0, 0, 1), np.random.default_rng(1), duration=10.0)
    head = ["t_s," + ",".join(f"{name}_m_s2" for name in ONE.channels)]
    rows = [
        ",".join(map(repr, (float(t), *map(float, row))))
        for t, row in zip(recording.t_s, recording.readings, strict=True)
    ]
    lines = [*head, *rows[:500], "no sample", rows[400], *rows[500:]]
    made = [json.loads(line) for line in gfimu.live(ONE, 100.0, source=lines, axis="z")]
    assert len([one for one in made if "fault" in one]) == 2
    found = [one for one in made if "fault" not in one]
    assert len(found) == len(rows)
    assert found[-1]["omega_rad_s"][2] == pytest.approx(rate[-1], abs=5.0 * found[-1]["rate_std_rad_s"])
    with pytest.raises(InputError, match="no use with a known axis"):
        gfimu.live(ONE, 100.0, source=lines, axis="z", gyro=True)
