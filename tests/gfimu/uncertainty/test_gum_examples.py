"""Degrees of freedom and coverage factors, against the figures that the GUM prints (JCGM 100:2008)."""

import numpy as np
from scipy.special import stdtrit

from gfimu.certification.certificate import Component
from gfimu.certification.coverage import uncertainties
from gfimu.uncertainty.components import stage_components
from gfimu.uncertainty.stage import Stage
from tests.gfimu.uncertainty.stage_cases import calibration_of


def test_the_end_gauge_of_example_h_1():
    """25, 9.7, 2.9 and 16.6 nm with 18, 25.6, 50 and 2 degrees of freedom: u = 32 nm, ν = 16, U_99 = 93 nm."""
    parts = zip((25.0, 9.7, 2.9, 16.6), (18.0, 25.6, 50.0, 2.0), strict=True)
    found = uncertainties([Component("l", "source", "A", "normal", std, "nm", dof) for std, dof in parts])["l"]
    assert round(found.std) == 32
    assert int(found.degrees_of_freedom) == 16
    assert abs(found.degrees_of_freedom - 16.7) < 0.2
    assert round(stdtrit(int(found.degrees_of_freedom), 0.995), 2) == 2.92
    assert round(2.92 * round(found.std)) == 93


def test_a_stage_stated_to_a_quarter_has_eight_degrees_of_freedom():
    """G.4.2, example: Δu/u = 0.25 gives ν = 8."""
    stage = Stage(stage="s", pose_tilt_std_rad=1e-4, reliability=0.25)
    found = stage_components(calibration_of("six-position"), stage, rng=np.random.default_rng(0), runs=2)
    assert {one.degrees_of_freedom for one in found.components} == {8.0}
