"""Results print on a line or two: never a dump of their arrays."""

from dataclasses import replace

import numpy as np
from every_item import every

import gfimu
from gfimu import AccelerometerArray, Recording, SensorErrors
from gfimu.array import Part
from gfimu.array.linear_solution import linear_solution
from gfimu.base.short_repr import short_repr
from gfimu.diagnosis.design.distinguishability import Distinguishability
from sim import DataSheet
from sim.scenarios import Scenario
from sim.twin import Twin

CUBE = AccelerometerArray.load("cube12")
RNG = np.random.default_rng(0)


def run(n=2000):
    t = np.arange(n) / 100.0
    t[n // 2 :] += 0.05
    readings = RNG.normal(0, 0.03, (n, 12)) + CUBE.axes @ [0.0, 0.0, 9.81]
    return Recording.from_arrays(t, readings, CUBE, reference={"tacho_rad_s": np.zeros(n)})


RUN = run()
ERRORS = SensorErrors.from_parts(CUBE, 100.0)
MAKERS = {
    "recording": lambda: RUN,
    "estimate": lambda: gfimu.estimate(RUN, CUBE),
    "rate": lambda: gfimu.estimate_rate(CUBE, RUN.t_s, RUN.readings, ERRORS, method="filter"),
    "array": lambda: CUBE,
    "large array": lambda: AccelerometerArray.load("mimu4444"),
    "chip": lambda: CUBE.chips[0],
    "part": lambda: Part.load("adxl345"),
    "errors": lambda: ERRORS,
    "score": lambda: gfimu.score("cube12")[0],
    "allan": lambda: gfimu.allan_deviation(RNG.normal(size=3000), 100.0),
    "noise": lambda: gfimu.identify_noise(RNG.normal(size=3000), 100.0),
    "recording noise": lambda: gfimu.recording_noise(RUN, stretch="all"),
    "linear": lambda: linear_solution(CUBE, RUN.readings, np.ones(12)),
    "null space": lambda: gfimu.null_space(CUBE),
    "drift": lambda: gfimu.drift_budget(CUBE, 10.0, gfimu.ErrorSources(0.01)),
    "summary": lambda: gfimu.summarise(gfimu.estimate(RUN, CUBE), RUN, CUBE),
    "distinguishability": lambda: Distinguishability(("a", "b"), np.zeros(2), np.zeros((2, 2))),
    "scenario": lambda: Scenario.load("paper_run"),
    "twin": lambda: Twin.load("cube12_turntable"),
    "world": lambda: Twin.load("cube12_turntable").world(),
    "data sheet": lambda: DataSheet.load("adxl345"),
}


@every("make", MAKERS.values())
def test_at_most_two_lines_and_no_array(make):
    result = make()
    text = repr(result)
    assert text.startswith(f"{type(result).__name__}(")
    assert "\n" not in text
    assert len(text) <= 240
    assert "array([" not in text
    assert "..." not in text


def test_what_the_most_common_say():
    assert repr(RUN) == (
        "Recording(cube12, 12 channels in m/s², 2000 samples, 20.04 s at 100 Hz, 1 gap, references tacho_rad_s)"
    )
    assert repr(replace(RUN.slice(0, 1), metadata={"corrupt_values": {"a11": 3}}, reference={})) == (
        "Recording(no array, 12 channels in m/s², 1 sample, 3 corrupt values left out)"
    )
    assert repr(gfimu.estimate(RUN, CUBE)) == "Estimate(cube12, integrate, 2000 samples, 20.04 s at 100 Hz, 1 gap)"
    assert repr(CUBE) == "AccelerometerArray('cube12', 4 chips (adxl345), 12 channels)"
    assert repr(CUBE.chips[0]) == "Chip(name='a1', position=[0.05, 0.05, 0.05], axes=<3 × 3>, part='adxl345')"


def test_the_general_form_leaves_out_what_is_empty():
    assert short_repr(replace(CUBE, description="", part_files={})).count("=") == 3
