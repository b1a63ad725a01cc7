"""The lines that a stage contributes to a certificate's budget, for calibrations of every kind."""

import numpy as np
import pytest

from gfimu.calibration import Stage, certify, stage_components
from tests.gfimu.calibration.certificate.stage.stage_cases import METHODS, calibration_of

STAGE = Stage(stage="table no. 2", source="report 7", pose_tilt_std_rad=1e-3, angle_step_std_rad=1e-4)
GAUGES = {
    "six-position": ("poses", "x_axis"),
    "recursive": ("poses", "x_axis"),
    "twelve-position": ("coarse", "x_axis"),
    "multi-position": ("x_axis", "coarse"),
}


def components(calibration, stage=STAGE):
    return stage_components(calibration, stage, rng=np.random.default_rng(0), runs=3)


@pytest.mark.parametrize(("name", "gauge"), [(name, gauge) for name in METHODS for gauge in GAUGES[name]])
def test_every_quantity_has_a_line_of_every_source(name, gauge):
    calibration = calibration_of(name, gauge=gauge)
    found = components(calibration)
    certificate = certify(calibration, components=found.components, explained_misfit=found.misfit)
    lines = [one for one in certificate.budget if one.kind == "B"]
    sources = {one.source.partition(":")[0] for one in lines}
    assert sources == {"levelling, each pose by itself", "step size of the stage's angles", "local gravity"}
    stated = {term.name for term in certificate.terms if term.value is not None}
    assert {one.quantity for one in lines} == stated
    assert len(lines) == 3 * len(stated)
    assert found.statements == ("stage: table no. 2; report 7",)


def test_the_combined_uncertainty_holds_the_lines_of_the_stage():
    calibration = calibration_of("six-position")
    found = components(calibration)
    alone, both = certify(calibration), certify(calibration, components=found.components)
    added = sum(one.std**2 for one in found.components if one.quantity == "a11_delta_o")
    np.testing.assert_allclose(both.term("a11_delta_o").std ** 2, alone.term("a11_delta_o").std ** 2 + added)


def test_a_stage_stated_to_a_quarter_has_eight_degrees_of_freedom():
    """JCGM 100:2008, G.4.2, example: Δu/u = 0.25 gives ν = 8."""
    found = components(calibration_of("six-position"), Stage(stage="s", reliability=0.25))
    assert {one.degrees_of_freedom for one in found.components} == {8.0}
    assert {one.degrees_of_freedom for one in components(calibration_of("six-position")).components} == {None}


@pytest.mark.parametrize(
    ("name", "said"), [("six-position", True), ("twelve-position", True), ("multi-position", False)]
)
def test_that_no_stage_was_given_is_said_where_directions_matter(name, said):
    assert any("no stage file" in text for text in components(calibration_of(name), None).statements) == said
