"""The picture of a diagnosis: its array on a table or on the arm of a pendulum, and its words."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from made_diagnoses import made_diagnosis

from gfimu import NamedCause
from gfimu.commands.diagnose import drawn_rig
from gfimu.diagnosis import DrawnRig
from gfimu.diagnosis.report.picture import _motion, _notes
from gfimu.diagnosis.report.plain_words import parameter_units
from gfimu.diagnosis.report.rig import marked_of, marked_words
from sim.twin import Twin

FOUND = made_diagnosis("explained")


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


def test_the_picture_prints_a_parameter_in_the_unit_that_its_effect_declares():
    found = made_diagnosis()
    key = "a11_m_s2_per_rad4_s4"
    cause = NamedCause("vibration_rectification", {key: 5.8e-6}, {key: 2e-7}, 0.99)
    units = parameter_units(found, cause)
    assert units[key] == "m/s²/(rad/s)⁴"
    assert "a11 (5.80 ± 0.20)·10⁻⁶ m/s²/(rad/s)⁴ (probability" in _notes(replace(found, causes=(cause,)))
    assert parameter_units(found, replace(cause, effect="not in the library")) == {}


@pytest.mark.parametrize(
    ("cause", "words"),
    [
        (
            NamedCause("bias", {"a21_m_s2": 0.1, "a31_m_s2": 0.001}, {"a21_m_s2": 0.01, "a31_m_s2": 0.01}, 0.9),
            "chip a2",
        ),
        (NamedCause("gain_drift", {"ratio": 0.1}, {"ratio": 0.01}, 0.9), "every chip"),
        (
            NamedCause("table_tilt", {"x_rad": 0.1}, {"x_rad": 0.01}, 0.9),
            "the array as a whole; the axis, with the table and its reference",
        ),
        (
            NamedCause("tacho_scale", {"ratio": 0.1}, {"ratio": 0.01}, 0.9),
            "the axis, with the table and its reference",
        ),
        (NamedCause("dropped_frames", {}, {}, 0.9), "nowhere in the array"),
    ],
)
def test_a_cause_is_marked_where_it_is(cause, words):
    marked = marked_of(replace(FOUND, causes=(cause,)))
    assert marked_words(marked, FOUND.twin.array, has_axis=True) == words


def test_a_described_error_of_the_reference_is_at_the_axis_and_a_gyro_is_not_drawn():
    marked = marked_of(made_diagnosis("unknown"))
    assert (marked.chips, marked.package, marked.axis) == (frozenset(), False, True)
    assert marked_words(marked, FOUND.twin.array, has_axis=False) == "the gyro, which is not drawn"
