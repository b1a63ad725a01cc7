"""How the array of a diagnosis is drawn: on a table, or on the arm of a pendulum whose axis is level."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from made_diagnoses import made_diagnosis

from gfimu.commands.diagnose import drawn_rig
from gfimu.diagnosis import DrawnRig
from gfimu.diagnosis.report.picture import _motion
from sim.twin import Twin


@pytest.fixture(scope="module")
def hung():
    return replace(made_diagnosis("nothing_found"), twin=Twin.load("pendulum"))


def test_a_pendulum_is_drawn_without_a_table_and_hangs(hung):
    rig = drawn_rig(hung)
    assert rig.shapes is None
    np.testing.assert_allclose(rig.lean, [np.pi / 2, 0.0, 0.0])
    rest = np.zeros(1)
    # A quarter of a turn from hanging the body is as high as its pivot.
    hanging, level = rig.places(rest)[0], rig.places(np.array([np.pi / 2]))[0]
    np.testing.assert_allclose(level[2] - hanging[2], 0.4, atol=1e-12)
    assert hanging[2] >= 0.0


def test_gravity_turns_in_the_body_of_a_pendulum(hung):
    rig = drawn_rig(hung)
    run = replace(hung.runs[0], angle=np.zeros_like(hung.runs[0].angle))
    axis, gravity, name = rig.seen_from(hung.twin.array, run)
    np.testing.assert_allclose(gravity, [0.0, -1.0, 0.0], atol=1e-12)  # along the arm
    assert abs(axis.direction @ gravity) < 1e-12
    np.testing.assert_allclose(axis.point, [0.0, 0.4, 0.0], atol=1e-12)
    assert name == "gravity at the start"


def test_the_motion_keeps_the_arm_at_its_length(hung):
    rig, (run,) = drawn_rig(hung), hung.runs
    motion = _motion(run, rig)
    pivot = motion.position + rig.attitude(run.angle).apply(rig.axis.point)
    np.testing.assert_allclose(pivot, np.tile(pivot[0], (len(pivot), 1)), atol=1e-12)


def test_a_table_is_drawn_as_before():
    rig = drawn_rig(made_diagnosis("nothing_found"))
    assert rig.lean is None
    assert set(rig.shapes) >= {"base", "table", "cube"}
    np.testing.assert_allclose(DrawnRig().places(np.array([0.3]))[0], [0.0, 0.0, 0.06])
