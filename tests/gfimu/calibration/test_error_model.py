"""Error model: conversions between the ways of writing it, against each other and by hand."""

import hypothesis.strategies as st
import numpy as np
import pytest
from hypothesis import given, settings

from gfimu import InputError
from gfimu.calibration import ErrorModel, free_elements

matrices = st.lists(st.floats(-0.2, 0.2), min_size=9, max_size=9).map(
    lambda values: np.eye(3) + np.array(values).reshape(3, 3)
)
vectors = st.lists(st.floats(-5, 5), min_size=3, max_size=3).map(np.array)


@settings(max_examples=50, deadline=None)
@given(matrices, vectors, vectors)
def test_every_form_describes_the_same_triad(sensitivity, bias, a):
    model = ErrorModel(sensitivity, bias)
    readings = model.read(a)
    np.testing.assert_allclose(readings, sensitivity @ a + bias, atol=1e-12)
    np.testing.assert_allclose(model.correct(readings), a, atol=1e-9)
    T, K, b = model.to_correction()
    np.testing.assert_allclose(T @ np.diag(K) @ (readings - b), a, atol=1e-9)
    np.testing.assert_allclose(np.diag(T), 1.0)
    B, S, E = model.to_counts()
    np.testing.assert_allclose(B + S * a + E @ a, readings, atol=1e-12)
    offset, W = model.to_voltage()
    np.testing.assert_allclose(offset + W @ readings, a, atol=1e-9)
    for again in (
        ErrorModel.from_correction(T, K, b),
        ErrorModel.from_counts(B, S, E),
        ErrorModel.from_voltage(offset, W),
        ErrorModel.from_parameters(model.parameters("poses"), "poses"),
    ):
        np.testing.assert_allclose(again.sensitivity, sensitivity, atol=1e-9)
        np.testing.assert_allclose(again.bias, bias, atol=1e-8)


@settings(max_examples=50, deadline=None)
@given(matrices, vectors)
def test_a_change_of_gauge_keeps_magnitudes(sensitivity, bias):
    model = ErrorModel(sensitivity, bias)
    readings = model.read(9.81 * np.eye(3))
    for gauge in ("x_axis", "z_axis"):
        turned = model.in_gauge(gauge)
        zero = np.ones((3, 3), dtype=bool)
        for element in free_elements(gauge):
            zero[element] = False
        np.testing.assert_allclose(turned.sensitivity[zero], 0.0, atol=1e-12)
        assert np.all(np.diag(turned.sensitivity) > 0)
        np.testing.assert_allclose(np.linalg.norm(turned.correct(readings), axis=1), 9.81, rtol=1e-9)


def test_gauge_x_axis_puts_sensing_axis_x_along_frame_x(triad):
    turned = triad.in_gauge("x_axis")
    along_y = turned.read([0.0, 1.0, 0.0]) - turned.bias
    assert along_y[0] == pytest.approx(0.0, abs=1e-12)


def test_counts_of_the_chinese_papers_table(mti):
    readings = mti.read([0.0, 0.0, 9.8])
    np.testing.assert_allclose(
        readings, [33086.641274 - 1.561722 * 9.8, 33390.333418 + 0.278138 * 9.8, 36686.421684], rtol=1e-9
    )


def test_bad_models_are_refused():
    with pytest.raises(InputError, match="two sensing axes are alike"):
        ErrorModel(np.ones((3, 3)), np.zeros(3))
    with pytest.raises(InputError, match="3 × 3"):
        ErrorModel(np.eye(2), np.zeros(3))
    with pytest.raises(InputError, match="valid: x_axis, z_axis"):
        ErrorModel.nominal().in_gauge("y_axis")
    with pytest.raises(InputError, match="unknown gauge"):
        free_elements("w")
