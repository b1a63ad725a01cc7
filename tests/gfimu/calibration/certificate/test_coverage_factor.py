"""Combined uncertainty, effective degrees of freedom and coverage factor against the GUM."""

import math

import pytest

from gfimu.calibration.certificate.certificate import Component
from gfimu.calibration.certificate.coverage import coverage_factor, uncertainties
from gfimu.calibration.certificate.numbers import plain_number, plus_minus


def component(std, freedom=None, quantity="l", kind="B"):
    return Component(quantity, "source", kind, "normal", std, "nm", freedom)


def test_the_end_gauge_of_the_gum():
    """GUM, H.1.6: 32 nm with 16 degrees of freedom, from 25 (18), 9.7 (25.6), 2.9 (50) and 16.6 nm (2)."""
    found = uncertainties([component(25.0, 18), component(9.7, 25.6), component(2.9, 50), component(16.6, 2)])["l"]
    assert found.std == pytest.approx(32.0, abs=0.4)
    assert math.floor(found.degrees_of_freedom) == 16


@pytest.mark.parametrize(
    ("freedom", "k"), [(1, 12.71), (2, 4.303), (10, 2.228), (20, 2.086), (50, 2.009), (None, 1.960)]
)
def test_coverage_factors_are_those_of_the_t_table(freedom, k):
    """GUM, table G.2, 95 %."""
    assert coverage_factor(freedom) == pytest.approx(k, abs=6e-4 * k)


def test_components_of_infinite_freedom_keep_k_of_the_normal():
    found = uncertainties([component(3.0), component(4.0)])["l"]
    assert found.degrees_of_freedom is None
    assert found.expanded == pytest.approx(1.95996 * 5.0, rel=1e-4)


def test_quantities_are_combined_each_by_itself():
    found = uncertainties([component(3.0), component(4.0, quantity="m"), component(4.0)])
    assert found["l"].std == pytest.approx(5.0)
    assert found["m"].std == pytest.approx(4.0)


@pytest.mark.parametrize(
    ("value", "expanded", "text"),
    [
        (414.41873, 0.0711, "414.419 ± 0.071"),
        (-28.4, 233.6, "−30 ± 230"),
        (0.0123, 0.0996, "0.01 ± 0.10"),
        (-2.855e-06, 2.4e-05, "(−0.3 ± 2.4) × 10⁻⁵"),
        (33123.85, 0.62, "33123.85 ± 0.62"),
        (1.23e7, 4.5e4, "(1.2300 ± 0.0045) × 10⁷"),
        (-1e-9, 0.5, "0.00 ± 0.50"),
        (2.0, 0.0, "2"),
    ],
)
def test_numbers_have_two_digits_of_their_uncertainty(value, expanded, text):
    assert plus_minus(value, expanded) == text
    assert plain_number(-2.5) == "−2.5"
